#pragma once

#include "contact/surface/contact_points.hpp"
#include "contact/surface/smooth_normals.hpp"
#include "mesh/box_tree.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/wall.hpp"

#include <functional>
#include <numbers>

// Contacts at sharp corners and edges, which integrals over faces do not resolve: the faces beside
// them are inclined to the other body, and the mean gap over such a face contains little of its
// corner's.
//
// Corners and nodes of edges on faces, and edges across edges: with them every way in which
// surfaces of flat faces can touch is covered. Places are the current ones; which corners and edges
// are sharp is decided at rest.

namespace amontons {

/// The edges of a surface as straight pieces between two nodes (those of a T6 are two), and which
/// of them are sharp and convex.
struct SharpFeatures {
    /// A piece of a sharp edge.
    struct Piece {
        /// Its two nodes.
        std::array<std::int32_t, 2> nodes{};
        std::array<std::int32_t, 2> faces{}; ///< on both sides
        std::int32_t chain = -1;             ///< -1: not sharp
        std::array<bool, 2> ends{};          ///< whether the chain ends at that node
    };
    std::vector<Piece> pieces; ///< the sharp ones first; all of a chain run the same way along it
    std::size_t sharp = 0;     ///< how many are
    int chains = 0;            ///< sharp edges that follow one another without a corner
    std::vector<std::int32_t> nodes; ///< of sharp edges, ascending
    std::vector<std::size_t> begin;  ///< of each in `faces`, and the end
    std::vector<std::int32_t> faces; ///< around each
    SmoothGroups smooth;             ///< faces that smooth edges join
};

/// @param places  of all nodes of the mesh, at rest [m]
/// @param sharp   angle between the normals of the faces from here on [rad]
SharpFeatures sharp_features(const ExternalSurface& surface, std::span<const Vec3> places,
                             double sharp = std::numbers::pi / 4);

struct FixedShape;

/// A surface where it is now.
struct SharpSurface {
    const ExternalSurface& surface;
    const SharpFeatures& features;
    std::span<const Vec3> places;      ///< of all nodes of the mesh [m]
    const FixedShape* fixed = nullptr; ///< of a surface that does not bend: what searches need
};

/// Unit directions of the chains at the two nodes of each sharp piece.
std::vector<std::array<Vec3, 2>> chain_directions(const SharpSurface& surface);
/// The box around a piece, extended by a margin on all sides [m].
BoundingBox piece_box(const SharpSurface& surface, const SharpFeatures::Piece& piece,
                      double margin);

/// Contacts of a sharp node on a face, of a sharp edge across any edge of the other body, of either
/// body against the other. Only where the faces beside the corner or edge rise from the other body
/// by more than 0.1 (sine of their inclination): with less, faces touch, which is found by
/// mortar_contacts. Below 0.1 the contact does not end at once: an overlap of a tenth of the face
/// times what the sine lacks is allowed, and there is no contact below -0.05. So no force begins at
/// a threshold, and the equilibrium does not depend on the path to it. Two meshes that slide flush
/// on each other would lose the contacts of their rims by this rule; with `known` a contact once
/// found is kept.
///
/// Normals are those of the face that is touched, or across both edges where both are sharp; along
/// a chain of edges those do not jump. Areas are 0, gaps are without the overlap that is left. An
/// id is of the node, or of the chain and what it crosses.
/// @param reach  contacts are made where the gap, or the overlap, is no larger [m]
/// @param known  ids, ascending, of contacts that an iteration has found already: those stay until
///               faces are inclined the other way, and others begin beyond 0.1; null: the gradual
///               rule above
/// @param bare_corners  whether the slave's sharp nodes that carry no multiplier (corners of T6)
///               are contacts at any inclination of their faces
/// Cost: O(n log n) for pieces of similar length; negligible where nothing is sharp.
SurfaceContacts sharp_contacts(const SharpSurface& slave, const SharpSurface& master, double reach,
                               const std::vector<std::int64_t>* known = nullptr,
                               bool bare_corners = false);

/// Contacts of sharp nodes that carry no multiplier (corners of T6) with a smooth obstacle, at any
/// inclination of their faces. Areas are 0.
/// @param wall   distance, normal and curvature of the obstacle
/// @param reach  contacts are made where the gap, or the overlap, is no larger [m]
SurfaceContacts sharp_wall_contacts(const SharpSurface& slave,
                                    const std::function<WallSample(const Vec3&)>& wall,
                                    double reach);

} // namespace amontons
