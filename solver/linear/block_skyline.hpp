#pragma once

#include "solver/linear/block_tridiagonal.hpp"

#include <vector>

namespace amontons {

/// A x = b for an A of 6x6 blocks whose rows begin near the diagonal, by block elimination from
/// the first node to the last without pivoting, as BlockTridiagonal: several chains merged along
/// their common length. O(n w^2) time and O(n w) memory for rows of w blocks.
class BlockSkyline {
public:
    /// Blocks (i, j) and (j, i) exist for top[i] <= j <= i. All are zero.
    void set_pattern(const std::vector<int>& top);

    /// Number of block rows.
    int size() const { return int(top_.size()); }
    /// First block row of column i.
    int top(int i) const { return top_[std::size_t(i)]; }

    /// Row `row`, column `col`; both orders are there if one is.
    Block6& block(int row, int col)
    {
        return row >= col ? lower_[at(row, col)] : upper_[at(col, row)];
    }
    const Block6& block(int row, int col) const
    {
        return row >= col ? lower_[at(row, col)] : upper_[at(col, row)];
    }

    /// Sets all blocks to zero.
    void set_zero();
    /// Copies every block whose row or column is node `from` or later; the patterns are the same.
    void copy_from(const BlockSkyline& other, int from);

    /// As BlockTridiagonal::factor, but in place: the blocks of nodes >= `from` are those of the
    /// matrix before, and of its factors after.
    int factor(int from);
    /// Negative determinants of the pivot blocks of the last factor.
    int negative_determinants() const { return odd_.back(); }

    /// Solves in place with the last factors.
    void solve(std::vector<Node6>& x) const;

private:
    std::size_t at(int i, int j) const
    {
        return start_[std::size_t(i)] + std::size_t(j - top_[std::size_t(i)]);
    }

    std::vector<int> top_;
    std::vector<std::size_t> start_; // of each row's blocks in the two arrays
    std::vector<Block6> lower_;      // A_ij, j <= i; then L_ij, and D_i^-1 on the diagonal
    std::vector<Block6> upper_;      // A_ji, j < i; then D_j^-1 U_ji. The diagonal's is not used
    std::vector<int> negative_, odd_;
};

} // namespace amontons
