#pragma once

#include "contact/options.hpp"
#include "contact/solution.hpp"

namespace amontons {

/// Solves u = W r + q with every contact's law, and certifies the answer.
///
/// Always returns the best reaction found, with a certificate recomputed from (W, q, mu, r): no
/// convergence is a status, not an exception. The same input gives the same result to the bit,
/// unless the time ran out.
/// @param warm_start  a reaction near the solution, rows; or empty. Used only where it is better
///                    than r = 0
/// @throws InputError  if the problem, the options or the warm start make no sense, or sweeps are
///                     needed from a matrix-free W, with all that is wrong; nothing has run
ContactSolution solve(const ContactProblem& problem, const SolverOptions& options = {},
                      const Eigen::VectorXd& warm_start = {});

} // namespace amontons
