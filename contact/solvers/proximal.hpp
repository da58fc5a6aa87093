#pragma once

#include "contact/solvers/newton.hpp"

namespace amontons {

/// Paths of the problem with W + alpha in place of W, centred at the last of their solutions, while
/// alpha tends to zero: where the path of the problem itself folds back, that of the easier problem
/// does not. The last resort; hundreds of Newton steps.
/// @param alpha  at first, over an own block's mean diagonal [-]
/// @returns true if SolveProgress::ends(), false if alpha cannot be reduced further
bool follow_proximal_paths(SolverWork& work, ShiftedDelassus& matrix, double alpha);

} // namespace amontons
