#pragma once

#include "mesh/wall.hpp"

namespace amontons {

/// An infinitely long round cylinder as an obstacle.
struct CylinderOptions {
    Vec3 point = Vec3::Zero(); ///< on the axis, the middle of the triangles [m]
    Vec3 axis = Vec3::UnitZ(); ///< any length > 0
    double radius = 0;         ///< [m], > 0
    bool inside = false;       ///< the free space is inside
    double length = 0;         ///< of the part made of triangles [m]; 0: 20 radii
};

/// Exact wall of the infinite cylinder, triangles of a part of it; no openings.
/// @throws InputError  if a number is out of range
WallModel make_cylinder(const CylinderOptions& options);

} // namespace amontons
