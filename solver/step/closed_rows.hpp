#pragma once

#include <Eigen/Core>
#include <vector>

namespace amontons {

/// The factor of a problem W r + u = 0 of bilateral rows, joints in particular. Rows may be
/// linearly dependent (a closed chain of hinges): r is then the solution of least norm, each force
/// weighted by the root of its row's compliance.
struct ClosedRows {
    Eigen::VectorXd scale;       ///< 1 / sqrt(W_ii) of each row
    std::vector<int> kept, left; ///< rows that are independent, and those that repeat them
    Eigen::MatrixXd root;        ///< U of the kept ones, scaled: U^T U = W there
    /// Of each column of the root, the first row that is other than 0.
    std::vector<Eigen::Index> begin;
    Eigen::MatrixXd share;     ///< of the kept ones in each that is left, kept x left
    Eigen::MatrixXd left_root; ///< Cholesky's of 1 + share^T share

    /// Whether there are no closed rows.
    bool empty() const { return root.size() == 0; }
};

/// @param W  symmetric and semidefinite
/// @return   empty where W has a row without compliance
ClosedRows close_rows(const Eigen::MatrixXd& W);

/// The reactions r = -W^+ u that close the kept rows; the dependent rows are then closed too, where
/// u is consistent.
/// @param u  values of all rows
Eigen::VectorXd closing_forces(const ClosedRows& rows, const Eigen::VectorXd& u);

} // namespace amontons
