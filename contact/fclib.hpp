#pragma once

#include "contact/global_problem.hpp"
#include "contact/named_arrays.hpp"

#include <optional>

// FCLib's collection of contact problems: which dataset holds what, without the file around it
// (solver/fclib_file.hpp opens files). Layout: fclib.h of FCLib 3.1.

namespace amontons {

/// u and r of a problem, or a guess of them; what a file does not have is empty.
struct FclibSolution {
    Eigen::VectorXd r; ///< reaction, rows of the problem [N or N s]
    Eigen::VectorXd u; ///< gap and slip, rows [m or m/s]
    Eigen::VectorXd v; ///< motion of the bodies, dofs of a global problem [m or m/s]
};

/// What a file holds: a local problem (W, q, mu) or a global one (M, H, f, w, mu).
///
/// Its bilateral equations (V, R, s; G, b) become bilateral contacts after all others, so that
/// the reaction of such a row is FCLib's lambda.
struct FclibProblem {
    /// Of a file with W, q and mu.
    std::optional<ContactProblem> local;
    /// Of a file with M, H, f, w and mu.
    std::optional<GlobalProblem> global;
    std::optional<FclibSolution> solution;
    /// Initial guesses of the file, in its order.
    std::vector<FclibSolution> guesses;
    /// Identity of each contact by the program that wrote the file; empty if the file has none.
    /// Dataset /amontons/contact; contacts of different steps are matched by it.
    std::vector<std::int32_t> identity;
    bool has_level = false; ///< the level is the file's (/amontons/level); else velocities
    std::string title, description, math_info;
};

/// Share of entries other than zero above which W is stored as a dense matrix [-].
constexpr double kFclibDense = 0.35;

/// The groups of a file that FCLib or amontons uses, separated by spaces.
extern const char* const kFclibGroups;

/// The problem in a file's datasets.
/// @param file  its name, for messages
/// @throws InputError  with every dataset that is missing or wrong: found, and allowed
FclibProblem fclib_problem(const std::vector<NamedArray>& arrays, const std::string& file);

/// The datasets of a problem, matrices by compressed columns.
/// @throws InputError  if FCLib cannot hold it: a frictionless contact of one row, a bilateral one
///                     before a frictional one, W as a function, more than 2^31 - 1 entries
std::vector<NamedArray> fclib_arrays(const FclibProblem& problem);

/// A problem as FCLib can hold it.
struct FclibForm {
    ContactProblem problem;         ///< every unilateral contact has three rows
    std::vector<Eigen::Index> rows; ///< those of the original's rows in it, increasing
};

/// Adds two rows without force to each frictionless contact of one row: q = 0, friction 0, and in W
/// the contact's own normal entry on the diagonal. The rows `rows` of a reaction of this form are a
/// reaction of the original.
/// @throws InputError  a matrix-free W, which no file holds
FclibForm fclib_form(const ContactProblem& problem);

/// The datasets of /solution alone.
/// @param bilateral  rows at the end that are FCLib's lambda
std::vector<NamedArray> fclib_solution_arrays(const FclibSolution& solution,
                                              Eigen::Index bilateral);

} // namespace amontons
