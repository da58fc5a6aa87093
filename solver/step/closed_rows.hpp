#pragma once

#include <Eigen/Core>
#include <vector>

namespace amontons {

/// The factor of a problem W r + u = 0 of rows that all hold, joints first of all. Rows may repeat
/// others (a closed chain of hinges): their forces are then the smallest that do, each measured by
/// the root of its row's compliance.
struct ClosedRows {
    Eigen::VectorXd scale;       ///< 1 / sqrt(W_ii) of each row
    std::vector<int> kept, left; ///< rows that are independent, and those that repeat them
    Eigen::MatrixXd root;        ///< U of the kept ones, scaled: U^T U = W there
    Eigen::MatrixXd share;       ///< of the kept ones in each that is left, kept x left
    Eigen::MatrixXd left_root;   ///< Cholesky's of 1 + share^T share

    /// Whether there are no closed rows.
    bool empty() const { return root.size() == 0; }
};

/// @param W  symmetric and semidefinite
/// @return   empty where W has a row without compliance
ClosedRows close_rows(const Eigen::MatrixXd& W);

/// -W^+ u, of what the kept rows need: u of the others is theirs where rows do not contradict each
/// other.
Eigen::VectorXd closing_forces(const ClosedRows& rows, const Eigen::VectorXd& u);

} // namespace amontons
