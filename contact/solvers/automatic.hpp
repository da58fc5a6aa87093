#pragma once

#include "contact/solvers/work.hpp"

namespace amontons {

/// Accelerated sweeps while they are the cheapest method; else Newton's method along the path;
/// where that does not converge, both in turns, each from the best iterate of the other.
///
/// The cost is predicted from the rate of the last sweeps and from counted operations, never from
/// the clock: the same input gives the same iterates.
/// @param warm  the start is near a solution: the state (open, stick, slip) of all but a few
///              contacts is that of the solution
void solve_automatically(SolverWork& work, bool warm);

} // namespace amontons
