#pragma once

#include "contact/fclib.hpp"
#include "contact/options.hpp"
#include "contact/solution.hpp"

#include <stdexcept>
#include <string_view>

// Contact problems solved by an external program: FCLib in, FCLib out (docs/new_solver.md).

namespace amontons {

/// `COMMAND PROBLEM SOLVED`, run by a shell, which writes into SOLVED a copy of PROBLEM with
/// /solution. The required tolerance is in its environment: AMONTONS_TOLERANCE.
struct OutsideSolver {
    /// Command line; the files follow it.
    std::string command;
    std::string folder = ".";                                     ///< it runs there
    double max_seconds = std::numeric_limits<double>::infinity(); ///< wall time of one problem [s]
};

/// There is no result: the message is the predicate of a sentence whose subject is the command.
class NoOutsideAnswer : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Result of another program.
struct OutsideAnswer {
    FclibSolution solution;
    double seconds = 0;  ///< wall time of the command [s]
    std::string printed; ///< what it wrote to stdout and stderr
};

/// @param problem    path of an FCLib file
/// @param tolerance  relative error that its result is to have [-]
/// @param stop       ends the command once it is set; null: nothing does
/// @param instead    bytes of the file that the command gets in place of `problem`; "": none
/// @throws NoOutsideAnswer  it failed, took too long or wrote no reaction
OutsideAnswer run_outside_solver(const OutsideSolver& solver, const std::string& problem,
                                 double tolerance, const std::atomic<bool>* stop,
                                 std::string_view instead = {});

/// Certifies a reaction as those of the program's own solvers are certified. @param r  rows of the
/// problem
/// @param tolerance  as SolverOptions::tolerance [-]
ContactSolution judged(const ContactProblem& problem, const Eigen::VectorXd& r, double tolerance,
                       ErrorScope scope = ErrorScope::all_rows);

/// Runs the other program on a problem, and certifies its answer.
/// @param warm_start  enters the file as a guess; may be empty
/// @throws NoOutsideAnswer, and InputError if no file can be written
ContactSolution solve_outside(const OutsideSolver& solver, const ContactProblem& problem,
                              const SolverOptions& options, const Eigen::VectorXd& warm_start);

} // namespace amontons
