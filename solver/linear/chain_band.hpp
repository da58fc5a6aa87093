#pragma once

#include "solver/linear/block_tridiagonal.hpp"

#include <vector>

namespace amontons {

/// LU decomposition of a block-tridiagonal matrix one unknown after the other, without pivoting.
/// Where BlockTridiagonal multiplies by inverses of its blocks and so loses the square of their
/// condition (of stretching against bending, 1e11 of a rod of 1e5 radii), this loses no more than
/// the matrix itself asks for, if that is symmetric and positive definite. O(n) time and memory.
class ChainBand {
public:
    /// @param first  nodes before it take no part
    /// @return  number of pivots that are not positive (of a symmetric matrix: of eigenvalues)
    int factor(const BlockTridiagonal& chain, int first);
    /// Solves in place with the last factors.
    void solve(std::vector<Node6>& x) const;

private:
    int first_ = 0, rows_ = 0;
    std::vector<double> rows_of_band_; // kWidth numbers a row
};

} // namespace amontons
