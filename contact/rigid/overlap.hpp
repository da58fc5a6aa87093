#pragma once

#include "contact/rigid/shape.hpp"
#include "contact/surface/overlap.hpp"

// How far a rigid shape penetrates another body that is given by its signed distance: measured on
// the surface of the shape, independently of the contacts that were found.

namespace amontons {

/// The point of a shape's surface that is deepest in another body.
struct ShapeOverlap {
    double depth = 0; ///< penetration [m]; 0: none
    /// The deepest point, in space [m].
    Vec3 place = Vec3::Zero();
};

/// Balls and boxes exactly against anything convex. A cylinder by its rims and, between them, by
/// the lines of its side that face the other body: to 1e-3 of its radius. A capsule by its axis, an
/// ellipsoid by a search on its surface (from seven places). Triangles by their faces.
/// Nothing for a Plane.
/// @param facets    of a TriangleShape: its triangles; not used for others
/// @param distance  from the other body, < 0 inside
/// @param near      a box around it
ShapeOverlap deepest_in(const RigidShape& shape, const Pose& pose, const FacetedSurface* facets,
                        const std::function<WallSample(const Vec3&)>& distance,
                        const BoundingBox& near);

} // namespace amontons
