#pragma once

#include "solver/step/body_step.hpp"

// Contact forces that the laws leave open: where rigid bodies share a load in more ways than one,
// or nearly so.

namespace amontons {

/// Result of the analysis of undetermined forces.
struct UndeterminedForces {
    std::vector<UndeterminedForce> pairs;  ///< in the order of the pairs
    std::vector<std::string> not_examined; ///< what was left out, and why: a sentence each
};

/// Of a step that was accepted, with the bodies where it left them.
/// @param tolerance  of the step: accuracy.contact [-]
UndeterminedForces undetermined_forces(const BodySystem& system, const BodyStepReport& step,
                                       const StepInput& input, double tolerance);

} // namespace amontons
