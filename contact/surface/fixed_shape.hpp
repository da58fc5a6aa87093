#pragma once

#include "contact/surface/faceted_surface.hpp"
#include "contact/surface/sharp_contacts.hpp"
#include "contact/surface/smooth_normals.hpp"
#include "mesh/closest_point.hpp"

namespace amontons {

/// A rigid surface with the data for searches on it. Made once, in a frame that moves with the
/// surface: the other surface is transformed into that frame.
struct FixedShape {
    const ExternalSurface& surface;
    const SharpFeatures& sharp;   ///< its sharp nodes and edges
    std::span<const Vec3> places; ///< of all nodes of the mesh [m]
    BoundingBox box;
    FacetTree faces;
    SmoothNormals normals;
    BoxTree sharp_nodes;                ///< of sharp.nodes
    BoxTree sharp_pieces, other_pieces; ///< of sharp.pieces, before and from sharp.sharp on
    std::vector<std::array<Vec3, 2>> directions; ///< of the chains at the ends of the sharp pieces

    /// @param surface, sharp, places  outlive it
    /// Cost: O(n log n).
    FixedShape(const ExternalSurface& surface, const SharpFeatures& sharp,
               std::span<const Vec3> places);
};

/// The unit normal at a place of the surface, which does not jump where it slides from one face
/// onto the next; nothing on a sharp edge or at its nodes, where faces differ.
/// @param flat  the surface's flat triangles
/// @param face  of `shape`, that has the place
std::optional<Vec3> smooth_normal_at(const FixedShape& shape, const FacetedSurface& flat,
                                     std::int32_t face, const TrianglePoint& place);

} // namespace amontons
