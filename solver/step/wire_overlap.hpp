#pragma once

#include "solver/step/wire_step.hpp"

namespace amontons {

/// Where a wire stands in a wall between its points of contact.
struct WireOverlap {
    double depth = 0; ///< [m]; 0: nowhere
    Vec3 point = Vec3::Zero();
    std::size_t wall = 0; ///< of the wire's
    /// What points of contact at such distances leave: h^2/8 times the curvatures of wall and wire;
    /// at least 1e-3 and at most a tenth of
    /// the wire's diameter [m].
    double allowed = 0;
};

/// The deepest place of a wire's surface in its walls, measured on its curve at quarters of the
/// elements beside points that may touch. Left out: walls on foundations, whose depth is their
/// load, and what lies in a sheath or another instrument.
/// Cost: three looks at a wall for each such element.
WireOverlap deepest_overlap(const WireBody& b);

/// Of a wire's overlaps in a run that with the largest depth over what is allowed. Plain numbers:
/// they go into checkpoints as they are.
struct WireOverlapLog {
    double depth = 0, allowed = 1; ///< [m]
    double x = 0, y = 0, z = 0;    ///< where [m]
    int wall = 0, step = 0;

    /// @param wall  number of the body that the wire stands in
    void note(const WireOverlap& overlap, int wall, int step);
    /// A sentence if it is more than is allowed, else "".
    std::string warning(const std::string& wire, const std::string& wall_name) const;
};

} // namespace amontons
