#pragma once

#include "mesh/base/types.hpp"

#include <vector>

namespace amontons {

/// A = L U of a dense matrix by blocks of columns; rows are exchanged only inside a diagonal block.
///
/// For W + D with W semidefinite and D's blocks of positive definite symmetric part: every pivot is
/// then regular. Other matrices may fail, or lose digits: examine the residual. Without a search
/// of pivots over whole columns nearly all of it is products of panels, which stay in registers.
/// A new factor of no more rows allocates nothing.
class DenseLu {
public:
    /// Opens a matrix of this many rows; its columns are to be filled in.
    void open(int rows);
    /// Column j: as many numbers as there are rows.
    double* column(int j) { return value_.data() + j * stride_; }
    std::ptrdiff_t stride() const { return stride_; } ///< numbers from one column to the next
    /// @returns false if a diagonal block is singular or a number not finite
    bool factorise();
    /// x <- A^-1 x, rows.
    void solve(Eigen::VectorXd& x) const;
    int rows() const { return rows_; }

private:
    bool factorise_block(int begin, int end);

    int rows_ = 0;
    std::ptrdiff_t stride_ = 0; ///< rows, filled up to whole vectors
    std::vector<double> value_; ///< L D^-1 below, D^-1 on, U above the diagonal blocks
    std::vector<double> panel_, packed_;
};

} // namespace amontons
