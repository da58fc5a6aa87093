#pragma once

#include <Eigen/Core>

namespace amontons {

/// G with G^T G = W, of as many rows as W has rank: the Cholesky factor that takes the largest
/// diagonal entry next and ends when all that is left is round-off. O(rows rank^2).
/// @param W  symmetric and semidefinite
Eigen::MatrixXd semidefinite_root(const Eigen::MatrixXd& W);

} // namespace amontons
