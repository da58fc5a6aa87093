// Rubber blocks pressed until their sides roll onto the floor.

#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>

using namespace amontons;

namespace {

/// A cube of 0.1 m, its top pressed down by 35 mm and moved by 20 mm, on z = 0.
Result pressed(const char* element, int cells, bool rigid_floor)
{
    const char* floor =
        rigid_floor ? R"("kind": "rigid", "shape": {"generate": "box", "size": [0.3, 0.3, 0.02]},
                 "start": {"place": [0, 0, -0.01]}, "drive": {"z": 0})"
                    : R"("kind": "obstacle", "surface": {"generate": "plane"})";
    return run(fmt::format(
        R"("bodies": {{"floor": {{{0}}}, "block": {{"kind": "solid",
           "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [0, 0, 0.05],
                     "cells": [{1}, {1}, {1}], "element": "{2}"}},
           "material": {{"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.45}},
           "hold": [{{"set": "z_max", "x": [[0, 0], [1, 0.02]], "y": 0,
                      "z": [[0, 0], [1, -0.035]]}}]}}}},
           "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
           "time": {{"step": 0.1, "end": 1}})",
        floor, cells, element));
}

} // namespace

TEST_CASE("the side of a pressed block rolls onto the floor: no step is halved, forces agree")
{
    double bricks = 0;
    for (const auto& [element, cells, rigid] :
         {std::tuple("H8", 3, false), {"H8", 3, true}, {"T10", 2, false}}) {
        CAPTURE(std::string(element));
        CAPTURE(rigid);
        const Result r = pressed(element, cells, rigid);
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        CHECK(r.records.size() == 11);
        CHECK(r.records.back().certificate.error <= 1e-8);
        // Gaps are zero at nodes on a plane, in means on a rigid body; T10 bend more easily.
        const double force = r.value("block_z_max_force_z");
        if (bricks == 0) bricks = force;
        CHECK(force == doctest::Approx(bricks).epsilon(rigid ? 0.01 : 0.05));
    }
}
