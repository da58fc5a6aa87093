// The generalised-alpha rule: its published recursion, its order, what it takes and what it keeps.

#include "solver/step/tests/body_runs.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <doctest/doctest.h>
#include <fmt/format.h>

using namespace amontons;

namespace {

/// A run without a message.
Result completed(const std::string& members, const std::vector<std::byte>& from = {})
{
    Result r = run(members, {}, false, from);
    REQUIRE(r.summary.message == "");
    return r;
}

std::string time_by_rule(double h, double end, const std::string& rule)
{
    return fmt::format(R"("time": {{"kind": "dynamic", "step": {:.17g}, "end": {:.17g}, {}}})", h,
                       end, rule);
}

std::string alpha(double rho)
{
    return fmt::format(R"("rule": "generalised_alpha", "spectral_radius": {})", rho);
}

/// One brick, a mass on a spring of frequency 1 along x, that a constant load pulls from rest to
/// oscillate about 0.01 m: u = 0.01 (1 - cos t).
constexpr double kMiddle = 0.01;
Result oscillator(double h, double end, const std::string& rule)
{
    return completed(R"("bodies": {"b": {"kind": "solid",
        "mesh": {"generate": "box", "size": [1, 0.1, 0.1], "cells": [1, 1, 1], "element": "H8"},
        "youngs_modulus": 100, "poisson_ratio": 0, "density": 300,
        "hold": [{"set": "x_min"}, {"set": "all", "y": 0, "z": 0}],
        "loads": [{"set": "x_max", "traction": [1, 0, 0]}]}}, )" +
                     time_by_rule(h, end, rule));
}

/// The rule on y. = -i y as published, from y = s / lambda = -1.
/// Source: Jansen, Whiting & Hulbert 2000, eq. 12 to 17.
std::complex<double> published(double rho, double h, int steps)
{
    using C = std::complex<double>;
    const double am = 0.5 * (3 - rho) / (1 + rho), af = 1 / (1 + rho), g = 0.5 + am - af;
    const C lambda(0, -1);
    C y = -1, s = lambda * y;
    for (int k = 0; k < steps; ++k) {
        // am s' + (1 - am) s = lambda (af y' + (1 - af) y),  y' = y + h ((1 - g) s + g s')
        const C known = y + h * (1 - g) * s;
        const C next =
            (lambda * (af * known + (1 - af) * y) - (1 - am) * s) / (am - lambda * af * h * g);
        y = known + h * g * next;
        s = next;
    }
    return y;
}

} // namespace

TEST_CASE("generalised-alpha is the published rule at any frequency and radius")
{
    for (const double rho : {0.0, 0.3, 0.8, 1.0})
        for (const double h : {0.1, 1.0, 10.0, 1e3}) {
            CAPTURE(rho);
            CAPTURE(h);
            const Result r = oscillator(h, 12 * h, alpha(rho));
            for (const int n : {1, 2, 3, 12}) {
                const double exact = kMiddle * (1 + published(rho, h, n).real());
                CHECK(std::abs(r.value("b_max_displacement", std::size_t(n)) - std::abs(exact)) <
                      1e-9 * kMiddle);
            }
            // What the rule took is counted.
            CHECK(std::abs(r.summary.energy.error()) < 1e-9 * r.summary.energy.work_absolute);
        }
}

TEST_CASE("generalised-alpha is of second order and implicit Euler of first")
{
    const auto error = [](double h, const std::string& rule) {
        const double t = 2;
        return std::abs(oscillator(h, t, rule).value("b_max_displacement") -
                        kMiddle * (1 - std::cos(t)));
    };
    for (const double rho : {0.0, 0.5, 1.0}) {
        CAPTURE(rho);
        const double order = std::log2(error(0.05, alpha(rho)) / error(0.025, alpha(rho)));
        CHECK(order > 1.9);
        CHECK(order < 2.1);
    }
    const double first = std::log2(error(0.05, R"("theta": 1)") / error(0.025, R"("theta": 1)"));
    CHECK(first > 0.9);
    CHECK(first < 1.1);
}

TEST_CASE("generalised-alpha takes high frequencies and leaves low ones")
{
    const auto energy = [](double h, int steps, double rho) {
        const Result r = oscillator(h, steps * h, alpha(rho));
        // Of the oscillation, about the middle; 0.005 J at the start.
        const EnergyRecord& e = r.summary.energy;
        return (e.elastic - e.elastic_start + e.kinetic - e.kinetic_start - e.work) /
                   (0.5 * kMiddle * 0.01) +
               1;
    };
    CHECK(std::abs(energy(1e3, 40, 0.5)) < 1e-12); // n rho^n
    CHECK(energy(0.1, 63, 0.5) > 0.995);           // a period of 63 steps
    CHECK(energy(0.1, 63, 1) == doctest::Approx(1).epsilon(1e-9));
}

TEST_CASE("generalised-alpha: a throw is right and a blow is Moreau's and momenta stay")
{
    const Result thrown = completed(R"("bodies": {"b": {"kind": "rigid", "mass": 2,
        "shape": {"generate": "ball", "radius": 0.1}, "start": {"velocity": [1, 0, 3]}}},
        "gravity": [0, 0, -9.81], )" +
                                    time_by_rule(0.02, 0.5, alpha(0.6)));
    // What is carried starts with the first velocity: once, an error of second order.
    CHECK(std::abs(thrown.value("b_x") - 0.5) < 1e-12);
    CHECK(std::abs(thrown.value("b_velocity_z") - (3 - 9.81 * 0.5)) < 1e-12);
    CHECK(std::abs(thrown.value("b_z") - (3 * 0.5 - 0.5 * 9.81 * 0.25)) <
          0.03 * 9.81 * 0.02 * 0.02);
    CHECK(std::abs(thrown.summary.energy.error()) < 1e-12 * thrown.summary.energy.work_absolute);

    const Result blow = completed(R"("bodies": {
        "a": {"kind": "rigid", "mass": 1, "shape": {"generate": "ball", "radius": 0.5},
              "start": {"velocity": [1, 0, 0]}},
        "b": {"kind": "rigid", "mass": 3, "shape": {"generate": "ball", "radius": 0.5},
              "start": {"place": [1.1, 0, 0]}}},
        "contact": [{"between": ["a", "b"], "restitution": 0.5}],
        "accuracy": {"contact": 1e-11}, )" +
                                  time_by_rule(0.01, 0.3, alpha(0.8)));
    CHECK(std::abs(blow.value("a_velocity_x") + 0.125) < 1e-10);
    CHECK(std::abs(blow.value("b_velocity_x") - 0.375) < 1e-10);
    CHECK(std::abs(blow.value("momentum_x") - 1) < 1e-12);

    for (
        const char* body :
        {R"("kind": "rigid", "density": 1000, "shape": {"generate": "box", "size": [0.1, 0.2, 0.3]})",
         R"("kind": "solid", "mesh": {"generate": "box", "size": [0.1, 0.2, 0.3],
             "cells": [1, 2, 3], "element": "T4"}, "youngs_modulus": 1e6, "poisson_ratio": 0.3,
             "density": 1000)",
         R"("kind": "solid", "mesh": {"generate": "box", "size": [0.1, 0.2, 0.3],
             "cells": [1, 2, 3], "element": "T4"}, "youngs_modulus": 1e6, "poisson_ratio": 0.3,
             "density": 1000, "motion": "corotational")"}) {
        CAPTURE(std::string(body));
        const Result r =
            completed(fmt::format(R"("bodies": {{"b": {{{}, "start": {{"velocity": [1, 2, 3],
            "spin": [3, -2, 5], "place": [0.3, 0, 0]}}}}}}, )",
                                  body) +
                      time_by_rule(0.01, 0.3, alpha(0.8)));
        for (const char* axis : {"_x", "_y", "_z"})
            for (const char* what : {"momentum", "angular_momentum"}) {
                const std::string name = std::string(what) + axis;
                CHECK(std::abs(r.value(name) - r.value(name, 1)) < 1e-10 * 60);
            }
    }
}

TEST_CASE("generalised-alpha: an elastic bar against a wall presses without ripple")
{
    // Benchmark A13, 50 cells: 300 Pa from 0.5 to 1.1667 s. The midpoint rule rings by half of it.
    const auto ripple = [](const std::string& rule) {
        const Result r = completed(R"("bodies": {"bar": {"kind": "solid",
            "mesh": {"generate": "box", "size": [10, 0.2, 0.2], "centre": [10, 0, 0],
                     "cells": [50, 1, 1], "element": "H8"},
            "youngs_modulus": 900, "poisson_ratio": 0, "density": 1,
            "hold": [{"set": "all", "y": 0, "z": 0}], "start": {"velocity": [-10, 0, 0]}},
            "wall": {"kind": "obstacle", "surface": {"generate": "plane", "axis": [1, 0, 0]}}},
            "contact": [{"between": ["bar", "wall"], "surfaces": ["x_min", ""],
                         "sliding": "small", "reach": 8}], )" +
                                   time_by_rule(0.2 / 30, 1.1, rule));
        double worst = 0;
        for (const StepRecord& s : r.records) {
            double f = 0;
            for (const ContactRecord& c : s.contacts)
                f += c.normal_force;
            if (s.time > 0.65) worst = std::max(worst, std::abs(f / 0.04 / 300 - 1));
        }
        return worst;
    };
    CHECK(ripple(alpha(0.8)) < 0.03);       // [regression] our own run
    CHECK(ripple(R"("theta": 0.5)") > 0.3); // [regression] our own run
}

TEST_CASE("generalised-alpha continues from a saved state with all that it carries")
{
    const std::string bodies = R"("bodies": {
        "s": {"kind": "solid", "mesh": {"generate": "box", "size": [0.2, 0.2, 0.1],
              "cells": [2, 2, 1], "element": "H8"}, "youngs_modulus": 1e5, "poisson_ratio": 0.3,
              "density": 250, "stiffness_damping": 1e-4, "start": {"place": [0, 0, 0.05]}},
        "r": {"kind": "rigid", "mass": 1, "shape": {"generate": "ball", "radius": 0.05},
              "start": {"place": [0, 0, 0.16], "spin": [1, 2, 3]}},
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}}},
        "gravity": [0, 0, -9.81],
        "contact": [{"between": ["s", "floor"], "friction": 0.3},
                    {"between": ["r", "s"], "friction": 0.3}], )";
    const double h = 1.0 / 512; // times without rounding, wherever a run begins
    const Result whole = completed(bodies + time_by_rule(h, 40 * h, alpha(0.7)));
    const Result half = completed(bodies + time_by_rule(h, 20 * h, alpha(0.7)));
    const Result rest =
        completed(bodies + time_by_rule(h, 40 * h, alpha(0.7)), half.simulation->save());
    for (const char* name : {"r_z", "r_spin_x", "s_max_displacement", "momentum_z"})
        CHECK(whole.value(name) == doctest::Approx(rest.value(name)).epsilon(1e-12));
}

namespace {

/// A box of 1 kg on a plane through the origin.
Result slide(const std::string& gravity, const std::string& velocity, double friction, double h,
             double end, const std::string& rule)
{
    return completed(fmt::format(R"("bodies": {{"b": {{"kind": "rigid", "mass": 1,
        "shape": {{"generate": "box", "size": [0.02, 0.02, 1e-5]}},
        "start": {{"place": [0, 0, 5e-6], "velocity": {}}}}},
        "floor": {{"kind": "obstacle", "surface": {{"generate": "plane", "axis": [0, 0, 1]}}}}}},
        "contact": [{{"between": ["b", "floor"], "friction": {:.17g}, "sliding": "finite"}}],
        "gravity": {}, )",
                                 velocity, friction, gravity) +
                     time_by_rule(h, end, rule));
}

} // namespace

TEST_CASE("friction of the midpoint rule and of generalised-alpha is of second order")
{
    // Thrown sideways on an incline of tan(a) = mu: |v| + v downhill stays 1. The velocity at the
    // end of the step alone would be 1.6e-2 off at 10 ms.
    const double mu = 0.36397023426620234, g = 9.81, c = 1 / std::hypot(1.0, mu);
    const std::string gravity = fmt::format("[{:.17g}, 0, {:.17g}]", g * mu * c, -g * c);
    for (const std::string& rule : {std::string(R"("theta": 0.5)"), alpha(0.8)}) {
        CAPTURE(rule);
        double off[2];
        for (const int half : {0, 1}) {
            const Result r = slide(gravity, "[0, 1, 0]", mu, half ? 5e-3 : 1e-2, 0.3, rule);
            const double down = r.value("b_velocity_x");
            off[half] = std::hypot(down, r.value("b_velocity_y")) + down - 1;
            CHECK(std::abs(r.summary.energy.error()) < 1e-8 * r.summary.energy.work_absolute);
        }
        CHECK(std::abs(off[0]) < 1e-3);
        CHECK(off[0] / off[1] == doctest::Approx(4).epsilon(0.1));
    }
}

TEST_CASE("a block that slides to rest stays there with the midpoint rule")
{
    // At 2 m/s and mu 0.25: 0.8155 s and as many metres; 0.8155 s is within a step.
    for (const std::string& rule : {std::string(R"("theta": 0.5)"), alpha(0.8)}) {
        CAPTURE(rule);
        const double h = 0.01;
        const Result r = slide("[0, 0, -9.81]", "[2, 0, 0]", 0.25, h, 1, rule);
        const double way = 2 * 2 / (2 * 0.25 * 9.81);
        CHECK(std::abs(r.value("b_x") - way) < 0.25 * 9.81 * h * h);
        // Its tilt between four corners, when friction ends, decays gradually.
        for (std::size_t k = 0; k < r.records.size(); ++k)
            CHECK(r.value("b_velocity_x", k) > -1e-6);
        CHECK(std::abs(r.value("b_velocity_x")) < 1e-6);
        CHECK(std::abs(r.summary.energy.friction + r.summary.energy.released - 2) < 1e-6);
    }
}

TEST_CASE("a knot of a curve within round-off of the start makes no step of its own")
{
    const auto pulled = [&](const char* first) {
        return run(fmt::format(R"("bodies": {{"b": {{"kind": "solid", "youngs_modulus": 1e5,
            "poisson_ratio": 0.3, "density": 1000, "mesh": {{"generate": "box", "size": [1, 1, 1],
            "element": "H8"}}, "hold": [{{"set": "z_min"}}], "loads": [{{"set": "z_max",
            "traction": [0, 0, 100], "over": [[{}, 0], [1, 1]]}}]}}}}, )",
                               first) +
                   time_by_rule(0.01, 0.05, alpha(0.8)));
    };
    const Result at_start = pulled("0");
    for (const char* first : {"1e-308", "1e-20"}) {
        CAPTURE(first);
        const Result r = pulled(first);
        REQUIRE(r.summary.message == "");
        CHECK(r.records.size() == at_start.records.size());
        CHECK(r.value("b_max_displacement") ==
              doctest::Approx(at_start.value("b_max_displacement")).epsilon(1e-12));
    }
}
