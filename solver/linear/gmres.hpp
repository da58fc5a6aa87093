#pragma once

#include <Eigen/Core>
#include <functional>

namespace amontons {

/// Result of a solve by GMRES.
struct GmresResult {
    /// The solution.
    Eigen::VectorXd x;
    int products = 0;    ///< with A, and with the preconditioner
    double residual = 0; ///< of the preconditioned system, relative to that of b
};

/// x with A x = b by GMRES from the right side's preconditioned vector, without restarts: for a
/// matrix that is nearly the one whose inverse is at hand.
/// @param A, inverse  products with a vector
/// @param most        products
GmresResult gmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& A,
                  const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& inverse,
                  const Eigen::VectorXd& b, double tolerance, int most);

} // namespace amontons
