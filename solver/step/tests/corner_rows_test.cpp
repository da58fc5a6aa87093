// A free rigid body lies with a flat side on faces that are larger than it.

#include "mesh/tests/relative.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <tuple>

using namespace amontons;

namespace {

constexpr double kBlockDensity = 5e5, kBlockHigh = 0.0118; // of the block [kg/m^3, m]
constexpr double kBedModulus = 6e8, kBedRatio = 0.16;      // of the bed

struct BlockOnBed {
    const char* element;
    int cells;       // of the bed along x and y
    bool box;        // or a cylinder on its end
    double x, y;     // of its middle [m]
    double moment_x; // of the moment that tips it
    double moment_y;
    bool moving;
    int turn; // axes in turn: 1 puts x on y, y on z, z on x
};

constexpr double kBlockWide = 0.0236,
                 kBlockDeep = 0.0177; // of the box; the cylinder's diameter [m]

/// The block on the bed under its weight and a moment about its middle, which it has from the
/// start.
Result block_on_bed(const BlockOnBed& c)
{
    const auto turned = [&](double x, double y, double z) {
        const double own[3] = {x, y, z};
        double v[3];
        for (int k = 0; k < 3; ++k)
            v[(k + c.turn) % 3] = own[k];
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v[0], v[1], v[2]);
    };
    const double wide = 0.118, deep = 0.0354; // of the bed [m]
    const double volume =
        (c.box ? kBlockWide * kBlockDeep : std::numbers::pi / 4 * kBlockWide * kBlockWide) *
        kBlockHigh;
    const double weight = kBlockDensity * kGravity * volume,
                 arm = (c.box ? kBlockDeep : kBlockWide) / 2;
    int cells[3];
    const int own[3] = {c.cells, c.cells, 2};
    for (int k = 0; k < 3; ++k)
        cells[(k + c.turn) % 3] = own[k];
    const std::string shape =
        c.box ? fmt::format(R"({{"generate": "box", "size": {}}})",
                            turned(kBlockWide, kBlockDeep, kBlockHigh))
              : fmt::format(R"({{"generate": "cylinder", "radius": {}, "length": {}}})",
                            kBlockWide / 2, kBlockHigh);
    return done(fmt::format(
        R"("bodies": {{
            "bed": {{"kind": "solid", "youngs_modulus": {}, "poisson_ratio": {}, "density": 1000,
                     "mesh": {{"generate": "box", "size": {}, "cells": [{}, {}, {}],
                               "element": "{}", "centre": {}}},
                     "hold": [{{"set": "{}_min"}}]}},
            "block": {{"kind": "rigid", "shape": {}, "density": {},
                       "start": {{"place": {}}}, "torque": {}}}}},
          "gravity": {}, "contact": [{{"between": ["block", "bed"], "friction": 0.4}}],
          "time": {{"kind": "{}", "step": {}, "end": {}}})",
        kBedModulus, kBedRatio, turned(wide, wide, deep), cells[0], cells[1], cells[2], c.element,
        turned(0, 0, -deep / 2), "xyz"[(2 + c.turn) % 3], shape, kBlockDensity,
        turned(c.x, c.y, kBlockHigh / 2),
        turned(c.moment_x * weight * arm, c.moment_y * weight * arm, 0), turned(0, 0, -kGravity),
        c.moving ? "dynamic" : "quasi_static", c.moving ? 1e-3 : 0.5, c.moving ? 0.03 : 1.0));
}

} // namespace

TEST_CASE("a block that is smaller than the faces under it does not turn on its few multipliers")
{
    // With multipliers on one line of nodes, at one node, beside a line, at two by two nodes.
    for (const BlockOnBed& c : {BlockOnBed{"H8", 4, true, 0.0118, -0.0354, 0.3, 0, false, 0},
                                {"H8", 4, true, 0.0118, -0.0354, 0.3, 0, false, 1},
                                {"H8", 4, true, 0.0118, -0.0354, 0, 0, false, 0},
                                {"H8", 4, true, 0, 0, 0.3, -0.2, false, 2},
                                {"H8", 2, true, 0.02, 0.01, -0.2, 0.3, true, 0},
                                {"H8", 4, true, 0.0147, 0.0147, 0.75, 0, false, 0},
                                {"T4", 3, true, -0.018, 0.021, 0.3, 0.2, false, 0},
                                {"T4", 2, false, 0.012, 0.003, 0.3, -0.2, true, 0},
                                {"T10", 2, true, 0.016, -0.02, 0.2, 0.3, false, 1},
                                {"T10", 4, false, 0.02, 0.016, -0.3, 0, false, 0}}) {
        CAPTURE(c.element);
        CAPTURE(c.cells);
        CAPTURE(c.box);
        CAPTURE(c.x);
        CAPTURE(c.turn);
        const Result r = block_on_bed(c);
        // A circular punch of radius a on a half-space turns by 3 (1 - nu^2) M / (4 E a^3)
        // (Borowicka 1943): here with M = weight times a, more than what acts.
        const double a = kBlockDeep / 2;
        const double weight = kBlockDensity * kGravity * kBlockWide * kBlockWide * kBlockHigh;
        const double most =
            3 * (1 - kBedRatio * kBedRatio) * weight * a / (4 * kBedModulus * a * a * a);
        double turn = 0;
        for (const char* axis : {"x", "y", "z"})
            turn = std::max(turn, std::abs(r.value(fmt::format("block_turn_{}", axis))));
        CHECK(turn < most);
    }
}

TEST_CASE("a solid block that is smaller than the faces under it does not turn on its multipliers")
{
    // Two cells of T4 or one of T10 beside a line of a bed whose faces are larger; the weight acts
    // at an angle.
    const auto block_on_bed = [](const std::string& bed, const std::string& block, int cells,
                                 double x, double y, bool moving) {
        return done(fmt::format(
            R"("bodies": {{
                "bed": {{"kind": "solid", "youngs_modulus": {}, "poisson_ratio": {}, "density": 1000,
                         "mesh": {{"generate": "box", "size": [0.118, 0.118, 0.0354], "cells": [4, 4, 2],
                                   "element": "{}", "centre": [0, 0, -0.0177]}},
                         "hold": [{{"set": "z_min"}}]}},
                "block": {{"kind": "solid", "youngs_modulus": 6e9, "poisson_ratio": 0.2, "density": {},
                           "mesh": {{"generate": "box", "size": [{}, {}, {}], "cells": [{}, {}, 1],
                                     "element": "{}"}},
                           "start": {{"place": [{}, {}, {}]}}}}}},
              "gravity": [1.2, -0.8, -9.81],
              "contact": [{{"between": ["block", "bed"], "friction": 0.6}}],
              "time": {{"kind": "{}", "step": {}, "end": {}}})",
            kBedModulus, kBedRatio, bed, kBlockDensity, kBlockWide, kBlockDeep, kBlockHigh, cells,
            cells, block, x, y, kBlockHigh / 2, moving ? "dynamic" : "quasi_static",
            moving ? 1e-3 : 0.5, moving ? 0.02 : 1.0));
    };
    const double a = kBlockDeep / 2;
    const double weight = kBlockDensity * kGravity * kBlockWide * kBlockDeep * kBlockHigh;
    const double most =
        3 * (1 - kBedRatio * kBedRatio) * weight * a / (4 * kBedModulus * a * a * a);
    for (const bool moving : {false, true})
        for (const auto& [bed, block, cells] :
             {std::tuple("H8", "H8", 2), {"T4", "T4", 2}, {"T4", "T10", 1}, {"H8", "T10", 2}})
            for (const auto& [x, y] : {std::pair(0.0118, -0.0354), {0.017, 0.0295}}) {
                CAPTURE(moving);
                CAPTURE(bed);
                CAPTURE(block);
                CAPTURE(x);
                const Result r = block_on_bed(bed, block, cells, x, y, moving);
                double turn = 0;
                for (const char* axis : {"x", "y", "z"})
                    turn = std::max(turn, std::abs(r.value(fmt::format("block_turn_{}", axis))));
                CHECK(turn < most);
            }
}

TEST_CASE("a block far smaller than a face slides as on a plane")
{
    // Rows below its corners move with them: behind them it would topple.
    const double speed = 0.4, mu = 0.3858, end = 0.1;
    for (const auto& [size, y] : {std::pair(0.004, 0.017), {0.001, 0.03}}) {
        CAPTURE(size);
        const Result r = done(fmt::format(
            R"("bodies": {{
                "bed": {{"kind": "solid", "youngs_modulus": {}, "poisson_ratio": {}, "density": 1000,
                         "mesh": {{"generate": "box", "size": [0.118, 0.118, 0.0354], "cells": [2, 2, 2],
                                   "element": "H8", "centre": [0, 0, -0.0177]}},
                         "hold": [{{"set": "z_min"}}]}},
                "block": {{"kind": "rigid", "shape": {{"generate": "box", "size": [{}, {}, {}]}},
                           "density": 50000,
                           "start": {{"place": [-0.03, {}, {}], "velocity": [{}, 0, 0]}}}}}},
              "gravity": [0, 0, -9.81], "contact": [{{"between": ["block", "bed"], "friction": {}}}],
              "time": {{"kind": "dynamic", "step": 1e-3, "end": {}}})",
            kBedModulus, kBedRatio, size, size, size / 2, y, size / 4, speed, mu, end));
        CHECK(r.value("block_velocity_x") ==
              test::relative(speed - mu * kGravity * end).epsilon(1e-3));
        CHECK(std::abs(r.value("block_turn_y")) < 1e-4);
    }
}
