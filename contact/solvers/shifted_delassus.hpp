#pragma once

#include "contact/linear/block_lu.hpp"
#include "contact/solvers/smoothed_law.hpp"
#include "contact/solvers/work.hpp"

#include <Eigen/LU>

#include <optional>

namespace amontons {

/// Solves (S W S + D) x = b, S a scale per contact and D a block per contact: the matrix of a
/// Newton step. Contacts that the law calls open take no part: their x is given.
///
/// Dense W: LU of the closed contacts' rows, O(closed^3). Sparse W: a block LU whose pattern is
/// analysed once, or the dense LU where that is cheaper or the block LU inaccurate. Matrix-free W:
/// GMRES with the own blocks as preconditioner.
class ShiftedDelassus {
public:
    explicit ShiftedDelassus(const SolverWork& work); ///< refers to it

    /// @param shift  added to every diagonal entry, >= 0
    /// @returns false if it is singular to working precision
    bool factorise(const std::vector<LinearisedLaw>& law, double shift);
    /// x: rows of closed contacts hold b and leave with the solution; those of open ones are kept
    /// as they are and must already be accounted for in b.
    /// @returns false, and x as it was, if the block LU is too inaccurate and a dense one too large
    bool solve(Eigen::VectorXd& x);
    /// What a factor of this many closed rows costs [ns on one core of 2024]; 0 for a matrix-free
    /// W, whose products nobody knows the cost of.
    double cost(Eigen::Index closed_rows);

private:
    void analyse(); ///< a sparse W's pattern, once: what sweeps solve alone never needs it
    void factorise_dense();
    void gather_dense(int contact, Eigen::Index first);
    void gather_sparse(int contact, Eigen::Index first, const std::vector<Eigen::Index>& place);
    bool factorise_sparse();
    void factorise_own_blocks();
    void solve_dense(Eigen::VectorXd& x) const;
    bool solve_sparse(Eigen::VectorXd& x) const; ///< false, and x as it was, if it is poor
    void solve_by_gmres(Eigen::VectorXd& x) const;
    /// y = (S W S + D) x on closed rows, 0 on open ones.
    void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y) const;
    bool open(int contact) const { return (*law_)[static_cast<std::size_t>(contact)].open; }

    const ContactProblem& problem_;
    const Columns& columns_;
    const Eigen::VectorXd& scale_;
    const std::vector<LinearisedLaw>* law_ = nullptr; ///< of the last factor
    double shift_ = 0;                                ///< of the last factor
    // dense
    std::vector<int> closed_; ///< rows
    bool by_blocks_ = false;  ///< the last factor is the sparse one
    bool distrusted_ = false; ///< a sparse factor has been too inaccurate
    Eigen::MatrixXd matrix_;  ///< of all rows; the factor takes its upper left corner
    std::optional<Eigen::PartialPivLU<Eigen::Ref<Eigen::MatrixXd>>> dense_;
    // sparse
    bool analysed_ = false;
    BlockLu sparse_;
    std::vector<BlockLu::Place> places_; ///< of each neighbour of each contact
    // matrix-free
    std::vector<Mat3> preconditioner_;
};

} // namespace amontons
