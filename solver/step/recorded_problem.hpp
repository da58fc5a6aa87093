#pragma once

#include "contact/problem.hpp"

#include <cstdint>
#include <string>

namespace amontons {

/// The contact problem of an accepted step, linearised at its end, with the reaction that the
/// step found: W = H A^-1 H^T with A the wire's tangent, q = u - W r.
///
/// The step's reaction solves it whatever A is: u = W r + q holds by the choice of q, and the laws
/// between u and r are the step's own. Of the tangent the symmetric part is taken (a friction force
/// that turns with the wall makes it unsymmetric by some percent, and solvers of contact problems
/// may require reciprocity). A includes the wire's geometric stiffness, but no stiffness of the
/// contacts; where the wire is unstable without its contacts A has negative eigenvalues, and so has
/// W. Such a problem is recorded as it is: with a stiffness of contacts added, u and r would obey
/// another law than Coulomb's.
struct RecordedProblem {
    ContactProblem problem;            ///< gaps and slips over the step [m], forces [N]
    Eigen::VectorXd reaction;          ///< the step's r, rows [N]
    std::vector<std::int32_t> contact; ///< identity; wires: contact point * walls + wall
    std::string name;                  ///< of the body or bodies; "" if it is all of them
    int negative_eigenvalues = 0;      ///< of A
    double asymmetry = 0;     ///< of the tangent, largest |K - K^T| / |K| of its blocks [-]
    double inverse_error = 0; ///< |A A^-1 H^T - H^T| / |H^T|, after refinement [-]
};

} // namespace amontons
