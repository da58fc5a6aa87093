#pragma once

#include "contact/solvers/sweeper.hpp"

namespace amontons {

/// Nonsmooth block Gauss-Seidel: contact after contact, each solved exactly with the others held.
///
/// Settled contacts are left out of a sweep (options.nsgs.freeze). Linear convergence, at a rate
/// that does not depend on the scale of a contact, but on how strongly contacts are coupled.
/// Cost of a sweep: 2 flops for each number in W, less what is open or frozen; W is read by
/// contiguous columns; no allocation.
void solve_nsgs(SolverWork& work);

/// The same with Anderson's extrapolation of r and u, which are linear in each other: a sweep
/// costs no product more, and 2 to 20 sweeps in one where convergence is slow.
/// D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12 (1965).
class AcceleratedNsgs {
public:
    explicit AcceleratedNsgs(SolverWork& work); ///< refers to it

    /// Up to this many sweeps, each followed by an extrapolation.
    /// @returns true if SolveProgress::ends(), false if the sweeps were used up
    bool advance(int sweeps);
    /// Drops the history of differences: to be called when r has been changed from outside.
    void restart();

private:
    void extrapolate();
    void store_iterate();

    SolverWork& work_;
    Sweeper sweeper_;
    Eigen::MatrixXd residual_change_, r_change_, u_change_; ///< rings of differences, rows x depth
    Eigen::MatrixXd normal_;                                ///< residual_change^T residual_change
    Eigen::VectorXd residual_, last_residual_, last_r_, last_u_, before_;
    int newest_ = -1, known_ = 0;
    bool has_last_ = false;
    double best_ = std::numeric_limits<double>::infinity();
};

} // namespace amontons
