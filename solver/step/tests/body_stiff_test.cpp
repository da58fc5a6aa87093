// Solids under stiff or prescribed data: closed forms of uniform states.

#include "solver/scene/read.hpp"
#include "solver/step/tests/keep.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>

using namespace amontons;

namespace {

struct Two {
    RunSummary summary;
    std::vector<StepRecord> records;
    std::vector<BodyRecord> bodies;
};

/// Two unit cubes one on the other, the lower on a floor that slides.
/// @param lower, upper  further members of the bodies
Two stacked(double lower_E, double upper_E, const std::string& lower, const std::string& upper,
            const char* sliding)
{
    const std::string text = fmt::format(
        R"({{"schema": 1, "bodies": {{
        "lower": {{"kind": "solid", "mesh": {{"generate": "box", "size": [1, 1, 1],
            "centre": [0.5, 0.5, 0.5], "cells": [2, 2, 2], "element": "T4"}},
            "youngs_modulus": {}, "poisson_ratio": 0, {}}},
        "upper": {{"kind": "solid", "mesh": {{"generate": "box", "size": [1, 1, 1],
            "centre": [0.5, 0.5, 1.5], "cells": [3, 3, 2], "element": "T4"}},
            "youngs_modulus": {}, "poisson_ratio": 0, {}}}}},
        "contact": [{{"between": ["upper", "lower"], "surfaces": ["z_min", "z_max"],
            "sliding": "{}"}}],
        "accuracy": {{"contact": 1e-10}}, "time": {{"step": 1, "end": 1}}}})",
        lower_E, lower, upper_E, upper, sliding);
    const std::unique_ptr<Simulation> simulation =
        make_simulation(parse_scene(text, "test.json", {}), {});
    Keep keep;
    const std::atomic<bool> never{false};
    Two t;
    t.summary = simulation->run(keep, never);
    t.records = std::move(keep.records);
    t.bodies = simulation->body_records();
    for (BodyRecord& b : t.bodies)
        b.elements = nullptr;
    return t;
}

const char* const kFoot =
    R"({"set": "z_min", "z": 0}, {"set": "x_min", "x": 0}, {"set": "y_min", "y": 0})";
const char* const kAside = R"({"set": "x_min", "x": 0}, {"set": "y_min", "y": 0})";

} // namespace

TEST_CASE("a stiff block that only contact holds presses a soft one as springs in series do")
{
    for (const double soft : {1e12, 1e6, 1.0}) {
        CAPTURE(soft);
        const double p = 1e-3 * soft;
        const Two t =
            stacked(soft, 1e12, fmt::format(R"("hold": [{}])", kFoot),
                    fmt::format(R"("hold": [{}], "loads": [{{"set": "z_max", "pressure": {}}}])",
                                kAside, p),
                    "finite");
        REQUIRE(t.summary.message == "");
        double worst = 0;
        for (const ContactRecord& c : t.records.back().contacts)
            worst = std::max(worst, std::abs(c.pressure / p - 1));
        CHECK(!t.records.back().contacts.empty());
        CHECK(worst < 1e-8);
    }
}

TEST_CASE("what is prescribed at the start counts as motion, and closes contacts")
{
    // The upper block's lower face is moved into the lower block by 1e-3 at once: p = E 1e-3.
    for (const char* sliding : {"small", "finite"}) {
        CAPTURE(sliding);
        const Two t = stacked(
            1e6, 1e6, fmt::format(R"("hold": [{}])", kFoot),
            fmt::format(R"("hold": [{}, {{"set": "z_min", "z": -1e-3}}])", kAside), sliding);
        REQUIRE(t.summary.message == "");
        double force = 0;
        for (const ContactRecord& c : t.records.back().contacts)
            force += c.normal_force;
        CHECK(std::abs(force / 1e3 - 1) < 1e-6);
        for (const BodyRecord& b : t.bodies)
            for (const Field& f : b.point_fields)
                if (f.name == "displacement" && b.name == "upper")
                    for (std::size_t i = 2; i < f.values.size(); i += 3)
                        CHECK(std::abs(f.values[i] + 1e-3) < 1e-9);
    }
}

TEST_CASE("the feet of a solid carry its weight and its load")
{
    const std::string text = R"({"schema": 1, "bodies": {
        "block": {"kind": "solid", "mesh": {"generate": "box", "size": [1, 1, 1],
            "cells": [2, 2, 2], "element": "H8"}, "youngs_modulus": 1e6, "poisson_ratio": 0.3,
            "density": 100, "hold": [{"set": "z_min"}],
            "loads": [{"set": "z_max", "force": [3, 0, -50]}]}},
        "gravity": [0, 0, -9.81], "time": {"step": 1, "end": 1}})";
    for (const char* motion : {"linear", "corotational"}) {
        CAPTURE(motion);
        const std::unique_ptr<Simulation> simulation = make_simulation(
            parse_scene(text, "test.json", {std::string("bodies.block.motion=") + motion}), {});
        Keep keep;
        const std::atomic<bool> never{false};
        REQUIRE(simulation->run(keep, never).message == "");
        double up = 0, along = 0;
        for (const Quantity& q : keep.records.back().quantities) {
            if (q.name == "block_z_min_force_z") up = q.value;
            if (q.name == "block_z_min_force_x") along = q.value;
        }
        CHECK(std::abs(up / (981 + 50) - 1) < 1e-9);
        CHECK(std::abs(along + 3) < 1e-6);
    }
}
