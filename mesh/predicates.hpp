#pragma once

#include "mesh/base/types.hpp"

// On which side a point lies, free of rounding: decided in double where the error bound allows,
// else in 106 bits. A determinant below 1e-30 of its terms counts as zero.

namespace amontons {

/// Sign of the volume of the tetrahedron a, b, c, d: > 0 if a, b, c are clockwise seen from d;
/// 0 if the four lie in one plane.
/// Source: filter bound of Shewchuk 1997, Discrete Comput. Geom. 18, 305-363 (orient3d, stage A).
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Sign of the area of the triangle a, b, c, seen along axis k (its coordinates k+1 and k+2).
int orientation_along(int k, const Vec3& a, const Vec3& b, const Vec3& c);

} // namespace amontons
