#pragma once

#include "contact/surface/contact_points.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/wall.hpp"

#include <functional>

// Contacts of faces with round bodies smaller than the faces: a ball between the nodes of a face
// touches none of them.

namespace amontons {

/// On each face that is longer at rest between its multipliers than nine tenths of the wall's
/// radius of curvature, the place nearest to the wall's centre of curvature there: that of a ball
/// is exact, of a cylinder it is the one of the section at the face's middle. Not where a node is,
/// which is a contact by itself; of a place on several faces once. Areas are 0. An id is of the
/// face.
/// @param places   of all nodes of the mesh, finite [m]
/// @param at_rest  of the same: what is pressed must not lose a contact because its face shrinks
/// @param wall     distance, normal and curvature of what is touched
/// @param reach    contacts are made where the gap, or the overlap, is no larger [m]
/// Cost: O(n), one sample of the wall for each face.
SurfaceContacts bulge_contacts(const ExternalSurface& slave, std::span<const Vec3> places,
                               std::span<const Vec3> at_rest,
                               const std::function<WallSample(const Vec3&)>& wall, double reach);

} // namespace amontons
