#include "solver/step/tests/body_runs.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

using namespace amontons;

namespace {

/// A light ball on a floor or above it, and a heavy one that comes down on it.
struct Struck {
    double light, light_mass, light_z, heavy, heavy_mass, heavy_z, speed, restitution, step, end;
};

Result fall(const Struck& s, const std::string& floor)
{
    return run(fmt::format(
        R"("bodies": {{
            "light": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": {}}}, "mass": {},
                      "start": {{"place": [0, 0, {}]}}}},
            "heavy": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": {}}}, "mass": {},
                      "start": {{"place": [0, 0, {}], "velocity": [0, 0, {}]}}}},
            "floor": {}}},
        "contact": [{{"between": ["*", "*"], "restitution": {}}}],
        "time": {{"kind": "dynamic", "step": {}, "end": {}}})",
        s.light, s.light_mass, s.light_z, s.heavy, s.heavy_mass, s.heavy_z, -s.speed, floor,
        s.restitution, s.step, s.end));
}

/// At the end of every step: what a floor below z = 0 and the balls leave of overlaps is what the
/// certificate calls little, no ball has changed sides, and no energy is gained.
void check_apart(const Result& r, const Struck& s)
{
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    const double little = 1.01e-3 * 2 * std::min(s.light, s.heavy),
                 start = 0.5 * s.heavy_mass * s.speed * s.speed;
    for (std::size_t i = 0; i < r.records.size(); ++i) {
        CAPTURE(i);
        const double light = r.value("light_z", i), heavy = r.value("heavy_z", i);
        CHECK(light > s.light - little);
        CHECK(heavy - light > s.light + s.heavy - little);
        CHECK(r.records[i].energy.kinetic < (1 + 1e-6) * start);
    }
    CHECK(r.summary.worst_overlap.depth < little);
}

constexpr const char* kPlane = R"({"kind": "obstacle", "surface": {"generate": "plane"}})";

} // namespace

TEST_CASE("a ball that is struck several times in a step ends it outside of what it has struck")
{
    // Between a floor and a heavy ball: overlaps of 0.12 and 0.2 of its radius were left.
    for (const Struck& s :
         {Struck{0.00798, 0.0017, 0.015826, 0.01816, 24.0, 0.051214, 4.2, 0.5, 0.0001159, 0.007504},
          Struck{0.007252, 0.038, 0.010526, 0.04018, 63.0, 0.081378, 1.9800000000000002, 0.9,
                 0.01392, 0.1392}}) {
        CAPTURE(s.light);
        check_apart(fall(s, kPlane), s);
    }
}

TEST_CASE("a ball that is struck through a thin slab is no contact of its far side")
{
    const Struck s{0.09184, 0.23, 0.14056, 0.1996, 69, 0.52338, 213.9, 0.5, 0.002018, 0.02018};
    const Result r =
        fall(s, R"({"kind": "rigid", "shape": {"generate": "box", "size": [9.3, 9.3, 0.09458]},
                                 "start": {"place": [0, 0, -0.04729]}, "mass": 1, "drive": {"x": 0}})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    for (std::size_t i = 0; i < r.records.size(); ++i)
        CHECK(r.value("light_z", i) > 0.9 * s.light);
}

TEST_CASE("a die that slides with friction over a softer block keeps its energy in long steps" *
          doctest::test_suite("slow"))
{
    // Each step slides by 0.6 of a cell. Where a multiplier at the rim has two normals because the
    // first iterations turned it, 5.4 % of the work are lost; 0.52 % with the friction of the start
    // on what lies beneath the die at the end.
    const auto missed = [](int steps) {
        const Result r = run(fmt::format(
            R"("bodies": {{
            "die": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.5, 0.25, 0.4], "cells": [10, 1, 7],
                     "element": "H8", "centre": [0.45, 0.125, 0.7]}},
                     "material": {{"law": "neo_hooke", "youngs_modulus": 6000, "poisson_ratio": 0.4}},
                     "hold": [{{"set": "all", "y": 0}},
                              {{"set": "z_max", "x": [[0, 0], [1, 0], [2, 0.6]], "z": [[0, 0], [1, -0.03]]}}]}},
            "block": {{"kind": "solid", "mesh": {{"generate": "box", "size": [2, 0.25, 0.5], "cells": [40, 1, 8],
                       "element": "H8", "centre": [1, 0.125, 0.25]}},
                       "material": {{"law": "neo_hooke", "youngs_modulus": 2000, "poisson_ratio": 0.4}},
                       "hold": [{{"set": "all", "y": 0}}, {{"set": "z_min", "x": 0, "z": 0}}]}}}},
            "contact": [{{"between": ["die", "block"], "friction": 0.3, "surfaces": ["z_min", "z_max"]}}],
            "time": {{"kind": "quasi_static", "step": {}, "end": 2}})",
            2.0 / steps));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return std::abs(r.summary.energy.error()) / r.summary.energy.work_absolute;
    };
    CHECK(missed(40) < 0.005);
}
