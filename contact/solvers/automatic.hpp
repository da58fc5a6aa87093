#pragma once

#include "contact/solvers/work.hpp"

namespace amontons {

/// Accelerated sweeps as long as they are the cheapest way; else the path of Newton's method;
/// where that leads nowhere, both in turns, each from the best that the other reached.
///
/// What is cheapest is judged by the rate of the last sweeps and by counted operations, never by
/// the clock: the same input takes the same way.
/// @param warm  the start is near a solution: which contacts do what is known, but for a few
void solve_automatically(SolverWork& work, bool warm);

} // namespace amontons
