#pragma once

#include "contact/rigid/shape.hpp"
#include "mesh/wall.hpp"

namespace amontons {

/// Signed distance to a rigid shape in the shape's frame, with its normal and, outside, its second
/// derivative. Exact outside; inside that to the nearest face (of a box and a cylinder: of the
/// nearest of their planes and sides).
/// @param near  of triangles: one that is probably near, or -1; that of x on return
WallSample shape_distance(const RigidShape& shape, const Vec3& x, std::int32_t& near);

} // namespace amontons
