#pragma once

#include "mesh/extract_surface.hpp"

#include <optional>

namespace amontons {

/// A surface at the start and at the end of a step.
struct MovedSurface {
    const ExternalSurface& surface;
    std::span<const Vec3> before, after; ///< of all nodes of the mesh [m]
};

/// Where a node of one of two surfaces passed through a face of the other, from outside to more
/// than `depth` behind it, which contacts at the end of a long step do not show. Nodes and faces
/// move along straight lines; faces count as triangles between their nodes.
/// @param depth  > 0 [m]
/// @return  the place of such a node [m]; nothing if there is none
/// Cost: O(n log n) where boxes around the paths overlap.
std::optional<Vec3> passage(const MovedSurface& a, const MovedSurface& b, double depth);

/// The least thickness of the body below a surface: measured from the middles of faces along their
/// inward normal, to where the surface faces the other way. It does not depend on the shape of the
/// elements.
/// @param places  of all nodes of the mesh [m]
/// @return  at most half the longest edge of any face [m]
/// Cost: O(n log n).
double least_thickness(const ExternalSurface& surface, std::span<const Vec3> places);
/// The same without that bound, of sides that face each other: corners are not thin. @param most
/// what is returned where the body is thicker [m]
double least_thickness(const ExternalSurface& surface, std::span<const Vec3> places, double most);

} // namespace amontons
