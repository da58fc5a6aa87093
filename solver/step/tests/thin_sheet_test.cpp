// A thin sheet, one element thick, that carries contact on both sides at once.

#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>

using namespace amontons;

namespace {

/// Sum of the contact forces on a body from another, by their places among all that is in the scene
/// (obstacles first).
Vec3 force_on(const StepRecord& step, int body, int from)
{
    Vec3 sum = Vec3::Zero();
    for (const ContactRecord& c : step.contacts) {
        if (c.body_a == body && c.body_b == from) sum += c.force;
        if (c.body_b == body && c.body_a == from) sum -= c.force;
    }
    return sum;
}

/// A sheet on z = 0 of a thickness, between a block below and another above that is pressed down
/// with 1 kPa. All are held sideways.
std::string sheet_between_blocks(double thick, const std::string& motion)
{
    const auto solid = [&](const std::string& name, const std::string& mesh, double E,
                           const std::string& more) {
        return fmt::format(
            R"("{}": {{"kind": "solid", "motion": "{}", "youngs_modulus": {}, "poisson_ratio": 0.3,
               "mesh": {{"generate": "box", {}}}, "hold": [{{"set": "x_min", "x": 0}},
               {{"set": "x_max", "x": 0}}, {{"set": "y_min", "y": 0}},
               {{"set": "y_max", "y": 0}}{}}})",
            name, motion, E, mesh, more);
    };
    const std::string lower =
        solid("lower", R"("size": [1, 1, 0.5], "centre": [0, 0, -0.25], "cells": [4, 4, 3])", 1e5,
              R"(, {"set": "z_min", "z": 0}])");
    const std::string sheet =
        solid("sheet",
              fmt::format(R"("size": [1, 1, {}], "centre": [0, 0, {}], "cells": [7, 6, 1])", thick,
                          thick / 2),
              1e6, "]");
    const std::string upper =
        solid("upper",
              fmt::format(R"("size": [1, 1, 0.5], "centre": [0, 0, {}], "cells": [5, 5, 2])",
                          thick + 0.25),
              1e5, R"(], "loads": [{"set": "z_max", "traction": [0, 0, -1000]}])");
    return "\"bodies\": {" + lower + ", " + sheet + ", " + upper +
           R"(}, "contact": [{"between": ["lower", "sheet"]}, {"between": ["sheet", "upper"]}], "time": {"step": 1, "end": 1})";
}

} // namespace

TEST_CASE("a sheet between two blocks hands on the pressure and on each side its own" *
          doctest::test_suite("slow"))
{
    for (const double thick : {0.05, 0.02})
        for (const char* motion : {"linear", "hyperelastic"}) {
            CAPTURE(thick);
            CAPTURE(motion);
            const Result r = run(sheet_between_blocks(thick, motion));
            REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
            const StepRecord& last = r.records.back();
            CHECK(last.certificate.error <= 1e-8);
            CHECK(force_on(last, 1, 0).z() == doctest::Approx(1000).epsilon(1e-6));
            CHECK(force_on(last, 1, 2).z() == doctest::Approx(-1000).epsilon(1e-6));
        }
}

TEST_CASE("an unloaded thin sheet between two blocks is at rest")
{
    // Round-off of its places, bent, moves it by a hundred times as much: no error of contacts that
    // neither gap nor slip.
    for (const double stiffness : {10.0, 1e5, 1e9}) {
        CAPTURE(stiffness);
        const auto material = [](double E) {
            return fmt::format(
                R"({{"law": "neo_hooke", "youngs_modulus": {}, "poisson_ratio": 0.45}})", E);
        };
        const Result r = run(fmt::format(
            R"("bodies": {{
            "lower": {{"kind": "solid", "material": {0}, "hold": [{{"set": "z_min"}}], "mesh":
              {{"generate": "box", "size": [1, 1, 0.4], "centre": [0, 0, -0.2], "cells": [4, 4, 2], "element": "H8"}}}},
            "sheet": {{"kind": "solid", "material": {1}, "hold": [{{"set": "x_min"}}], "mesh":
              {{"generate": "box", "size": [1.3, 1.3, 0.002], "centre": [0, 0, 0.001], "cells": [7, 7, 1], "element": "H8"}}}},
            "upper": {{"kind": "solid", "material": {0}, "hold": [{{"set": "z_max"}}], "mesh":
              {{"generate": "box", "size": [0.6, 0.6, 0.3], "centre": [0.03, 0.02, 0.152], "cells": [3, 3, 2], "element": "T10"}}}}}},
            "contact": [{{"between": ["lower", "sheet"], "friction": 0.3}},
                        {{"between": ["sheet", "upper"], "friction": 0.3}}],
            "time": {{"step": 1, "end": 1}})",
            material(1e5), material(stiffness)));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        CHECK(r.value("upper_max_displacement") < 1e-12);
        CHECK(r.vector("upper_z_max_force").norm() < 1e-9 * 1e5);
    }
}

TEST_CASE("a small ball on the wide faces of a sheet: nothing passes between nodes" *
          doctest::test_suite("slow"))
{
    // Of 12.5 mm, wider than the ball; a step of 2.5 mm is more than the sheet is thick.
    for (const char* element : {"H8", "T10"})
        for (const double side : {1.0, -1.0})
            for (const char* shape : {R"("ball", "radius": 0.006)",
                                      R"("cylinder", "radius": 0.005, "length": 0.009)"}) {
                CAPTURE(std::string(element));
                CAPTURE(std::string(shape));
                CAPTURE(side);
                const Result r = run(fmt::format(
                    R"("bodies": {{"ball": {{"kind": "rigid", "density": 500,
                       "shape": {{"generate": {2}}},
                       "start": {{"place": [0.0045, 0.0035, {0}], "turn": [1.5707963267948966, 0, 0],
                                  "velocity": [0, 0, {1}]}}}},
                       "sheet": {{"kind": "solid", "density": 1100, "mesh": {{"generate": "box",
                       "size": [0.1, 0.1, 0.001], "cells": [8, 8, 1], "element": "{3}"}},
                       "material": {{"law": "neo_hooke", "youngs_modulus": 5e7, "poisson_ratio": 0.4}},
                       "hold": [{{"set": "x_min"}}, {{"set": "x_max"}}]}}}},
                       "contact": [{{"between": ["ball", "sheet"], "friction": 0.2}}],
                       "time": {{"kind": "dynamic", "step": 5e-4, "end": 0.008}})",
                    side * 0.02, -side * 5, shape, element));
                REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
                CHECK(side * r.value("ball_z") > 0);
                for (const StepRecord& step : r.records) { // of the sheet's thickness
                    CHECK(step.certificate.worst_penetration <= 0.1 * 0.001);
                    CHECK(step.certificate.worst_overlap.depth <= 0.1 * 0.001);
                }
            }
}

TEST_CASE("one wide face pressed onto a small ball that stands still" * doctest::test_suite("slow"))
{
    const auto force = [](int cells) {
        const Result r = run(fmt::format(
            R"("bodies": {{"ball": {{"kind": "rigid", "shape": {{"generate": "ball",
               "radius": 0.02}}, "start": {{"place": [0.004, 0.003, -0.02]}}, "drive": {{"z": 0}}}},
               "block": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.06],
               "centre": [0, 0, 0.03], "cells": [{0}, {0}, {0}], "element": "H8"}},
               "material": {{"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.3}},
               "hold": [{{"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.01]]}}]}}}},
               "contact": [{{"between": ["block", "ball"]}}],
               "time": {{"step": 0.25, "end": 1}})",
            cells));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return -r.vector("block_z_max_force").z();
    };
    const double coarse = force(1), fine = force(10);
    CHECK(fine > 0);
    CHECK(coarse > fine);      // one element yields less, and is found all the same
    CHECK(coarse < 10 * fine); // [regression] our own run
}

TEST_CASE("a soft sheet that its blocks keep from buckling is pressed and dragged" *
          doctest::test_suite("slow"))
{
    // Of rubber, 20 mm thick and wider than the blocks, which squeeze it. Extrapolated, and with a
    // matrix that rests on contacts from the third iteration on, no step led beyond 0.94 s.
    const auto solid = [](const std::string& name, const std::string& mesh,
                          const std::string& hold) {
        return fmt::format(
            R"("{}": {{"kind": "solid", "mesh": {{"generate": "box", "element": "H8", {}}},
            "material": {{"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.45}},
            "hold": [{{{}}}]}})",
            name, mesh, hold);
    };
    const Result r = run(
        "\"bodies\": {" +
        solid("lower", R"("size": [1, 1, 0.4], "centre": [0, 0, -0.2], "cells": [4, 4, 2])",
              R"("set": "z_min")") +
        ", " +
        solid("sheet", R"("size": [1.3, 1.3, 0.02], "centre": [0, 0, 0.01], "cells": [7, 7, 1])",
              R"("set": "x_min")") +
        ", " +
        solid("upper", R"("size": [1, 1, 0.4], "centre": [0.03, 0.02, 0.22], "cells": [5, 5, 2])",
              R"("set": "z_max", "x": [[0, 0], [1, 0], [2, 0.1]], "y": 0,
                 "z": [[0, 0], [1, -0.02], [2, -0.02]])") +
        R"(}, "contact": [{"between": ["lower", "sheet"], "friction": 0.3},
                          {"between": ["sheet", "upper"], "friction": 0.3}],
            "time": {"step": 0.1, "end": 1})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    for (const StepRecord& step : r.records)
        CHECK(step.certificate.error <= 1e-8);
    // Blocks are in balance with what presses them: nothing of them is held where they touch.
    for (const char* axis : {"_x", "_y", "_z"}) {
        CHECK(r.value(std::string("lower_z_min_force") + axis) ==
              doctest::Approx(-r.value(std::string("sheet_on_lower_force") + axis)).epsilon(1e-6));
        CHECK(r.value(std::string("upper_z_max_force") + axis) ==
              doctest::Approx(-r.value(std::string("sheet_on_upper_force") + axis)).epsilon(1e-6));
    }
    // Of the sheet some are: its hold has 7 N of the 3275 N from them.
    const Vec3 press = r.vector("upper_z_max_force");
    CHECK((r.vector("lower_z_min_force") + r.vector("sheet_x_min_force") + press).norm() <
          1e-6 * press.norm());
}
