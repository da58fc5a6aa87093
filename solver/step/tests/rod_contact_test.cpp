// Laws of rods that touch; closed forms of single cases are in validation/cases.

#include "solver/step/pivot_method.hpp"
#include "solver/step/tests/body_runs.hpp"

#include "mesh/base/error.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;

namespace {

/// A rod of 0.2 m along x on the plane z = 0, pressed on it by 5 N/m, as stiff as can be, held
/// sideways; its start is drawn along x and turned about it over 1 s.
std::string dragged(double way, double angle, double step)
{
    return fmt::format(R"("bodies": {{
        "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
        "rod": {{"kind": "rod",
            "segments": [{{"length": 0.2, "radius": 0.002, "EI": 10, "EA": 1e6, "element": 0.01}}],
            "shape": {{"start": [0, 0, 0.002], "normal": [0, 0, 1]}},
            "hold": [{{"set": "start", "x": [[0, 0], [1, {}]], "y": [[0, 0], [1, 0]], "z": [[0, 0], [1, 0]],
                       "axis": [1, 0, 0], "angle": [[0, 0], [1, {}]]}},
                     {{"set": "end", "y": [[0, 0], [1, 0]], "turns": "free"}}],
            "loads": [{{"set": "all", "line": [0, 0, -5]}}]}}}},
        "contact": [{{"between": ["rod", "floor"], "friction": 0.3}}],
        "time": {{"step": {}, "end": 1}})",
                       way, angle, step);
}

/// A cantilever of 1 m whose middle a cylinder lifts by 0.1 m.
std::string lifted(double spacing, double friction)
{
    return fmt::format(R"("bodies": {{
        "roller": {{"kind": "rigid", "shape": {{"generate": "cylinder", "radius": 0.05, "length": 0.5}},
            "start": {{"place": [0.61, 0, -0.061], "turn": [1.5707963267948966, 0, 0]}},
            "drive": {{"z": [[0, 0], [1, 0.1]]}}}},
        "rod": {{"kind": "rod", "contact_spacing": {},
            "segments": [{{"length": 1, "radius": 0.01, "EI": 1, "EA": 1e5, "element": 0.05}}],
            "shape": {{"normal": [0, 0, 1]}}, "hold": [{{"set": "start"}}]}}}},
        "contact": [{{"between": ["rod", "roller"], "friction": {}}}],
        "time": {{"step": 0.1, "end": 1}})",
                       spacing, friction);
}

} // namespace

TEST_CASE("a rod's friction is one cone along and around it")
{
    const double r = 0.002;
    for (const auto& [way, angle] :
         {std::pair{0.01, 0.0}, {-0.01, 0.0}, {0.0, 0.5}, {0.00075, 0.5}, {0.0015, -0.5}}) {
        CAPTURE(way);
        CAPTURE(angle);
        const Result run_of = run(dragged(way, angle, 0.1));
        REQUIRE(run_of.summary.message == "");
        const double most = 0.3 * run_of.value("floor_on_rod_force_z");
        CHECK(most > 0.3 * 0.95); // what is held takes its share
        // Against the slip of the surface at the floor: (way, r angle) along x and y.
        const double slip = std::hypot(way, r * angle);
        CHECK(run_of.value("rod_start_force_x") ==
              doctest::Approx(most * way / slip).epsilon(1e-3));
        CHECK(run_of.value("rod_start_moment_x") ==
              doctest::Approx(most * r * r * angle / slip).epsilon(1e-3));
        // Friction is there at once, and the first step's work is by the trapezoid from no force.
        const Result finer = run(dragged(way, angle, 0.05));
        REQUIRE(finer.summary.message == "");
        CHECK(std::abs(run_of.summary.energy.error()) < 0.06 * run_of.summary.energy.work);
        CHECK(finer.summary.energy.error() ==
              doctest::Approx(0.5 * run_of.summary.energy.error()).epsilon(0.02));
    }
}

TEST_CASE("what a rod that is drawn over a ball takes from its hand friction takes from element to "
          "element")
{
    // The ball touches between the nodes too, and the contact wanders from one to the next.
    for (const double step : {0.02, 0.01}) {
        CAPTURE(step);
        const Result r = run(fmt::format(R"("bodies": {{
            "ball": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.002}},
                "start": {{"place": [0.08, 0, -0.0026]}},
                "drive": {{"x": 0, "y": 0, "z": [[0, 0], [0.2, 0.0021]]}}}},
            "rod": {{"kind": "rod",
                "segments": [{{"length": 0.15, "radius": 0.0005, "EI": 1e-3, "EA": 1e4,
                               "element": 0.005}}],
                "shape": {{"normal": [0, 0, 1]}},
                "hold": [{{"set": "start", "x": [[0, 0], [0.2, 0], [1, -0.04]], "y": [[0, 0]],
                           "z": [[0, 0]]}},
                         {{"set": "end", "y": [[0, 0]], "z": [[0, 0]], "turns": "free"}}]}}}},
            "contact": [{{"between": ["rod", "ball"], "friction": 0.3}}],
            "time": {{"step": {}, "end": 1}})",
                                         step));
        REQUIRE(r.summary.message == "");
        const EnergyRecord& e = r.summary.energy;
        CHECK(e.friction > 0.5 * e.work_absolute);
        CHECK(std::abs(e.error()) < 1e-3 * e.friction);
    }
}

TEST_CASE("more places that may touch do not change what a rod does and Newton's method is quick")
{
    for (const double friction : {0.0, 0.3}) {
        CAPTURE(friction);
        std::vector<double> lift, push;
        for (const double spacing : {0.0, 0.025, 0.0125}) {
            const Result r = run(lifted(spacing, friction));
            REQUIRE(r.summary.message == "");
            lift.push_back(r.value("roller_on_rod_force_z"));
            push.push_back(r.value("roller_on_rod_force_x"));
            CHECK(r.records.size() == 11);
            for (const StepRecord& s : r.records)
                CHECK(s.certificate.certified);
            CHECK(r.records.back().factorisations <= 8); // [regression] our own run
        }
        for (std::size_t i = 1; i < lift.size(); ++i) {
            CHECK(lift[i] ==
                  doctest::Approx(lift[0]).epsilon(2e-3)); // [regression] of these spacings
            CHECK(push[i] ==
                  doctest::Approx(push[0]).epsilon(1e-2)); // [regression] of these spacings
        }
    }
}

TEST_CASE("rods that cross at a tenth of a degree rub each other as quickly as at ninety")
{
    for (const double degrees : {90.0, 1.0, 0.1}) {
        const double a = degrees * 3.14159265358979323846 / 180, c = std::cos(a), s = std::sin(a);
        const auto rod = [](double x, double y, double z, double tx, double ty, const char* load) {
            return fmt::format(R"({{"kind": "rod", "plane": [{:.17g}, {:.17g}, 0],
                "segments": [{{"length": 1, "radius": 0.005, "EI": 0.5, "element": 0.0476190476}}],
                "shape": {{"start": [{:.17g}, {:.17g}, {}], "direction": [{:.17g}, {:.17g}, 0],
                           "normal": [0, 0, 1]}},
                "hold": [{{"set": "start", "turns": "free"}}, {{"set": "end", "turns": "free"}}]{}}})",
                               -ty, tx, x, y, z, tx, ty, load);
        };
        const Result r =
            run("\"bodies\": {\"lower\": " + rod(-0.5, 0, 0, 1, 0, "") + ", \"upper\": " +
                rod(-0.5 * c, -0.5 * s, 0.01, c, s,
                    R"(, "loads": [{"at": 0.5, "force": [0, 0, -1], "over": [[0, 0], [1, 1]]}])") +
                R"(}, "contact": [{"between": ["upper", "lower"], "friction": 0.3}],
               "time": {"step": 0.1, "end": 1})");
        CAPTURE(degrees);
        REQUIRE(r.summary.message == "");
        CHECK(r.value("lower_on_upper_normal_force") == doctest::Approx(0.5).epsilon(1e-3));
        int most = 0;
        for (const StepRecord& step : r.records)
            most = std::max(most, step.iterations);
        CHECK(most < 100); // [regression] our own run
    }
}

TEST_CASE("rods thrown at each other do not pass however long the step")
{
    for (const double h : {0.002, 0.02}) {
        CAPTURE(h);
        const Result r = run(fmt::format(R"("bodies": {{
            "fixed": {{"kind": "rod", "segments": [{{"length": 0.2, "radius": 0.002, "EI": 0.01,
                "element": 0.02, "density": 1000}}], "shape": {{"start": [-0.1, 0, 0]}},
                "hold": [{{"set": "start"}}, {{"set": "end"}}]}},
            "thrown": {{"kind": "rod", "segments": [{{"length": 0.1, "radius": 0.002, "EI": 0.01,
                "element": 0.02, "density": 1000}}],
                "shape": {{"start": [0.013, -0.05, 0.03], "direction": [0, 1, 0]}},
                "velocity": [0, 0, -3]}}}},
            "contact": [{{"between": ["*", "*"]}}],
            "time": {{"kind": "dynamic", "step": {}, "end": 0.04}})",
                                         h));
        REQUIRE(r.summary.message == "");
        CHECK(r.value("thrown_end_z") > 0.003);
    }
}

TEST_CASE("rods that begin in each other are refused for no contact would hold them apart")
{
    const char* rod = R"({"kind": "rod", "hold": [{"set": "start"}], "shape": {"start": [0, 0, %]},
        "segments": [{"length": 1, "radius": 0.01, "EI": 1, "element": 0.1}]})";
    const auto at = [&](const char* z) {
        std::string text = rod;
        return text.replace(text.find('%'), 1, z);
    };
    const auto issue = [&](const char* z) {
        try {
            run("\"bodies\": {\"one\": " + at("0") + ", \"other\": " + at(z) +
                R"(}, "contact": [{"between": ["one", "other"]}], "time": {"step": 1, "end": 1})");
        } catch (const InputError& error) {
            return error.issues().at(0).found;
        }
        return std::string();
    };
    CHECK(issue("0").find("one and other overlap by ") == 0);
    CHECK(issue("0.009") != "");
    CHECK(issue("0.02") == "");
}

TEST_CASE("what rods cannot touch is reported")
{
    const auto issues = [](const std::string& contact, const std::string& more = "") {
        try {
            run(R"("bodies": {
                "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
                "block": {"kind": "solid", "mesh": {"generate": "box", "size": [1, 1, 1],
                    "cells": [1, 1, 1]}, "youngs_modulus": 1e5, "poisson_ratio": 0.3},
                "rod": {"kind": "rod", )" +
                more + R"("segments": [{"length": 1, "radius": 0.01, "EI": 1,
                    "element": 0.1}], "hold": [{"set": "start"}]}},
                "time": {"step": 1, "end": 1}, "contact": [)" +
                contact + "]");
        } catch (const InputError& error) {
            std::string all;
            for (const Issue& i : error.issues())
                all += i.place + ": " + i.found + ", allowed: " + i.allowed + "\n";
            return all;
        }
        return std::string();
    };
    CHECK(issues(R"({"between": ["rod", "block"], "surfaces": ["middle", ""]})")
              .find("/contact/0/surfaces/0: \"middle\", allowed: \"\" (all of the rod)") !=
          std::string::npos);
    CHECK(issues(R"({"between": ["rod", "floor"], "surfaces": ["middle", ""]})")
              .find("/contact/0/surfaces/0: \"middle\", allowed: \"\" (all of the rod)") !=
          std::string::npos);
    CHECK(issues(R"({"between": ["block", "block"]})").find("a body and itself") !=
          std::string::npos);
    CHECK(issues(R"({"between": ["rod", "floor"]})", R"("contact_spacing": 1e-9, )") ==
          "/bodies/rod/contact_spacing: 1e-09, allowed: >= 1e-06 [m]\n");
}

TEST_CASE("a rod that a step would take through a thin plate is stopped by it")
{
    const Result r = run(R"("bodies": {
        "plate": {"kind": "rigid", "shape": {"generate": "box", "size": [0.2, 0.2, 0.004]},
          "start": {"place": [0.7, 0, -0.062]}, "drive": {"z": [[0, 0], [1, 0]]}},
        "rod": {"kind": "rod", "segments": [{"length": 1, "radius": 0.01, "EI": 1, "EA": 1e5, "element": 0.05}],
          "shape": {"normal": [0, 0, 1]},
          "hold": [{"set": "start", "x": 0, "y": 0, "z": [[0, 0], [1, -0.2]]}]}},
        "contact": [{"between": ["rod", "plate"]}], "time": {"step": 1, "end": 1})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    int over = 0; // nodes over the plate, on its upper side
    for (const Vec3& x : r.records.back().beams.at(0).points) {
        if (std::abs(x.x() - 0.7) > 0.09) continue;
        CHECK(x.z() > -0.0501);
        ++over;
    }
    CHECK(over >= 3);
    double force = 0;
    for (const ContactRecord& c : r.records.back().contacts)
        force += c.normal_force;
    CHECK(force > 0);
}

TEST_CASE("a free rod that falls on a ball between two of its nodes does not pass it")
{
    const Result r = run(R"("bodies": {
        "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01},
          "start": {"place": [0.45, 0, -0.065]}, "drive": {"z": [[0, 0], [1, 0]]}},
        "rod": {"kind": "rod", "segments": [{"length": 1, "radius": 0.005, "EI": 1, "EA": 1e5, "element": 0.1,
          "density": 1000}], "shape": {"normal": [0, 0, 1]}, "velocity": [0, 0, -10]}},
        "contact": [{"between": ["rod", "ball"]}],
        "time": {"kind": "dynamic", "step": 0.01, "end": 0.02})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    double nearest = 1;
    for (const StepRecord& s : r.records)
        for (const ContactRecord& c : s.contacts)
            nearest = std::min(nearest, c.gap);
    CHECK(nearest < 1e-3); // it is found
    // The middle line at the ball's place stays above it.
    const BeamRecord& rod = r.records.back().beams.at(0);
    double z = -1;
    for (std::size_t i = 0; i + 1 < rod.points.size(); ++i)
        if (rod.points[i].x() <= 0.45 && rod.points[i + 1].x() >= 0.45)
            z = std::max(rod.points[i].z(), rod.points[i + 1].z());
    CHECK(z > -0.065);
}

TEST_CASE("a cylinder that turns beneath a rod or takes it along is not passed")
{
    // Along the cylinder's top. A place at rest takes a straight way of space, one that is taken
    // along a straight way of the cylinder's frame: the other one is 1.6 radii inside.
    const double R = 0.05, r = 0.001, turn = 0.5;
    for (const double taken : {0.0, turn}) {
        CAPTURE(taken);
        const Result run_of = run(fmt::format(
            R"("bodies": {{
            "roller": {{"kind": "rigid", "shape": {{"generate": "cylinder", "radius": {}, "length": 0.5}},
              "start": {{"turn": [1.5707963267948966, 0, 0]}},
              "drive": {{"axis": [0, 1, 0], "angle": [[0, 0], [1, {}]]}}}},
            "rod": {{"kind": "rod",
              "segments": [{{"length": 0.1, "radius": {}, "EI": 1, "EA": 1e5, "element": 0.01}}],
              "shape": {{"start": [0, -0.05, {}], "direction": [0, 1, 0], "normal": [0, 0, 1]}},
              "hold": [{{"set": "start", "x": [[0, 0], [1, {}]], "y": 0, "z": [[0, 0], [1, {}]],
                         "axis": [0, 1, 0], "angle": [[0, 0], [1, {}]]}}]}}}},
            "contact": [{{"between": ["rod", "roller"]}}], "time": {{"step": 1, "end": 1}})",
            R, turn, r, R + r, (R + r) * std::sin(taken), (R + r) * (std::cos(taken) - 1), taken));
        REQUIRE_MESSAGE(run_of.summary.status == "done", run_of.summary.message);
        CHECK(run_of.records.size() == 2);
        CHECK(run_of.records.back().retries == 0);
    }
}

TEST_CASE("a rod as thin as can be costs no more to watch than a thick one")
{
    // One place a radius would be a hundred million.
    const Result r = run(R"("bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01},
          "start": {"place": [0.5, 0, 0.1]}, "drive": {"z": [[0, 0], [1, 0]]}},
        "rod": {"kind": "rod", "segments": [{"length": 1, "radius": 1e-8, "EI": 1, "EA": 1e5,
          "element": 0.1, "density": 1e17}], "shape": {"start": [0, 0, 0.3], "normal": [0, 0, 1]},
          "velocity": [0, 0, -5]}},
        "contact": [{"between": ["*", "*"]}],
        "time": {"kind": "dynamic", "step": 0.01, "end": 0.03})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    CHECK(r.value("rod_end_z") == doctest::Approx(0.15).epsilon(1e-9));
}

namespace {

/// Wires of 20 elements beside each other, each crossed by one that is pressed on five of them.
std::string woven(int rows)
{
    std::string bodies;
    for (int j = 0; j < rows; ++j)
        bodies += fmt::format(
            R"({}"low{}": {{"kind": "rod",
                "segments": [{{"length": 0.1, "radius": 2.5e-4, "EI": 6e-4, "element": 0.005}}],
                "shape": {{"start": [0, {}, 0], "normal": [0, 0, 1]}},
                "hold": [{{"set": "start"}}, {{"set": "end", "turns": "free"}}]}},
            "up{}": {{"kind": "rod",
                "segments": [{{"length": 0.094, "radius": 2.5e-4, "EI": 6e-4, "element": 0.0047}}],
                "shape": {{"start": [{}, {}, 5.2e-4], "direction": [0, 1, 0], "normal": [0, 0, 1]}},
                "hold": [{{"set": "start"}}],
                "loads": [{{"at": 0.0329, "force": [0, 0, -1], "over": [[0, 0], [1, 0.05]]}},
                          {{"at": 0.0705, "force": [0, 0, -1], "over": [[0, 0], [1, 0.05]]}}]}})",
            j > 0 ? ", " : "", j, 0.02 * j, j, 0.02 * (j % 5 + 0.5), 0.02 * j - 0.014);
    return "\"bodies\": {" + bodies + R"(},
        "contact": [{"between": ["*", "*"], "friction": 0.1}], "time": {"step": 0.125, "end": 1})";
}

} // namespace

TEST_CASE("places that many wires touch at are settled beside each other and not one by one" *
          doctest::test_suite("slow"))
{
    const Result few = run(woven(8)), many = run(woven(40));
    REQUIRE(few.summary.status == "done");
    REQUIRE(many.summary.status == "done");
    CHECK(many.summary.contacts_max > 4 * few.summary.contacts_max);
    const auto factors = [](const Result& r) {
        int sum = 0;
        for (const StepRecord& step : r.records)
            sum += step.iterations;
        return sum;
    };
    CHECK(factors(many) < 4 * factors(few)); // of five times the wires
}

TEST_CASE("trials of statuses that come round again are found the first time")
{
    // Two on their way to a circle of five, each with a slip direction of its own.
    const auto tried = [](int k) {
        std::vector<Trial> t(3);
        t[0].status = k < 2 ? 1 : 2;
        t[1].status = 2;
        t[1].c1 = std::cos(0.1 * (k < 2 ? k : 2 + (k - 2) % 5));
        t[1].c2 = std::sin(0.1 * (k < 2 ? k : 2 + (k - 2) % 5));
        return t;
    };
    pivoting::CircleFinder circle;
    for (int k = 0; k < 7; ++k) {
        CAPTURE(k);
        CHECK(!circle.closed_by(tried(k), 0));
    }
    CHECK(circle.closed_by(tried(7), 0));
    CHECK(!circle.closed_by(tried(7), 1)); // the matrix is another one
}

TEST_CASE("where balances end a rod snaps and what that releases is counted")
{
    // An arch between two clamps, loaded in the middle past its limit: the balance beyond is that
    // at which the path of balances arrives, through loads that fall and rise again.
    const auto arch = [](const char* time, const char* floor, const char* contact) {
        return fmt::format(R"("bodies": {{ {}
            "arch": {{"kind": "rod", "plane": [0, 0, 1],
                "segments": [{{"length": 0.4, "radius": 0.001, "EI": 1, "EA": 4e6, "element": 0.01,
                               "curvature": -4}}],
                "shape": {{"direction": [0.6967067093471654, 0.7173560908995228, 0],
                           "normal": [-0.7173560908995228, 0.6967067093471654, 0]}},
                "hold": [{{"set": "start"}}, {{"set": "end"}}],
                "loads": [{{"at": 0.2, "force": [0, -600, 0], "over": [[0, 0], [1, 1]]}}]}} }},
            "contact": [{}], "time": {{"step": 0.05, "end": 1, {}}})",
                           floor, contact, time);
    };
    const Result path = run(arch(R"("path": 0.002)", "", ""));
    REQUIRE(path.summary.message == "");
    const Result snap = run(arch(R"("smallest_step": 0.05)",
                                 R"("floor": {"kind": "obstacle", "surface": {"generate": "plane",
                                     "centre": [0, -1, 0], "axis": [0, 1, 0]}},)",
                                 R"({"between": ["arch", "floor"]})"));
    REQUIRE(snap.summary.message == "");
    CHECK(snap.value("arch_start_force_x") ==
          doctest::Approx(path.value("arch_start_force_x")).epsilon(1e-6));
    CHECK(snap.summary.energy.elastic ==
          doctest::Approx(path.summary.energy.elastic).epsilon(1e-6));
    const EnergyRecord& e = snap.summary.energy;
    CHECK(e.released > 0.2 * e.elastic); // [regression] our own run
    CHECK(std::abs(e.error()) < 0.005 * e.released);
    CHECK(std::abs(path.summary.energy.error()) < 0.005 * e.released); // falling loads take it back
}

TEST_CASE("what has not come out of a sheath is held: a cantilever as long as what has")
{
    // 0.5 m straight; the sheath's end is at the origin, 0.02 m before a wall that the rest of the
    // wire leads through.
    const auto fed = [](const char* way, double load) {
        return fmt::format(R"("bodies": {{
            "back": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [-0.02, 0, 0],
                                                     "axis": [1, 0, 0]}}}},
            "front": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [0.302, 0, 0],
                                                      "axis": [-1, 0, 0]}}}},
            "wire": {{"kind": "rod", "segments": [{{"length": 0.5, "radius": 0.002, "EI": 1,
                                                  "EA": 1e6, "element": 0.01}}],
                "shape": {{"start": [-0.4, 0, 0], "normal": [0, 0, 1]}}, "fed": {},
                "loads": [{{"set": "all", "line": [0, 0, {}]}}]}}}},
            "contact": [{{"between": ["wire", "back"]}}, {{"between": ["wire", "front"]}}],
            "time": {{"step": 0.1, "end": 1}})",
                           way, load);
    };
    const double q = 0.01;
    for (const auto& [way, out] : {std::pair{"[[0, 0.1], [1, 0.1]]", 0.1},
                                   {"[[0, 0.1], [1, 0.2]]", 0.2},
                                   {"[[0, 0.1], [0.5, 0.25], [1, 0.15]]", 0.15}}) {
        CAPTURE(out);
        const Result r = run(fed(way, -q));
        REQUIRE(r.summary.message == "");
        CHECK(r.value("wire_end_x") == doctest::Approx(out).epsilon(1e-6));
        CHECK(r.value("wire_end_z") == doctest::Approx(-q * std::pow(out, 4) / 8).epsilon(1e-4));
        CHECK(std::abs(r.value("wire_push_force")) < 1e-5);
    }
    // On the wall in front: a bar from there to its base.
    const Result pressed = run(fed("[[0, 0.1], [1, 0.300001]]", 0));
    REQUIRE(pressed.summary.message == "");
    CHECK(pressed.value("wire_push_force") == doctest::Approx(1e6 * 1e-6 / 0.5).epsilon(1e-4));
}

TEST_CASE("a sheath is pushed back by what bends at its end and by half its square over EI" *
          doctest::test_suite("slow"))
{
    // Bent by an end load across: M = F x of the end. Straight wire, and one of natural curvature
    // that the sheath holds straight: there (M + EI k)^2 / (2 EI).
    for (const double curvature : {0.0, 2.0})
        for (const char* way : {"[[0, 0.8], [1, 0.8]]", "[[0, 0.7], [1, 0.8]]"}) {
            CAPTURE(curvature);
            CAPTURE(way);
            const Result r = run(fmt::format(R"("bodies": {{
                "floor": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [0, 0, -5]}}}},
                "rod": {{"kind": "rod", "plane": [0, 0, 1],
                    "segments": [{{"length": 2, "radius": 0.001, "EI": 0.5, "EA": 1e7, "element": 0.02,
                                  "curvature": {}}}],
                    "shape": {{"points": [{{"at": [-1.2, 0, 0]}}, {{"at": [0.8, 0, 0]}}],
                              "normal": [0, 1, 0], "stress_free": false}}, "fed": {},
                    "loads": [{{"set": "end", "force": [0, -0.6, 0], "over": [[0, 0], [1, 1]]}}]}}}},
                "contact": [{{"between": ["rod", "floor"]}}], "time": {{"step": 0.05, "end": 1}})",
                                             curvature, way));
            REQUIRE(r.summary.message == "");
            // From the sheath's end: the first shape's end less what is out at first.
            const double x = r.value("rod_end_x") - (std::string(way).find("0.7") < 9 ? 0.1 : 0);
            const double M = 0.5 * curvature - 0.6 * x;
            CHECK(r.value("rod_push_force") == doctest::Approx(-M * M).epsilon(1e-3));
            CHECK(std::abs(r.summary.energy.error()) < 2e-3 * r.summary.energy.work_absolute);
        }
}

TEST_CASE("a rod pushed out of a sheath against a clamp is an elastica between inflection points")
{
    // Slope a at the inflection points, k = sin(a / 2): free length l with d / l = 2 E / K - 1,
    // thrust P = EI (4 K / l)^2, push P cos(a). Source: Bosi, Misseroni, Dal Corso & Bigoni 2015.
    for (const auto& [degrees, longer] :
         {std::pair{20.0, 1.0312}, {45.0, 1.1756}, {90.0, 2.1884}}) {
        CAPTURE(degrees);
        const double a = degrees * std::numbers::pi / 180, k = std::sin(0.5 * a);
        const double K = std::comp_ellint_1(k), E = std::comp_ellint_2(k);
        const double l = 1 / (2 * E / K - 1), P = std::pow(4 * K / l, 2);
        CHECK(l == doctest::Approx(longer).epsilon(1e-4));
        const Result r = run(fmt::format(R"("bodies": {{
            "floor": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [0, 0, -5]}}}},
            "rod": {{"kind": "rod", "plane": [0, 0, 1],
                "segments": [{{"length": 4, "radius": 0.001, "EI": 1, "EA": 1e7, "element": 0.05}}],
                "shape": {{"points": [{{"at": [-3, 0, 0]}}, {{"at": [1, 0, 0]}}]}},
                "fed": [[0, 1], [0.1, 1.001], [1, {:.12g}]], "hold": [{{"set": "end"}}],
                "loads": [{{"set": "all", "line": [0, 20, 0], "over": [[0, 1], [0.2, 1], [0.5, 0]]}}]}}}},
            "contact": [{{"between": ["rod", "floor"]}}], "time": {{"step": 0.005, "end": 1}})",
                                         l));
        REQUIRE(r.summary.message == "");
        CHECK(std::abs(r.value("rod_end_force_x")) == doctest::Approx(P).epsilon(2e-3));
        CHECK(std::abs(r.value("rod_push_force") - P * std::cos(a)) < 2e-3 * P);
        CHECK(std::abs(r.summary.energy.error()) < 1e-2 * r.summary.energy.work_absolute);
    }
}

TEST_CASE("a rope hangs as an elastic catenary however small its bending stiffness" *
          doctest::test_suite("slow"))
{
    // Of 1 m and 10 N, its ends drawn to this span. Source of both closed forms: Irvine 1981, Cable
    // Structures, section 1.3.
    const double weight = 10;
    const auto hang = [&](int elements, double span, double EA, double slender) {
        double low = 1e-8, high = 1e3 * (weight + EA);
        for (int i = 0; i < 200; ++i) {
            const double H = std::sqrt(low * high);
            (2 * H / weight * std::asinh(weight / (2 * H)) + H / EA < span ? low : high) = H;
        }
        const double H = low, V = 0.5 * weight, EI = H / (elements * elements * slender);
        const Result r = run(fmt::format(R"("bodies": {{
            "floor": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [0, 0, -5]}}}},
            "rope": {{"kind": "rod", "plane": [0, 1, 0],
                "segments": [{{"length": 1, "radius": 0.001, "EI": {0}, "EA": {1}, "element": {2}}}],
                "shape": {{"normal": [0, 0, 1]}},
                "hold": [{{"set": "start", "turns": "free"}},
                         {{"set": "end", "turns": "free", "x": [[0, 0], [1, {3}]], "y": 0, "z": 0}}],
                "loads": [{{"set": "all", "line": [0, 0, {4}]}}, {{"at": 0.5, "force": [0, 0, 0]}}]}}}},
            "contact": [{{"between": ["rope", "floor"]}}], "time": {{"step": 0.25, "end": 1}})",
                                         EI, EA, 1.0 / elements, span - 1, -weight));
        REQUIRE(r.summary.message == "");
        CHECK(r.value("rope_end_force_x") == doctest::Approx(H).epsilon(2e-3));
        CHECK(-r.value("rope_0.5_z") ==
              doctest::Approx((std::hypot(H, V) - H) / weight + V * V / (2 * weight * EA))
                  .epsilon(2e-3));
        CHECK(r.value("rope_negative") == 0);
    };
    for (const int elements : {40, 120})
        for (const double slender : {1e2, 1e4, 1e6, 1e8})
            for (const auto& [span, EA] :
                 {std::pair{1.02, 1e3}, {1.0, 1e3}, {1.0, 1e5}, {0.9, 1e4}, {0.5, 1e4}}) {
                CAPTURE(elements);
                CAPTURE(slender);
                CAPTURE(span);
                CAPTURE(EA);
                hang(elements, span, EA, slender);
            }
}

TEST_CASE("a rope's sag converges with the second power of the element at least whether bending "
          "counts or not")
{
    const auto sag = [](int elements, double EI) {
        const Result r = run(fmt::format(R"("bodies": {{
            "floor": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [0, 0, -5]}}}},
            "rope": {{"kind": "rod", "plane": [0, 1, 0],
                "segments": [{{"length": 1, "radius": 0.001, "EI": {}, "EA": 1e4, "element": {}}}],
                "shape": {{"normal": [0, 0, 1]}},
                "hold": [{{"set": "start", "turns": "free"}}, {{"set": "end", "turns": "free"}}],
                "loads": [{{"set": "all", "line": [0, 0, -10]}}, {{"at": 0.5, "force": [0, 0, 0]}}]}}}},
            "contact": [{{"between": ["rope", "floor"]}}], "time": {{"step": 1, "end": 1}})",
                                         EI, 1.0 / elements));
        REQUIRE(r.summary.message == "");
        return -r.value("rope_0.5_z");
    };
    // The pull is 35 N where nothing bends: pull h^2 / EI from 6e-6 to 6e4 with 40 elements.
    for (const double slender : {1e-4, 1e-2, 1.0, 1e2, 1e6}) {
        CAPTURE(slender);
        const double EI = 35 / (100 * slender);
        const double exact = sag(320, EI), coarse = sag(40, EI), half = sag(80, EI);
        CHECK(std::abs(coarse - exact) < 1e-5 * exact);
        CHECK((std::abs(half - exact) < 1e-8 * exact ||
               std::log2(std::abs(coarse - exact) / std::abs(half - exact)) > 1.8));
    }
}

TEST_CASE("a frictionless force between rods is along their normal where the step ends")
{
    // Two rods that cross, one drawn through the other's middle and to the side.
    const Result r = run(R"("bodies": {
        "a": {"kind": "rod", "segments": [{"length": 0.4, "radius": 0.005, "EI": 1, "EA": 1e5,
                                           "element": 0.02}],
            "shape": {"start": [-0.2, 0, 0]}, "hold": [{"set": "start"}, {"set": "end"}]},
        "b": {"kind": "rod", "segments": [{"length": 0.4, "radius": 0.005, "EI": 1, "EA": 1e5,
                                           "element": 0.02}],
            "shape": {"start": [0.02, -0.2, 0.0101], "direction": [0, 1, 0]},
            "hold": [{"set": "start", "x": [[0, 0], [1, 0.05]], "z": [[0, 0], [1, -0.05]],
                      "y": [[0, 0], [1, 0]]},
                     {"set": "end", "x": [[0, 0], [1, -0.03]], "z": [[0, 0], [1, -0.02]],
                      "y": [[0, 0], [1, 0]]}]}},
        "contact": [{"between": ["a", "b"]}], "time": {"step": 0.1, "end": 1})");
    REQUIRE(r.summary.message == "");
    int pressed = 0;
    for (const StepRecord& step : r.records)
        for (const ContactRecord& c : step.contacts) {
            if (!(c.force.norm() > 0)) continue;
            ++pressed;
            CHECK((c.force - c.normal.dot(c.force) * c.normal).norm() < 1e-12 * c.force.norm());
        }
    CHECK(pressed > 5);
}

TEST_CASE("a rod sinks through a medium as fast as its weight over the drag and that is released")
{
    const Result r = run(R"("bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane", "centre": [0, 0, -5]}},
        "rod": {"kind": "rod", "drag": 4,
            "segments": [{"length": 0.2, "radius": 0.002, "EI": 10, "EA": 1e6, "element": 0.01}],
            "hold": [{"set": "start", "x": [[0, 0], [1, 0]], "y": [[0, 0], [1, 0]]}],
            "loads": [{"set": "all", "line": [0, 0, -2]}]}},
        "contact": [{"between": ["rod", "floor"]}], "time": {"step": 0.1, "end": 1})");
    REQUIRE(r.summary.message == "");
    CHECK(r.value("rod_end_z") == doctest::Approx(-0.5).epsilon(1e-3));
    CHECK(r.summary.energy.work == doctest::Approx(0.2).epsilon(1e-3));
    CHECK(std::abs(r.summary.energy.error()) < 1e-3 * r.summary.energy.work);
}

TEST_CASE("a rod in a medium begins at rest on a floor that it touches at all of 200 elements")
{
    // All places carry the same: each trial of the states corrects one of them.
    const Result r = run(R"("bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "rod": {"kind": "rod", "drag": 0.02,
            "segments": [{"length": 20, "radius": 0.001, "EI": 0.15, "EA": 6e5, "element": 0.1}],
            "shape": {"start": [0, 0, 0.001]}, "hold": [{"set": "start", "x": [[0, 0], [1, 0]],
                                                         "y": [[0, 0], [1, 0]]}],
            "loads": [{"set": "all", "line": [0, 0, -0.25]}]}},
        "contact": [{"between": ["rod", "floor"]}], "time": {"step": 0.02, "end": 0.04})");
    REQUIRE(r.summary.message == "");
    REQUIRE(r.records.size() == 3);
    for (const StepRecord& step : r.records) {
        double force = 0;
        for (const ContactRecord& c : step.contacts)
            force += c.normal_force;
        // The medium, which holds the rod where it begins, bears a hundredth of it there.
        CHECK(force == doctest::Approx(0.25 * 20).epsilon(step.time > 0 ? 1e-6 : 0.02));
    }
}

TEST_CASE("in a medium a rod snaps in its own time and no step is made up")
{
    // The arch of the test before, drawn instead of loaded: work is what is elastic or released.
    const Result r = run(R"("bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane", "centre": [0, -1, 0],
                                                   "axis": [0, 1, 0]}},
        "arch": {"kind": "rod", "plane": [0, 0, 1], "drag": 100,
            "segments": [{"length": 0.4, "radius": 0.001, "EI": 1, "EA": 4e6, "element": 0.01,
                          "curvature": -4}],
            "shape": {"direction": [0.6967067093471654, 0.7173560908995228, 0],
                      "normal": [-0.7173560908995228, 0.6967067093471654, 0]},
            "hold": [{"set": "start"}, {"set": "end"}],
            "loads": [{"at": 0.2, "force": [0, -600, 0], "over": [[0, 0], [1, 1], [3, 1]]}]}},
        "contact": [{"between": ["arch", "floor"]}],
        "time": {"step": 0.02, "end": 1.5, "smallest_step": 1e-6})");
    REQUIRE(r.summary.message == "");
    CHECK(r.value("arch_0.2_y") < 0);
    const EnergyRecord& e = r.summary.energy;
    CHECK(e.released > 0.1 * e.work);               // [regression] our own run
    CHECK(std::abs(e.error()) < 3e-2 * e.released); // [regression] our own run
    for (const StepRecord& step : r.records)
        CHECK(step.remark.find("snapped") == std::string::npos);
}

TEST_CASE("a strip pinned on a table is turned against friction's moment about the pin")
{
    // Drawn aside at its end by more than it bends: the whole of it slides. A hinge keeps it from
    // rolling, mu w L / 2; a round strip on a pin rolls about itself until friction has no torque
    // on it, so that one half slides one way and one the other, mu w L / 4. Of n elements, whose
    // nodes rub, the latter is (1 - 1 / n) mu w L / 4.
    const double L = 0.3, r = 0.002, density = 3000, mu = 0.3, n = 40;
    const double weight = density * std::numbers::pi * r * r * kGravity;
    for (const bool rolls : {false, true}) {
        CAPTURE(rolls);
        const double aside = rolls ? 1e-4 : 0.03; // rolling on takes many pivots
        const Result d = done(fmt::format(
            R"("bodies": {{{}, "strip": {{"kind": "rod", "segments": [{{"length": 0.3,
                "radius": 0.002, "EI": 10, "element": 0.0075, "density": 3000}}],
                "shape": {{"start": [0, 0, 0.002]}}, "hold": [{{"set": "start", "turns": "{}"}},
                {{"set": "end", "y": [[0, 0], [1, {}]], "turns": "free"}}]}}}},
                "contact": [{{"between": ["strip", "floor"], "friction": 0.3}}],
                "gravity": [0, 0, -9.81], "time": {{"step": {}, "end": 1}})",
            kFloor, rolls ? "free" : "about", aside, rolls ? 1.0 : 0.1));
        const double force = rolls ? (1 - 1 / n) * mu * weight * L / 4
                                   : mu * weight * L / 2 / std::cos(std::asin(aside / L));
        CHECK(d.value("strip_end_force_y") == doctest::Approx(force).epsilon(rolls ? 0.01 : 1e-3));
        CHECK(d.summary.energy.friction > 0);
    }
}

TEST_CASE("a belt round a pulley that turns and one that does not is pulled as Euler states" *
          doctest::test_suite("slow"))
{
    // No hold: pulleys alone carry the belt. It slides on the one that stands, creeps on the other.
    const auto pulley = [](const char* name, double x, const char* drive) {
        return fmt::format(R"("{}": {{"kind": "rigid", "shape": {{"generate": "cylinder",
            "radius": 0.03, "length": 0.04}}, "start": {{"place": [{}, 0, 0],
            "turn": [1.5707963267948966, 0, 0]}}, "drive": {{{}}}}},)",
                           name, x, drive);
    };
    const Result d = done(fmt::format(
        R"("bodies": {{{} {} "belt": {{"kind": "rod", "plane": [0, 1, 0], "segments": [{{
            "length": 0.6010619, "radius": 0.002, "EI": 1e-4, "EA": 2000, "element": 0.006}}],
            "shape": {{"curve": {{"pieces": [{{"length": 0.2}},
                {{"radius": 0.032, "angle": 3.141592653589793}}, {{"length": 0.2}},
                {{"radius": 0.032, "angle": 3.141592653589793}}], "start": [0, 0, 0.032],
                "direction": [1, 0, 0], "normal": [0, 0, -1]}}, "closed": true}}}}}},
            "contact": [{{"between": ["belt", "turned"], "friction": 0.3}},
                        {{"between": ["belt", "other"], "friction": 0.3}}],
            "time": {{"step": 0.05, "end": 2}})",
        pulley("turned", 0, R"("axis": [0, 1, 0], "angle": [[0, 0], [1, 0], [2, 0.2]])"),
        pulley("other", 0.2, R"("x": [[0, 0], [1, 0.001]])")));
    CHECK(d.records.size() == 41); // the requested steps
    const std::size_t end = d.records.size() - 1;
    const double torque =
        (d.records[end].energy.work - d.records[end - 1].energy.work) / (0.05 * 0.2);
    const double both = -d.value("turned_on_belt_force_x");
    const double ratio = std::exp(0.3 * std::numbers::pi * 0.03 / 0.032);
    CHECK(torque == doctest::Approx(0.032 * both * (ratio - 1) / (ratio + 1)).epsilon(0.01));
}

TEST_CASE("a rope over two drums that nothing else keeps from turning is pulled as a belt" *
          doctest::test_suite("slow"))
{
    // The rope's middle line runs at R + r, friction acts at R.
    const double R = 0.03, r = 0.002, mu = 0.3;
    const auto drum = [](const char* name, double x) {
        return fmt::format(R"("{}": {{"kind": "obstacle", "surface": {{"generate": "cylinder",
            "radius": 0.03, "centre": [{}, 0, 0], "axis": [0, 1, 0]}}}},)",
                           name, x);
    };
    const Result d = done(fmt::format(
        R"("bodies": {{{} {} "rope": {{"kind": "rod", "segments": [{{"length": 0.4999996,
            "radius": 0.002, "EI": 1e-5, "EA": 1e5, "element": 0.004}}],
            "shape": {{"curve": {{"pieces": [{{"length": 0.0997345}},
                {{"radius": 0.032, "angle": 1.5707963267948966}}, {{"length": 0.2}},
                {{"radius": 0.032, "angle": 1.5707963267948966}}, {{"length": 0.0997345}}],
                "start": [-0.032, 0, -0.0997345], "direction": [0, 0, 1], "normal": [1, 0, 0]}}}},
            "hold": [{{"set": "start", "x": 0, "y": 0, "z": [[0, 0], [1, -0.002], [2, -0.01]],
                       "turns": "free"}}],
            "loads": [{{"set": "end", "force": [0, 0, -10], "over": [[0, 0], [1, 1]]}}]}}}},
            "contact": [{{"between": ["rope", "left"], "friction": 0.3}},
                        {{"between": ["rope", "right"], "friction": 0.3}}],
            "time": {{"step": 0.05, "end": 2}})",
        drum("left", 0), drum("right", 0.2)));
    CHECK(-d.value("rope_start_force_z") ==
          doctest::Approx(10 * std::exp(mu * std::numbers::pi * R / (R + r))).epsilon(3e-3));
}

TEST_CASE(
    "what nothing holds of a rod in a groove stays where it is, is reported and takes no load")
{
    const auto groove = [](double friction, const char* load) {
        return fmt::format(
            R"("bodies": {{"left": {{"kind": "obstacle", "surface": {{"generate": "plane",
                "axis": [0, 1, 1]}}}}, "right": {{"kind": "obstacle", "surface": {{
                "generate": "plane", "axis": [0, -1, 1]}}}}, "rod": {{"kind": "rod", "segments": [{{
                "length": 0.3, "radius": 0.002, "EI": 0.01, "element": 0.015, "density": 3000}}],
                "shape": {{"start": [0, 0, 0.00282842712474619]}}, "loads": [{}]}}}},
                "contact": [{{"between": ["rod", "left"], "friction": {}}},
                            {{"between": ["rod", "right"], "friction": {}}}],
                "gravity": [0, 0, -9.81], "time": {{"step": 0.25, "end": 1}})",
            load, friction, friction);
    };
    const auto reported = [](const Result& r) {
        for (const std::string& w : r.summary.warnings)
            if (w.find("nothing holds rod: ") != w.npos) return true;
        return false;
    };
    const double weight = 3000 * std::numbers::pi * 4e-6 * 0.3 * kGravity;
    const Result slick = done(groove(0, "")), rough = done(groove(0.3, ""));
    for (const Result* r : {&slick, &rough}) {
        CHECK(r->value("left_on_rod_force_z") == doctest::Approx(0.5 * weight).epsilon(1e-7));
        CHECK(r->value("rod_max_displacement") < 1e-8);
    }
    CHECK(reported(slick));
    CHECK(!reported(rough)); // two contacts a cross-section: it can neither roll nor slide

    // Friction bears a push along and a torque about the rod; nothing else does.
    const char* push = R"({"set": "end", "force": [0.01, 0, 0], "over": [[0, 0], [1, 1]]})";
    const char* torque = R"({"set": "end", "moment": [1e-5, 0, 0], "over": [[0, 0], [1, 1]]})";
    const Result pushed = done(groove(0.3, push)), twisted = done(groove(0.3, torque));
    CHECK(pushed.value("left_on_rod_force_x") + pushed.value("right_on_rod_force_x") ==
          doctest::Approx(-0.01).epsilon(1e-6));
    CHECK(twisted.value("rod_max_displacement") < 1e-6);
    for (const char* load : {push, torque})
        CHECK(run(groove(0, load)).summary.message != "");
}
