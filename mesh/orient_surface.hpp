#pragma once

#include "mesh/surface_mesh.hpp"

#include <array>
#include <cstdint>
#include <vector>

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

/// The part of each triangle, counted from 0: those that edges of two triangles connect.
std::vector<std::int32_t> parts_of(const SurfaceMesh& mesh);

/// Turns parts of a closed, consistently oriented surface so that normals point out of what they
/// enclose together: outwards, and inwards where an odd number of the other parts lies around one
/// (a cavity). Parts that pass through one another have no such side: any may come out.
/// Cost: O(triangles of the parts around a part), for each part.
void orient_parts(SurfaceMesh& mesh);

/// The normal of a triangle, of length 1; 0 if it has no area.
Vec3 unit_normal(const SurfaceMesh& mesh, const std::array<std::int32_t, 3>& triangle);

/// Volume inside a closed surface, > 0 if its normals point outwards [m^3]. Of an open one, the
/// volume of the cones from its mean vertex: its sign shows to which side most of the surface
/// faces.
double enclosed_volume(const SurfaceMesh& mesh);

} // namespace amontons
