// What bodies do that would stand in each other: no contact is lost, whatever the number of steps,
// the reach and the meshes; what remains is reported.

#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fmt/format.h>

using namespace amontons;

namespace {

std::string block(const std::string& name, const std::string& mesh, const std::string& hold,
                  const std::string& more = "")
{
    return fmt::format(R"("{}": {{"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
        "mesh": {{"generate": "box", {}}}, "hold": [{}]{}}})",
                       name, mesh, hold, more);
}

std::string quasi_static(int steps)
{
    return fmt::format(R"("time": {{"step": {:.17g}, "end": 1}})", 1.0 / steps);
}

/// A rigid tool that is driven 50 mm into a block.
std::string tool_in_block(const std::string& shape, const std::string& element, int steps,
                          const std::string& law = "")
{
    return R"("bodies": {"tool": {"kind": "rigid", "shape": {)" + shape +
           R"(}, "start": {"place": [0.013, 0.011, 0.1]}, "drive": {"x": 0, "y": 0, "z": [[0, 0], [1, -0.05]]}}, )" +
           block(
               "blk",
               R"("size": [1, 1, 0.5], "cells": [10, 10, 5], "centre": [0, 0, -0.25], "element": ")" +
                   element + "\"",
               R"({"set": "z_min"})") +
           R"(}, "contact": [{"between": ["tool", "blk"])" + law + "}], " + quasi_static(steps);
}

double tool_force(const std::string& scene)
{
    const Result r = run(scene);
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    return -r.value("tool_on_blk_force_z");
}

/// A rigid ball that is pressed 10 mm into the middle of a quadratic face of 250 mm.
std::string ball_on_wide_face(int steps)
{
    return R"("bodies": {"ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.1},
        "start": {"place": [0.061, 0.047, 0.1]}, "drive": {"x": 0, "y": 0, "z": [[0, 0], [1, -0.01]]}}, )" +
           block(
               "blk",
               R"("size": [0.5, 0.5, 0.25], "cells": [2, 2, 1], "centre": [0, 0, -0.125], "element": "T10")",
               R"({"set": "z_min"})") +
           R"(}, "contact": [{"between": ["ball", "blk"]}], )" + quasi_static(steps);
}

} // namespace

TEST_CASE("a block driven on a plane ends with one force in any number of steps" *
          doctest::test_suite("slow"))
{
    const auto force = [](int steps, const std::string& law) {
        const Result r = run(
            R"("bodies": {"plane": {"kind": "obstacle", "surface": {"generate": "plane"}}, )" +
            block(
                "box",
                R"("size": [0.3, 0.25, 0.2], "cells": [4, 3, 3], "centre": [0, 0, 0.101], "element": "H8")",
                R"({"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.06]]})") +
            R"(}, "contact": [{"between": ["box", "plane"])" + law + "}], " + quasi_static(steps));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        CHECK(r.summary.worst_overlap.depth < 1e-9);
        return r.value("plane_on_box_force_z");
    };
    const double one = force(1, "");
    CHECK(one > 1000);
    for (const int steps : {2, 3, 5, 10, 20})
        CHECK(force(steps, "") == doctest::Approx(one).epsilon(1e-6));
    CHECK(force(3, R"(, "reach": 1e-4)") == doctest::Approx(one).epsilon(1e-6));
    CHECK(force(3, R"(, "reach": 0.15)") == doctest::Approx(one).epsilon(1e-6));
}

TEST_CASE("a rigid tool driven into a block: one force in any number of steps" *
          doctest::test_suite("slow"))
{
    for (const auto& [shape, a] :
         {std::pair<std::string, double>(R"("generate": "box", "size": [0.2, 0.2, 0.2])", 0.1),
          {R"("generate": "cylinder", "radius": 0.109, "length": 0.2)", 0.109}}) {
        CAPTURE(shape);
        const double many = tool_force(tool_in_block(shape, "H8", 10));
        // A rigid disc on a half-space, 2 E* a d (Sneddon 1965); the bonded block of 0.5 m is
        // stiffer.
        const double disc = 2 * 1e6 / (1 - 0.3 * 0.3) * a * 0.05;
        CHECK(many > disc);
        CHECK(many < 2.5 * disc);
        for (const int steps : {1, 3})
            CHECK(tool_force(tool_in_block(shape, "H8", steps)) ==
                  doctest::Approx(many).epsilon(1e-3));
    }
}

TEST_CASE(
    "tools that are pressed in coarse blocks deeply end with one force in any number of steps")
{
    // Contacts at edges jump in them: on the geometry at the end are several equilibria.
    const auto force = [](const std::string& tool, double depth, const std::string& mesh,
                          int steps) {
        const Result r = run(
            fmt::format(
                R"("bodies": {{"tool": {{"kind": "rigid", {}, "drive": {{"x": 0, "y": 0, "angle": 0,
                                    "z": [[0, 0], [1, {}]]}}}}, )",
                tool, -depth) +
            block("blk", mesh, R"({"set": "z_min"})") +
            R"(}, "contact": [{"between": ["tool", "blk"]}], )" + quasi_static(steps));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return r.vector("tool_on_blk_force");
    };
    struct Pressed {
        std::string tool;
        double depth;
        std::string mesh;
    };
    for (const auto& [tool, depth, mesh] :
         {Pressed{R"("shape": {"generate": "cylinder", "radius": 0.005077, "length": 0.006631},
            "start": {"place": [-0.002101, -0.002206, 0.005077], "turn": [1.53432, -0.395783, -0.395783]})",
                  0.001661,
                  R"("size": [0.03174, 0.03125, 0.01406], "cells": [3, 3, 2], "element": "T10",
                     "centre": [0, 0, -0.00703])"},
          {R"("shape": {"generate": "box", "size": [0.01227, 0.03276, 0.02643]},
            "start": {"place": [-0.0107, -0.004329, 0.013215], "turn": [0, 0, -0.7242]})",
           0.00174,
           R"("size": [0.08387, 0.113, 0.03045], "cells": [4, 4, 2], "element": "T10",
              "centre": [0, 0, -0.015225])"}}) {
        CAPTURE(tool);
        const Vec3 one = force(tool, depth, mesh, 1);
        for (const int steps : {2, 5})
            CHECK((force(tool, depth, mesh, steps) - one).norm() < 1e-6 * one.norm());
    }
}

TEST_CASE("a small reach changes no force")
{
    // A tool smaller than a face: mean gaps over its faces are larger than the reach.
    const auto force = [](const std::string& law) {
        const Result r = run(
            R"("bodies": {"tool": {"kind": "rigid", "shape": {"generate": "box", "size": [0.01, 0.018, 0.015]},
                "start": {"place": [0, 0, 0.0075]}, "drive": {"x": 0, "y": 0, "z": [[0, 0], [0.5, 0.005], [1, -0.00165]]}}, )" +
            block("blk",
                  R"("size": [0.055, 0.0425, 0.016], "cells": [2, 3, 1], "element": "H8",
                     "centre": [0.00124, 0.00062, -0.008])",
                  R"({"set": "z_min"})") +
            R"(}, "contact": [{"between": ["tool", "blk"])" + law + "}], " + quasi_static(4));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return r.vector("tool_on_blk_force");
    };
    const Vec3 free = force("");
    for (const char* reach : {"1e-5", "1e-4", "1e-3"})
        CHECK((force(fmt::format(R"(, "reach": {})", reach)) - free).norm() < 1e-6 * free.norm());
}

TEST_CASE("bodies that overlap at the start are separated at rest, whatever their restitution")
{
    const Result r = run(
        R"("bodies": {"floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
            "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.05}, "mass": 1,
                     "start": {"place": [0, 0, 0.045]}}},
        "contact": [{"between": ["ball", "floor"], "restitution": 0.5, "start_overlap": "resolve"}],
        "gravity": [0, 0, -9.81], "time": {"kind": "dynamic", "step": 1e-4, "end": 1e-3})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    CHECK(r.value("ball_z") == doctest::Approx(0.05).epsilon(1e-3));
    CHECK(std::abs(r.value("ball_velocity_z")) < 1e-9);
}

TEST_CASE("rigid bodies that begin in each other by less than is refused are no source of energy")
{
    // Less than 1e-3 of the ball. Undone in steps of the run, it would give a speed of its own.
    for (const char* surface :
         {R"("generate": "plane")", R"("generate": "ball", "radius": 0.5, "centre": [0, 0, -0.5])"})
        for (const double step : {1e-5, 1e-3}) {
            CAPTURE(surface);
            CAPTURE(step);
            const Result r = run(fmt::format(
                R"("bodies": {{"floor": {{"kind": "obstacle", "surface": {{{}}}}},
                "ball": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.2}}, "mass": 0.7,
                          "start": {{"place": [0, 0, 0.19999]}}}}}},
                "contact": [{{"between": ["ball", "floor"]}}], "gravity": [0, 0, -9.81],
                "time": {{"kind": "dynamic", "step": {}, "end": {}}})",
                surface, step, 10 * step));
            REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
            CHECK(r.value("ball_z") == doctest::Approx(0.2).epsilon(1e-9));
            CHECK(std::abs(r.value("ball_velocity_z")) < 1e-9);
            CHECK(r.value("floor_on_ball_force_z") == doctest::Approx(0.7 * 9.81).epsilon(1e-6));
        }
}

TEST_CASE("a box that begins in a ball is separated from it as far as contacts show")
{
    // Depths below 1e-3 of a face are left out where surfaces are measured.
    const Result r = run(
        R"("bodies": {"floor": {"kind": "obstacle", "surface":
            {"generate": "ball", "centre": [0, 0, -0.4943], "radius": 0.4943}},
            "body": {"kind": "rigid", "shape": {"generate": "box", "size": [0.2331, 0.3677, 0.4009]},
                     "mass": 0.74, "start": {"place": [0, 0, 0.17269]}}},
        "contact": [{"between": ["body", "floor"], "start_overlap": "resolve"}],
        "gravity": [0, 0, -9.81], "time": {"kind": "dynamic", "step": 1e-4, "end": 1e-3})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    CHECK(r.value("body_z") == doctest::Approx(0.20045).epsilon(1e-9));
}

TEST_CASE("a ball that is struck in a long step does not pass through a thin bar")
{
    const Result r = run(
        R"("bodies": {
            "light": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.0006518}, "mass": 0.011,
                      "start": {"place": [0, 0, 0.0019088]}},
            "heavy": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.00367}, "mass": 39,
                      "start": {"place": [0, 0, 0.0068487], "velocity": [0, 0, -3.5]}},
            "bar": {"kind": "obstacle", "surface": {"generate": "cylinder", "centre": [0, 0, -0.000455],
                    "axis": [0, 1, 0], "radius": 0.000455}}},
        "contact": [{"between": ["*", "*"], "restitution": 1}],
        "time": {"kind": "dynamic", "step": 0.001062, "end": 0.01062})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    CHECK(r.value("light_z") > 0);
    CHECK(r.value("heavy_z") > r.value("light_z"));
}

TEST_CASE("a light ball between a floor and a heavy one that comes down gains no energy")
{
    // It strikes both within a step, and still moves away from one of them.
    const Result r = run(
        R"("bodies": {
            "light": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.00417}, "mass": 0.045,
                      "start": {"place": [0, 0, 0.009237]}},
            "heavy": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.03537}, "mass": 14,
                      "start": {"place": [0, 0, 0.056984], "velocity": [0, 0, -97.5]}},
            "floor": {"kind": "obstacle", "surface": {"generate": "ball", "centre": [0, 0, -0.006523],
                      "radius": 0.006523}}},
        "contact": [{"between": ["*", "*"], "restitution": 0.7}],
        "time": {"kind": "dynamic", "step": 7.698e-05, "end": 0.0007698})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    CHECK(r.value("light_z") > 0);
    CHECK(r.value("heavy_z") > r.value("light_z"));
    double most = 0;
    for (const StepRecord& record : r.records)
        most = std::max(most, record.energy.kinetic);
    CHECK(most <= (1 + 1e-9) * 0.5 * 14 * 97.5 * 97.5);
}

TEST_CASE("a start inside is refused with depth and place, or pressed out")
{
    const std::string deep =
        R"("bodies": {"tool": {"kind": "rigid", "shape": {"generate": "box", "size": [0.2, 0.2, 0.2]},
        "start": {"place": [0.013, 0.011, 0.05]}, "drive": {"x": 0, "y": 0, "z": 0}}, )" +
        block(
            "blk",
            R"("size": [1, 1, 0.5], "cells": [10, 10, 5], "centre": [0, 0, -0.25], "element": "H8")",
            R"({"set": "z_min"})");
    const auto scene = [&](const std::string& law) {
        return deep + R"(}, "contact": [{"between": ["tool", "blk"])" + law + "}], " +
               quasi_static(1);
    };
    CHECK_THROWS_WITH_AS(run(scene("")), doctest::Contains("blk and tool overlap by 0.05 m"),
                         InputError);
    const double driven =
        tool_force(tool_in_block(R"("generate": "box", "size": [0.2, 0.2, 0.2])", "H8", 5));
    CHECK(tool_force(scene(R"(, "start_overlap": "resolve")")) ==
          doctest::Approx(driven).epsilon(1e-3));
}

TEST_CASE("a start inside is refused where sets of faces are to touch")
{
    const auto scene = [](double z, const std::string& law) {
        return R"("bodies": {)" +
               block("up",
                     fmt::format(R"("size": [0.1, 0.1, 0.1], "cells": [2, 2, 2],
                                 "centre": [0, 0, {}], "element": "H8")",
                                 z),
                     R"({"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -1e-3]]})") +
               ", " +
               block("lo",
                     R"("size": [0.12, 0.12, 0.1], "cells": [3, 3, 2], "centre": [0, 0, -0.05],
                     "element": "H8")",
                     R"({"set": "z_min"})") +
               R"(}, "contact": [{"between": ["up", "lo"])" + law + "}], " + quasi_static(1);
    };
    const std::string sets = R"(, "surfaces": ["z_min", "z_max"])";
    const std::string small = R"(, "sliding": "small")";
    for (const std::string& law : {std::string(), sets, small, sets + small}) {
        CHECK_THROWS_WITH_AS(run(scene(0.045, law)),
                             doctest::Contains("up and lo overlap by 0.005 m"), InputError);
        CHECK_THROWS_WITH_AS(run(scene(0.02, law)), doctest::Contains("overlap by 0.03 m"),
                             InputError);
    }
    const auto force = [&](const std::string& law) {
        const Result r = run(scene(0.05, law));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return std::abs(r.value("lo_on_up_force_z"));
    };
    CHECK(force("") > 1);
    CHECK(force(sets) == doctest::Approx(force("")).epsilon(1e-9));
    // What stands in the other elsewhere, as fitted bodies may, is not that pair's.
    const std::string sides = R"(, "surfaces": ["x_min", "x_max"])";
    CHECK(run(scene(0.045, sides)).summary.status == "done");
}

TEST_CASE("a tool in a block that are turned and shifted together give the same force")
{
    const double angle = 0.7;
    const Vec3 shift(0.3, -0.2, 0.5);
    const auto force = [&](bool moved, const std::string& shape) {
        const Eigen::Quaterniond turn(Eigen::AngleAxisd(moved ? angle : 0, Vec3::UnitY()));
        const Vec3 at = moved ? shift : Vec3::Zero(), place = turn * Vec3(0.013, 0.011, 0.1) + at,
                   drive = turn * Vec3(0, 0, -0.03);
        const auto start = [&](const Vec3& x) {
            return fmt::format(
                R"("start": {{"place": [{:.17g}, {:.17g}, {:.17g}], "turn": [0, {:.17g}, 0]}})",
                x.x(), x.y(), x.z(), moved ? angle : 0);
        };
        const Result r = run(
            R"("bodies": {"tool": {"kind": "rigid", "shape": {)" + shape + "}, " + start(place) +
            fmt::format(
                R"(, "drive": {{"x": [[0, 0], [1, {:.17g}]], "y": 0, "z": [[0, 0], [1, {:.17g}]]}}}}, )",
                drive.x(), drive.z()) +
            block(
                "blk",
                R"("size": [1, 1, 0.5], "cells": [6, 6, 3], "centre": [0, 0, -0.25], "element": "H8")",
                R"({"set": "z_min"})", ", " + start(at)) +
            R"(}, "contact": [{"between": ["tool", "blk"]}], )" + quasi_static(2));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return r.vector("tool_on_blk_force").norm();
    };
    for (const std::string shape : {R"("generate": "box", "size": [0.2, 0.2, 0.2])",
                                    R"("generate": "cylinder", "radius": 0.109, "length": 0.2)"})
        CHECK(force(true, shape) == doctest::Approx(force(false, shape)).epsilon(1e-6));
}

TEST_CASE("surfaces that should fit: gaps and overlaps at the start are taken out of the gap")
{
    const auto force = [](double gap, const std::string& law) {
        const Result r = run(
            "\"bodies\": {" +
            block(
                "up",
                fmt::format(
                    R"("size": [0.2, 0.2, 0.1], "cells": [4, 4, 2], "centre": [0, 0, {:.17g}], "element": "H8")",
                    0.05 + gap),
                R"({"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.005]]})") +
            ", " +
            block(
                "lo",
                R"("size": [0.2, 0.2, 0.1], "cells": [3, 3, 2], "centre": [0, 0, -0.05], "element": "H8")",
                R"({"set": "z_min"})") +
            R"(}, "contact": [{"between": ["up", "lo"])" + law + "}], " + quasi_static(2));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return r.value("up_on_lo_force_z");
    };
    const double fitting = force(0, "");
    CHECK(std::abs(fitting) > 500);
    for (const double gap : {1e-3, -1e-3})
        CHECK(force(gap, R"(, "start_overlap": "close")") ==
              doctest::Approx(fitting).epsilon(1e-5));
    CHECK(std::abs(force(1e-3, "")) < 0.9 * std::abs(fitting));
}

TEST_CASE("what worst_overlap leaves out is listed, and a run that continues warns once")
{
    const std::string scene = ball_on_wide_face(2);
    const Result whole = run(scene);
    REQUIRE(whole.summary.status == "done");
    CHECK(whole.summary.not_measured.empty());
    REQUIRE(!whole.summary.warnings.empty()); // a ball that is smaller than a face
    const Result again = run(scene, {}, false, whole.simulation->save());
    CHECK(again.summary.warnings == whole.summary.warnings);
    const Result small = run(
        R"("bodies": {"plane": {"kind": "obstacle", "surface": {"generate": "plane"}}, )" +
        block("box", R"("size": [0.3, 0.3, 0.2], "cells": [2, 2, 2], "centre": [0, 0, 0.1])",
              R"({"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.001]]})") +
        R"(}, "contact": [{"between": ["box", "plane"], "sliding": "small"}], )" + quasi_static(1));
    REQUIRE(small.summary.status == "done");
    CHECK(small.summary.not_measured.size() == 1);
}

TEST_CASE("a body entirely inside another one is found at the start")
{
    for (const std::string kind : {"T4", "T10", "H8"}) {
        const std::string outer =
            block("outer", R"("size": [1, 1, 1], "cells": [3, 3, 3], "element": ")" + kind + "\"",
                  R"({"set": "z_min"})");
        const std::string inner = block(
            "inner", R"("size": [0.3, 0.3, 0.3], "cells": [2, 2, 2], "element": ")" + kind + "\"",
            R"({"set": "z_min"})");
        const std::string ball =
            R"("inner": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.05}, "drive": {}})";
        const std::string same =
            block("inner", R"("size": [1, 1, 1], "cells": [3, 3, 3], "element": ")" + kind + "\"",
                  R"({"set": "z_min"})");
        for (const std::string& second : {inner, ball, same}) {
            CAPTURE(second);
            CHECK_THROWS_WITH_AS(run("\"bodies\": {" + outer + ", " + second +
                                     R"(}, "contact": [{"between": ["inner", "outer"]}], )" +
                                     quasi_static(1)),
                                 doctest::Contains("overlap by"), InputError);
        }
    }
}

TEST_CASE("crossed bars and stacked plates of any thickness work without a reach" *
          doctest::test_suite("slow"))
{
    // Clamped at both ends and pressed at the middle: 192 EI / L^3 each, two in series.
    for (const double thick : {0.02, 0.05}) {
        CAPTURE(thick);
        const double drive = 0.2 * thick, gap = 0.01 * thick;
        const auto bar = [&](const char* name, bool along_x, double z, const std::string& hold) {
            return block(
                name,
                fmt::format(
                    R"("size": [{}, {}, {}], "cells": [{}, {}, 1], "centre": [0.003, 0.002, {}], "element": "H8")",
                    along_x ? 1 : thick, along_x ? thick : 1, thick, along_x ? 20 : 1,
                    along_x ? 1 : 20, z),
                hold);
        };
        const std::string down = fmt::format(R"("x": 0, "y": 0, "z": [[0, 0], [1, -{}]])", drive);
        const Result r =
            run("\"bodies\": {" +
                bar("up", true, thick / 2 + gap,
                    R"({"set": "x_min", )" + down + R"(}, {"set": "x_max", )" + down + "}") +
                ", " + bar("lo", false, -thick / 2, R"({"set": "y_min"}, {"set": "y_max"})") +
                R"(}, "contact": [{"between": ["up", "lo"]}], )" + quasi_static(4));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        const double EI = 1e6 * std::pow(thick, 4) / 12;
        CHECK(r.value("lo_on_up_force_z") ==
              doctest::Approx(0.5 * 192 * EI * (drive - gap)).epsilon(0.05).scale(0));
        // Contact begins within a step: its work is that of a straight line.
        CHECK(std::abs(r.summary.energy.error()) < 0.02 * r.summary.energy.work);
    }
}

TEST_CASE("a fine ball on a coarse block presses it, and the contact that is smaller than a face "
          "is warned of" *
          doctest::test_suite("slow"))
{
    const auto pressed = [](int cells) {
        return run(
            R"("bodies": {"ball": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
            "mesh": {"generate": "ball", "radius": 0.1, "around": 16, "element": "T10"},
            "start": {"place": [0.011, 0.007, 0.1]},
            "hold": [{"set": "all", "x": 0, "y": 0, "z": [[0, 0], [1, -0.01]]}]}, )" +
            block(
                "blk",
                fmt::format(
                    R"("size": [0.5, 0.5, 0.25], "cells": [{}, {}, {}], "centre": [0, 0, -0.125], "element": "H8")",
                    cells, cells, cells / 2),
                R"({"set": "z_min"})") +
            R"(}, "contact": [{"between": ["ball", "blk"]}], )" + quasi_static(1));
    };
    const double fine = 537; // of 16 cells [regression]; Hertz on a half-space: 463 N
    for (const int cells : {4, 8}) {
        CAPTURE(cells);
        const Result r = pressed(cells);
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        const double force = -r.value("ball_on_blk_force_z");
        CHECK(force > 0.85 * fine);
        CHECK(r.summary.worst_overlap.depth < 0.0025);
        bool reported = false;
        for (const std::string& w : r.summary.warnings)
            reported = reported || w.find("smaller than a face") != w.npos;
        CHECK(reported == (cells == 4));
    }
}

TEST_CASE("a rigid ball in the middle of a wide quadratic face is not lost")
{
    const Result r = run(ball_on_wide_face(1));
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    CHECK(-r.value("ball_on_blk_force_z") > 0.85 * 463); // Hertz, on a half-space
    CHECK(!r.summary.warnings.empty());
    CHECK(r.summary.worst_overlap.depth < 0.005);
}

TEST_CASE(
    "a rigid ball that a face's nodes reach only when it is deep is pressed by no less than a "
    "half-space, in any number of steps")
{
    struct Scene {
        double E, nu, R, depth;
        std::string place, mesh;
    };
    // A node of the face touches at half the depth, and at all of it.
    for (
        const Scene& c :
        {Scene{
             1300, 0.2, 0.18, 0.01951, "0.08573, -0.05657",
             R"("size": [0.9614, 0.7997, 0.502], "cells": [6, 3, 3], "element": "T10", "centre": [0, 0, -0.251])"},
         Scene{
             1.5e9, 0.4, 0.0012, 6.961e-5, "0.0001688, 0.000628",
             R"("size": [0.005945, 0.005717, 0.002916], "cells": [7, 9, 2], "element": "H8", "centre": [0, 0, -0.001458])"}}) {
        CAPTURE(c.mesh);
        double of_one_step = 0;
        for (const int steps : {1, 3}) {
            const Result r = run(fmt::format(
                R"("bodies": {{"ball": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": {0}}},
                "start": {{"place": [{1}, {0}]}}, "drive": {{"x": 0, "y": 0, "z": [[0, 0], [1, -{2}]], "angle": 0}}}},
                "blk": {{"kind": "solid", "mesh": {{"generate": "box", {3}}}, "youngs_modulus": {4},
                "poisson_ratio": {5}, "hold": [{{"set": "z_min"}}]}}}},
                "contact": [{{"between": ["ball", "blk"]}}], {6})",
                c.R, c.place, c.depth, c.mesh, c.E, c.nu, quasi_static(steps)));
            REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
            const double force = -r.value("ball_on_blk_force_z");
            // Hertz 1881; the block is a layer on a rigid ground, which is stiffer.
            const double hertz =
                4.0 / 3 * c.E / (1 - c.nu * c.nu) * std::sqrt(c.R) * std::pow(c.depth, 1.5);
            CHECK(force > hertz);
            CHECK(!r.summary.warnings.empty()); // smaller than a face
            if (steps == 1) of_one_step = force;
            CHECK(force == doctest::Approx(of_one_step).epsilon(1e-8).scale(0));
        }
    }
}

TEST_CASE("the work that a ball smaller than a face takes is accounted for, and given back")
{
    // Faces of three to four half-widths. Of T10 two nodes begin to touch on the way.
    for (const char* mesh : {R"("cells": [7, 7, 4], "element": "T4")",
                             R"("cells": [6, 6, 3], "element": "T10")"})
        for (const int steps : {8, 20}) {
            CAPTURE(mesh);
            CAPTURE(steps);
            const Result r = run(fmt::format(
                R"("bodies": {{"ball": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.2219}},
                "start": {{"place": [0.009, 0.0076, 0.2219]}},
                "drive": {{"x": 0, "y": 0, "z": [[0, 0], [1, -0.0138], [2, 0]], "angle": 0}}}},
                "blk": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.7, 0.7, 0.35], {},
                "centre": [0, 0, -0.175]}}, "youngs_modulus": 4e5, "poisson_ratio": 0.06,
                "hold": [{{"set": "z_min"}}]}}}}, "contact": [{{"between": ["ball", "blk"]}}],
                "time": {{"kind": "quasi_static", "step": {}, "end": 2}})",
                mesh, 2.0 / steps));
            REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
            const EnergyRecord& e = r.summary.energy;
            CHECK(std::abs(e.error()) < 0.03 * e.scale());
            CHECK(std::abs(e.released) < 0.03 * e.scale()); // it is apart again
            for (const std::string& w : r.summary.warnings)
                CHECK(w.find("energy") == w.npos);
        }
}

TEST_CASE("a body that is struck is followed through its step with restitution and without")
{
    for (const double restitution : {0.0, 0.5})
        for (const double step : {2e-3, 5e-4}) {
            CAPTURE(restitution);
            CAPTURE(step);
            const Result r = run(fmt::format(
                R"("bodies": {{
                "light": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.005}}, "mass": 0.001,
                           "start": {{"place": [0, 0, 0.011]}}}},
                "heavy": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.02}}, "mass": 1,
                           "start": {{"place": [0, 0, 0.037], "velocity": [0, 0, -10]}}}},
                "bar": {{"kind": "rigid", "shape": {{"generate": "cylinder", "radius": 0.003, "length": 0.1}},
                         "start": {{"place": [0, 0, -0.003], "turn": [1.5707963267948966, 0, 0]}}, "drive": {{}}}}}},
                "contact": [{{"between": ["*", "*"], "restitution": {}}}],
                "time": {{"kind": "dynamic", "step": {}, "end": 0.02}})",
                restitution, step));
            REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
            CHECK(r.value("light_z") > 0);
        }
}

TEST_CASE("a ball of coarse facets that stands between the nodes of a coarse block is held")
{
    // 0.75 mm of its mesh come into one face of the block of 205 mm, less than what faces as wide
    // leave of the ball's curvature: multipliers of the block alone see a gap on average.
    const auto force = [](int steps) {
        const Result r = run(
            R"("bodies": {"round": {"kind": "solid", "mesh": {"generate": "ball", "radius": 0.123,
                "around": 11, "element": "T4"}, "youngs_modulus": 5.7e6, "poisson_ratio": 0.19,
                "start": {"place": [0.006765, 0.004305, 0.123]},
                "hold": [{"set": "all", "x": 0, "y": 0, "z": [[0, 0], [1, -0.003722]]}]}, )" +
            block("blk",
                  R"("size": [0.615, 0.615, 0.3075], "cells": [3, 3, 2], "centre": [0, 0, -0.15375],
                     "element": "H8")",
                  R"({"set": "z_min"})") +
            R"(}, "contact": [{"between": ["round", "blk"]}], )" + quasi_static(steps));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        // 1 % of a face, or more than half of what came in is warned of.
        CHECK(r.summary.worst_overlap.depth < 0.01 * 0.29);
        return std::abs(r.value("blk_z_min_force_z"));
    };
    const double one = force(1);
    // Hertz for a ball that overlaps by as much: more is right for facets, 0 is not.
    CHECK(one > 0.1 * 4 / 3 * 1e6 / (1 - 0.3 * 0.3) * std::sqrt(0.123) * std::pow(0.00075, 1.5));
    CHECK(force(3) == doctest::Approx(one).epsilon(1e-3));
}
