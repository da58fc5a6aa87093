#pragma once

#include "solver/scene/findings.hpp"
#include "solver/scene/scene.hpp"

namespace amontons {

/// Beside beams a solid is the wall of a vessel: a generated tube, linear or hyperelastic, held, at
/// rest.
void check_vessels(const Scene& scene, Findings& findings);

} // namespace amontons
