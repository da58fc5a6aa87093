#pragma once

#include "contact/solvers/colours.hpp"
#include "contact/solvers/local.hpp"
#include "contact/solvers/work.hpp"

#include <vector>

namespace amontons {

/// Sweeps of block Gauss-Seidel over a work's r and u: contact after contact, each solved exactly
/// with the others held.
///
/// u is kept up to date: a contact reads its own u_i, solves, and adds W(:, i) dr_i to u. A contact
/// that does not change thus costs an evaluation. The published form computes row i of W r for each
/// contact, which costs the same whether anything changes or not.
///
/// A dense W that leaves the cache is read in single precision: half of what a sweep waits for.
/// What u then lacks is 6e-8 of its change since SolveProgress computed it in full, as it does
/// before success.
///
/// Of a W of bodies the motions of these are kept up to date instead: a contact reads those of its
/// own, and of a pile a sweep stays in cache. Its contacts are visited by colours of bodies: the
/// same order for any number of threads.
class Sweeper {
public:
    explicit Sweeper(SolverWork& work); ///< refers to it; needs W by columns

    /// One sweep over all contacts but the settled ones: those whose u has changed, since their
    /// last visit left them solved, by less than `freeze` times the error's mean share at the
    /// common scale and the worst of the last sweep at their own.
    void sweep(double freeze, bool backward = false);

    /// True if sweeps read W in single precision.
    bool is_rounded() const { return !rounded_.empty(); }

private:
    Mat3& own(int i) { return own_[static_cast<std::size_t>(i)]; }
    const Mat3& own(int i) const { return own_[static_cast<std::size_t>(i)]; }
    LocalBlock& block(int i) { return blocks_[static_cast<std::size_t>(i)]; }
    void sweep_bodies(bool backward);
    double visit_if_changed(int i);
    void visit(int i);
    void add(int i, const double* change);
    LocalReaction solve_shifted(int i, const Vec3& ri, const Vec3& b) const;
    void visit_row(int i);

    SolverWork& work_;
    std::vector<float> rounded_;           ///< W unit_ by columns, or nothing
    double unit_ = 1;                      ///< a power of two that brings W near one
    Eigen::VectorXd u_;                    ///< of this sweep, as the columns take it
    Eigen::VectorXd v_;                    ///< of bodies, where W is one of bodies
    std::vector<Mat3> own_;                ///< diagonal blocks of frictional contacts
    std::vector<LocalBlock> blocks_;       ///< the same, prepared
    Eigen::VectorXd own_weight_, weight_;  ///< of a change squared: its own scale, the common one
    Eigen::VectorXd multiplier_;           ///< last one of each contact that slipped, else 0
    Colours colours_;                      ///< of a W of bodies
    double settled_ = 0, own_settled_ = 0; ///< changes squared that need no visit in this sweep
    bool watches_ = false;                 ///< are there any?
    double worst_ = 0;     ///< largest change of u in the last sweep, each at its own scale
    Eigen::VectorXd seen_; ///< u of each contact as its last visit left it, rows
};

} // namespace amontons
