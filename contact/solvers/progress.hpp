#pragma once

#include "contact/infeasible.hpp"
#include "contact/options.hpp"
#include "contact/solution.hpp"
#include "mesh/base/phase_timer.hpp"

#include <algorithm>

namespace amontons {

/// Result of an iterative solver; solve() certifies it.
struct SolverRun {
    Eigen::VectorXd reaction; ///< the best iterate
    int iterations = 0;
    SolveStatus status = SolveStatus::stagnated; ///< why it ended
    std::vector<ErrorPoint> history;
    InfeasibilityProof proof;
};

/// Evaluates the iterates of a solver: error, best reaction, limits, stagnation.
///
/// Allocates when made and seldom after: the thinned history is the only thing that grows.
class SolveProgress {
public:
    SolveProgress(const ContactProblem& problem, const SolverOptions& options);

    /// Evaluates an iterate and returns whether to end; call it with every iterate, the start
    /// first.
    /// @param u  W r + q as the solver keeps it; replaced now and then by the exact product,
    ///           and always before success is believed
    /// @param exact  replace u and evaluate the round-off floor at once: for iterates that cost
    ///               more than a product
    bool ends(const Eigen::VectorXd& r, Eigen::VectorXd& u, bool exact = false);

    /// Counts an iterate that is not evaluated.
    void pass() { ++passes_; }

    /// Ends the run as infeasible.
    void prove(InfeasibilityProof proof);

    /// Is there time for a step that takes this long [s]? Not if it would end after twice
    /// max_seconds; the solve then ends as out of time.
    bool has_time_for(double seconds);
    /// Of max_seconds [s].
    double seconds_left() const { return std::max(0.0, options_.max_seconds - clock_.seconds()); }
    /// max_seconds are over, or a stop was requested.
    bool must_stop() const
    {
        return (options_.stop && *options_.stop) || clock_.seconds() >= options_.max_seconds;
    }

    const NaturalMapError& natural_map() const { return natural_map_; }
    double error() const { return error_; } ///< of the last iterate [-]
    /// ||F_i|| of each contact at the last iterate, n [N].
    const Eigen::VectorXd& residuals() const { return residuals_; }
    const Eigen::VectorXd& best() const { return run_.reaction; } ///< iterate of the least error
    double best_error() const { return best_; }                   ///< [-]
    /// Iterations so far.
    int iterations() const { return run_.iterations; }
    /// The result, at the end of a solve.
    SolverRun result() && { return std::move(run_); }

private:
    bool converged(const Eigen::VectorXd& r, Eigen::VectorXd& u, bool exact);
    bool converged_by_rounding(const Eigen::VectorXd& r, const Eigen::VectorXd& u);

    const ContactProblem& problem_;
    const SolverOptions& options_;
    Stopwatch clock_;
    NaturalMapError natural_map_;
    SolverRun run_;
    Eigen::VectorXd residuals_;
    Eigen::VectorXd rounded_; // what has converged, where r itself has not
    double error_ = 0, best_ = std::numeric_limits<double>::infinity();
    double threshold_ = 0;
    double stall_reference_ = std::numeric_limits<double>::infinity();
    int stall_start_ = 0;
    int passes_ = 0, next_refresh_ = 16, next_history_ = 0;
};

} // namespace amontons
