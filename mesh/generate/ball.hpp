#pragma once

#include "mesh/wall.hpp"

namespace amontons {

/// A ball as an obstacle.
struct BallOptions {
    Vec3 centre = Vec3::Zero(); ///< [m]
    double radius = 0;          ///< [m], > 0
    bool inside = false;        ///< the free space is inside the ball
    double resolution = 0;      ///< edge of the triangles [m]; 0: 1280 triangles
};

/// Exact wall and an icosphere; no openings.
/// @throws InputError  if a number is out of range
WallModel make_ball(const BallOptions& options);

} // namespace amontons
