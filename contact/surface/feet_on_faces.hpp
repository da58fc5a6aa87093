#pragma once

#include "contact/surface/contact_points.hpp"
#include "contact/surface/nearest_face.hpp"
#include "contact/surface/smooth_normals.hpp"

#include <array>
#include <optional>

// Feet of points on the surface of a deformable solid, for contacts of curves (contact/curve).
//
// A T6 counts as its four T3. Over faces that smooth edges join the foot of x is the y with
// x = y + d n(y), n the smooth normal there: feet, normals and distances do not jump from one face
// to the next, also in dents. Beyond sharp convex edges the foot is the nearest point of the edge,
// and n leads from there to x. Beyond the border of a surface that is not closed there is none.

namespace amontons {

/// The foot of a point.
struct FaceFoot {
    Vec3 place = Vec3::Zero();          ///< on the surface [m]
    Vec3 normal = Vec3::UnitZ();        ///< unit, outwards
    double distance = 0;                ///< of the point, > 0 outside [m]
    std::array<StencilEntry, 4> node{}; ///< of the mesh; weights >= 0 but for round-off, sum 1
    int nodes = 0;
    bool beyond = false; ///< of an edge or a corner: over no face
};

/// Feet of points on the smooth surface over faces: x = y + d n(y), docs/theory/rods.md.
class FeetOnFaces {
public:
    /// @param places   of all nodes of the mesh, finite [m]
    /// @param at_rest  what is sharp there is sharp; what a load dents is not [m]
    /// @param near     faces that this box does not touch have no feet
    FeetOnFaces(const ExternalSurface& surface, std::span<const Vec3> places,
                std::span<const Vec3> at_rest, const BoundingBox& near);

    /// The foot at most `within` away [m], the nearest one.
    std::optional<FaceFoot> find(const Vec3& x, double within) const;

    /// The greatest extent, along a direction, of the faces around this node [m]; 0: none is near.
    /// @param along  unit, or 0: along any
    double width_at(std::int32_t node, const Vec3& along) const;
    /// The extent of the face of a foot along a direction [m].
    double length_along(const FaceFoot& foot, const Vec3& along) const;
    /// True if there are no faces.
    bool empty() const { return facets_.empty(); }

private:
    struct Candidate {
        const Facet* facet;
        FacetPoint point;
        double distance; ///< [m]
    };
    std::optional<FaceFoot> over(const Candidate& c, const Vec3& x) const;
    std::optional<FaceFoot> beyond(std::span<const Candidate> nearest, const Vec3& x) const;
    FaceFoot foot_at(const Facet& facet, const Vec2& xi) const;

    std::span<const Vec3> places_;
    ExternalSurface surface_; ///< T3 and Q4: the faces near, and a ring around them
    std::optional<SmoothNormals> normals_;
    std::vector<Facet> facets_;                ///< of those near
    std::optional<BoxTree> tree_;              ///< of their boxes
    std::vector<std::int32_t> around_, begin_; ///< faces around the surface's nodes
    /// Edges, nodes ascending, where a surface is not closed, and those that are sharp.
    struct Edges {
        std::vector<std::array<std::int32_t, 2>> nodes;
        std::vector<char> has; ///< of the surface's nodes: whether one of them ends there
    };
    bool is_on(const Edges& edges, const FaceFoot& foot) const;
    Edges border_, sharp_;
};

} // namespace amontons
