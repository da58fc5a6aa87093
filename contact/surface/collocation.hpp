#pragma once

#include "contact/surface/contact_points.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/wall.hpp"

#include <functional>

// Contacts at the nodes that carry multipliers (multipliers.hpp): corners of T3 and Q4, middles of
// T6. A contact moves with its node alone; its area is that of the dual multiplier, over the faces
// that are directed at the other surface.

namespace amontons {

/// How a place inside a shape comes out of it: against its own surface's normal, into which it was
/// pressed. The nearest way out changes at once where two are equally long, as beside the edge of a
/// punch, and a place under it would be pushed sideways.
/// @param way      unit, or zero: the nearest
/// @param longest  a longer way is none: the nearest [m]
WallSample exit_from(const std::function<WallSample(const Vec3&)>& shape, const Vec3& x,
                     const Vec3& way, double longest);

/// With a smooth rigid obstacle. The constraints of dual multipliers are at their nodes, so this is
/// no less exact than integrals.
/// @param places  of all nodes of the mesh, finite [m]
/// @param wall    called once for each node that carries a multiplier
/// @param reach   contacts are made where the gap, or the overlap, is no larger [m]
SurfaceContacts wall_contacts(const ExternalSurface& slave, std::span<const Vec3> places,
                              const std::function<WallSample(const Vec3&)>& wall, double reach);

/// With the nearest point of another solid: faster than mortar_contacts, not exact where the mesh
/// of the master is finer (some of its nodes may touch nothing). A node beyond the master's border
/// touches nothing.
/// @param smooth_normals  as MortarOptions
/// @param reach  largest |gap| of a contact [m]
SurfaceContacts nodal_contacts(const ExternalSurface& slave, std::span<const Vec3> slave_places,
                               const ExternalSurface& master, std::span<const Vec3> master_places,
                               double reach, bool smooth_normals = false);

} // namespace amontons
