#pragma once

#include "solver/step/simulation.hpp"

#include <vector>

namespace amontons {

/// Makes the obstacles of a scene: runs generators, reads and checks surface files.
/// @throws InputError  with all Issues of all obstacles; a mesh's Issue keeps the mesh's file
std::vector<Obstacle> build_obstacles(const Scene& scene);

} // namespace amontons
