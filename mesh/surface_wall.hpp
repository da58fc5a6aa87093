#pragma once

#include "mesh/wall.hpp"

#include <string>

namespace amontons {

/// How a triangle surface becomes a wall.
struct SurfaceWallOptions {
    /// Where the free space is: "inside", "outside", or "" to determine it from the surface: inside
    /// a vessel (a surface whose holes are small), else the side that the normals of a closed
    /// surface point to. Required for an open surface that is no vessel.
    std::string side;
    /// Edges between triangles whose normals differ by more stay sharp [rad]; 0: 120 degrees
    /// inside (a lumen is smooth, whatever its facets), 60 degrees outside.
    double crease = 0;
    double spacing = 0; ///< of the field's grid [m]; 0: a fifth of the smallest radius found
};

/// The wall of a triangle surface: facets are refined to a smooth surface through the same
/// vertices, whose signed distance is sampled. Each hole of a vessel becomes an opening
/// ("opening_1" is the widest), beyond which the wall continues straight for some radii.
/// `surface` of the model is the refined one.
/// @throws InputError  if the surface is not manifold or orientable, has no triangle, or an
///                     unknown or missing side
/// Cost: 0.1 s for 3600 triangles; the wall is sampled while it is used.
WallModel make_wall_from_surface(SurfaceMesh mesh, const SurfaceWallOptions& options = {});
/// The same with the default crease and spacing.
inline WallModel make_wall_from_surface(SurfaceMesh mesh, const std::string& side)
{
    return make_wall_from_surface(std::move(mesh), SurfaceWallOptions{side, 0, 0});
}

} // namespace amontons
