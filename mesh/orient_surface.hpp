#pragma once

#include "mesh/surface_mesh.hpp"

#include <cstdint>

namespace amontons {

/// The outcome of orient_consistently.
struct Orienting {
    std::int64_t turned = 0; ///< triangles
    bool orientable = true;  ///< false: a Moebius strip; some neighbours still disagree
};

/// Turns triangles until neighbours agree about the side. In each component the smaller part is
/// turned. Edges with more than two triangles connect nothing.
Orienting orient_consistently(SurfaceMesh& mesh);

/// Turns all triangles: normals then point to the other side.
void turn_around(SurfaceMesh& mesh);

/// Volume inside a closed surface, > 0 if its normals point outwards [m^3]. Of an open one, the
/// volume of the cones from its mean vertex: its sign says towards which side the most of the
/// surface looks.
double enclosed_volume(const SurfaceMesh& mesh);

} // namespace amontons
