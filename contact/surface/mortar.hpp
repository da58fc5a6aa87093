#pragma once

#include "contact/surface/contact_points.hpp"
#include "mesh/extract_surface.hpp"

namespace amontons {

struct FixedShape;

/// How contacts of two surfaces are found.
struct MortarOptions {
    /// Contacts are made where the gap, or the overlap, is no larger [m], > 0.
    double reach = 0;
    /// The slave's multipliers at their nodes and the nearest point of the master instead of
    /// integrals: for interaction. See nodal_contacts.
    bool nodal = false;
    /// Normals of faces T3 and Q4 that do not jump at smooth edges, for curved surfaces given as
    /// facets (smooth_normals.hpp). Gaps stay those of the faces.
    bool smooth_normals = false;
    /// Normals are those of the master alone, of one that does not bend: they turn with it, not
    /// with what is pressed on it.
    bool master_normals = false;
    /// The normal of a contact is the direction in which its gap grows fastest as the surfaces are
    /// moved against each other, so that its force does no work where they slide along each other.
    /// Else it is the mean of both sides', which does: some 1 % of what friction takes.
    bool normals_of_gap = false;
    /// Of a body that may touch itself: its nodes at rest; both surfaces are of its mesh, and may
    /// be the same one. Faces with a node in common do not touch, and what lies behind a face at
    /// rest overlaps by no more than a share of that distance: more is the body's own thickness
    /// seen from within.
    std::span<const Vec3> at_rest = {};
};

/// Contacts between two surfaces of solids by dual mortar multipliers (multipliers.hpp): one at
/// each corner node of the slave's faces T3 and Q4, one at each middle node of its T6.
///
///   A_i = int psi_i,  d_ij = int psi_i N_j / A_i,  m_il = int psi_i M_l / A_i,
///   n_i = normalised int psi_i (nu_master - nu_slave),
///
/// over what faces of the slave and of the master share, seen along the slave's normal. Any kinds
/// of faces may touch. Where a face of the slave is covered in part, areas are >= 0 and sum to what
/// is covered; a multiplier that keeps under 5 % of its area joins a neighbour. Where the master
/// has several layers, the nearest counts. Only faces that are directed at each other do: the far
/// sides of thin bodies do not touch.
///
/// Exact on flat faces; on curved ones as exact as six integration points on each piece.
/// @param slave_places, master_places  of all nodes of each mesh, finite [m]
/// Cost: O(n log n) for faces of similar size.
SurfaceContacts mortar_contacts(const ExternalSurface& slave, std::span<const Vec3> slave_places,
                                const ExternalSurface& master, std::span<const Vec3> master_places,
                                const MortarOptions& options);

/// The same on a master that does not bend, with its smooth normals, in space; contacts have no
/// stencil on it. Of small triangles integrals are right to 1e-7.
/// @param slave_places  in the master's frame
/// Cost: of the faces that come within reach alone, and O(n) of the slave.
SurfaceContacts mortar_contacts(const ExternalSurface& slave, std::span<const Vec3> slave_places,
                                const FixedShape& master, const MortarOptions& options);

} // namespace amontons
