#pragma once

#include "mesh/surface_mesh.hpp"

#include <cstdint>
#include <vector>

namespace amontons {

/// For each point, the first point at exactly the same place (itself, if it is the first).
/// 0 and -0 are the same place. O(n) time and memory.
std::vector<std::int32_t> first_at_same_place(const std::vector<Vec3>& points);

/// Merges points at exactly the same place. The first of each stays, in the order of the file;
/// triangles keep their number and place, also those that lose their area.
/// @param triangles  indices within the mesh's points (not checked)
void weld(SurfaceMesh& mesh);

} // namespace amontons
