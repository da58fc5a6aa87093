#include "mesh/tests/relative.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

// Rods that come out of a sheath, in motion: what comes out brings its velocity along.

using namespace amontons;
using test::relative;

namespace {

// Nothing touches it, but with it in the scene instruments are rods.
constexpr const char* kFarBody = R"("far": {"kind": "rigid", "shape": {"generate": "ball",
    "radius": 0.001}, "mass": 1, "start": {"place": [5, 5, 5]}, "drive": {"x": 0, "y": 0, "z": 0}},)";
constexpr double kDensity = 8000, kRadius = 4e-4;

/// A curve of constant acceleration, by a table.
std::string accelerated(double from, double acceleration, double T, int parts)
{
    std::string points;
    for (int i = 0; i <= parts; ++i) {
        const double t = T * i / parts;
        points += fmt::format("{}[{:.17g}, {:.17g}]", i ? ", " : "", t,
                              from + 0.5 * acceleration * t * t);
    }
    return "[" + points + "]";
}

/// A wire of steel that comes out sideways and falls, in free space.
struct Falling {
    int steps = 100;
    const char* rule = R"("theta": 1)";
    double element = 5e-3, T = 0.1;
    std::string fed = "[[0, 0.05], [0.1, 0.08]]"; // a table's knots would be blows
    const char* twist = "";
    const char* other = kFarBody;

    std::string scene() const
    {
        return fmt::format(R"("gravity": [0, 0, -9.81], "bodies": {{{0} "wire": {{"kind": "beam",
            "segments": [{{"length": 0.15, "radius": {1}, "EI": 2e-4, "element": {2}, "density": {3}}}],
            "drive": {{"insertion": {4} {5}}}}}}},
            "time": {{"kind": "dynamic", "step": {6:.17g}, "end": {7}, {8}}},
            "accuracy": {{"contact": 1e-12}})",
                           other, kRadius, element, kDensity, fed, twist, T / steps, T, rule);
    }
};

/// Order of convergence of a value by three runs, each with half the step of the one before.
double order_of(double a, double b, double c)
{
    return std::log2(std::abs((a - b) / (b - c)));
}

const double kLineMass = kDensity * std::numbers::pi * kRadius * kRadius; // [kg/m]

} // namespace

TEST_CASE("a fed wire that nothing moves in is a rod that is clamped at its length")
{
    // The same nodes out of a clamp: 50 mm of elements of 5 mm.
    for (const char* rule :
         {R"("theta": 1)", R"("theta": 0.5)", R"("rule": "generalised_alpha")"}) {
        CAPTURE(rule);
        Falling f;
        f.steps = 40;
        f.rule = rule;
        f.fed = "[[0, 0.05], [1, 0.05]]";
        const Result fed = done(f.scene());
        const Result clamped = done(fmt::format(
            R"("gravity": [0, 0, -9.81], "bodies": {{"wire": {{"kind": "rod", "segments": [
            {{"length": 0.05, "radius": {0}, "EI": 2e-4, "element": 5e-3, "density": {1}}}],
            "shape": {{"start": [0, 0, 0], "direction": [1, 0, 0]}}, "hold": [{{"set": "start"}}]}}}},
            "time": {{"kind": "dynamic", "step": 0.0025, "end": 0.1, {2}}},
            "accuracy": {{"contact": 1e-12}})",
            kRadius, kDensity, rule));
        REQUIRE(fed.records.size() == clamped.records.size());
        for (const std::size_t i : {std::size_t(5), std::size_t(20), std::size_t(40)})
            CHECK(fed.value("wire_tip_z", i) ==
                  relative(clamped.value("wire_end_z", i)).epsilon(1e-5));
        CHECK(std::abs(fed.value("wire_tip_z")) > 1e-4);
    }
}

TEST_CASE(
    "a straight wire that is fed at constant acceleration is pushed with its mass that is out")
{
    // d/dt of nothing that passes the end: it has the velocity that it had inside.
    const double a = 2, from = 0.03, T = 0.1;
    for (const char* rule : {R"("theta": 1)", R"("theta": 0.5)",
                             R"("rule": "generalised_alpha", "spectral_radius": 0.5)"}) {
        CAPTURE(rule);
        for (const int steps : {20, 40}) {
            CAPTURE(steps);
            const std::string scene = fmt::format(
                R"("bodies": {{{0} "wire": {{"kind": "beam", "segments": [{{"length": 0.15,
                "radius": {1}, "EI": 2e-4, "element": 5e-3, "density": {2}}}],
                "drive": {{"insertion": {3}}}}}}},
                "time": {{"kind": "dynamic", "step": {4:.17g}, "end": {5}, {6}}},
                "accuracy": {{"contact": 1e-12}})",
                kFarBody, kRadius, kDensity, accelerated(from, a, T, steps), T / steps, T, rule);
            const Result r = done(scene);
            const double h = T / steps;
            const auto out_at = [&](double t) { return from + 0.5 * a * t * t; };
            // By implicit Euler the force where a step ends. Other rules keep or filter the axial
            // wave that each knot of the table excites: the mean of two steps.
            const std::size_t last = r.records.size() - 1;
            const bool euler = std::string(rule).find('1') != std::string::npos;
            const double push = r.value("wire_push_force", last),
                         before = r.value("wire_push_force", last - 1);
            if (euler)
                CHECK(push == relative(kLineMass * a * out_at(T)).epsilon(1e-6));
            else // [regression] the bound
                CHECK(0.5 * (push + before) ==
                      relative(kLineMass * a * out_at(T - h)).epsilon(steps > 20 ? 0.03 : 0.06));
            // Its kinetic energy is what the drive has given it, inside and out. [regression] 0.05
            const double speed = a * T, out = out_at(T);
            CHECK(r.summary.energy.kinetic == relative(0.5 * kLineMass * out * speed * speed)
                                                  .epsilon(euler ? 1.1 * h / T : 0.05));
            CHECK(std::abs(r.summary.energy.error()) <
                  1e-3 * std::abs(r.summary.energy.work_absolute));
        }
    }
}

TEST_CASE("a straight wire that is fed at constant speed needs no push: no momentum is made")
{
    // A flux of momentum through the end of the sheath would be m_l v^2 = 4 mN.
    for (const char* rule : {R"("theta": 1)", R"("theta": 0.5)", R"("rule": "generalised_alpha")"})
        for (const char* fed : {"[[0, 0.03], [0.1, 0.13]]", "[[0, 0.13], [0.1, 0.03]]"}) {
            CAPTURE(rule);
            CAPTURE(fed);
            const Result r = done(fmt::format(
                R"("bodies": {{{} "wire": {{"kind": "beam", "segments": [{{"length": 0.15,
                "radius": {}, "EI": 2e-4, "element": 5e-3, "density": {}}}],
                "drive": {{"insertion": {}}}}}}},
                "time": {{"kind": "dynamic", "step": 2e-3, "end": 0.1, {}}},
                "accuracy": {{"contact": 1e-12}})",
                kFarBody, kRadius, kDensity, fed, rule));
            for (std::size_t i = 1; i < r.records.size(); ++i)
                CHECK(std::abs(r.value("wire_push_force", i)) < 1e-6 * kLineMass);
            const double start = 0.5 * kLineMass * std::abs(r.value("wire_depth", 0)), // 1 m/s
                end = 0.5 * kLineMass * std::abs(r.value("wire_depth"));
            CHECK(r.summary.energy.kinetic == relative(end).epsilon(1e-6));
            CHECK(r.summary.energy.work == relative(end - start).epsilon(1e-6));
            CHECK(std::abs(r.summary.energy.error()) < 1e-6 * end);
        }
}

TEST_CASE("a falling wire that comes out moves to second order of the step" *
          doctest::test_suite("slow"))
{
    for (const char* rule :
         {R"("theta": 0.5)", R"("rule": "generalised_alpha", "spectral_radius": 0.5)"}) {
        CAPTURE(rule);
        double z[3] = {}, x[3] = {}, error[3] = {};
        for (int k = 0; k < 3; ++k) {
            Falling f;
            f.T = 0.03;
            f.steps = 150 << k;
            f.rule = rule;
            f.fed = "[[0, 0.051], [0.03, 0.0515]]";
            const Result r = done(f.scene());
            z[k] = r.value("wire_tip_z");
            x[k] = r.value("wire_tip_x");
            error[k] = std::abs(r.summary.energy.error()) / r.summary.energy.work_absolute;
        }
        CAPTURE(z[2]);
        CHECK(z[2] < -1e-4);
        CHECK(order_of(z[0], z[1], z[2]) > 1.8);
        CHECK(order_of(x[0], x[1], x[2]) > 1.8);
        CHECK(error[2] < 1e-4);
    }
}

TEST_CASE(
    "a wire whose tip is moved as it leaves the sheath has the same motion as a rod and alone" *
    doctest::test_suite("slow"))
{
    // Both by implicit Euler; the one has masses at its nodes and none in half of the element that
    // comes out, the other that of its cubic line: their kinetic energies differ by an element.
    for (const double element : {5e-3, 2.5e-3})
        for (const int steps : {100, 200, 400}) {
            CAPTURE(element);
            CAPTURE(steps);
            const auto moved = [&](const char* other) {
                return done(fmt::format(
                    R"("bodies": {{{0} "wire": {{"kind": "beam", "segments": [{{"length": 0.15,
                    "radius": {1}, "EI": 2e-4, "element": {2}, "density": {3}}}],
                    "hold": {{"x": [[0, 0], [0.02, 0.009]], "y": [[0, 0], [0.02, 0.004]], "turns": "held"}},
                    "drive": {{"insertion": [[0, 0.05], [0.02, 0.06]]}}}}}},
                    "time": {{"kind": "dynamic", "step": {4:.17g}, "end": 0.02}},
                    "accuracy": {{"contact": 1e-12}})",
                    other, kRadius, element, kDensity, 0.02 / steps));
            };
            const Result rod = moved(kFarBody), wire = moved("");
            CHECK(rod.value("wire_push_force") == relative(wire.value("push_force")).epsilon(1e-3));
            CHECK(rod.summary.energy.elastic ==
                  relative(wire.summary.energy.elastic).epsilon(3e-5));
            CHECK(rod.summary.energy.kinetic ==
                  relative(wire.summary.energy.kinetic).epsilon(10 * element));
            CHECK(std::abs(rod.summary.energy.error()) < 1e-3 * rod.summary.energy.work_absolute);
        }
}

TEST_CASE("a wire that is drawn in whole and comes out again keeps its energy balance")
{
    Falling f;
    f.T = 0.4;
    f.steps = 400;
    f.fed = "[[0, 0.03], [0.15, 0], [0.2, 0], [0.4, 0.04]]";
    f.rule = R"("rule": "generalised_alpha", "spectral_radius": 0.3)";
    const Result r = done(f.scene());
    CHECK(r.value("wire_depth") == relative(0.04).epsilon(1e-6));
    CHECK(std::abs(r.summary.energy.error()) < 0.02 * r.summary.energy.work_absolute);
}

TEST_CASE("a wire that pushes a free box at constant acceleration: m a + mu m g")
{
    const double mass = 2e-4, friction = 0.3, a = 3, T = 0.1;
    const int steps = 100;
    for (const char* rule : {R"("theta": 1)", R"("theta": 0.5)",
                             R"("rule": "generalised_alpha", "spectral_radius": 0.5)"}) {
        CAPTURE(rule);
        const Result r = done(fmt::format(
            R"("gravity": [0, 0, -9.81], "bodies": {{
            "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
            "body": {{"kind": "rigid", "shape": {{"generate": "box", "size": [0.004, 0.004, 0.004]}},
                "mass": {0}, "start": {{"place": [0.0222, 0, 0.002]}}}},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 2e-4, "EI": 1e-3,
                "element": 2.5e-3, "density": 1}}],
                "introducer": {{"at": [0, 0, 0.002], "direction": [1, 0, 0]}},
                "drive": {{"insertion": {1}}}}}}},
            "contact": [{{"between": ["body", "floor"], "friction": {2}}},
                        {{"between": ["wire", "body"]}}],
            "time": {{"kind": "dynamic", "step": {3:.17g}, "end": {4}, {5}}},
            "accuracy": {{"contact": 1e-10}})",
            mass, accelerated(0.02, a, T, steps), friction, T / steps, T, rule));
        const double wire =
            1 * std::numbers::pi * 4e-8 * 0.035 * a; // its own inertia, below 1e-5 of it
        const double push = mass * a + friction * mass * kGravity;
        REQUIRE(wire < 1e-4 * push);
        // Of other rules than implicit Euler the mean over two steps: see above.
        for (const std::size_t i : {std::size_t(20), std::size_t(60), r.records.size() - 1})
            CHECK(0.5 * (r.value("wire_push_force", i) + r.value("wire_push_force", i - 1)) ==
                  relative(push).epsilon(5e-3));
        CHECK(r.value("body_velocity_x") == relative(a * T).epsilon(0.02));
        CHECK(r.summary.uncertified_steps == 0);
    }
}

TEST_CASE("a box that a wire pushes at constant speed stays upright, however long the steps are")
{
    // The step is solved in several iterations; the arms of the contacts are those of its start.
    const double mass = 2e-4, friction = 0.3, speed = 0.035;
    for (const double step : {5e-3, 1e-3}) {
        CAPTURE(step);
        const Result r = done(fmt::format(R"("gravity": [0, 0, -9.81], "bodies": {{{},
            "body": {{"kind": "rigid", "shape": {{"generate": "box", "size": [0.004, 0.004, 0.004]}},
                "mass": {}, "start": {{"place": [0.022, 0, 0.002]}}}},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 2e-4, "EI": 1e-3,
                "element": 2.5e-3, "density": 6450}}],
                "introducer": {{"at": [0, 0, 0.002], "direction": [1, 0, 0]}},
                "drive": {{"insertion": [[0, 0.015], [1, {}]]}}}}}},
            "contact": [{{"between": ["body", "floor"], "friction": {}}},
                        {{"between": ["wire", "body"]}}],
            "time": {{"kind": "dynamic", "step": {}, "end": 0.5}})",
                                          kFloor, mass, 0.015 + speed, friction, step));
        CHECK(std::abs(r.value("body_turn_y")) < 1e-3);
        CHECK(r.value("body_z") == relative(0.002).epsilon(1e-3));
        CHECK(r.value("body_velocity_x") == relative(speed).epsilon(1e-3));
        CHECK(r.value("wire_push_force") == relative(friction * mass * kGravity).epsilon(5e-3));
    }
}

TEST_CASE("a wire that pushes a free solid, or a rod that rolls, at constant acceleration")
{
    // A block: m a + mu m g. A round rod that lies across and is pushed at the height of its middle
    // line rolls: 3/2 m a.
    const double a = 3, T = 0.1, density = 3000, side = 4e-3, radius = 1e-3, length = 0.02;
    const int steps = 100;
    struct Pushed {
        std::string body;
        double height, from, force;
    };
    const double block = density * side * side * side,
                 bar = density * std::numbers::pi * radius * radius * length;
    for (const Pushed& p :
         {Pushed{fmt::format(R"({{"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
              "density": {0}, "mesh": {{"generate": "box", "size": [{1}, {1}, {1}],
              "cells": [2, 2, 2], "element": "H8"}}, "start": {{"place": [0.0222, 0, {2}]}}}})",
                             density, side, side / 2),
                 side / 2, 0.02, block * a + 0.3 * block * kGravity},
          Pushed{fmt::format(R"({{"kind": "rod", "segments": [{{"length": {0}, "radius": {1},
              "EI": 0.1, "element": {2}, "density": {3}}}],
              "shape": {{"start": [0.0212, {4}, {1}], "direction": [0, 1, 0]}}}})",
                             length, radius, length / 4, density, -length / 2),
                 radius, 0.02, 1.5 * bar * a}}) {
        CAPTURE(p.body);
        const Result r = done(fmt::format(
            R"("gravity": [0, 0, -9.81], "bodies": {{{0}, "body": {1},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 2e-4, "EI": 1e-3,
                "element": 2.5e-3, "density": 1}}],
                "introducer": {{"at": [0, 0, {2}], "direction": [1, 0, 0]}},
                "drive": {{"insertion": {3}}}}}}},
            "contact": [{{"between": ["body", "floor"], "friction": 0.3}},
                        {{"between": ["wire", "body"]}}],
            "time": {{"kind": "dynamic", "step": {4:.17g}, "end": {5}}})",
            kFloor, p.body, p.height, accelerated(p.from, a, T, steps), T / steps, T));
        for (const std::size_t i : {std::size_t(60), r.records.size() - 1})
            CHECK(r.value("wire_push_force", i) == relative(p.force).epsilon(0.01));
        CHECK(r.summary.uncertified_steps == 0);
    }
}

TEST_CASE("a clip whose legs are pressed onto each other in free space does not drift")
{
    // The legs cross where two opposite forces press them: no momentum.
    const double to_crossing = std::hypot(0.0125, 0.0025),
                 length = 2 * std::hypot(0.0625, 0.0125) + std::hypot(0.02, 0.008);
    const Result r = done(fmt::format(R"("bodies": {{"clip": {{"kind": "rod",
        "segments": [{{"length": {0:.17g}, "radius": 0.001, "EI": 1e-3, "element": 0.005,
            "density": 3000}}],
        "shape": {{"points": [{{"at": [-0.0125, -0.0025, 0.004]}}, {{"at": [0.05, 0.01, 0.004]}},
            {{"at": [0.05, -0.01, -0.004]}}, {{"at": [-0.0125, 0.0025, -0.004]}}]}},
        "loads": [{{"at": {1:.17g}, "force": [0, 0, -0.4]}},
                  {{"at": {2:.17g}, "force": [0, 0, 0.4]}}]}}}},
        "contact": [{{"between": ["clip", "clip"], "friction": 0.2}}],
        "time": {{"kind": "dynamic", "step": 5e-4, "end": 0.02, "damping": 40}})",
                                      length, to_crossing, length - to_crossing));
    int touching = 0;
    for (std::size_t i = 0; i < r.records.size(); ++i) {
        const double impulse = 0.4 * r.records[i].time;
        CHECK(r.vector("momentum", i).norm() <= 1e-9 * impulse);
        touching += r.value("clip_on_clip_normal_force", i) > 0.01;
    }
    CHECK(touching >= 10);
    CHECK(r.summary.energy.friction > 0);
    CHECK(r.summary.uncertified_steps == 0);
    CHECK(std::abs(r.summary.energy.error()) < 0.01 * r.summary.energy.work_absolute);
}

TEST_CASE("two wires that come out side by side strike the wall of a bend and come to rest" *
          doctest::test_suite("slow"))
{
    // Both come out quickly into a bend, strike its wall and each other, and come to rest.
    std::string wires, pairs;
    for (int w = 0; w < 2; ++w) {
        wires += fmt::format(R"("w{0}": {{"kind": "beam", "segments": [{{"length": 0.1,
            "radius": 4e-4, "EI": {1}, "element": 2.5e-3, "density": 8000}}],
            "introducer": {{"at": [0.001, 0, {2}], "direction": [1, 0, 0]}},
            "drive": {{"insertion": [[0, 0.01], [0.1, 0.045], [0.14, 0.045]]}}}},)",
                             w, w == 0 ? 2e-4 : 1e-4, w == 0 ? 5e-4 : -5e-4);
        pairs += fmt::format(R"({{"between": ["w{}", "tube"], "friction": 0.1}},)", w);
    }
    const Result r = done(fmt::format(
        R"("bodies": {{{} "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.002,
        "centreline": {{"normal": [0, 1, 0], "pieces": [{{"length": 0.02}},
        {{"radius": 0.03, "angle": 1.2}}]}}}}}}}},
        "contact": [{} {{"between": ["w0", "w1"], "friction": 0.1}}],
        "time": {{"kind": "dynamic", "step": 1e-3, "end": 0.14, "damping": 50}})",
        wires, pairs));
    CHECK(r.summary.uncertified_steps == 0);
    CHECK(std::abs(r.summary.energy.error()) < 0.02 * r.summary.energy.work_absolute);
    CHECK(r.summary.energy.friction > 0);
    CHECK(r.summary.energy.kinetic < 1e-3 * r.summary.energy.elastic);
    for (const char* name : {"w0_depth", "w1_depth"})
        CHECK(r.value(name) == relative(0.045).epsilon(1e-3));
}
