#pragma once

#include <Eigen/SparseCore>

namespace amontons {

/// |A x - b| / (|A| |x| + |b|) in the maximum norm: about 1e-16 if x is as good as doubles allow,
/// whatever the condition of A. Only the lower triangle of A is read.
double backward_error(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& x,
                      const Eigen::VectorXd& b);

} // namespace amontons
