#pragma once

#include "mesh/base/curve.hpp"
#include "solver/scene/scene.hpp"

#include <limits>
#include <string>
#include <vector>

namespace amontons {

/// A curve of a body that a caller may set between two steps.
struct LiveCurve {
    std::string name; ///< BODY.x, BODY.loads.0.over: as in the scene
    std::string unit;
    CurvePoints* curve = nullptr; ///< the body's own, by which it moves
    double missing = 0;           ///< its value where the scene has none
    /// Least admissible value, in the unit of the input.
    double lower = -std::numeric_limits<double>::infinity();
    /// Greatest admissible value, in the unit of the input.
    double upper = std::numeric_limits<double>::infinity();
};

/// The curves of a drive.
inline void add_drive(const std::string& body, DriveInput& d, std::vector<LiveCurve>& all)
{
    all.push_back({body + ".x", "m", &d.x});
    all.push_back({body + ".y", "m", &d.y});
    all.push_back({body + ".z", "m", &d.z});
    all.push_back({body + ".angle", "rad", &d.angle});
}

} // namespace amontons
