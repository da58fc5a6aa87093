#pragma once

#include "mesh/base/types.hpp"

#include <array>
#include <vector>

namespace amontons {

/// Each point that is no farther than `distance` from one before it, with one of those: pairs
/// (earlier, later), by the later one. O(n log n).
/// @param distance  [m], >= 0
std::vector<std::array<std::int32_t, 2>> near_points(const std::vector<Vec3>& points,
                                                     double distance);

} // namespace amontons
