#pragma once

#include "solver/step/wire_step.hpp"

namespace amontons {

/// How often the distance of a wire's contact points can be halved.
constexpr int kMostSpacingHalvings = 20;

/// Where a wire stands in a wall between its points of contact.
struct WireOverlap {
    double depth = 0; ///< [m]; 0: nowhere
    /// The deepest place [m].
    Vec3 point = Vec3::Zero();
    std::size_t wall = 0; ///< of the wire's
    /// What points of contact at such distances leave: h^2/8 times the curvatures of wall and wire;
    /// at least 1e-3 and at most a tenth of the wire's diameter [m].
    double allowed = 0;
    double most = 0; ///< beyond it no step is done: that tenth [m]
};

/// The place of a wire's surface that is deepest in its walls, of what is allowed there, measured
/// on its curve between the points that may touch: at quarters of the elements, at half the
/// distance of the points and at radii of the wire, whichever are closest. Left out: walls on
/// foundations, whose depth is their load, and what lies in a sheath or another instrument. Cost:
/// one sample of a wall for each of these places.
WireOverlap deepest_overlap(const WireBody& b);

/// Where what is between contact points stands in a wall: closer than a quarter of the wire's least
/// diameter they would find no more of it.
bool may_halve_spacing(const WireBody& b);
/// Contact points of a wire at half the distance; the forces stay on those that there were.
void halve_spacing(WireBody& b);
/// Contact points at the distance that so many halvings leave, without forces; nothing if they are.
void set_halvings(WireBody& b, int halvings);

/// Why no step ends so deep in a wall.
std::string never_done(const WireOverlap& overlap, const std::string& wire,
                       const std::string& wall);

/// Of a wire's overlaps in a run that with the largest depth over what is allowed. Plain numbers:
/// they enter checkpoints as they are.
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
