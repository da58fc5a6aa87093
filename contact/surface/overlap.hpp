#pragma once

#include "contact/surface/faceted_surface.hpp"
#include "mesh/bounding_tree.hpp"
#include "mesh/wall.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>

// How far surfaces stand in each other: measured on the surfaces themselves, whatever contacts were
// found between them.
//
// Two meshes overlap where a node of one is inside the other, or an edge of one enters and leaves
// again. A mesh and an exact shape overlap where the distance from the shape is negative somewhere
// on a face. Faces T3 count as flat triangles, T6 as four through their middle nodes; what this
// leaves out of a face that bends is h^2/32 times its curvature. Edges enter and leave Q4 by their
// two triangles; the depth is that of the bent face itself.

namespace amontons {

/// A place of one surface that is inside the body behind another.
struct OverlapSpot {
    double depth = 0; ///< its distance from that body's surface [m], > 0
    /// The deepest place [m].
    Vec3 point = Vec3::Zero();
    /// The place on the body's own surface.
    SurfacePlace own;
    SurfacePlace other;         ///< the nearest place of the other mesh; none on an exact shape
    Vec3 normal = Vec3::Zero(); ///< of that place, unit, outwards
    double face = 0;            ///< the smaller of the touching faces, by its longest edge [m]
    double bulge = 0;           ///< of both: what flat faces leave [m]
    /// The same of the bodies without strain, where that is known: what bends around an edge is
    /// no curved surface that its faces stand for [m].
    double bulge_at_rest = 0;
    double round = 0; ///< of an exact shape alone, by the least of its two curvatures [m]
    /// Of an exact shape: the least distance of the face's nodes, those that carry multipliers [m].
    double node_gap = 0;
};

/// The signed distance from a surface, < 0 behind it.
class FaceDistance {
public:
    /// The nearest place of the other surface.
    struct Foot {
        /// To the surface [m], < 0 inside.
        double distance = 0;
        Vec3 point = Vec3::Zero(); ///< on the surface
        /// Unit: the gradient of the distance; close to the surface that of the face, or the mean
        /// of those that touch there.
        Vec3 normal = Vec3::Zero();
        std::int32_t triangle = 0;
        /// What of the triangle is nearest; within 1e-3 of it a corner or an edge.
        TriangleFeature feature = TriangleFeature::face;
        Vec2 xi = Vec2::Zero(); ///< of the point on its reference face
    };

    /// @param near  triangles that do not touch this box are left out
    FaceDistance(const PlacedSurface& surface, const BoundingBox& near);
    /// True if there are no faces.
    bool empty() const { return !tree_; }
    /// Nothing where the nearest place is on a border: there the surface has no sides.
    /// @param hint  a triangle that is probably near, or -1; that of x on return
    std::optional<Foot> at(const Vec3& x, std::int32_t& hint) const;
    /// The point by the nodes of its face.
    SurfacePlace place_of(const Foot& foot) const;
    /// Is some side of the surface under both, and nothing but it under one of them? Then the way
    /// from one to the other does not lead through the body from side to side.
    /// @param deepest  what both may be off that side [m]: so deep the way is at most
    bool on_one_side(const Foot& p, const Foot& q, double deepest) const;
    /// Where the way from a to b passes through the surface, as shares of it, ascending.
    void crossings(const Vec3& a, const Vec3& b, std::vector<double>& shares) const;

private:
    Vec3 normal_(std::int32_t triangle) const;
    template <class Visit> void for_triangles_under_(const Foot& foot, Visit visit) const;
    void touch_bent_face_(const Vec3& x, Foot& foot) const;

    PlacedSurface surface_;
    std::vector<std::int32_t> number_; // of the tree's triangles
    std::optional<BoundingTree> tree_;
};

/// The longest edge between the corners of a face [m].
double longest_edge(const ExternalSurface& surface, std::size_t face, std::span<const Vec3> places);

/// Of the surface around a face, by how its triangles turn against those beside them; across an
/// edge of the body there is none [1/m].
double curvature_of_face(const PlacedSurface& surface, std::size_t face);

/// By how much a face may stand off the curved surface that it and those beside it are made for, or
/// in it: the largest width^2/8 times curvature, of its width across each edge to another [m].
/// @param widest  of the widths that count [m]
double bulge_of_face(const PlacedSurface& surface, std::size_t face, double widest);

/// Outward and unit, of the faces that a place lies on; zero where they fold onto each other.
Vec3 outward_normal_at(const PlacedSurface& surface, const SurfacePlace& place);

/// The box around some of a surface's nodes.
BoundingBox box_around(const PlacedSurface& surface);

/// How far the nodes of a surface reach along a direction [m].
struct Extent {
    /// Range of n . x over the surface [m].
    double low = std::numeric_limits<double>::infinity(), high = -low;
};
/// Extent of a surface along a unit direction.
Extent extent_along(const Vec3& direction, const ExternalSurface& surface,
                    std::span<const Vec3> places);

/// What is deep in neither way needs no bulge (nor `round`): it is left 0, and costs most of a
/// search.
struct Shallow {
    double of_face = 0; ///< depth over the smaller of the touching faces [-]
    double depth = std::numeric_limits<double>::infinity(); ///< [m]

    bool operator()(const OverlapSpot& s) const
    {
        return !(s.depth > std::min(of_face * s.face, depth));
    }
};

/// Sizes of the faces that a spot's places of a and b lie on, and, where it is not shallow, bulges.
void measure_faces(const PlacedSurface& a, const PlacedSurface& b, const Shallow& shallow,
                   OverlapSpot& spot);

/// Places of a that are inside the body of b; their depth is that below b.
/// Cost: O(n log n) where their boxes overlap.
void overlap_spots(const PlacedSurface& a, const PlacedSurface& b, std::vector<OverlapSpot>& spots,
                   const Shallow& shallow = {});

/// What is known of the set where a distance is < 0.
enum class Inside {
    any,
    convex, ///< everything is beyond each of the distance's tangent planes
};

/// Of a body's or face's size (ratio): what tangent planes leave deeper than a known place by less
/// is rounding, for which nothing is searched.
constexpr double kNoDeeper = 1e-12;

/// Places of a surface inside an exact shape, at most one of each face, the deepest there: exact to
/// a twentieth of it for convex shapes.
/// @param distance  from the shape, < 0 inside
/// @param near      a box around the shape
/// Depths below 1e-3 of a face may be left out. Cost: one sample for each face near the shape, some
/// more where it enters the face; of a convex one those of its nodes where they show that no other
/// place of the face is deeper.
void overlap_spots(const PlacedSurface& a, const std::function<WallSample(const Vec3&)>& distance,
                   const BoundingBox& near, std::vector<OverlapSpot>& spots,
                   const Shallow& shallow = {}, Inside inside = Inside::any);
/// The same of some faces alone.
void overlap_spots(const PlacedSurface& a, const std::function<WallSample(const Vec3&)>& distance,
                   std::span<const std::int32_t> faces, std::vector<OverlapSpot>& spots,
                   const Shallow& shallow = {}, Inside inside = Inside::any);

/// Lower bound of a convex distance [m] on the hull of some points, by the tangent planes at them.
/// @param at  the distance at each of the points
double least_by_tangents(std::span<const Vec3> points, std::span<const WallSample> at);

} // namespace amontons
