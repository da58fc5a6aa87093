// Scenes of ellipsoids, capsules and wedges, and files stretched by three numbers, against closed
// forms.

#include "solver/step/tests/body_runs.hpp"

#include "mesh/base/error.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <numbers>
#include <unistd.h>

using namespace amontons;

namespace {

/// A body of 1000 kg/m^3 on the floor, gravity turned by an angle towards x.
std::string on_incline(const std::string& shape, const std::string& start, double angle,
                       double friction, double step, double end)
{
    return fmt::format(R"("bodies": {{"body": {{"kind": "rigid", "density": 1000, "shape": {{{}}},
        "start": {{{}}}}}, {}}}, "contact": [{{"between": ["body", "floor"], "friction": {}}}],
        "gravity": [{:.17g}, 0, {:.17g}], "time": {{"kind": "dynamic", "step": {}, "end": {}}})",
                       shape, start, kFloor, friction, kGravity * std::sin(angle),
                       -kGravity * std::cos(angle), step, end);
}

} // namespace

TEST_CASE("a capsule that lies across an incline rolls with its own inertia, and along it stays")
{
    const double r = 0.02, half = 0.04, angle = 0.2;
    // m a = m g sin - f, I a / r = f r; I of a cylinder and a ball.
    const double cylinder = 2 * half * r * r, ball = 4.0 / 3 * r * r * r;
    const double inertia = (cylinder * 0.5 + ball * 0.4) / (cylinder + ball); // over m r^2
    const double rolling = kGravity * std::sin(angle) / (1 + inertia);
    const std::string shape =
        fmt::format(R"("generate": "capsule", "radius": {}, "length": {})", r, 2 * half);
    const Result across =
        run(on_incline(shape, R"("place": [0, 0, 0.02], "turn": [1.5707963267948966, 0, 0])", angle,
                       0.5, 1e-3, 0.3));
    REQUIRE(across.summary.status == "done");
    CHECK(across.value("body_velocity_x") == doctest::Approx(rolling * 0.3).epsilon(5e-3));
    CHECK(across.value("body_spin_y") == doctest::Approx(rolling * 0.3 / r).epsilon(5e-3));
    const Result along =
        run(on_incline(shape, R"("place": [0, 0, 0.02], "turn": [0, 1.5707963267948966, 0])", angle,
                       0.5, 1e-3, 0.3));
    CHECK(std::abs(along.value("body_velocity_x")) < 1e-6);
}

TEST_CASE("a wedge on an incline stays below the angle of friction and slides above it")
{
    const std::string wedge =
        R"("generate": "wedge", "points": [[0, 0], [0.1, 0], [0.1, 0.02], [0, 0.05]], "length": 0.08)";
    // Its polygon stands upright: y of the polygon is z.
    const std::string start = R"("turn": [1.5707963267948966, 0, 0])";
    const Result rests = run(on_incline(wedge, start, 0.29, 0.3, 1e-3, 0.2));
    CHECK(std::abs(rests.value("body_velocity_x")) < 1e-6);
    const double angle = 0.4;
    const Result slides = run(on_incline(wedge, start, angle, 0.3, 1e-3, 0.2));
    REQUIRE(slides.summary.status == "done");
    CHECK(
        slides.value("body_velocity_x") ==
        doctest::Approx(0.2 * kGravity * (std::sin(angle) - 0.3 * std::cos(angle))).epsilon(1e-3));
}

TEST_CASE("an ellipsoid on the floor rocks with the period of its curvature and its inertia")
{
    const double a = 0.06, b = 0.05, c = 0.03;
    // Rolling: the height of the centre grows by (R - c) phi^2 / 2, R the radius of curvature
    // below.
    const double R = a * a / c, inertia = (a * a + c * c) / 5;
    const double omega = std::sqrt(kGravity * (R - c) / (inertia + c * c));
    const double quarter = std::numbers::pi / 2 / omega;
    const double tilt = 0.01;
    const Result r =
        run(on_incline(fmt::format(R"("generate": "ellipsoid", "radii": [{}, {}, {}])", a, b, c),
                       fmt::format(R"("place": [0, 0, {:.17g}], "turn": [0, {}, 0])",
                                   std::hypot(a * std::sin(tilt), c * std::cos(tilt)), tilt),
                       0, 2, quarter / 400, quarter));
    REQUIRE(r.summary.status == "done");
    CHECK(std::abs(r.value("body_turn_y") - (-tilt)) < 0.02 * tilt); // since the start: level now
    CHECK(std::abs(r.value("body_spin_y")) == doctest::Approx(tilt * omega).epsilon(0.02));
}

TEST_CASE("quasi-static, an ellipsoid between two plates carries the load along its axis")
{
    const Result r = run(fmt::format(R"("bodies": {{
        "egg": {{"kind": "rigid", "mass": 1, "shape": {{"generate": "ellipsoid",
            "radii": [0.05, 0.04, 0.03]}}, "start": {{"place": [0, 0, 0.03]}}, "force": [0, 0, -5]}},
        {}}}, "contact": [{{"between": ["egg", "floor"], "friction": 0.4}}], "time": {{"step": 1,
        "end": 1}})",
                                     kFloor));
    REQUIRE(r.summary.status == "done");
    CHECK(r.value("floor_on_egg_force_z") == doctest::Approx(5).epsilon(1e-8));
    CHECK(r.value("floor_on_egg_contacts") == 1);
}

TEST_CASE("an elastic block under an ellipsoid and a capsule carries what they are pushed with" *
          doctest::test_suite("slow"))
{
    // Contacts with solids come from the shape's distance; balls are the ellipsoids that are known.
    const auto pushed = [](const std::string& shape) {
        return run(fmt::format(R"("bodies": {{
            "block": {{"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.05], "cells": [10, 10, 5],
                "centre": [0, 0, -0.025]}}, "hold": [{{"set": "z_min"}}]}},
            "tool": {{"kind": "rigid", "shape": {{{}}}, "start": {{"place": [0, 0, 0.03]}},
                "drive": {{"z": [[0, 0], [1, -0.001]]}}}}}},
            "contact": [{{"between": ["block", "tool"]}}], "time": {{"step": 0.5, "end": 1}})",
                               shape));
    };
    const Result ball = pushed(R"("generate": "ball", "radius": 0.03)");
    const Result round = pushed(R"("generate": "ellipsoid", "radii": [0.03, 0.03, 0.03])");
    const Result flat = pushed(R"("generate": "ellipsoid", "radii": [0.06, 0.06, 0.03])");
    const double of_ball = ball.value("tool_on_block_force_z");
    CHECK(of_ball < 0);
    CHECK(round.value("tool_on_block_force_z") == doctest::Approx(of_ball).epsilon(1e-8));
    // Hertz: F ~ sqrt(R), and the flat one has four times the radius of curvature.
    CHECK(flat.value("tool_on_block_force_z") / of_ball == doctest::Approx(2).epsilon(0.2));
    CHECK(std::abs(round.value("tool_on_block_force_z") + round.value("block_z_min_force_z")) <
          1e-8);
    const Result capsule = pushed(R"("generate": "capsule", "radius": 0.015, "length": 0.03)");
    CHECK(capsule.value("tool_on_block_force_z") < 0);
}

TEST_CASE("a file stretched by three numbers is the body of those lengths")
{
    const std::string path =
        (std::filesystem::temp_directory_path() / fmt::format("cube.{}.obj", getpid())).string();
    {
        std::ofstream out(path);
        for (int i = 0; i < 8; ++i)
            out << "v " << (i & 1) << ' ' << (i >> 1 & 1) << ' ' << (i >> 2 & 1) << '\n';
        for (const char* f : {"1 3 4", "1 4 2", "5 6 8", "5 8 7", "1 2 6", "1 6 5", "3 7 8",
                              "3 8 4", "1 5 7", "1 7 3", "2 4 8", "2 8 6"})
            out << "f " << f << '\n';
    }
    const auto momentum = [&](const char* scale) {
        return run(fmt::format(R"("bodies": {{"b": {{"kind": "rigid", "density": 10,
            "shape": {{"file": "{}", "scale": {}}}, "start": {{"velocity": [1, 0, 0],
            "spin": [0, 0, 1]}}}}}}, "time": {{"kind": "dynamic", "step": 0.1, "end": 0.1}})",
                               path, scale));
    };
    const Result r = momentum("[0.1, 0.2, 0.3]");
    CHECK(r.value("momentum_x") == doctest::Approx(10 * 0.006).epsilon(1e-9));
    CHECK(r.vector("b", 0).isApprox(Vec3(0.05, 0.1, 0.15), 1e-12));
    CHECK(momentum("0.1").value("momentum_x") == doctest::Approx(10 * 0.001).epsilon(1e-9));
    CHECK_THROWS_AS(momentum("[0.1, 0.2]"), InputError);
    CHECK_THROWS_AS(momentum("[0.1, -0.2, 0.3]"), InputError);
    std::filesystem::remove(path);
}
