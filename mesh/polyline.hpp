#pragma once

#include "mesh/base/types.hpp"

#include <vector>

namespace amontons {

/// Points along a curve in space, such as the centreline of a vessel.
struct Polyline {
    std::vector<Vec3> points;   ///< in order; neighbours differ [m]
    std::vector<double> radius; ///< of the lumen at each point [m]; empty if not known
};

} // namespace amontons
