#pragma once

#include <Eigen/Core>
#include <functional>

namespace amontons {

/// Result of a solve by GMRES.
struct GmresResult {
    /// The last iterate; 0 if b is.
    Eigen::VectorXd x;
    int products = 0;    ///< iterations: products with A and with the preconditioner M^-1
    double residual = 0; ///< |M^-1 (b - A x)| / |M^-1 b| [-]
};

/// Solves A x = b by GMRES without restarts, preconditioned from the left, from x = 0 (Saad &
/// Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856): for an A near a matrix M that is factored.
/// @param A, inverse  products of A and of M^-1 with a vector
/// @param tolerance   ends at this `residual`
/// @param most        iterations, > 0; the last iterate is returned, converged or not
GmresResult gmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& A,
                  const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& inverse,
                  const Eigen::VectorXd& b, double tolerance, int most);

} // namespace amontons
