// Springs to the surroundings, moments of holds, turns and probes of solids, against closed forms.

#include "solver/step/tests/body_runs.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <doctest/doctest.h>
#include <filesystem>
#include <fmt/format.h>
#include <numbers>
#include <unistd.h>

using namespace amontons;

namespace {

constexpr double kModulus = 1e6, kBed = 1e7, kShearBed = 2e6, kPressed = 1000;

/// A column of 0.1 x 0.1 x 0.2 m without lateral strain; `more` are its members.
std::string column(const char* element, const char* motion, const std::string& more)
{
    return fmt::format(R"("column": {{"kind": "solid", "youngs_modulus": {}, "poisson_ratio": 0,
        "density": 1000, "motion": "{}", "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.2],
        "cells": [2, 2, 3], "centre": [0, 0, 0.1], "element": "{}"}}, {}}})",
                       kModulus, motion, element, more);
}

std::string bed(double normal, double tangential)
{
    return fmt::format(R"("supports": [{{"set": "z_min", "normal": {}, "tangential": {}}}])",
                       normal, tangential);
}

constexpr const char* kOneStep = R"("time": {"step": 1, "end": 1})";

} // namespace

TEST_CASE("a column on a bed of springs sinks by p (1/k + L/E) and stores that work in both")
{
    for (const char* element : {"T4", "T10", "H8"})
        for (const char* motion : {"linear", "corotational", "hyperelastic"}) {
            CAPTURE(element);
            CAPTURE(motion);
            const std::string more =
                bed(kBed, kShearBed) + fmt::format(R"(, "probes": {{"top": {{"set": "z_max"}},
                    "middle": {{"at": [0.01, 0.02, 0.1]}}}}, "loads": [{{"set": "z_max",
                    "traction": [0, 0, {}], "over": [[0, 0], [1, 1]]}}])",
                                                   -kPressed);
            const Result r = run(
                fmt::format(R"("bodies": {{{}}}, {})", column(element, motion, more), kOneStep));
            REQUIRE(r.summary.status == "done");
            // A strain of 1e-3: what large ones add is as much.
            const double exact = std::string(motion) == "hyperelastic" ? 2e-3 : 1e-8;
            CHECK(r.value("column_z_min_support_force_z") ==
                  doctest::Approx(kPressed * 0.01).epsilon(1e-8));
            CHECK(r.value("column_top_displacement_z") ==
                  doctest::Approx(-kPressed * (1 / kBed + 0.2 / kModulus)).epsilon(exact));
            CHECK(r.value("column_middle_displacement_z") ==
                  doctest::Approx(-kPressed * (1 / kBed + 0.1 / kModulus)).epsilon(exact));
            CHECK(r.value("column_middle_stress_zz") == doctest::Approx(-kPressed).epsilon(exact));
            CHECK(r.value("column_middle_von_mises") == doctest::Approx(kPressed).epsilon(exact));
            CHECK(r.value("column_top_stress_zz") == doctest::Approx(-kPressed).epsilon(exact));
            CHECK(r.value("column_support_energy") ==
                  doctest::Approx(0.5 * kPressed * kPressed / kBed * 0.01).epsilon(1e-7));
            const EnergyRecord& e = r.records.back().energy;
            CHECK(e.elastic ==
                  doctest::Approx(0.5 * kPressed * kPressed * (1 / kBed + 0.2 / kModulus) * 0.01)
                      .epsilon(exact));
            CHECK(std::abs(e.error()) < 1e-3 * e.elastic);
        }
}

TEST_CASE("a traction along a bed shifts the body by its tangential stiffness alone")
{
    for (const char* element : {"T4", "T10", "H8"}) {
        CAPTURE(element);
        const Result r = run(
            fmt::format(R"("bodies": {{{}}}, {})",
                        column(element, "linear",
                               bed(kBed, kShearBed) +
                                   R"(, "loads": [{"set": "z_min", "traction": [300, -200, 0]}])"),
                        kOneStep));
        REQUIRE(r.summary.status == "done");
        CHECK(r.value("column_max_displacement") ==
              doctest::Approx(std::hypot(300, 200) / kShearBed).epsilon(1e-8));
        CHECK(r.vector("column_turn").norm() < 1e-10);
    }
}

TEST_CASE("a body placed elsewhere and turned lies on its bed as it did")
{
    const std::string how =
        bed(kBed, kShearBed) + R"(, "loads": [{"set": "z_max", "force": [0.3, 0, -4]}])";
    const Result straight =
        run(fmt::format(R"("bodies": {{{}}}, {})", column("H8", "linear", how), kOneStep));
    // About y by a right angle: x to -z, z to x.
    const Result turned = run(
        fmt::format(R"("bodies": {{{}}}, {})",
                    column("H8", "linear",
                           bed(kBed, kShearBed) +
                               R"(, "start": {"place": [1, 2, 3], "turn": [0, 1.5707963267948966,
                   0]}, "loads": [{"set": "z_max", "force": [-4, 0, -0.3]}])"),
                    kOneStep));
    REQUIRE(turned.summary.status == "done");
    CHECK(turned.value("column_max_displacement") ==
          doctest::Approx(straight.value("column_max_displacement")).epsilon(1e-9));
    CHECK(turned.value("column_z_min_support_force_x") == doctest::Approx(4).epsilon(1e-9));
    CHECK(turned.value("column_z_min_support_force_z") == doctest::Approx(0.3).epsilon(1e-9));
}

TEST_CASE(
    "a stiff block bounces on its bed with the period of mass and spring and keeps its energy")
{
    const double mass = 1000 * 0.002, stiffness = 1e5 * 0.01,
                 period = 2 * std::numbers::pi * std::sqrt(mass / stiffness);
    for (const char* motion : {"linear", "corotational", "hyperelastic"}) {
        CAPTURE(motion);
        const Result r = run(fmt::format(
            R"("bodies": {{{}}}, "time": {{"kind": "dynamic", "theta": 0.5, "rule": "theta",
               "step": {:.17g}, "end": {:.17g}}})",
            column("H8", motion,
                   bed(1e5, 1e5) + R"(, "start": {"velocity": [0, 0, -0.01]}, "probes": {"c":
                   {"at": [0, 0, 0.1]}})"),
            period / 200, period / 4));
        REQUIRE(r.summary.status == "done");
        // The block yields a little, too: E A / L is 50 times the bed's.
        CHECK(r.value("column_c_displacement_z") ==
              doctest::Approx(-0.01 * period / (2 * std::numbers::pi)).epsilon(0.02));
        const EnergyRecord& e = r.records.back().energy;
        CHECK(std::abs(e.elastic + e.kinetic - e.kinetic_start) < 1e-6 * e.kinetic_start);
        CHECK(e.kinetic < 0.01 * e.kinetic_start);
        CHECK(std::abs(e.error()) < 1e-9 * e.kinetic_start);
    }
}

TEST_CASE("what springs along the normal alone leave free is named, and held by contacts it rests")
{
    try {
        run(fmt::format(R"("bodies": {{{}}}, {})", column("H8", "linear", bed(kBed, 0)), kOneStep));
        CHECK(false);
    } catch (const InputError& error) {
        CHECK(std::string(error.what()).find("column") != std::string::npos);
    }
    // Three beds of normals along x, y and z hold it all.
    const Result held = run(fmt::format(
        R"("bodies": {{{}}}, {})",
        column("H8", "linear",
               R"("supports": [{"set": "x_min", "normal": 1e6}, {"set": "y_min", "normal": 1e6},
                   {"set": "z_min", "normal": 1e6}], "loads": [{"set": "all", "force": [1, 2, 3]}])"),
        kOneStep));
    REQUIRE(held.summary.status == "done");
    CHECK(held.value("column_x_min_support_force_x") == doctest::Approx(-1).epsilon(1e-8));
    CHECK(held.value("column_y_min_support_force_y") == doctest::Approx(-2).epsilon(1e-8));
    CHECK(held.value("column_z_min_support_force_z") == doctest::Approx(-3).epsilon(1e-8));
    // A driven plate presses it from above: what it may do along the bed, friction alone holds.
    const Result pressed = run(fmt::format(
        R"("bodies": {{{}, "plate": {{"kind": "rigid", "shape": {{"generate": "box",
           "size": [0.3, 0.3, 0.02]}}, "start": {{"place": [0, 0, 0.21]}},
           "drive": {{"z": [[0, 0], [1, -1e-4]], "x": [[0, 0], [1, 1e-5]]}}}}}},
           "contact": [{{"between": ["column", "plate"], "friction": 0.5}}], {})",
        column("H8", "linear", bed(kBed, 0)), kOneStep));
    REQUIRE(pressed.summary.status == "done");
    // Springs in a row: bed and column.
    const double force = 1e-4 * 0.01 / (1 / kBed + 0.2 / kModulus);
    CHECK(pressed.value("column_z_min_support_force_z") == doctest::Approx(force).epsilon(1e-5));
    CHECK(std::abs(pressed.value("column_z_min_support_force_x")) < 1e-6 * force);
}

TEST_CASE("the hold of a cantilever has the moment F L, by loads and by contact")
{
    const auto bar = [](const char* motion, const char* more) {
        return fmt::format(R"("bar": {{"kind": "solid", "youngs_modulus": 1e8, "poisson_ratio": 0.3,
            "density": 1000, "motion": "{}", "mesh": {{"generate": "box", "size": [0.4, 0.05, 0.05],
            "cells": [8, 2, 2], "centre": [0.2, 0, 0]}}, "hold": [{{"set": "x_min"}}]{}}})",
                           motion, more);
    };
    const double force = 0.02;
    for (const char* motion : {"linear", "corotational", "hyperelastic"})
        for (const char* time :
             {kOneStep, R"("time": {"kind": "dynamic", "step": 0.001, "end": 0.002})"}) {
            CAPTURE(motion);
            CAPTURE(time);
            const bool dynamic = time != kOneStep;
            const Result r =
                run(fmt::format(R"("bodies": {{{}}}, {})",
                                bar(motion, R"(, "loads": [{"set": "x_max", "force": [0, 0, -0.02]},
                    {"set": "x_max", "force": [0, 0.01, 0]}])"),
                                time));
            REQUIRE(r.summary.status == "done");
            if (dynamic) continue; // inertia takes part: it runs, and the record has the names
            // Large-motion solids: the arm is shortened by second-order terms.
            const double exact = std::string(motion) == "linear" ? 1e-9 : 1e-6;
            CHECK(r.value("bar_x_min_moment_y") == doctest::Approx(-force * 0.4).epsilon(exact));
            CHECK(r.value("bar_x_min_moment_z") == doctest::Approx(-0.01 * 0.4).epsilon(exact));
            CHECK(std::abs(r.value("bar_x_min_moment_x")) < 1e-6 * force);
        }
    // By contact: a driven block pushes the bar down near x = 0.3.
    const Result pushed = run(fmt::format(
        R"("bodies": {{{}, "block": {{"kind": "rigid", "shape": {{"generate": "box", "size": [0.1, 0.1,
           0.02]}}, "start": {{"place": [0.3, 0, 0.035]}}, "drive": {{"z": [[0, 0], [1, -1e-4]]}}}}}},
           "contact": [{{"between": ["bar", "block"], "friction": 0.3}}], {})",
        bar("linear", ""), kOneStep));
    REQUIRE(pushed.summary.status == "done");
    Vec3 moment = Vec3::Zero(); // of the contacts, about the middle of the held face
    for (const ContactRecord& c : pushed.records.back().contacts)
        moment += c.point.cross(c.force);
    CHECK(pushed.value("bar_x_min_force_z") > 0.1);
    CHECK((pushed.vector("bar_x_min_moment") + moment).norm() < 2e-3 * moment.norm());
}

TEST_CASE("the turn of a solid is that of its drive, and of its spin over time")
{
    const Result driven = run(fmt::format(
        R"("bodies": {{{}}}, {})",
        column(
            "T4", "linear",
            R"("hold": [{"set": "z_min"}], "drive": {"axis": [0, 1, 0], "angle": [[0, 0], [1, 0.7]]})"),
        kOneStep));
    CHECK((driven.vector("column_turn") - Vec3(0, 0.7, 0)).norm() < 1e-9);
    const Result spinning = run(
        fmt::format(R"("bodies": {{{}}}, "time": {{"kind": "dynamic", "step": 0.002, "end": 0.5}})",
                    column("H8", "linear", R"("start": {"spin": [0, 0, 2]})")));
    CHECK(spinning.value("column_turn_z") == doctest::Approx(1).epsilon(1e-3));
    CHECK(std::abs(spinning.value("column_turn_x")) < 1e-6);
}

TEST_CASE("a probe's contact pressure is the load over the area on which it rests")
{
    // Without lateral strain the pressure is the same everywhere.
    const Result r = run(fmt::format(
        R"("bodies": {{{}, {}}}, "contact": [{{"between": ["column", "floor"], "friction": 0.3}}], {})",
        column("H8", "linear",
               R"("probes": {"foot": {"set": "z_min"}, "edge": {"at": [0.05, 0.01, 0]},
                   "top": {"set": "z_max"}}, "loads": [{"set": "z_max", "traction": [0, 0, -1000]}])"),
        kFloor, kOneStep));
    REQUIRE(r.summary.status == "done");
    CHECK(r.value("column_foot_contact_pressure") == doctest::Approx(1000).epsilon(1e-6));
    CHECK(r.value("column_edge_contact_pressure") == doctest::Approx(1000).epsilon(0.01));
    CHECK(r.value("column_top_contact_pressure") == 0);
    CHECK_THROWS_AS(
        run(fmt::format(R"("bodies": {{{}}}, {})",
                        column("H8", "linear", R"("probes": {"far": {"at": [1, 1, 1]}})"),
                        kOneStep)),
        InputError);
    CHECK_THROWS_AS(
        run(fmt::format(R"("bodies": {{{}}}, {})",
                        column("H8", "linear", R"("probes": {"odd": {"set": "nowhere"}})"),
                        kOneStep)),
        InputError);
}

TEST_CASE("contacts of small sliding are reported where the bodies are now")
{
    // Two equal cubes, pressed together by 10 mm: their faces touch half-way.
    const std::string cube = R"("kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0,
        "mesh": {"generate": "box", "element": "H8", "size": [0.1, 0.1, 0.1], "cells": )";
    const Result r = done(R"("bodies": {"bed": {)" + cube +
                          R"([3, 3, 3], "centre": [0, 0, 0.05]}, "hold": [{"set": "z_min"}]},
        "tool": {)" + cube +
                          R"([2, 2, 2], "centre": [0, 0, 0.15]},
        "hold": [{"set": "z_max", "z": [[0, 0], [1, -0.01]]}]}},
        "contact": [{"between": ["tool", "bed"], "friction": 0.3, "sliding": "small"}], )" +
                          kOneStep);
    REQUIRE(!r.records.back().contacts.empty());
    for (const ContactRecord& c : r.records.back().contacts)
        CHECK(c.point.z() == doctest::Approx(0.095).epsilon(1e-9));
}

TEST_CASE("fields along a line are compared with a reference by their root mean square")
{
    // A pressed column without lateral strain: stress -p, displacement -p z / E.
    const std::string file = (std::filesystem::temp_directory_path() /
                              ("amontons_line_" + std::to_string(::getpid()) + ".csv"))
                                 .string();
    const auto errors = [&](const std::string& reference) {
        write_file(file, reference);
        Result r = run(fmt::format(
            R"("bodies": {{{}}}, {})",
            column("H8", "linear",
                   fmt::format(R"("hold": [{{"set": "z_min"}}], "loads": [{{"set": "z_max",
                       "traction": [0, 0, {}]}}], "probes": {{"axis": {{"line": {{
                       "from": [0.01, 0.02, 0], "to": [0.01, 0.02, 0.2], "reference": "{}"}}}}}})",
                               -kPressed, file)),
            kOneStep));
        REQUIRE(r.summary.status == "done");
        return r;
    };
    const Result exact = errors("s [m],stress_zz [Pa],displacement_z [m],von_mises\n"
                                "0,-1000,0,1000\n0.03,-1000,-3e-5,1000\n0.2,-1000,-2e-4,1000\n");
    CHECK(exact.value("column_axis_stress_zz_error") <= 1e-8);
    CHECK(exact.value("column_axis_displacement_z_error") <= 1e-8);
    CHECK(exact.value("column_axis_von_mises_error") <= 1e-8);
    // Weights 0.1, 0.2, 0.1: missed is 0.1 p^2, the reference has (0.1 + 0.2 + 4 * 0.1) p^2.
    const Result off = errors("s,stress_zz\n0,-1000\n0.1,-1000\n0.2,-2000\n");
    CHECK(off.value("column_axis_stress_zz_error") ==
          doctest::Approx(std::sqrt(0.1 / 0.7)).epsilon(1e-8));
    for (const char* wrong : {"s,stress_zz\n0,-1\n0.3,-1\n", "s,stress_zz\n0.1,-1\n0,-1\n",
                              "s,stres_zz\n0,1\n0.1,1\n", "s,stress_zz\n0,0\n0.1,0\n",
                              "s,stress_zz\n0,1\n", "s\n0\n0.1\n", "s,stress_zz\n0,\n0.1,1\n"}) {
        CAPTURE(wrong);
        CHECK_THROWS_AS(errors(wrong), InputError);
    }
    std::filesystem::remove(file);
}
