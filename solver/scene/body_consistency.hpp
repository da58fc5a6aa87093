#pragma once

#include "solver/scene/findings.hpp"
#include "solver/scene/scene.hpp"

namespace amontons {

/// What is wrong between the fields of solids, rigid bodies and couplings.
void check_bodies(const Scene& scene, Findings& findings);

} // namespace amontons
