#pragma once

#include "contact/problem.hpp"
#include "solver/large/large_matrix.hpp"

#include <atomic>
#include <functional>
#include <limits>
#include <string>

// Contact of one large linear solid with bodies that do not move, without W: the work of an
// iteration is linear in unknowns and contacts. Equations: docs/theory/large.md.

namespace amontons {

/// A y = load + C r, u = q + C^T y, and the contact law between u and r.
struct LargeContactProblem {
    Eigen::SparseMatrix<double> C; ///< degrees of freedom x rows; 0 at held ones
    Eigen::VectorXd q;             ///< of y = 0 [m]
    Eigen::VectorXd mu;            ///< of each contact
    std::vector<ContactKind> kind; ///< of each contact; none bilateral
    std::vector<int> first;        ///< row of each contact
    Eigen::VectorXd load;          ///< 0 at held degrees of freedom [N]
    /// A y, 0 at held degrees of freedom.
    std::function<Eigen::VectorXd(const Eigen::VectorXd&)> times;
    Eigen::VectorXd diagonal; ///< of A [N/m]
};

/// Options of the Newton method without W.
struct LargeContactOptions {
    double tolerance = 1e-8; ///< of the natural map, and of the balance of forces
    const std::atomic<bool>* stop = nullptr;
};

/// Solution of contact without W.
struct LargeContactSolution {
    /// Change of the iterate, and reactions.
    Eigen::VectorXd y, r;
    Eigen::VectorXd compliance; ///< W r: the part of u by r alone [m]
    double mean_compliance = 0; ///< trace of W over its rows [m/N], to some per cent
    /// Natural map, relative to the free motion's gaps and slips; without contacts that of the
    /// balance, relative to the load.
    double error = std::numeric_limits<double>::infinity();
    bool converged = false;
    int newton = 0, linear = 0; ///< iterations
    std::string fault; ///< of the linear solver, if that is why it did not converge; else ""
};

/// Solves a contact problem of a large solid by Newton's method with iterative linear solves.
/// @param A     of the solid, without blocks; has others afterwards
/// @param r     a guess, rows; or empty
/// @param mean  LargeContactSolution::mean_compliance of an earlier problem of the same matrix
///              [m/N]; or 0
LargeContactSolution solve_large_contact(LargeMatrix& A, const LargeContactProblem& problem,
                                         const Eigen::VectorXd& r, double mean,
                                         const LargeContactOptions& options);

} // namespace amontons
