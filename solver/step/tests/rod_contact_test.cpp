// Laws of rods that touch; closed forms of single cases are in validation/cases.

#include "solver/step/tests/body_runs.hpp"

#include "mesh/base/error.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>

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

TEST_CASE("what rods cannot touch is said")
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
    CHECK(nearest < 1e-3); // it is met
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
    // On the wall in front: a bar from there to the last node that is held.
    const Result pressed = run(fed("[[0, 0.1], [1, 0.300001]]", 0));
    REQUIRE(pressed.summary.message == "");
    CHECK(pressed.value("wire_push_force") == doctest::Approx(1e6 * 1e-6 / 0.31).epsilon(1e-4));
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
