#pragma once

#include "solver/scene/fields.hpp"
#include "solver/scene/findings.hpp"

namespace amontons {

/// The fields of "haptic": which body a hand holds, and how.
ObjectDeclaration declare_haptic();

/// What is wrong between these fields and the bodies.
void check_haptic(const Scene& scene, Findings& findings);

} // namespace amontons
