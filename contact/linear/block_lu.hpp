#pragma once

#include "mesh/base/types.hpp"

#include <vector>

namespace amontons {

/// A = L U for a matrix of 3 x 3 blocks with a symmetric pattern, without exchanging blocks.
///
/// For W + D with W semidefinite and D's blocks of positive definite symmetric part: every pivot
/// block is then regular. Other matrices may fail, or lose digits: look at the residual.
/// The pattern is analysed once (minimum degree); a new factor with the same pattern allocates
/// nothing. Cost: O(fill), by the same sum as a Cholesky factor, twice.
class BlockLu {
public:
    /// @param start, neighbour  the pattern by columns: block rows of column j are
    ///                          neighbour[start[j]] .. neighbour[start[j + 1] - 1]
    void analyse(const std::vector<std::size_t>& start, const std::vector<int>& neighbour);

    /// Opens a new matrix of the analysed pattern, all zero.
    void clear();
    /// A(i, j) += block; (i, j) must be in the pattern.
    void add(int i, int j, const Mat3& block);
    /// @returns false if a pivot block is singular to working precision
    bool factorise();
    /// x <- A^-1 x, 3 n.
    void solve(Eigen::VectorXd& x) const;

    /// Blocks of L, the diagonal included.
    std::size_t fill() const { return row_.size() + pivot_.size(); }
    /// Block products that a factor takes: its cost, about 20 ns each.
    double work() const { return work_; }

private:
    // Columns are padded to four numbers: one vector register each.
    struct alignas(32) Block {
        double column[3][4] = {};
    };
    std::size_t find(int row, int column) const;

    int n_ = 0;
    std::vector<int> order_, place_;   // order_[k]: block that is eliminated k-th; its inverse
    std::vector<std::size_t> first_;   // of each column of L in row_, n + 1
    std::vector<int> row_;             // rows below the diagonal, ascending
    std::vector<Block> lower_, upper_; // L(row, column), U(column, row)^T: the same pattern
    std::vector<Mat3> pivot_, inverse_;
    std::vector<std::vector<std::size_t>> updates_; // entries of row k, as indices into row_
    std::vector<int> column_of_;                    // column of each entry
    double work_ = 0;
};

} // namespace amontons
