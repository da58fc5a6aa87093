// Laws that hold for scenes of solids and rigid bodies as a whole.

#include "mesh/generate/plane.hpp"
#include "solver/step/body_simulation.hpp"

#include "solver/body/solid_body.hpp"
#include "solver/step/body_build.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;

namespace {

std::string gravity_on_incline(double degrees)
{
    const double a = degrees * std::numbers::pi / 180;
    return fmt::format(R"("gravity": [{:.17g}, 0, {:.17g}])", kGravity * std::sin(a),
                       -kGravity * std::cos(a));
}

/// A block 0.2 x 0.2 x 0.1 of 1 kg, rigid or elastic, on the floor.
std::string lying_block(const std::string& kind)
{
    if (kind == "rigid")
        return R"("block": {"kind": "rigid", "shape": {"generate": "box", "size": [0.2, 0.2, 0.1]},
                  "mass": 1, "start": {"place": [0, 0, 0.05]}})";
    return fmt::format(R"("block": {{"kind": "solid",
        "mesh": {{"generate": "box", "size": [0.2, 0.2, 0.1], "cells": [2, 2, 1], "element": "H8"}},
        "youngs_modulus": 1e5, "poisson_ratio": 0.3, "density": 250, "motion": "{}",
        "start": {{"place": [0, 0, 0.05]}}}})",
                       kind);
}

} // namespace

TEST_CASE("a block on an incline slides with g (sin a - mu cos a) by the rule of the step")
{
    // Benchmark B01: x = a t (t + h) / 2 for the implicit Euler rule.
    const double a = kGravity * (0.5 - 0.3 * std::sqrt(0.75)), t = 0.2, h = 0.01;
    const Result r = run(fmt::format(R"("bodies": {{{}, {}}}, {},
        "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
        "time": {{"kind": "dynamic", "step": {}, "end": {}}})",
                                     lying_block("rigid"), kFloor, gravity_on_incline(30), h, t));
    REQUIRE(r.summary.message == "");
    CHECK(std::abs(r.value("block_x") - a * t * (t + h) / 2) < 1e-10);
    CHECK(std::abs(r.value("block_velocity_x") - a * t) < 1e-9);
    CHECK(r.summary.energy.friction > 0);
    CHECK(std::abs(r.summary.energy.error()) < 1e-9 * r.summary.energy.work);
}

TEST_CASE("below the angle of friction a block sticks")
{
    for (const char* kind : {"rigid", "linear", "corotational"}) {
        CAPTURE(kind);
        const Result r = run(fmt::format(R"("bodies": {{{}, {}}}, {},
            "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
            "time": {{"kind": "dynamic", "step": 0.01, "end": 1}})",
                                         lying_block(kind), kFloor, gravity_on_incline(16.6)));
        REQUIRE(r.summary.message == "");
        if (std::string(kind) == "rigid") {
            CHECK(std::abs(r.value("block_x")) < 1e-10);
        } else { // it has settled by its weight; then it stays
            const double at_half = r.value("block_max_displacement", 50);
            CHECK(std::abs(r.value("block_max_displacement") - at_half) < 1e-6);
        }
    }
}

TEST_CASE("a stop ends the step that is being solved but not as a failure")
{
    const std::string scene = fmt::format(R"("bodies": {{{}, {}}}, "gravity": [0, 0, -9.81],
        "contact": [{{"between": ["block", "floor"], "friction": 0.5}}],
        "time": {{"kind": "quasi_static", "step": 1, "end": 1}})",
                                          lying_block("rigid"), kFloor);
    CHECK(run(scene).summary.status == "done");
    const Result stopped = run(scene, {}, true);
    CHECK(stopped.summary.status == "interrupted");
    CHECK(stopped.records.empty());
}

TEST_CASE("bodies left alone keep their momentum and angular momentum")
{
    const std::string solid = R"("kind": "solid",
        "mesh": {"generate": "box", "size": [0.1, 0.2, 0.3], "cells": [1, 2, 3], "element": "T4"},
        "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
        "start": {"velocity": [1, 2, 3], "spin": [3, -2, 5], "place": [0.3, 0, 0]})";
    const std::string rigid = R"("kind": "rigid", "density": 1000,
        "shape": {"generate": "box", "size": [0.1, 0.2, 0.3]},
        "start": {"velocity": [1, 2, 3], "spin": [3, -2, 5], "place": [0.3, 0, 0]})";
    for (const std::string& body : {rigid, solid, solid + R"(, "motion": "corotational")"})
        for (const char* theta : {"1", "0.5"}) {
            CAPTURE(body);
            CAPTURE(std::string(theta));
            const Result r = run(fmt::format(R"("bodies": {{"b": {{{}}}}},
                "time": {{"kind": "dynamic", "step": 0.01, "end": 0.3, "theta": {}}})",
                                             body, theta));
            REQUIRE(r.summary.message == "");
            const Vec3 p = r.vector("momentum", 1), L = r.vector("angular_momentum", 1);
            CHECK((r.vector("momentum") - p).norm() < 1e-10 * p.norm());
            CHECK((r.vector("angular_momentum") - L).norm() < 1e-10 * L.norm());
        }
}

TEST_CASE("two bodies that collide keep their momentum and friction only takes energy")
{
    const Result r = run(R"("bodies": {
        "a": {"kind": "rigid", "density": 1000, "shape": {"generate": "box", "size": [0.1, 0.2, 0.3]},
              "start": {"velocity": [1, 0.1, 0], "spin": [1, 2, 3]}},
        "b": {"kind": "rigid", "density": 500, "shape": {"generate": "ball", "radius": 0.1},
              "start": {"place": [0.3, 0.05, 0.02], "spin": [-3, 0, 4]}}},
        "contact": [{"between": ["a", "b"], "friction": 0.02}],
        "time": {"kind": "dynamic", "step": 0.005, "end": 0.5})");
    REQUIRE(r.summary.message == "");
    CHECK(r.summary.contacts_max > 0);
    const Vec3 p = r.vector("momentum", 0), L = r.vector("angular_momentum", 0);
    CHECK((r.vector("momentum") - p).norm() < 1e-10 * p.norm());
    CHECK((r.vector("angular_momentum") - L).norm() < 1e-10 * L.norm());
    CHECK(r.summary.energy.friction > 0);
    const EnergyRecord& e = r.summary.energy;
    CHECK(e.kinetic > 0);
    CHECK(e.kinetic < e.kinetic_start);
    CHECK(std::abs(e.error()) < 1e-3 * (e.kinetic_start - e.kinetic));
}

TEST_CASE("the midpoint rule keeps the energy of a vibrating solid and Euler's does not")
{
    const auto after = [](const char* theta) {
        return run(fmt::format(R"("bodies": {{"b": {{"kind": "solid",
            "mesh": {{"generate": "box", "size": [1, 0.2, 0.2], "cells": [4, 1, 1], "element": "H8"}},
            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
            "hold": [{{"set": "x_min"}}], "start": {{"velocity": [0, 0, 1]}}}}}},
            "time": {{"kind": "dynamic", "step": 0.002, "end": 0.2, "theta": {}}})",
                               theta));
    };
    const Result kept = after("0.5"), lost = after("1");
    REQUIRE(kept.summary.message == "");
    const double start = 0.5 * 1000 * 0.04; // of 0.04 m^3 at 1 m/s; held nodes are stopped first
    const EnergyRecord &a = kept.summary.energy, &b = lost.summary.energy;
    CHECK(std::abs(a.error()) < 1e-9 * start);
    CHECK(b.elastic + b.kinetic - b.kinetic_start <
          -0.1 * start);                       // [regression] what the rule takes here
    CHECK(std::abs(b.error()) < 1e-9 * start); // what the rule took is counted
}

TEST_CASE("balls in line share a blow by Moreau's law")
{
    // Benchmark B13.
    for (const double e : {1.0, 0.0}) {
        std::string bodies;
        for (int k = 0; k < 3; ++k)
            bodies += fmt::format(R"({}"b{}": {{"kind": "rigid", "mass": 1,
                "shape": {{"generate": "ball", "radius": 0.5}},
                "start": {{"place": [{}, 0, 0], "velocity": [{}, 0, 0]}}}})",
                                  k ? ", " : "", k, k, k == 0 ? 1 : 0);
        const Result r = run(fmt::format(R"("bodies": {{{}}},
            "contact": [{{"between": ["*", "*"], "restitution": {}}}],
            "accuracy": {{"contact": 1e-11}},
            "time": {{"kind": "dynamic", "step": 0.01, "end": 0.01}})",
                                         bodies, e));
        REQUIRE(r.summary.message == "");
        const double first = e == 1 ? -1.0 / 3 : 1.0 / 3, others = e == 1 ? 2.0 / 3 : 1.0 / 3;
        CHECK(std::abs(r.value("b0_velocity_x") - first) < 1e-10);
        CHECK(std::abs(r.value("b1_velocity_x") - others) < 1e-10);
        CHECK(std::abs(r.value("b2_velocity_x") - others) < 1e-10);
    }
}

TEST_CASE("joints keep what they must keep and leave the rest")
{
    const auto hung = [](const char* kind) { // a rod hung at its end, released level
        return run(fmt::format(R"("bodies": {{"rod": {{"kind": "rigid", "mass": 2,
            "shape": {{"generate": "box", "size": [1, 0.05, 0.05]}}, "start": {{"place": [0.5, 0, 0]}}}}}},
            "gravity": [0, 0, -9.81],
            "couplings": [{{"kind": "{}", "between": ["rod", "world"], "at": [0, 0, 0], "axis": [0, 1, 0]}}],
            "time": {{"kind": "dynamic", "step": 0.001, "end": 0.3, "theta": 0.5}})",
                               kind));
    };
    const Result weld = hung("weld");
    REQUIRE(weld.summary.message == "");
    CHECK(std::abs(weld.value("rod_z")) < 1e-9);
    for (const char* kind : {"hinge", "ball"}) {
        CAPTURE(kind);
        const Result r = hung(kind);
        REQUIRE(r.summary.message == "");
        // Angle of a rod: theta'' = 1.5 g cos(theta) / L, so energy gives the spin.
        const double drop = -r.value("rod_z"), spin = std::abs(r.value("rod_spin_y"));
        CHECK(drop > 0.3);
        CHECK(spin == doctest::Approx(std::sqrt(3 * kGravity * drop * 2)).epsilon(2e-3));
        const double x = r.value("rod_x"), z = r.value("rod_z");
        CHECK(std::abs(std::hypot(x, z) - 0.5) < 1e-4); // [regression] of this step
        CHECK(std::abs(r.value("rod_y")) < 1e-9);
    }
    const Result slider = run(R"("bodies": {"bead": {"kind": "rigid", "mass": 2,
        "shape": {"generate": "ball", "radius": 0.1}}}, "gravity": [3, 0, -9.81],
        "couplings": [{"kind": "slider", "between": ["bead", "world"], "axis": [1, 0, 0]}],
        "time": {"kind": "dynamic", "step": 0.01, "end": 0.5})");
    REQUIRE(slider.summary.message == "");
    CHECK(std::abs(slider.value("bead_velocity_x") - 1.5) < 1e-8);
    CHECK(std::abs(slider.value("bead_z")) < 1e-9);
}

TEST_CASE("a spring stretches by the weight over its stiffness")
{
    const Result r = run(R"("bodies": {"ball": {"kind": "rigid", "mass": 2,
        "shape": {"generate": "ball", "radius": 0.1}}}, "gravity": [0, 0, -9.81],
        "couplings": [{"kind": "spring", "between": ["ball", "world"], "at": [0, 0, 0.1],
                       "to": [0, 0, 1], "stiffness": 1000}],
        "time": {"step": 1, "end": 1})");
    REQUIRE(r.summary.message == "");
    CHECK(std::abs(r.value("ball_z") + 2 * kGravity / 1000) < 1e-8);
    // What the ball exerts on the world, as the column's name specifies.
    CHECK((r.vector("ball_on_world_coupling_0_force") + 2 * kGravity * Vec3::UnitZ()).norm() <
          1e-6);
}

TEST_CASE("A_on_B is the force that A exerts on B, of contacts and joints and holds")
{
    // A stone on a block that lies on the floor; a held block hangs on a welded one.
    const Result r = run(fmt::format(R"("bodies": {{"stone": {{"kind": "rigid", "mass": 3,
        "shape": {{"generate": "box", "size": [0.1, 0.1, 0.1]}}, "start": {{"place": [0, 0, 0.25]}}}},
        "block": {{"kind": "solid", "youngs_modulus": 1e7, "poisson_ratio": 0, "density": 1000,
        "mesh": {{"generate": "box", "size": [0.2, 0.2, 0.2], "centre": [0, 0, 0.1], "cells": [2, 2, 2],
        "element": "H8"}}}}, {},
        "roof": {{"kind": "solid", "youngs_modulus": 1e9, "poisson_ratio": 0, "density": 1000,
        "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [1, 0, 1], "cells": [2, 2, 2],
        "element": "H8"}}, "hold": [{{"set": "z_max"}}]}},
        "lamp": {{"kind": "rigid", "mass": 2, "shape": {{"generate": "ball", "radius": 0.02}},
        "start": {{"place": [1, 0, 0.9]}}}}}},
        "contact": [{{"between": ["stone", "block"], "friction": 0.3}},
                    {{"between": ["block", "floor"], "friction": 0.3}}],
        "couplings": [{{"kind": "weld", "between": ["lamp", "roof"], "at": [1, 0, 0.94],
                       "set": "z_min"}}],
        "gravity": [0, 0, -9.81], "time": {{"step": 1, "end": 1}})",
                                     kFloor));
    REQUIRE(r.summary.message == "");
    const Vec3 g{0, 0, -kGravity};
    CHECK((r.vector("stone_on_block_force") - 3 * g).norm() < 1e-6);
    CHECK((r.vector("floor_on_block_force") + (3 + 8) * g).norm() < 1e-6);
    CHECK((r.vector("lamp_on_roof_coupling_0_force") - 2 * g).norm() < 1e-6);
    CHECK((r.vector("roof_z_max_force") + (2 + 1) * g).norm() < 1e-6);
    // An old name is none: it had the other sign.
    for (const Quantity& q : r.records.back().quantities) {
        CHECK(q.name.rfind("block_on_", 0) != 0);
        CHECK(q.name.rfind("coupling_", 0) != 0);
    }
}

TEST_CASE("a body that contacts alone hold is in balance and one that nothing holds is named")
{
    const auto pressed = [](const char* load) {
        return run(fmt::format(R"("bodies": {{"block": {{"kind": "solid",
            "mesh": {{"generate": "box", "size": [1, 1, 1], "cells": [2, 2, 2], "element": "T10"}},
            "youngs_modulus": 1e13, "poisson_ratio": 0.3, "start": {{"place": [0, 0, 0.5]}},
            "loads": [{{"set": "z_max", {}}}]}}, {}}},
            "contact": [{{"between": ["block", "floor"], "friction": 0}}],
            "time": {{"step": 1, "end": 1}})",
                               load, kFloor));
    };
    const Result held = pressed(R"("pressure": 1000)");
    REQUIRE(held.summary.message == "");
    CHECK(std::abs(held.value("floor_on_block_force_z") - 1000) < 1e-6);
    CHECK(std::abs(held.value("floor_on_block_max_pressure") - 1000) < 1e-4);
    CHECK(held.records.back().remark.find("shift along") != std::string::npos);
    const Result pushed = pressed(R"("traction": [10, 0, -1000])");
    CHECK(pushed.summary.status == "failed");
    CHECK(pushed.summary.message.find("block") != std::string::npos);
    const Result pulled = pressed(R"("pressure": -1000)");
    CHECK(pulled.summary.status == "failed");
    CHECK(pulled.summary.message.find("nothing holds its shift along (0, 0, 1)") !=
          std::string::npos);
}

TEST_CASE("a run that is stopped and continues gives the same bits" * doctest::test_suite("slow"))
{
    const std::string dynamic =
        fmt::format(R"("schema": 1, "bodies": {{{}, {}}}, {},
        "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
        "time": {{"kind": "dynamic", "step": 0.01, "end": 0.2}})",
                    lying_block("corotational"), kFloor, gravity_on_incline(30));
    const std::string dragged = fmt::format(R"("schema": 1, "bodies": {{"block": {{"kind": "solid",
        "mesh": {{"generate": "box", "size": [1, 1, 1], "cells": [2, 2, 2], "element": "T10"}},
        "youngs_modulus": 1e6, "poisson_ratio": 0.3, "start": {{"place": [0, 0, 0.5]}},
        "hold": [{{"set": "z_max", "x": [[0, 0], [1, 0.02]], "y": 0, "z": -0.01}}]}}, {}}},
        "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
        "time": {{"step": 0.05, "end": 1}})",
                                            kFloor);
    const auto ball = [](const char* name, double x) {
        return fmt::format(R"("{}": {{"kind": "solid", "mesh": {{"generate": "ball",
            "radius": 0.05, "around": 4, "element": "T4"}}, "youngs_modulus": 1e5,
            "poisson_ratio": 0.3, "density": 1000, "start": {{"place": [{}, 0, 0.051]}}}})",
                           name, x);
    };
    const std::string alike =
        fmt::format(R"("schema": 1, "bodies": {{{}, {}, {}}}, {},
        "contact": [{{"between": ["*", "*"], "friction": 0.3}}],
        "time": {{"kind": "dynamic", "step": 0.005, "end": 0.15}})",
                    ball("a", 0), ball("b", 0.1001), kFloor, gravity_on_incline(10));
    // Few contacts on many nodes, always the same: a way of its own after twenty calls.
    const std::string foot = R"("schema": 1, "bodies": {"block": {"kind": "solid",
        "mesh": {"generate": "box", "size": [1, 1, 1], "cells": [8, 8, 4], "element": "T4"},
        "youngs_modulus": 1e6, "poisson_ratio": 0.3, "hold": [{"set": "z_max"}]},
        "foot": {"kind": "solid", "mesh": {"generate": "box", "size": [0.5, 0.5, 0.1],
        "cells": [2, 2, 1], "element": "T4"}, "youngs_modulus": 1e6, "poisson_ratio": 0.3,
        "start": {"place": [0, 0, -0.55]},
        "hold": [{"set": "z_min", "x": [[0, 0], [1, 0.01]], "y": 0, "z": [[0, 0.001], [1, 0.002]]}]}},
        "contact": [{"between": ["foot", "block"], "surfaces": ["z_max", "z_min"], "friction": 0.3,
                     "sliding": "small"}], "time": {"step": 0.02, "end": 1})";
    // The same on a mesh whose columns are worth it only after some steps: W comes from the factor.
    std::string late = foot;
    late.replace(late.find("[0.5, 0.5, 0.1]"), 15, "[1.0, 1.0, 0.1]");
    late.replace(late.find("[8, 8, 4]"), 9, "[41, 41, 1]");
    late.replace(late.find("\"end\": 1}"), 9, "\"end\": 0.56}");
    // Rigid balls that touch and part: their pairs are numbered in the order in which they touch.
    const auto thrown = [](int k, double speed) {
        return fmt::format(R"("ball_{}": {{"kind": "rigid", "shape": {{"generate": "ball",
            "radius": 0.05}}, "density": 1000,
            "start": {{"place": [{}, 0, 0.05], "velocity": [{}, 0, 0]}}}})",
                           k, 0.12 * k, speed);
    };
    const std::string balls =
        fmt::format(R"("schema": 1, "bodies": {{{}, {}, {}, {}}}, {},
        "contact": [{{"between": ["*", "*"], "friction": 0.3, "restitution": 0.8}}],
        "time": {{"kind": "dynamic", "step": 0.01, "end": 0.4}})",
                    thrown(0, 0.1), thrown(1, 0), thrown(2, 2), kFloor, gravity_on_incline(10));
    for (const std::string& scene : {dynamic, dragged, alike, foot, late, balls}) {
        const Scene s = parse_scene("{" + scene + "}", "test.json", {});
        const auto made = [&] {
            std::vector<Obstacle> obstacles;
            obstacles.push_back({"floor", make_plane({})});
            return make_simulation(s, std::move(obstacles));
        };
        const std::atomic<bool> never{false};
        Keep whole;
        REQUIRE(made()->run(whole, never).message == "");

        int stopped = 0;
        for (const std::int64_t stop_at : {10, 24}) { // before that way is taken, and after
            CAPTURE(stop_at);
            if (whole.records.size() <= std::size_t(stop_at) + 1) continue; // it is over by then
            ++stopped;
            struct Stop : StepObserver {
                std::int64_t at = 0;
                std::atomic<bool> stop{false};
                void on_step(const StepRecord& r) override { stop = r.step >= at; }
            } part;
            part.at = stop_at;
            const auto first = made();
            REQUIRE(first->run(part, part.stop).status == "interrupted");
            const auto second = made();
            second->restore(first->save());
            Keep rest;
            REQUIRE(second->run(rest, never).status == "done");
            REQUIRE(rest.records.size() + std::size_t(stop_at) + 1 == whole.records.size());
            const StepRecord &a = whole.records.back(), &b = rest.records.back();
            REQUIRE(a.quantities.size() == b.quantities.size());
            for (std::size_t i = 0; i < a.quantities.size(); ++i)
                CHECK(a.quantities[i].value == b.quantities[i].value);
        }
        CHECK(stopped > 0);
    }
}

TEST_CASE("small sliding: only nodes in contact are kept track of and the forces stay")
{
    // Two blocks alike with a foot at different places; `probe` makes one of them slide elsewhere.
    const auto block = [](const char* name, double x, const char* set) {
        return fmt::format(R"("{}": {{"kind": "solid", "mesh": {{"generate": "box",
            "size": [1, 1, 1], "cells": [8, 8, 4], "element": "T4"}}, "youngs_modulus": 1e6,
            "poisson_ratio": 0.3, "start": {{"place": [{}, 0, 0]}}, "hold": [{{"set": "{}"}}]}})",
                           name, x, set);
    };
    const auto foot = [](const char* name, double x) {
        return fmt::format(R"("{}": {{"kind": "solid", "mesh": {{"generate": "box",
            "size": [0.25, 0.25, 0.1], "cells": [2, 2, 1], "element": "T4"}},
            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "start": {{"place": [{}, 0, -0.55]}},
            "hold": [{{"set": "z_min", "x": [[0, 0], [1, 0.01]], "y": 0,
                       "z": [[0, 0.001], [1, 0.002]]}}]}})",
                           name, x);
    };
    const auto scene = [&](bool probe) {
        return fmt::format(
            R"("bodies": {{{}, {}, {}, {}, {}}}, "contact": [
            {{"between": ["foot", "block"], "surfaces": ["z_max", "z_min"], "friction": 0.3,
              "sliding": "small"}},
            {{"between": ["corner", "other"], "surfaces": ["z_max", "z_min"], "friction": 0.3,
              "sliding": "small"}}{}], "time": {{"step": 0.1, "end": 1}})",
            block("block", 0, "z_max"), block("other", 2, "z_max"), foot("foot", 0),
            foot("corner", 2.25), foot("probe", 5),
            probe ? R"(, {"between": ["probe", "block"]}, {"between": ["probe", "foot"]},
                               {"between": ["probe", "other"]}, {"between": ["probe", "corner"]})"
                  : "");
    };
    const Scene narrow = parse_scene("{\"schema\": 1, " + scene(false) + "}", "test.json", {});
    std::vector<Issue> warnings;
    const std::unique_ptr<BodySystem> system = build_bodies(narrow, {}, warnings);
    std::vector<std::int32_t> touching[2];
    for (const BodyRef& b : system->refs) {
        if (b.name != "block" && b.name != "other") continue;
        const std::span<const std::int32_t> t = b.solid->touching();
        touching[b.name == "other"].assign(t.begin(), t.end());
        for (const std::int32_t i : t) {
            // Under one foot or the other, to the next nodes: alike bodies share what is kept.
            const Vec3 x = b.solid->mesh().nodes[std::size_t(i)];
            CHECK(x[2] == doctest::Approx(-0.5));
            CHECK(std::abs(x[1]) < 0.26);
            CHECK(x[0] > -0.26);
            CHECK(x[0] < 0.51);
        }
    }
    CHECK(touching[0].size() >= 9);
    CHECK(touching[0] == touching[1]);

    const Result a = run(scene(false)), b = run(scene(true));
    for (const char* name : {"foot_z_min_force_x", "foot_z_min_force_z", "corner_z_min_force_x",
                             "corner_z_min_force_z"}) {
        CAPTURE(name);
        CHECK(std::abs(a.value(name)) > 1);
        CHECK(a.value(name) == doctest::Approx(b.value(name)).epsilon(1e-9));
    }
}

TEST_CASE("an elastic block that floats on another without friction is pressed and does not drift")
{
    // Poisson's ratio 0: the state is uniform, and no node moves aside.
    for (const char* element : {"T4", "T10"})
        for (const char* sliding : {"small", "finite"}) {
            CAPTURE(element);
            CAPTURE(sliding);
            const auto block = [&](const char* name, int cells, double z, const char* rest) {
                return fmt::format(R"("{}": {{"kind": "solid", "mesh": {{"generate": "box",
                    "size": [1, 1, 0.5], "cells": [{}, {}, 2], "element": "{}"}},
                    "youngs_modulus": 1e6, "poisson_ratio": 0, "start": {{"place": [0, 0, {}]}}, {}}})",
                                   name, cells, cells, element, z, rest);
            };
            const Result r = run(fmt::format(
                R"("bodies": {{{}, {}}}, "contact": [{{"between": ["high", "low"],
                   "surfaces": ["z_min", "z_max"], "sliding": "{}"}}],
                   "accuracy": {{"contact": 1e-9}}, "time": {{"step": 1, "end": 1}})",
                block("low", 2, 0.25, R"("hold": [{"set": "z_min"}])"),
                block("high", 3, 0.75, R"("loads": [{"set": "z_max", "pressure": 1e3}])"),
                sliding));
            REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
            double aside = -1; // of no record
            for (const BodyRecord& b : r.simulation->body_records())
                for (const Field& f : b.point_fields)
                    if (b.name == "high" && f.name == "displacement")
                        for (std::size_t i = 0; i < f.values.size(); i += 3)
                            aside = std::max(aside, std::hypot(f.values[i], f.values[i + 1]));
            CHECK(aside >= 0);
            CHECK(aside < 1e-9);
        }
}

TEST_CASE(
    "free rigid bodies move the same whether a wildcard names their pairs or each has its own law")
{
    // Wide and fast enough that some are near from the start, some touch later, and some never.
    std::string bodies;
    std::vector<std::string> names{"floor"};
    for (int k = 0; k < 8; ++k) {
        names.push_back(fmt::format("brick_{}", k));
        bodies += fmt::format(R"(, "{}": {{"kind": "rigid", "shape": {{"generate": "box",
            "size": [0.1, 0.1, 0.1]}}, "density": 1000, "start": {{"place": [{}, {}, {}],
            "velocity": [{}, 0, 0]}}}})",
                              names.back(), 0.15 * (k % 4), 0.03 * (k % 3), 0.05 + 0.1 * (k / 4),
                              k % 4 == 0 ? 3.0 : 0.0);
    }
    const std::string law = R"("friction": 0.4, "restitution": 0.3)";
    std::string each;
    for (std::size_t i = 0; i < names.size(); ++i)
        for (std::size_t j = i + 1; j < names.size(); ++j)
            each += fmt::format(R"({}{{"between": ["{}", "{}"], {}}})", each.empty() ? "" : ", ",
                                names[i], names[j], law);
    const auto moved = [&](const std::string& laws) {
        return run(fmt::format(R"("bodies": {{{}{}}}, "contact": [{}], "gravity": [0, 0, -9.81],
            "time": {{"kind": "dynamic", "step": 0.005, "end": 0.3}})",
                               kFloor, bodies, laws));
    };
    const Result star = moved(fmt::format(R"({{"between": ["*", "*"], {}}})", law));
    const Result named = moved(each);
    CHECK(star.summary.message == "");
    REQUIRE(star.records.size() == named.records.size());
    for (std::size_t k = 1; k < names.size(); ++k) {
        CHECK(star.vector(names[k]) == named.vector(names[k]));
        CHECK(star.vector(names[k] + "_spin") == named.vector(names[k] + "_spin"));
    }
    // The first row is thrown at what stands beside it.
    CHECK(star.vector("brick_1").x() > 0.2);
}

TEST_CASE("bodies that are alike move as each does alone")
{
    const auto block = [](const char* name, double y) {
        return fmt::format(R"("{}": {{"kind": "solid", "mesh": {{"generate": "box",
            "size": [0.1, 0.1, 0.1], "cells": [3, 3, 2], "element": "T4"}}, "youngs_modulus": 1e5,
            "poisson_ratio": 0.3, "density": 1000, "start": {{"place": [0, {}, 0.06],
            "velocity": [0.3, 0, 0], "spin": [0, 1, {}]}}}})",
                           name, y, y);
    };
    const auto scene = [&](const std::string& bodies) {
        return run(fmt::format(R"("bodies": {{{}, {}}}, "gravity": [0, 0, -9.81],
            "contact": [{{"between": ["*", "floor"], "friction": 0.3}}],
            "time": {{"kind": "dynamic", "step": 0.005, "end": 0.3}})",
                               bodies, kFloor));
    };
    const Result a = scene(block("a", 0)), b = scene(block("b", 2)),
                 both = scene(block("a", 0) + "," + block("b", 2));
    REQUIRE(both.summary.message == "");
    REQUIRE(both.records.size() > 1);
    REQUIRE(a.records.size() == both.records.size());
    REQUIRE(b.records.size() == both.records.size());
    for (std::size_t step = 0; step < both.records.size(); ++step) {
        CHECK(both.value("a_max_displacement", step) ==
              doctest::Approx(a.value("a_max_displacement", step)).epsilon(1e-4));
        CHECK(both.value("b_max_displacement", step) ==
              doctest::Approx(b.value("b_max_displacement", step)).epsilon(1e-4));
    }
}

TEST_CASE("a body that nothing can hold is refused before the run with its free motions")
{
    try {
        run(R"("bodies": {"block": {"kind": "solid", "mesh": {"generate": "box", "size": [1, 1, 1]},
            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "hold": [{"set": "z_min", "z": 0}]},
            "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 1}}},
            "time": {"step": 1, "end": 1})");
        FAIL("accepted");
    } catch (const InputError& error) {
        const std::string text = error.what();
        CHECK(error.issues().size() == 2);
        CHECK(text.find("/bodies/block") != std::string::npos);
        CHECK(text.find("turn about") != std::string::npos);
        CHECK(text.find("/bodies/ball") != std::string::npos);
    }
}

TEST_CASE("names that the meshes do not have are refused together with the nearest")
{
    try {
        run(R"("bodies": {"block": {"kind": "solid", "mesh": {"generate": "box", "size": [1, 1, 1]},
            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "hold": [{"set": "z_mim"}],
            "loads": [{"set": "top", "pressure": 1}]}}, "time": {"step": 1, "end": 1})");
        FAIL("accepted");
    } catch (const InputError& error) {
        const std::string text = error.what();
        CHECK(text.find("/bodies/block/hold/0/set") != std::string::npos);
        CHECK(text.find("\"z_min\"") != std::string::npos);
        CHECK(text.find("/bodies/block/loads/0/set") != std::string::npos);
    }
}

TEST_CASE("a path of balances ends at the end of time however far the table of the load passes")
{
    const auto frame = [](const char* over) {
        return run(std::string(R"("bodies": {"frame": {"kind": "rod", "plane": [0, 0, 1],
            "segments": [{"length": 2.4, "radius": 0.0138, "EI": 1440, "EA": 4.32e7, "element": 0.12}],
            "shape": {"points": [{"at": [0, 0, 0]}, {"at": [0, 1.2, 0]}, {"at": [1.2, 1.2, 0]}]},
            "hold": [{"set": "start", "turns": "free"}, {"set": "end", "turns": "free"}],
            "loads": [{"at": 1.44, "force": [0, -1, 0], "over": )") +
                   over + R"(}]}}, "time": {"step": 500, "end": 10000, "path": 0.012})");
    };
    const Result ends = frame("[[0, 0], [10000, 10000]]"),
                 continues = frame("[[0, 0], [20000, 20000]]");
    for (const Result* r : {&ends, &continues}) {
        REQUIRE_MESSAGE(r->summary.status == "done", r->summary.message);
        CHECK(r->records.back().time == 10000);
        CHECK(r->value("frame_start_force_y") + r->value("frame_end_force_y") ==
              doctest::Approx(10000).epsilon(1e-8));
    }
    CHECK((ends.vector("frame_1.44") - continues.vector("frame_1.44")).norm() < 1e-8);
    CHECK(ends.records.size() < 60); // [regression] our own run
}

TEST_CASE("the turn of a rigid body is distinguished from where it began and its closed contacts "
          "are counted")
{
    const Result r = run(fmt::format(R"("bodies": {{"box": {{"kind": "rigid", "mass": 1,
        "shape": {{"generate": "box", "size": [0.2, 0.1, 0.1]}}, "start": {{"turn": [0, 0, 1],
        "place": [0, 0, 0.05]}}, "drive": {{"axis": [0, 0, 2], "angle": [[0, 0], [1, -2.5]]}}}},
        "stone": {{"kind": "rigid", "mass": 1, "shape": {{"generate": "box", "size": [0.1, 0.1, 0.1]}},
        "start": {{"place": [1, 0, 0.05]}}}}, {}}},
        "contact": [{{"between": ["stone", "floor"], "friction": 0.1}}],
        "gravity": [0, 0, -9.81], "time": {{"step": 0.5, "end": 1}})",
                                     kFloor));
    REQUIRE(r.summary.message == "");
    CHECK((r.vector("box_turn", 0)).norm() < 1e-12);
    CHECK((r.vector("box_turn") - Vec3(0, 0, -2.5)).norm() < 1e-12);
    double acting = 0;
    for (const ContactRecord& c : r.records.back().contacts)
        acting += c.normal_force > 0;
    CHECK(r.value("floor_on_stone_contacts") == acting);
    CHECK(acting >= 3);
}

TEST_CASE("points of contacts lie on the bodies as they are, with small sliding too")
{
    const Result r =
        run(R"("bodies": {"floor": {"kind": "obstacle", "surface": {"generate": "plane",
        "centre": [0, 0, -0.01]}}, "block": {"kind": "solid", "youngs_modulus": 1e6,
        "poisson_ratio": 0.3, "mesh": {"generate": "box", "size": [0.2, 0.2, 0.2],
        "centre": [0, 0, 0.1], "cells": [2, 2, 2], "element": "H8"},
        "hold": [{"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.015]]}]}},
        "contact": [{"between": ["block", "floor"], "sliding": "small"}],
        "time": {"step": 1, "end": 1})");
    REQUIRE(r.summary.message == "");
    REQUIRE(r.records.back().contacts.size() >= 9);
    for (const ContactRecord& c : r.records.back().contacts)
        CHECK(std::abs(c.point.z() + 0.01) < 1e-9);
}

TEST_CASE("solids in motion write the velocity of their nodes")
{
    const Result r =
        run(R"("bodies": {"b": {"kind": "solid", "youngs_modulus": 1e6, "density": 1000,
        "poisson_ratio": 0.3, "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "cells": [1, 1, 1],
        "element": "H8"}, "start": {"velocity": [3, 0, -1]}}},
        "time": {"kind": "dynamic", "step": 0.01, "end": 0.1})");
    REQUIRE(r.summary.message == "");
    const Field* velocity = nullptr;
    const std::vector<BodyRecord> bodies = r.simulation->body_records();
    for (const Field& f : bodies.at(0).point_fields)
        if (f.name == "velocity") velocity = &f;
    REQUIRE(velocity);
    REQUIRE(velocity->values.size() == 24);
    for (std::size_t i = 0; i < 24; i += 3) {
        CHECK(velocity->values[i] == doctest::Approx(3).epsilon(1e-9));
        CHECK(velocity->values[i + 2] == doctest::Approx(-1).epsilon(1e-9));
    }
}

TEST_CASE("bodies without mass are named where gravity would act on them")
{
    for (const double density : {0.0, 1000.0})
        for (const bool gravity : {false, true}) {
            const Result r = run(fmt::format(R"("bodies": {{"b": {{"kind": "solid",
                "youngs_modulus": 1e6, "poisson_ratio": 0, "density": {},
                "mesh": {{"generate": "box", "size": [1, 1, 1], "cells": [1, 1, 1],
                "element": "H8"}}, "hold": [{{"set": "z_min"}}]}}}}, "gravity": [0, 0, {}],
                "time": {{"step": 1, "end": 1}})",
                                            density, gravity ? -9.81 : 0));
            CAPTURE(density);
            CAPTURE(gravity);
            REQUIRE(r.simulation->warnings().size() == (gravity && density == 0 ? 1 : 0));
            if (gravity && density == 0)
                CHECK(r.simulation->warnings()[0].place == "/bodies/b/density");
        }
}
