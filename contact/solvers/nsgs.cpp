#include "contact/solvers/nsgs.hpp"

#include "mesh/base/dense.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// The error is examined again after this share of the sweeps done: an evaluation costs a fifth of
/// a sweep, and superfluous sweeps cost no more.
constexpr int kSeldom = 20, kSeldomest = 32;

/// Does r diverge? Tested at these sweeps, as the direction settles late, by the growth in two
/// sweeps, forward and backward.
constexpr int kFirstProof = 32;
constexpr int kProofFactor = 2;
constexpr int kProofSweeps = 2;

/// Differences that an extrapolation uses.
constexpr int kDepth = 6;
/// Residual that grew by this since the best: Anderson's history is dropped.
constexpr double kDisorder = 2;
/// Relative shift of the normal equations' diagonal: differences may be parallel.
constexpr double kRegular = 1e-10;

} // namespace

void solve_nsgs(SolverWork& work)
{
    Sweeper sweeper(work);
    Eigen::VectorXd before = work.r;
    const bool symmetric = work.options.nsgs.order == SolverOptions::Nsgs::Order::symmetric;

    int next_proof = kFirstProof, next_check = 0;
    for (int done = 0;; ++done) {
        if (done < next_check && !work.progress.must_stop()) {
            work.progress.pass();
        } else {
            if (work.progress.ends(work.r, work.u)) break;
            next_check = std::min(done + 1 + std::min(done / kSeldom, kSeldomest),
                                  std::max(done + 1, work.options.max_iterations));
        }
        if (done == next_proof) before = work.r;
        if (done == next_proof + kProofSweeps) {
            next_proof *= kProofFactor;
            if (std::optional<InfeasibilityProof> proof =
                    prove_infeasible(work.problem, work.r - before)) {
                work.progress.prove(std::move(*proof));
                break;
            }
        }
        const double freeze = done >= next_proof ? 0 : work.options.nsgs.freeze; // growth of all
        sweeper.sweep(freeze, symmetric && done % 2 == 1);
    }
}

AcceleratedNsgs::AcceleratedNsgs(SolverWork& work)
    : work_(work)
    , sweeper_(work)
    , residual_change_(work.r.size(), kDepth)
    , r_change_(work.r.size(), kDepth)
    , u_change_(work.r.size(), kDepth)
    , normal_(kDepth, kDepth)
{
}

void AcceleratedNsgs::restart()
{
    known_ = 0;
    newest_ = -1;
    has_last_ = false;
    best_ = std::numeric_limits<double>::infinity();
}

bool AcceleratedNsgs::advance(int sweeps)
{
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        const bool rounded = sweeper_.is_rounded() && has_last_;
        if (rounded) before_ = work_.u;
        if (work_.progress.ends(work_.r, work_.u)) return true;
        // Where u was computed anew, the last u is corrected by nearly the same: else their
        // difference would be mostly this correction.
        if (rounded) last_u_ += work_.u - before_;
        if (work_.progress.error() > kDisorder * best_) restart();
        best_ = std::min(best_, work_.progress.error());
        if (known_ > 0) extrapolate();
        before_ = work_.r;
        sweeper_.sweep(0);
        store_iterate();
    }
    return false;
}

void AcceleratedNsgs::extrapolate()
{
    Eigen::MatrixXd matrix = normal_.topLeftCorner(known_, known_);
    matrix.diagonal() *= 1 + kRegular;
    const Eigen::VectorXd share =
        LdltFactor(matrix).solve(residual_change_.leftCols(known_).transpose() * residual_);
    if (!share.allFinite()) return;
    work_.r.noalias() -= r_change_.leftCols(known_) * share;
    work_.u.noalias() -= u_change_.leftCols(known_) * share;
}

void AcceleratedNsgs::store_iterate()
{
    residual_ = (work_.r - before_).cwiseQuotient(work_.scale);
    if (has_last_) {
        newest_ = (newest_ + 1) % kDepth;
        known_ = std::min(known_ + 1, kDepth);
        residual_change_.col(newest_) = residual_ - last_residual_;
        r_change_.col(newest_) = work_.r - last_r_;
        u_change_.col(newest_) = work_.u - last_u_;
        for (int k = 0; k < known_; ++k)
            normal_(k, newest_) = normal_(newest_, k) =
                residual_change_.col(k).dot(residual_change_.col(newest_));
    }
    last_residual_ = residual_;
    last_r_ = work_.r;
    last_u_ = work_.u;
    has_last_ = true;
}

} // namespace amontons
