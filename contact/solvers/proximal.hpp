#pragma once

#include "contact/solvers/newton.hpp"

namespace amontons {

/// Paths of the problem with W + alpha in place of W, centred at the last of their solutions, while
/// alpha tends to zero: where the path of the problem itself folds back, that of an easier one
/// beside it does not. The way of last resort; hundreds of Newton steps.
/// @param alpha  at first, over an own block's mean diagonal [-]
/// @returns true if the progress ended, false if it leads no further
bool follow_proximal_paths(SolverWork& work, ShiftedDelassus& matrix, double alpha);

} // namespace amontons
