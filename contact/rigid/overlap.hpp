#pragma once

#include "contact/rigid/shape.hpp"
#include "contact/surface/overlap.hpp"

// How far a rigid shape stands in something whose distance is known: measured on the shape itself,
// whatever contacts were found.

namespace amontons {

/// Where a shape's surface is deepest in something.
struct ShapeOverlap {
    double depth = 0; ///< [m]; 0: nowhere inside
    /// Where it is deepest [m].
    Vec3 place = Vec3::Zero();
};

/// What holds a body: a box, and a half-space way . x <= most, on which a box around a round body
/// gives little information.
struct Surroundings {
    /// A box around it [m].
    BoundingBox box;
    Vec3 way = Vec3::Zero();                               ///< unit, or zero: no half-space
    double most = std::numeric_limits<double>::infinity(); ///< [m]
};

/// Balls and boxes exactly against anything convex. A cylinder by its rims and, between them, by
/// the lines of its side that face the other body: to 1e-3 of its radius. A capsule by its axis, an
/// ellipsoid by a search on its surface (from seven places). Triangles by their faces.
/// Nothing for a Plane.
/// @param facets    of a TriangleShape: its triangles; not used for others
/// @param distance  from the other body, < 0 inside
/// @param near      around it
/// @param inside    of the other body
ShapeOverlap deepest_in(const RigidShape& shape, const Pose& pose, const FacetedSurface* facets,
                        const std::function<WallSample(const Vec3&)>& distance,
                        const Surroundings& near, Inside inside = Inside::any);

/// The place of a shape that is lowest along a unit direction, exactly; nothing for a Plane.
std::optional<Vec3> lowest_place(const RigidShape& shape, const Pose& pose, const Vec3& direction);

/// Of a shape in a half-space, exactly.
/// @param place, normal  of its plane: a point [m]; unit, out of it
ShapeOverlap deepest_below(const RigidShape& shape, const Pose& pose, const Vec3& place,
                           const Vec3& normal);

} // namespace amontons
