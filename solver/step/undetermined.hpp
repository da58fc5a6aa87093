#pragma once

#include "solver/step/body_step.hpp"

// Contact forces that are not determined by the laws: where a load can be distributed over rigid
// bodies' contacts in more than one way, or nearly so.

namespace amontons {

/// Result of the analysis of undetermined forces.
struct UndeterminedForces {
    std::vector<UndeterminedForce> pairs;  ///< in the order of the pairs
    std::vector<std::string> not_examined; ///< a sentence for each part left out, with the reason
};

/// The pairs whose forces are undetermined in an accepted step, with their intervals. The bodies
/// are in the state at its end.
/// @param tolerance  of the step: accuracy.contact [-]
UndeterminedForces undetermined_forces(const BodySystem& system, const BodyStepReport& step,
                                       const StepInput& input, double tolerance);

} // namespace amontons
