#pragma once

#include "contact/linear/block_lu.hpp"
#include "solver/linear/block_tridiagonal.hpp"
#include "solver/linear/supernodal.hpp"

#include <array>
#include <vector>

namespace amontons {

/// A x = b for a sparse A of 6x6 blocks, as of rods that touch anywhere: by Cholesky's method where
/// A is symmetric and positive definite, else by elimination without exchange of blocks. What
/// pivoting::solve asks of a matrix, without part factors.
class NodeMatrix {
public:
    /// @param coupled  pairs of nodes, in any order, also more than once; the blocks of both orders
    ///                 are there, and those of each node with itself. All are zero.
    void set_pattern(int nodes, std::vector<std::array<int, 2>> coupled);

    bool guarded = true; ///< else factor() takes every matrix for definite
    /// Number of nodes.
    int size() const { return int(start_.size()) - 1; }
    /// The block of two nodes; it must be in the pattern.
    Block6& block(int row, int col) { return block_[at(row, col)]; }
    const Block6& block(int row, int col) const { return block_[at(row, col)]; }
    /// A += s f h^T in one block.
    void add(int row, int col, const Column6& f, const Node6& h, double s);
    /// States that what is added is not symmetric.
    void set_unsymmetric() { symmetric_ = false; }

    /// (A + A^T) / 2.
    void take_symmetric_part();

    /// Sets all blocks to zero.
    void set_zero();
    /// The values of a matrix of the same pattern.
    void copy_values(const NodeMatrix& other);

    /// The factors are made when they are needed.
    /// @return 0 if positive definite, 1 if not, or not symmetric
    int factor(int);
    int negative_determinants() const { return guarded ? 1 : 0; } ///< 1: not known
    /// In place; not finite where there is no factor.
    void solve(std::vector<Node6>& x);

private:
    std::size_t at(int row, int col) const;
    bool cholesky();
    bool is_symmetric() const;
    void analyse_elimination();
    bool eliminate();

    std::vector<std::size_t> start_; // of each column's blocks
    std::vector<int> row_;           // of each block, ascending in a column
    std::vector<Block6> block_;
    bool symmetric_ = true;
    enum class Factor { none, cholesky, lu, failed } factor_ = Factor::none;

    bool analysed_lu_ = false, analysed_cholesky_ = false;
    bool indefinite_ = false; ///< a matrix of this pattern was
    BlockLu lu_;
    std::vector<std::array<BlockLu::Place, 4>> place_; // of each block's quarters
    SupernodalFactor supernodal_;
    Eigen::SparseMatrix<double> lower_;
};

} // namespace amontons
