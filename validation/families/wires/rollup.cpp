#include "validation/families/wires/wires.hpp"
#include "validation/loaded_wire.hpp"

#include "solver/beam/rotation.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace amontons::validation {

std::vector<Measured> rollup()
{
    std::vector<Measured> rows;
    Quaternion skew;
    rotate_in_body(skew.q, Vec3(0.7, -1.1, 0.4));
    for (double turns : {0.5, 1.0, 2.0})
        for (bool skewed : {false, true}) {
            LoadedWire wire;
            wire.length = 10;
            wire.EI = 100;
            wire.GJ = 77;
            wire.EA = 10000;
            wire.GA = 5000;
            wire.elements = 10;
            wire.planar = true; // a moment fixed in space makes the circle unstable out of it
            if (skewed) wire.frame = rotation_matrix(skew.q);
            const double curvature = 2 * std::numbers::pi * turns / wire.length;
            wire.moment = wire.EI * curvature * wire.frame.col(2);
            const double angle = curvature * wire.length;
            const Vec3 exact = wire.frame * Vec3(std::sin(angle) / curvature,
                                                 (1 - std::cos(angle)) / curvature, 0);
            const Vec3 tip = solve(wire).state.nodes.back().position();
            rows.push_back(
                at_most(fmt::format("tip from the circle's end, of the length, {} "
                                    "turn{}{}",
                                    turns, turns == 1 ? "" : "s", skewed ? ", skew axis" : ""),
                        (tip - exact).norm() / wire.length, 1e-10));
        }
    return rows;
}

} // namespace amontons::validation
