#include "contact/solvers/progress.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// Updates by columns lose a digit in this many sweeps at worst; the product costs one sweep.
constexpr int kRefreshEvery = 64;
/// The history keeps every iteration up to this one, then each that is 5 % later.
constexpr int kFullHistory = 64;
constexpr double kThinning = 1.05;
constexpr double kProgress = 0.9;

} // namespace

SolveProgress::SolveProgress(const ContactProblem& problem, const SolverOptions& options)
    : problem_(problem)
    , options_(options)
    , natural_map_(problem, options.scope)
    , residuals_(contact_count(problem))
    , threshold_(options.tolerance)
{
    run_.history.reserve(256);
}

bool SolveProgress::converged(const Eigen::VectorXd& r, Eigen::VectorXd& u, bool exact)
{
    error_ = natural_map_(r, u, residuals_);
    const bool due = exact || passes_ >= next_refresh_;
    if (error_ > threshold_ && !due) return false;

    if (passes_ > 0) { // the start comes with an exact u
        problem_.W.apply(r, u);
        u += problem_.q;
        error_ = natural_map_(r, u, residuals_);
    }
    if (due) {
        next_refresh_ = passes_ + kRefreshEvery;
        threshold_ = natural_map_.threshold(r, u, options_.tolerance);
    }
    // Sweeps end just below the threshold: there round-off decides.
    if (error_ <= threshold_) error_ = natural_map_.decided(r, u, residuals_, threshold_);
    if (error_ <= threshold_) return true;
    return due && converged_by_rounding(r, u);
}

/// Where the last digit of r is more than the tolerance, another last digit may be right.
bool SolveProgress::converged_by_rounding(const Eigen::VectorXd& r, const Eigen::VectorXd& u)
{
    if (!(error_ < kRoundings * natural_map_.rounding(r, u))) return false;
    Eigen::VectorXd other = natural_map_.rounded(r, u), own = u;
    problem_.W.apply(other, own);
    own += problem_.q;
    Eigen::VectorXd residuals(residuals_.size());
    const double error = natural_map_.certain(other, own, residuals, threshold_);
    if (!(error <= threshold_)) return false;
    error_ = error;
    residuals_ = std::move(residuals);
    rounded_ = std::move(other);
    return true;
}

bool SolveProgress::ends(const Eigen::VectorXd& r, Eigen::VectorXd& u, bool exact)
{
    const bool success = converged(r, u, exact);
    run_.iterations = passes_++;

    if (error_ < best_ || run_.reaction.size() == 0) {
        best_ = error_;
        run_.reaction = r;
    }
    if (run_.iterations >= next_history_ || success) {
        run_.history.push_back({run_.iterations, clock_.seconds(), error_});
        next_history_ = run_.iterations < kFullHistory
                            ? run_.iterations + 1
                            : static_cast<int>(kThinning * run_.iterations);
    }
    if (success) {
        // The threshold rose with the floor of this r: a smaller error at another r does not count.
        run_.reaction = rounded_.size() > 0 ? rounded_ : r;
        run_.status = SolveStatus::converged;
        return true;
    }
    run_.status = SolveStatus::stagnated;
    if (!std::isfinite(error_)) return true; // iterates from here on are not finite either
    if (must_stop()) {
        run_.status = SolveStatus::out_of_time;
        return true;
    }
    if (best_ < kProgress * stall_reference_) {
        stall_reference_ = best_;
        stall_start_ = run_.iterations;
    }
    return run_.iterations >= options_.max_iterations ||
           run_.iterations - stall_start_ >= options_.patience;
}

bool SolveProgress::has_time_for(double seconds)
{
    if (clock_.seconds() + seconds <= 2 * options_.max_seconds) return true;
    run_.status = SolveStatus::out_of_time;
    return false;
}

void SolveProgress::prove(InfeasibilityProof proof)
{
    run_.status = SolveStatus::infeasible;
    run_.proof = std::move(proof);
}

} // namespace amontons
