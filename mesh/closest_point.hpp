#pragma once

#include "mesh/base/types.hpp"

namespace amontons {

/// Which part of a triangle a point lies on. Edge k runs from vertex k to vertex k + 1.
enum class TriangleFeature : std::uint8_t { face, edge0, edge1, edge2, vertex0, vertex1, vertex2 };

/// The nearest point of a triangle.
struct TrianglePoint {
    Vec3 point = Vec3::Zero();   ///< [m]
    Vec3 weights = Vec3::Zero(); ///< barycentric: point = sum of weights times vertices
    TriangleFeature feature = TriangleFeature::face;
};

/// The point of the triangle (a, b, c) nearest to x. A triangle without area is a segment or a
/// point and is handled as such.
/// Source: Ericson, Real-Time Collision Detection (2005), section 5.1.5.
TrianglePoint closest_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c);

} // namespace amontons
