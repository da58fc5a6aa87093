#pragma once

#include "mesh/generate/surface_nets.hpp"
#include "mesh/wall.hpp"

namespace amontons {

/// Cuts a surface at the planes of its openings, so that it ends there in circles.
///
/// Every opening's tube continues beyond its plane in `mesh`; that part is removed within
/// `reach` along the opening's direction. Vertices near the plane are moved onto it, so that
/// no sliver is left; the rims lie on the openings' circles.
/// @param edge   typical edge of the triangles [m]
/// @param reach  one length per opening: how far its tube continues [m]
SurfaceMesh trim_openings(SurfaceMesh mesh, const ImplicitSurface& surface,
                          const std::vector<Opening>& openings, double edge,
                          const std::vector<double>& reach);

/// How many triangles trim_openings() leaves of those of surface_nets(), without making others
/// than those around the openings.
/// @param all  triangles of surface_nets(surface, low, high, edge)
/// @param edge  typical edge of the triangles [m]
std::size_t count_trimmed(std::size_t all, const ImplicitSurface& surface, const Vec3& low,
                          const Vec3& high, const std::vector<Opening>& openings, double edge,
                          const std::vector<double>& reach);

} // namespace amontons
