#pragma once

#include "mesh/wall.hpp"

namespace amontons {

/// An infinite plane as an obstacle; the free space is where the normal points.
struct PlaneOptions {
    Vec3 point = Vec3::Zero();   ///< [m]
    Vec3 normal = Vec3::UnitZ(); ///< any length > 0
    double size = 1;             ///< edge of the square made of triangles [m], > 0
};

/// Exact wall of the infinite plane, two triangles around `point`; no openings.
/// @throws InputError  if a number is out of range
WallModel make_plane(const PlaneOptions& options);

} // namespace amontons
