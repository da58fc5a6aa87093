#pragma once

#include "contact/solvers/progress.hpp"

namespace amontons {

/// Nonsmooth block Gauss-Seidel: contact after contact, each solved exactly with the others held.
///
/// Settled contacts are left out of a sweep (options.nsgs.freeze). Linear convergence, at a rate
/// that does not depend on the scale of a contact, but on how strongly contacts are coupled.
/// @param start  rows, in the cones
/// Cost of a sweep: 2 rows^2 flops for dense W, less what is open or frozen; W is read by
/// contiguous columns; no allocation.
SolverRun solve_nsgs(const ContactProblem& problem, const SolverOptions& options,
                     Eigen::VectorXd start);

} // namespace amontons
