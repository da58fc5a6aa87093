#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>

namespace amontons {

/// W = C^T A C, symmetric to the last bit.
///
/// The rows of a contact, which follow each other in C, act on the same nodes: they are taken
/// together, three at a time, so that A is read once for them.
/// @param A      symmetric
/// @param C      compressed; of its inner indices only `place` counts
/// @param place  row of A of each of C's numbers
/// @param W      resized to C's columns
void congruence(const Eigen::MatrixXd& A, const Eigen::SparseMatrix<double>& C,
                std::span<const Eigen::Index> place, Eigen::MatrixXd& W);

} // namespace amontons
