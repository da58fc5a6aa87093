#pragma once

#include "solver/linear/block_tridiagonal.hpp"

// What iterative refinement needs of a block-tridiagonal matrix that elimination without pivoting
// has factored.

namespace amontons {

/// Makes A symmetric. @return  how much it was not, the largest share of a block
double symmetrise(BlockTridiagonal& A);

/// right - A x, of the nodes from A.first() on
std::vector<Node6> residual(const BlockTridiagonal& A, const std::vector<Node6>& right,
                            const std::vector<Node6>& x);

} // namespace amontons
