#pragma once

#include "mesh/centreline.hpp"
#include "mesh/wall.hpp"

namespace amontons {

/// A vessel that is one tube.
struct TubeOptions {
    Centreline centreline;
    double resolution = 0; ///< edge of the triangles [m]; 0: chord error below 0.3 % of the radius
};

/// The free space inside the tube: exact wall (SweptTube), triangles with normals inwards,
/// openings "inlet" at the start and "outlet" at the end.
/// @throws InputError  if the centreline is empty or the resolution negative or not finite
WallModel make_tube(const TubeOptions& options);

} // namespace amontons
