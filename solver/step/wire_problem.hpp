#pragma once

#include "solver/step/recorded_problem.hpp"
#include "solver/step/wire_step.hpp"

namespace amontons {

/// The contact problem of the wire: contacts that act or are nearer than kNearActive radii. Call it
/// before the next step.
RecordedProblem contact_problem(const WireBody& body);

constexpr double kNearActive = 0.1; ///< of the wire's radius [-]

} // namespace amontons
