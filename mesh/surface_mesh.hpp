#pragma once

#include "mesh/base/types.hpp"

#include <array>
#include <string>
#include <vector>

namespace amontons {

/// Triangles in space. Each triangle is counter-clockwise seen from the free side
/// (the side where other bodies may be), so its normal points into the free space.
struct SurfaceMesh {
    std::vector<Vec3> points;                          ///< [m]
    std::vector<std::array<std::int32_t, 3>> triangles; ///< indices into `points`
};

} // namespace amontons
