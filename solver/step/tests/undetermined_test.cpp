// Which contact forces the laws leave open at the requested accuracy.

#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>

using namespace amontons;

namespace {

constexpr const char* kAtRest = R"("time": {"step": 1, "end": 1})";
constexpr const char* kInMotion = R"("time": {"kind": "dynamic", "step": 1e-3, "end": 3e-3})";

const UndeterminedForce* of_pair(const Result& r, const std::string& a, const std::string& b)
{
    for (const UndeterminedForce& u : r.summary.undetermined)
        if ((u.a == a && u.b == b) || (u.a == b && u.b == a)) return &u;
    return nullptr;
}

std::string plane(const std::string& name, const Vec3& axis, const Vec3& centre = Vec3::Zero())
{
    return fmt::format(R"("{}": {{"kind": "obstacle", "surface": {{"generate": "plane",
        "axis": [{:.17g}, {:.17g}, {:.17g}], "centre": [{:.17g}, {:.17g}, {:.17g}]}}}})",
                       name, axis.x(), axis.y(), axis.z(), centre.x(), centre.y(), centre.z());
}

/// A body of 1 kg and shape that begins there.
std::string body(const std::string& name, const std::string& shape, const Vec3& place)
{
    return fmt::format(R"("{}": {{"kind": "rigid", "shape": {{{}}}, "mass": 1,
        "start": {{"place": [{:.17g}, {:.17g}, {:.17g}]}}}})",
                       name, shape, place.x(), place.y(), place.z());
}

/// A ball that lies in a groove between two planes at this angle from the floor.
std::string groove(double angle, double friction, const char* time)
{
    return fmt::format(
        R"("bodies": {{{}, {}, {}}}, "contact": [{{"between": ["ball", "*"], "friction": {}}}],
           "gravity": [0, 0, -1], {})",
        plane("left", {std::sin(angle), 0, std::cos(angle)}),
        plane("right", {-std::sin(angle), 0, std::cos(angle)}),
        body("ball", R"("generate": "ball", "radius": 0.1)", {0, 0, 0.1 / std::cos(angle)}),
        friction, time);
}

/// A square plate that lies on four balls below its corners, which lie on the floor.
std::string table(const std::string& plate, const char* time)
{
    std::string bodies = plate + "," + kFloor;
    for (const int i : {-1, 1})
        for (const int j : {-1, 1})
            bodies += "," + body(fmt::format("leg{}{}", (i + 1) / 2, (j + 1) / 2),
                                 R"("generate": "ball", "radius": 0.1)", Vec3(i, j, 0.1));
    return fmt::format(R"("bodies": {{{}}}, "contact": [{{"between": ["*", "*"]}}],
        "gravity": [0, 0, -1], {})",
                       bodies, time);
}

const char* const kPlate = R"("generate": "box", "size": [2.2, 2.2, 0.1])";

} // namespace

TEST_CASE("walls that share a load may take any part of it")
{
    for (const char* time : {kAtRest, kInMotion}) {
        CAPTURE(std::string(time));
        const Result r = run(fmt::format(
            R"("bodies": {{{}, {}, {}, {}}}, "contact": [{{"between": ["block", "*"]}}],
               "gravity": [0, 0, -1], {})",
            plane("a", {0, 0, 1}), plane("b", {0, 0, 1}), plane("c", {0, 0, 1}),
            body("block", R"("generate": "box", "size": [0.1, 0.1, 0.1])", {0, 0, 0.05}), time));
        REQUIRE(r.summary.message == "");
        CHECK(r.summary.undetermined.size() == 3);
        CHECK(r.summary.undetermined_not_examined.empty());
        for (const char* wall : {"a", "b", "c"}) {
            const UndeterminedForce* u = of_pair(r, "block", wall);
            REQUIRE(u);
            CHECK(u->normal);
            CHECK(!u->tangential);
            CHECK(u->min == doctest::Approx(0));
            CHECK(u->max == doctest::Approx(1).epsilon(1e-6));
        }
    }
}

TEST_CASE("of a table each leg on its own may take between nothing and half of the weight")
{
    for (const char* time : {kAtRest, kInMotion}) {
        CAPTURE(std::string(time));
        const Result r = run(table(body("plate", kPlate, {0, 0, 0.25}), time));
        REQUIRE(r.summary.message == "");
        CHECK(r.summary.undetermined.size() == 8);
        for (const char* leg : {"leg00", "leg01", "leg10", "leg11"}) {
            const UndeterminedForce *on = of_pair(r, "plate", leg),
                                    *below = of_pair(r, leg, "floor");
            REQUIRE(on);
            REQUIRE(below);
            CHECK(on->min == doctest::Approx(0));
            CHECK(on->max == doctest::Approx(0.5).epsilon(1e-6));
            CHECK(below->min == doctest::Approx(1).epsilon(1e-6)); // a leg of 1 kg
            CHECK(below->max == doctest::Approx(1.5).epsilon(1e-6));
        }
    }
}

TEST_CASE("forces that balance alone fixes are not listed however many contacts share them")
{
    for (const char* time : {kAtRest, kInMotion})
        for (const double friction : {0.0, 0.5}) {
            CAPTURE(std::string(time));
            CAPTURE(friction);
            const char* const brick = R"("generate": "box", "size": [0.4, 0.2, 0.1])";
            const Result r = run(fmt::format(
                R"("bodies": {{{}, {}, {}}}, "contact": [{{"between": ["*", "*"], "friction": {}}}],
                   "gravity": [0, 0, -1], {})",
                kFloor, body("below", brick, {0, 0, 0.05}), body("above", brick, {0.1, 0, 0.15}),
                friction, time));
            REQUIRE(r.summary.message == "");
            CHECK(r.records.back().contacts.size() > 6);
            CHECK(r.summary.undetermined.empty());
            CHECK(r.summary.undetermined_not_examined.empty());
        }
}

TEST_CASE("a groove determines its forces as far as its angle is more than the accuracy")
{
    for (const char* time : {kAtRest, kInMotion}) {
        CAPTURE(std::string(time));
        // In motion the law is one of velocities, which the angle enters twice: u = W r + q.
        const double some = time == kAtRest ? 1e-7 : std::sqrt(1e-7);
        const Result steep = run(groove(1e-2, 0, time)), flat = run(groove(1e-8, 0, time)),
                     between = run(groove(some, 0, time));
        REQUIRE(steep.summary.message == "");
        REQUIRE(flat.summary.message == "");
        REQUIRE(between.summary.message == "");
        CHECK(steep.summary.undetermined.empty());
        for (const char* side : {"left", "right"}) {
            const UndeterminedForce* u = of_pair(flat, "ball", side);
            REQUIRE(u);
            CHECK(u->min == doctest::Approx(0));
            CHECK(u->max == doctest::Approx(1).epsilon(1e-6));
            // N1 - N2 is known to the accuracy, of the weight, over the angle: 0.1 of it.
            u = of_pair(between, "ball", side);
            REQUIRE(u);
            CHECK(u->max - u->min == doctest::Approx(0.1).epsilon(1e-3));
        }
    }
    // With a higher accuracy it is determined.
    CHECK(run(groove(1e-7, 0, kAtRest) + R"(, "accuracy": {"contact": 1e-10})")
              .summary.undetermined.empty());
}

TEST_CASE("friction leaves a ball in a groove all forces between sliding up and down")
{
    const double angle = 0.5, friction = 0.2;
    for (const char* time : {kAtRest, kInMotion}) {
        CAPTURE(std::string(time));
        const Result r = run(groove(angle, friction, time));
        REQUIRE(r.summary.message == "");
        for (const char* side : {"left", "right"}) {
            const UndeterminedForce* u = of_pair(r, "ball", side);
            REQUIRE(u);
            CHECK(u->normal);
            CHECK(u->tangential);
            const double c = std::cos(angle), s = friction * std::sin(angle);
            CHECK(u->min == doctest::Approx(0.5 / (c + s)).epsilon(2e-3));
            CHECK(u->max == doctest::Approx(0.5 / (c - s)).epsilon(2e-3));
        }
    }
}

TEST_CASE("a block that fits between two walls may be squeezed as much as one likes")
{
    const Result r = run(fmt::format(
        R"("bodies": {{{}, {}, {}, {}}},
           "contact": [{{"between": ["block", "*"], "friction": 0.5}}], "gravity": [0, 0, -1], {})",
        kFloor, plane("left", {1, 0, 0}, {-0.05, 0, 0}), plane("right", {-1, 0, 0}, {0.05, 0, 0}),
        body("block", R"("generate": "box", "size": [0.1, 0.1, 0.1])", {0, 0, 0.05}), kAtRest));
    REQUIRE(r.summary.message == "");
    for (const char* side : {"left", "right"}) {
        const UndeterminedForce* u = of_pair(r, "block", side);
        REQUIRE(u);
        CHECK(u->min == doctest::Approx(0));
        CHECK(std::isinf(u->max));
    }
    const UndeterminedForce* u = of_pair(r, "block", "floor"); // walls may carry the weight
    REQUIRE(u);
    CHECK(u->min == doctest::Approx(0));
}

TEST_CASE("elastic bodies determine what rigid ones share")
{
    const std::string soft =
        R"("plate": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
        "density": 2.0661157, "start": {"place": [0, 0, 0.25]},
        "mesh": {"generate": "box", "size": [2.2, 2.2, 0.1], "cells": [11, 11, 1], "element": "H8"}})";
    const Result plate = run(table(soft, kInMotion));
    REQUIRE(plate.summary.message == "");
    CHECK(plate.summary.contacts_max > 0);
    CHECK(plate.summary.undetermined.empty());
    // A rigid plate on four elastic blocks: the balance alone leaves as much open as of the legs
    // above.
    std::string blocks;
    for (const int i : {-1, 1})
        for (const int j : {-1, 1})
            blocks += fmt::format(R"(, "block{}{}": {{"kind": "solid", "youngs_modulus": 1e4,
                "poisson_ratio": 0.3, "hold": [{{"set": "z_min"}}], "start": {{"place": [{}, {}, 0.1]}},
                "mesh": {{"generate": "box", "size": [0.2, 0.2, 0.2], "cells": [2, 2, 2],
                "element": "H8"}}}})",
                                  (i + 1) / 2, (j + 1) / 2, i, j);
    const Result r =
        run(fmt::format(R"("bodies": {{{}{}}}, "contact": [{{"between": ["plate", "*"]}}],
        "gravity": [0, 0, -1], {})",
                        body("plate", kPlate, {0, 0, 0.25}), blocks, kAtRest));
    REQUIRE(r.summary.message == "");
    CHECK(r.summary.contacts_max >= 4);
    CHECK(r.summary.undetermined.empty());
}

TEST_CASE("what a spring carries is determined by its length and what a joint carries is not")
{
    // A plate that can only move up and down, on a leg; above, a spring with 0.3 N or a bar.
    const auto hung = [&](const std::string& joint) {
        return run(fmt::format(R"("bodies": {{{}, {}, {}}}, "gravity": [0, 0, -1],
            "couplings": [{{"kind": "slider", "between": ["plate", "world"]}}, {}],
            "contact": [{{"between": ["plate", "leg"]}}, {{"between": ["leg", "floor"]}}], {})",
                               kFloor,
                               body("leg", R"("generate": "ball", "radius": 0.1)", {0, 0, 0.1}),
                               body("plate", kPlate, {0, 0, 0.25}), joint, kAtRest));
    };
    const Result spring =
        hung(R"({"kind": "spring", "between": ["plate", "world"], "at": [0, 0, 0.3],
        "to": [0, 0, 1.3], "length": 0.997, "stiffness": 100})");
    REQUIRE(spring.summary.message == "");
    CHECK(spring.value("leg_on_plate_force_z") == doctest::Approx(0.7));
    CHECK(spring.summary.undetermined.empty());
    const Result bar =
        hung(R"({"kind": "ball", "between": ["plate", "world"], "at": [0, 0, 0.3]})");
    REQUIRE(bar.summary.message == "");
    const UndeterminedForce* u = of_pair(bar, "plate", "leg");
    REQUIRE(u);
    CHECK(u->min == doctest::Approx(0));
    CHECK(std::isinf(u->max));
}

TEST_CASE("a run that was over states what it left open when it is resumed, too")
{
    const std::string scene = groove(0.5, 0.2, kAtRest);
    const Result r = run(scene);
    REQUIRE(r.summary.undetermined.size() == 2);
    const Result again = run(scene, {}, false, r.simulation->save());
    REQUIRE(again.records.empty());
    REQUIRE(again.summary.undetermined.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
        CHECK(again.summary.undetermined[i].a == r.summary.undetermined[i].a);
        CHECK(again.summary.undetermined[i].b == r.summary.undetermined[i].b);
        CHECK(again.summary.undetermined[i].tangential);
        CHECK(again.summary.undetermined[i].min == r.summary.undetermined[i].min);
        CHECK(again.summary.undetermined[i].max == r.summary.undetermined[i].max);
    }
}

TEST_CASE("a run that ends in a refused step states that undetermined forces were not searched for")
{
    // The pressure turns elements inside out: the last matrix that was tried has no factor.
    const RunSummary sum = run(R"("bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "cylinder", "centre": [0, 0, -0.1],
          "axis": [0, 1, 0], "radius": 0.08}},
        "block": {"kind": "solid", "motion": "corotational", "youngs_modulus": 1e5,
          "poisson_ratio": 0.4, "mesh": {"generate": "box", "size": [0.1, 0.1, 0.04],
            "cells": [3, 2, 2], "element": "T10"},
          "hold": [{"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.01]]}],
          "loads": [{"set": "x_max", "pressure": [[0, 0], [1, 1e9]]}]}},
        "contact": [{"between": ["block", "floor"], "friction": 0.3, "reach": 0.01}],
        "time": {"step": 0.1, "end": 0.3})")
                               .summary;
    CHECK(sum.status == "failed");
    CHECK(sum.undetermined.empty());
    CHECK(sum.undetermined_not_examined ==
          std::vector<std::string>{"all: the last step was refused"});
}
