// Bodies that could pass through each other within a step: none does.

#include "solver/step/body_simulation.hpp"

#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>

using namespace amontons;

TEST_CASE("a corner pressed on a stiff face and edges pressed across each other do not pass")
{
    const auto lowest = [](const BodyRecord& body, const auto& counts) {
        double z = 1;
        for (const Vec3& x : body.points)
            if (counts(x)) z = std::min(z, x.z());
        return z;
    };
    for (const std::string element : {"T4", "T10", "H8"}) {
        CAPTURE(element);
        const auto solid = [&](const char* size, const char* cells, const char* E,
                               const char* rest) {
            return fmt::format(R"({{"kind": "solid", "mesh": {{"generate": "box", "size": {},
                "cells": {}, "element": "{}"}}, "youngs_modulus": {}, "poisson_ratio": 0.3, {}}})",
                               size, cells, element, E, rest);
        };
        const char* const rest = R"("contact": [{"between": ["upper", "lower"], "friction": 0.2}],
            "time": {"kind": "quasi_static", "step": 0.5, "end": 1})";
        // A cube on its corner, sqrt(3) 0.01 below its middle, comes down by 1.5 mm from 0.5 mm.
        const Result corner = run(fmt::format(
            R"("bodies": {{"lower": {}, "upper": {}}}, {})",
            solid("[0.1, 0.1, 0.02]", "[3, 3, 1]", "1e13",
                  R"("start": {"place": [0.003, 0.002, -0.01]}, "hold": [{"set": "z_min"}])"),
            solid("[0.02, 0.02, 0.02]", "[1, 1, 1]", "1e6",
                  R"("start": {"turn": [0.66744, 0.66744, 0], "place": [0, 0, 0.01782]},
                     "drive": {"z": [[0, 0], [1, -0.0015]]}, "hold": [{"set": "z_max"}])"),
            rest));
        REQUIRE(corner.summary.message == "");
        const auto any = [](const Vec3&) { return true; };
        CHECK(std::abs(lowest(corner.simulation->body_records()[1], any)) < 1e-8);
        CHECK(corner.value("lower_z_min_force_z") > 0);
        // Bars on their edges: three elements along each, no node where they cross.
        const Result edges = run(fmt::format(
            R"("bodies": {{"lower": {}, "upper": {}}}, {})",
            solid("[0.1, 0.02, 0.02]", "[3, 1, 1]", "1e13",
                  R"("start": {"turn": [0.7853981633974483, 0, 0]}, "hold": [{"set": "all"}])"),
            solid("[0.02, 0.1, 0.02]", "[1, 3, 1]", "1e6",
                  R"("start": {"turn": [0, 0.7853981633974483, 0], "place": [0.004, 0, 0.0288]},
                     "drive": {"z": [[0, 0], [1, -0.0015]]},
                     "hold": [{"set": "y_min"}, {"set": "y_max"}])"),
            rest));
        REQUIRE(edges.summary.message == "");
        const double ridge = 0.01 * std::sqrt(2.0);
        // The two nodes beside the crossing, or the middle node on it.
        const double near = element == "T10" ? 0.01 : 0.02;
        const auto middle = [&](const Vec3& x) { return std::abs(x.y()) < near; };
        CHECK(std::abs(lowest(edges.simulation->body_records()[1], middle) - ridge) < 1e-6);
        CHECK(edges.value("upper_y_min_force_z") + edges.value("upper_y_max_force_z") < 0);
    }
}

TEST_CASE("a block driven through a plate thinner than a step touches it all the same")
{
    // Whatever the step: halved steps end where short ones do.
    const auto pressed = [](const char* tool, double step) {
        return run(fmt::format(R"("bodies": {{
            "plate": {{"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.004], "cells": [6, 6, 1],
                          "element": "H8"}}, "hold": [{{"set": "x_min"}}, {{"set": "x_max"}}]}},
            "tool": {{{}, "start": {{"place": [0, 0, 0.012]}},
                "drive": {{"z": [[0, 0], [1, -0.02]]}}}}}},
            "contact": [{{"between": ["tool", "plate"]}}],
            "time": {{"kind": "quasi_static", "step": {}, "end": 1}})",
                               tool, step));
    };
    const char* const tools[] = {
        R"("kind": "rigid", "shape": {"generate": "box", "size": [0.02, 0.02, 0.004]},
           "density": 1000)",
        R"("kind": "solid", "youngs_modulus": 1e9, "poisson_ratio": 0.3, "hold": [{"set": "z_max"}],
           "mesh": {"generate": "box", "size": [0.02, 0.02, 0.004], "cells": [2, 2, 1],
                    "element": "H8"})"};
    for (const char* tool : tools) {
        const Result once = pressed(tool, 1.0), often = pressed(tool, 0.02);
        CHECK(once.summary.message == "");
        const auto force = [](const Result& r) {
            return r.value("plate_x_min_force_z") + r.value("plate_x_max_force_z");
        };
        CHECK(force(often) > 0.1);
        CHECK(std::abs(force(once) - force(often)) < 0.01 * force(often));
    }
}

TEST_CASE("a free block comes to rest on a plane though all its nodes may touch: pins move too")
{
    for (const char* element : {"T4", "T10", "H8"})
        for (const char* motion : {"linear", "corotational"})
            for (const int cells : {1, 2})
                for (const double gap : {0.0, 1e-9, 1e-4})
                    for (const double friction : {0.0, 0.3}) {
                        CAPTURE(element);
                        CAPTURE(motion);
                        CAPTURE(cells);
                        CAPTURE(gap);
                        CAPTURE(friction);
                        const Result r = run(fmt::format(
                            R"("bodies": {{{}, "block": {{"kind": "solid", "motion": "{}",
                            "mesh": {{"generate": "box", "size": [0.05, 0.05, 0.05],
                                "centre": [0.3, 0, {}], "cells": [{}, {}, {}], "element": "{}"}},
                            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000}}}},
                            "gravity": [0, 0, -9.81],
                            "contact": [{{"between": ["block", "floor"], "friction": {}}}],
                            "time": {{"kind": "quasi_static", "step": 1, "end": 1}})",
                            kFloor, motion, 0.025 + gap, cells, cells, cells, element, friction));
                        REQUIRE(r.summary.message == "");
                        const double weight = 1000 * kGravity * 0.05 * 0.05 * 0.05;
                        CHECK(std::abs(r.value("floor_on_block_force_z") - weight) < 1e-8 * weight);
                    }
}
