#pragma once

#include "solver/step/simulation.hpp"

#include <array>
#include <span>
#include <vector>

namespace amontons {

struct ContactSurface;

/// Predicted cost of each method for the linear systems of a scene, and the method chosen
/// (docs/theory/large.md).
/// @param solids    of the scene, as they are built; their meshes
/// @param laws      written out, with the surfaces of either side, null where there is none
/// @param all       of the ways, also those that are not taken
LinearPlan choose_linear(const Scene& scene, std::span<const SolidInput> solids,
                         const std::vector<VolumeMesh>& meshes,
                         const std::vector<Obstacle>& obstacles, std::span<const ContactLaw> laws,
                         std::span<const std::array<const ContactSurface*, 2>> surfaces, bool all);

} // namespace amontons
