#pragma once

#include "contact/surface/contact_points.hpp"
#include "contact/surface/smooth_normals.hpp"
#include "mesh/box_tree.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/wall.hpp"

#include <functional>
#include <numbers>

// Contacts at sharp corners and edges, which integrals over faces do not see: the faces beside them
// turn away from what is touched, and the mean gap over such a face gives little information of its
// corner's.
//
// Corners and nodes of edges on faces, and edges across edges: with them surfaces of flat faces
// meet in all the ways they can. All is as it is now, but for what is sharp: that is of the rest.

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
/// The box that a piece is searched for in, and a margin around [m].
BoundingBox piece_box(const SharpSurface& surface, const SharpFeatures::Piece& piece,
                      double margin);

/// Contacts of a sharp node on a face, of a sharp edge across any edge of the other body, of either
/// body against the other. Only where the faces beside what is sharp rise from the other body by
/// more than 0.1 (sine): where one does not, faces meet, which mortar_contacts has.
/// As faces lie flatter the contact does not end at once: it may overlap by a tenth of the face
/// times what the rise lacks, and there is none below -0.05. So no force sets in at a threshold,
/// and the balance does not depend on the way to it. Two meshes that slide on each other flush
/// would lose their rims by that; there (`known`) a contact that has been found stays as it is.
///
/// Normals are those of the face that is touched, or across both edges where both are sharp; along
/// a chain of edges those do not jump. Areas are 0, gaps are without the overlap that is left. An
/// id is of the node, or of the chain and what it crosses.
/// @param reach  contacts are made where the gap, or the overlap, is no larger [m]
/// @param known  ids, ascending, of contacts that an iteration has found already: those stay until
///               faces lean the other way, and others begin beyond 0.1; null: by and by, as above
/// @param bare_corners  whether the slave's sharp nodes that carry no multiplier (corners of T6)
///               are contacts however their faces lie
/// Cost: O(n log n) for pieces of similar length; nothing to speak of where nothing is sharp.
SurfaceContacts sharp_contacts(const SharpSurface& slave, const SharpSurface& master, double reach,
                               const std::vector<std::int64_t>* known = nullptr,
                               bool bare_corners = false);

/// Sharp nodes that carry no multiplier (corners of T6) on a smooth obstacle, however their faces
/// lie.
SurfaceContacts sharp_wall_contacts(const SharpSurface& slave,
                                    const std::function<WallSample(const Vec3&)>& wall,
                                    double reach);

} // namespace amontons
