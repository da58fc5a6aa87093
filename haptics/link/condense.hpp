#pragma once

#include "haptics/link/condensed.hpp"
#include "haptics/link/held_body.hpp"
#include "solver/step/body_step.hpp"

namespace amontons {

/// Condenses the end of a step on its contacts near the handle, and near all bodies that contacts
/// tie to it: see docs/theory/haptics.md.
/// @param system  after the accepted step; body `handle` of it is `held`
/// @param step    the step that led there
Condensed condense(BodySystem& system, int handle, HeldBody& held, const StepInput& step,
                   const BodyStepReport& report, const ReductionOptions& options);

} // namespace amontons
