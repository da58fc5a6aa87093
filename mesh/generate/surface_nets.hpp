#pragma once

#include "mesh/surface_mesh.hpp"

#include <functional>

namespace amontons {

/// A surface given as the zeros of a function that is > 0 in the free space and changes no
/// faster than distance.
struct ImplicitSurface {
    std::function<double(const Vec3&)> value; ///< [m]
    std::function<Vec3(const Vec3&)> project; ///< a nearby point of the surface
};

/// Triangles of the whole surface inside a box, their normals into the free space, vertices on
/// the surface: one vertex for each sheet of it in each grid cell, projected and relaxed.
/// @param low, high  box that holds the surface [m]
/// @param edge       of the grid's cells and about that of the triangles [m]
/// Where two sheets are nearer to each other than the grid's cells they may be joined by handles,
/// and in rare cases an edge gets four triangles: choose a smaller edge.
/// Sources: Gibson 1998, Constrained elastic surface nets; Nielson 2004, Dual marching cubes.
/// @param part  makes only the triangles in cubes of four cells for which this is true, given their
///              middle; next to others vertices are elsewhere than in the whole. Null: all
SurfaceMesh surface_nets(const ImplicitSurface& surface, const Vec3& low, const Vec3& high,
                         double edge, const std::function<bool(const Vec3&)>& part = nullptr);

/// Properties of the result of surface_nets(), from the signs at the grid's nodes alone.
struct NetsPrediction {
    bool manifold = true;      ///< no edge gets four triangles
    std::size_t triangles = 0; ///< number of triangles; valid if manifold
    std::int64_t euler = 0;    ///< 2 for each closed part, less 2 for each handle
};
/// Predicts whether surface_nets() gives a manifold, and its number of triangles, in a tenth of its
/// time.
NetsPrediction predict_nets(const ImplicitSurface& surface, const Vec3& low, const Vec3& high,
                            double edge);

/// Moves free vertices along the surface towards the mean of their neighbours.
/// @param fixed   one entry per vertex; vertices that stay
void relax_on_surface(SurfaceMesh& mesh, const ImplicitSurface& surface,
                      const std::vector<char>& fixed, int sweeps);

} // namespace amontons
