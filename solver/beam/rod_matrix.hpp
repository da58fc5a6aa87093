#pragma once

#include "solver/linear/block_tridiagonal.hpp"
#include "solver/linear/chain_band.hpp"

// The matrix of a rod: block-tridiagonal along it and, where it is closed, with a block that joins
// its last node to its first. O(n) to factor and to solve.

namespace amontons {

using Map6 = Eigen::Map<Vec6>;
using ConstMap6 = Eigen::Map<const Vec6>;

/// A block as an Eigen matrix.
Mat6 dense(const Block6& b);
/// Copies a matrix into a block.
void set_block(Block6& b, const Mat6& m);
/// Adds a matrix to a block.
void add_to_block(Block6& b, const Mat6& m);

/// The matrix of a rod: block-tridiagonal, closed rods with a border. docs/theory/rods.md.
class RodMatrix {
public:
    RodMatrix(int nodes, bool closed);

    BlockTridiagonal chain;                  ///< of all nodes
    Block6 first_with_last, last_with_first; ///< of a closed rod

    /// Sets all blocks to zero.
    /// @param first  of a rod that is not closed: those that couple nodes before it with one another
    ///               stay as they are
    void set_zero(int first = 0);
    /// Multiplies all blocks by a factor.
    void scale(double by);
    /// Factors the matrix.
    /// @param first  of a rod that is not closed: nodes before it are left out
    /// @return  number of negative eigenvalues, of a symmetric matrix
    int factor(int first = 0);
    /// Solves in place with the last factors.
    void solve(std::vector<Node6>& x) const;
    /// out = A x
    /// @param first  nodes before it are left out: zero in `out`
    void multiply(const std::vector<Node6>& x, std::vector<Node6>& out, int first = 0) const;

private:
    bool closed_;
    ChainBand factors_; // of the chain, node 0 of a closed rod left out
    // Node 0 of a closed rod is eliminated last: A of the others, Z = A^-1 (their column of node
    // 0), S what is left of node 0's block.
    std::vector<std::vector<Node6>> Z_;
    Mat6 inverse_S_ = Mat6::Identity();
};

} // namespace amontons
