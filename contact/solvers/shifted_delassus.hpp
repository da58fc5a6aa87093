#pragma once

#include "contact/linear/block_lu.hpp"
#include "contact/linear/dense_lu.hpp"
#include "contact/solvers/shifted_bodies.hpp"
#include "contact/solvers/smoothed_law.hpp"
#include "contact/solvers/work.hpp"

#include <Eigen/LU>

#include <optional>

namespace amontons {

/// Solves (S W S + D) x = b, S a scale per contact and D a block per contact: the matrix of a
/// Newton step. Contacts that the law calls open take no part: their x is given.
///
/// Dense W: LU of the closed contacts' rows, O(closed^3). Sparse W: a block LU whose pattern is
/// analysed once, or the dense LU where that is cheaper. Both exchange rows only inside diagonal
/// blocks, and the residual shows whether that was enough: else a dense LU that searches its
/// pivots. W of bodies: ShiftedBodies. Matrix-free W: GMRES with the own blocks as preconditioner.
class ShiftedDelassus {
public:
    explicit ShiftedDelassus(const SolverWork& work); ///< refers to it

    /// @param shift  added to every diagonal entry, >= 0
    /// @returns false if it is singular to working precision
    bool factorise(const std::vector<LinearisedLaw>& law, double shift);
    /// @param b  of closed rows; those of open ones do not count
    /// @param x  enters with the rows of open contacts, and leaves with the others too
    /// @param product  leaves with S W S x
    /// @returns false if the factor is too inaccurate, and too large for one that is not
    bool solve(const Eigen::VectorXd& b, Eigen::VectorXd& x, Eigen::VectorXd& product);
    /// Of a factor of W of bodies: changes of the reactions and motions of some contacts by
    /// additional forces on them, while all contacts respond by their D; by rows, those of the
    /// contacts one after another.
    struct Response {
        /// Reactions and motions of the chosen contacts by unit forces on them.
        Eigen::MatrixXd reactions, motions;
    };
    /// Linear response of these contacts: see Response.
    Response response(const std::vector<int>& contacts) const;
    double shift() const { return shift_; } ///< of the last factor, no less than requested
    /// Factors without a search of pivots are tried again, although one has been too inaccurate.
    void trust() { distrusted_ = false; }
    /// Estimated time of a factor of this many closed rows [ns on one core of 2024]; 0 for a
    /// matrix-free W, the cost of whose products is unknown.
    double cost(Eigen::Index closed_rows);
    /// Is cost(closed_rows) at least `limit` [ns]? Where the size of W shows it, the pattern is not
    /// analysed: the analysis of a large packing takes longer than the sweeps that solve it.
    bool costs_at_least(double limit, Eigen::Index closed_rows);

private:
    double filling_cost() const; ///< what a sparse factor costs beside the factor itself [ns]
    void analyse(); ///< a sparse W's pattern, once: what sweeps solve alone never needs it
    bool factorise_dense();
    void factorise_with_pivots();
    std::vector<Eigen::Index> places() const; ///< first closed row of each contact, -1 if open
    /// Fills the closed rows of a contact's columns of S W S + D, columns `stride` numbers apart.
    void gather(int contact, const std::vector<Eigen::Index>& place, double* target,
                std::ptrdiff_t stride) const;
    bool factorise_sparse();
    void factorise_own_blocks();
    /// x <- the factor's x on closed rows, 0 on open ones; b has 0 on open ones.
    void solve_once(const Eigen::VectorXd& b, Eigen::VectorXd& x) const;
    void solve_by_gmres(const Eigen::VectorXd& b, Eigen::VectorXd& x) const;
    /// Refines x until the residual no longer gets smaller. @returns  it, over that of x = 0
    double refine(const Eigen::VectorXd& b, Eigen::VectorXd& x, Eigen::VectorXd& product);
    void apply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const; ///< S W S x
    /// y = (S W S + D) x on closed rows, 0 on open ones.
    void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y) const;
    /// residual = b - S W S x - D x on closed rows, 0 on open ones.
    void subtract(const Eigen::VectorXd& b, const Eigen::VectorXd& x,
                  const Eigen::VectorXd& product, Eigen::VectorXd& residual) const;
    bool open(int contact) const { return (*law_)[static_cast<std::size_t>(contact)].open; }

    const ContactProblem& problem_;
    const Columns& columns_;
    const Eigen::VectorXd& scale_;
    const std::vector<LinearisedLaw>* law_ = nullptr; ///< of the last factor
    double shift_ = 0;                                ///< of the last factor
    enum class Factor { dense, pivoted, blocks, bodies };
    Factor factor_ = Factor::dense; ///< the last one
    bool distrusted_ = false;       ///< one without a search of pivots has been too inaccurate
    // dense
    std::vector<Eigen::Index> closed_; ///< rows
    DenseLu dense_;
    Eigen::MatrixXd matrix_; ///< what is factorised in place
    std::optional<Eigen::PartialPivLU<Eigen::Ref<Eigen::MatrixXd>>> pivoted_;
    // sparse
    bool analysed_ = false;
    BlockLu sparse_;
    std::vector<BlockLu::Place> places_; ///< of each neighbour of each contact
    // of bodies
    ShiftedBodies bodies_;
    // matrix-free
    std::vector<Mat3> preconditioner_;
};

} // namespace amontons
