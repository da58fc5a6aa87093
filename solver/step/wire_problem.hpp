#pragma once

#include "solver/step/recorded_problem.hpp"
#include "solver/step/wire_step.hpp"

namespace amontons {

/// The contact problem of the wire at the last accepted step: contacts that act or whose gap is
/// below kNearActive radii. Call it before the next step.
RecordedProblem contact_problem(const WireBody& body);

constexpr double kNearActive = 0.1; ///< gap over the wire's radius [-]

} // namespace amontons
