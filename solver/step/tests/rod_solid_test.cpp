// Laws of rods that touch elastic solids; closed forms of single cases are in validation/cases.

#include "solver/step/tests/body_runs.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>

using namespace amontons;

namespace {

/// A block of 0.2 x 0.1 x 0.05 m below z = 0, its bottom held.
std::string soft_block(const std::string& cells, const std::string& more,
                       const std::string& hold = R"("hold": [{"set": "z_min"}], )")
{
    return fmt::format(R"("block": {{"kind": "solid", {}
        "mesh": {{"generate": "box", "size": [0.2, 0.1, 0.05], "centre": [0, 0, -0.025], "cells": {}}},
        "youngs_modulus": 1e5, "poisson_ratio": 0.3{}}})",
                       hold, cells, more);
}

/// A rod of 0.3 m across the block and beyond both edges, whose ends are pressed down and pulled
/// along it.
std::string across(double radius, double y, double down, double along)
{
    std::string holds;
    for (const char* end : {"start", "end"})
        holds += fmt::format(
            R"({}{{"set": "{}", "x": [[0, 0], [1, 0], [2, {}]], "y": [[0, 0], [1, 0]],
                "z": [[0, 0], [1, {}]]}})",
            holds.empty() ? "" : ", ", end, along, -down);
    return fmt::format(R"("rod": {{"kind": "rod",
        "segments": [{{"length": 0.3, "radius": {}, "EI": 1, "EA": 1e5, "element": 0.015}}],
        "shape": {{"start": [-0.15, {}, {}], "normal": [0, 0, 1]}}, "hold": [{}]}})",
                       radius, y, radius + 1e-3, holds);
}

std::string rod_on_block(const std::string& bodies, double friction, double step, double end)
{
    return fmt::format(
        R"("bodies": {{{}}}, "contact": [{{"between": ["block", "rod"], "friction": {}}}],
        "time": {{"step": {}, "end": {}}})",
        bodies, friction, step, end);
}

} // namespace

TEST_CASE("a stiff rod in a block is a rigid cylinder" * doctest::test_suite("slow"))
{
    // Pressed in by 1.5 mm, faces of a third of its radius.
    for (const char* element : {"H8", "T10"}) {
        CAPTURE(element);
        const double R = 0.02;
        const std::string solid = fmt::format(
            R"("block": {{"kind": "solid", "hold": [{{"set": "z_min"}}], "mesh": {{"generate": "box",
            "size": [0.1, 0.04, 0.05], "centre": [0, 0, -0.025], "cells": [14, 4, 4],
            "element": "{}"}}, "youngs_modulus": 1e5, "poisson_ratio": 0.3}})",
            element);
        const std::string z = R"("z": [[0, 0], [1, -0.0015]])";
        const Result rod = run(fmt::format(
            R"("bodies": {{{}, "rod": {{"kind": "rod", "segments": [{{"length": 0.06, "radius": {},
            "EI": 1e5, "EA": 1e9, "element": 0.01}}],
            "shape": {{"start": [0.001, -0.03, {}], "direction": [0, 1, 0], "normal": [0, 0, 1]}},
            "hold": [{{"set": "start", "x": [[0, 0], [1, 0]], "y": [[0, 0], [1, 0]], {}}},
                     {{"set": "end", "x": [[0, 0], [1, 0]], "y": [[0, 0], [1, 0]], {}}}]}}}},
            "contact": [{{"between": ["rod", "block"]}}], "time": {{"step": 0.5, "end": 1}})",
            solid, R, R, z, z));
        const Result cylinder = run(fmt::format(
            R"("bodies": {{{}, "rod": {{"kind": "rigid",
            "shape": {{"generate": "cylinder", "radius": {}, "length": 0.06}},
            "start": {{"place": [0.001, 0, {}], "turn": [1.5707963267948966, 0, 0]}},
            "drive": {{{}}}}}}},
            "contact": [{{"between": ["rod", "block"]}}], "time": {{"step": 0.5, "end": 1}})",
            solid, R, R, z));
        REQUIRE_MESSAGE(rod.summary.status == "done", rod.summary.message);
        REQUIRE(cylinder.summary.status == "done");
        const double force = rod.value("block_on_rod_force_z");
        CHECK(force > 2.5);
        CHECK(force == doctest::Approx(-cylinder.value("rod_on_block_force_z")).epsilon(1e-6));
        // What the block's nodes show is what the rod does.
        int shown = 0;
        for (const BodyRecord& b : rod.simulation->body_records()) {
            for (const Field& f : b.point_fields)
                if (f.name == "contact_pressure") {
                    ++shown;
                    REQUIRE(!f.values.empty());
                    CHECK(*std::max_element(f.values.begin(), f.values.end()) > 1000);
                }
        }
        CHECK(shown == 1);
    }
}

TEST_CASE("a rod along an elastic foundation yields as Hetenyi's beam does")
{
    // A strip of one element across and through it and no Poisson's ratio is Winkler's foundation,
    // but for its shear, k = E b / t; the rod lies on it under its line load q, and bends by
    // F lambda / (2 k) where a force F acts, lambda^4 = k / (4 EI).
    const double E = 1e5, b = 0.02, t = 0.005, k = E * b / t, EI = 10, F = 4, q = 80;
    const auto deepest = [&](double force, double radius) {
        const Result r = run(fmt::format(
            R"("bodies": {{
            "block": {{"kind": "solid", "mesh": {{"generate": "box", "size": [1.2, {}, {}],
                "centre": [0, 0, {}], "cells": [120, 1, 1], "element": "H8"}}, "youngs_modulus": {},
                "poisson_ratio": 0, "hold": [{{"set": "z_min"}}]}},
            "rod": {{"kind": "rod", "segments": [{{"length": 1, "radius": {}, "EI": {}, "EA": 1e6,
                "element": 0.02}}], "shape": {{"start": [-0.5, 0, {}], "normal": [0, 0, 1]}},
                "plane": [0, 1, 0], "hold": [
                {{"set": "start", "x": [[0, 0], [1, 0]], "y": [[0, 0], [1, 0]], "z": [[0, 0], [1, {}]], "turns": "free"}},
                {{"set": "end", "y": [[0, 0], [1, 0]], "z": [[0, 0], [1, {}]], "turns": "free"}}],
                "loads": [{{"set": "all", "line": [0, 0, {}], "over": [[0, 0], [1, 1]]}},
                          {{"at": 0.5, "force": [0, 0, {}], "over": [[0, 0], [1, 1]]}}]}}}},
            "contact": [{{"between": ["rod", "block"]}}], "time": {{"step": 1, "end": 1}})",
            b, t, -t / 2, E, radius, EI, radius, -q / k, -q / k, -q, -force));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return r.value("rod_0.5_z");
    };
    const double lambda = std::pow(k / (4 * EI), 0.25);
    for (const double radius : {0.002, 0.01})
        CHECK(deepest(0, radius) - deepest(F, radius) ==
              doctest::Approx(F * lambda / (2 * k)).epsilon(5e-3));
}

TEST_CASE(
    "a rod that lies on an elastic foundation buckles at 2 sqrt(k EI) and not at Euler's load" *
    doctest::test_suite("slow"))
{
    // Hinged, four half waves of pi (EI / k)^(1/4) long, pressed on by its line load as far as its
    // ends are held down: with any other number of waves it would carry more. Euler's load is a
    // thirty-second of that, and from there on the rod alone has unstable modes.
    const double E = 1e5, b = 0.02, t = 0.005, k = E * b / t, EI = 10, q = 160, pi = std::acos(-1);
    const double L = 4 * pi * std::pow(EI / k, 0.25), critical = 2 * std::sqrt(k * EI);
    const Result r = run(fmt::format(
        R"("bodies": {{
        "strip": {{"kind": "solid", "mesh": {{"generate": "box", "size": [1.2, {}, {}],
            "centre": [0, 0, {}], "cells": [240, 1, 1], "element": "H8"}}, "youngs_modulus": {},
            "poisson_ratio": 0, "hold": [{{"set": "z_min"}}]}},
        "rod": {{"kind": "rod", "segments": [{{"length": {}, "radius": 0.002, "EI": {}, "EA": 1e8,
            "element": {}}}], "shape": {{"start": [{}, 0, 0.002], "normal": [0, 0, 1]}},
            "plane": [0, 1, 0], "hold": [
            {{"set": "start", "x": [[0, 0], [1, 0]], "y": [[0, 0], [1, 0]], "z": [[0, 0], [1, {}]], "turns": "free"}},
            {{"set": "end", "y": [[0, 0], [1, 0]], "z": [[0, 0], [1, {}]], "turns": "free"}}],
            "loads": [{{"set": "all", "line": [0, 0, {}], "over": [[0, 0], [1, 1]]}},
                      {{"set": "end", "force": [-1, 0, 0], "over": [[0, 0], [1, 0], [2, {}], [3, {}]]}}]}}}},
        "contact": [{{"between": ["rod", "strip"]}}],
        "time": {{"step": 0.5, "end": 3, "smallest_step": 0.4}})",
        b, t, -t / 2, E, L, EI, L / 48, -L / 2, -q / k, -q / k, -q, 0.98 * critical,
        1.01 * critical));
    const auto load = [&](const StepRecord& s) {
        return critical * (s.time < 2 ? 0.98 * (s.time - 1) : 0.98 + 0.03 * (s.time - 2));
    };
    bool beyond_euler = false, buckled = r.summary.status != "done";
    for (const StepRecord& s : r.records) {
        CAPTURE(load(s));
        const bool away = value(s, "rod_max_displacement") > 1.5 * q / k;
        if (load(s) < 0.985 * critical) {
            CHECK(!away);
            CHECK(value(s, "rod_negative") == 0);
            beyond_euler = beyond_euler || load(s) > 10 * EI * pi * pi / (L * L);
        }
        buckled = buckled || away;
    }
    CHECK(beyond_euler);
    CHECK(buckled);
}

TEST_CASE("holds of a rod and of the block that it is pressed into are in balance" *
          doctest::test_suite("slow"))
{
    // Ends of the rod, and a side of the block, are held where they touch.
    for (const char* motion : {"linear", "corotational", "hyperelastic"}) {
        CAPTURE(std::string(motion));
        const Result r =
            run(rod_on_block(soft_block("[8, 4, 2]", fmt::format(R"(, "motion": "{}")", motion),
                                        R"("hold": [{"set": "z_min"}, {"set": "x_min", "x": 0,
                                         "y": [[0, 0], [2, 1e-3]]}], )") +
                                 ", " + across(0.01, 0.011, 3e-3, 2e-3),
                             0.3, 0.5, 2));
        REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
        const Vec3 press = r.vector("block_on_rod_force");
        const Vec3 sum = r.vector("rod_start_force") + r.vector("rod_end_force") +
                         r.vector("block_z_min_force") + r.vector("block_x_min_force");
        CHECK(press.norm() > 1);
        CHECK(sum.norm() < 1e-6 * press.norm());
    }
}

TEST_CASE("a free block between a floor and a rod is in balance of forces and moments" *
          doctest::test_suite("slow"))
{
    // The rod lies askew over it and is pulled sideways: forces in all directions.
    const Result r = run(
        R"("bodies": {"floor": {"kind": "obstacle",
            "surface": {"generate": "plane", "centre": [0, 0, -0.05]}}, )" +
        soft_block("[6, 4, 3]", R"(, "motion": "corotational")", "") + R"(, "rod": {"kind": "rod",
            "segments": [{"length": 0.4, "radius": 0.004, "EI": 1, "EA": 1e5, "element": 0.02}],
            "shape": {"start": [-0.18, -0.05, 0.004], "direction": [0.96, 0.28, 0], "normal": [0, 0, 1]},
            "hold": [{"set": "start", "x": [[0, 0], [1, 0]], "z": [[0, 0], [1, -0.003]], "y": [[0, 0], [1, 0], [2, 0.004]]},
                     {"set": "end", "z": [[0, 0], [1, -0.002]], "y": [[0, 0], [1, 0], [2, 0.001]]}]}},
        "contact": [{"between": ["block", "floor"], "friction": 0.8},
                    {"between": ["rod", "block"], "friction": 0.4}],
        "time": {"step": 0.25, "end": 2})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    double size = 0, sideways = 0;
    for (const ContactRecord& c : r.records.back().contacts) { // 0 floor, 1 block, 2 rod
        const double sign = c.body_a == 1 ? 1 : -1;
        force += sign * c.force;
        moment += sign * c.point.cross(c.force);
        size += c.force.norm();
        if (c.body_a == 2) sideways += c.force.y();
    }
    CHECK(std::abs(sideways) > 0.05 * size);
    CHECK(force.norm() < 1e-7 * size);
    CHECK(moment.norm() < 1e-7 * size * 0.2);
    // The rod, too.
    const Vec3 held = r.vector("rod_start_force") + r.vector("rod_end_force");
    CHECK((r.vector("block_on_rod_force") + held).norm() < 1e-7 * size);
}

TEST_CASE("a rod that is drawn along a hard block slides at mu N and sticks before")
{
    for (const char* element : {"H8", "T10", "T4"}) {
        CAPTURE(element);
        const Result r = run(rod_on_block(
            fmt::format(R"("block": {{"kind": "solid", "hold": [{{"set": "z_min"}}],
                "mesh": {{"generate": "box", "size": [0.2, 0.1, 0.05], "centre": [0, 0, -0.025],
                "cells": [8, 4, 2], "element": "{}"}}, "youngs_modulus": 1e10,
                "poisson_ratio": 0.3}})",
                        element) +
                R"(, "rod": {"kind": "rod", "segments": [{"length": 0.1, "radius": 0.002, "EI": 1,
                "EA": 1e4, "element": 0.01}], "shape": {"start": [-0.06, 0.01, 0.002], "normal": [0, 0, 1]},
                "hold": [{"set": "start", "x": [[0, 0], [1, 0], [3, 0.06]], "y": [[0, 0], [1, 0]],
                          "z": [[0, 0], [1, 0]]}, {"set": "end", "y": [[0, 0], [1, 0]], "turns": "free"}],
                "loads": [{"set": "all", "line": [0, 0, -50]}]})",
            0.3, 0.1, 3));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        REQUIRE(r.records.size() > 13);
        for (std::size_t i = 11; i < r.records.size(); ++i) {
            const double normal = r.value("block_on_rod_force_z", i);
            CHECK(normal > 4.7); // what is held takes its share
            if (i > 12)          // 3 mm each, over many faces
                CHECK(r.value("block_on_rod_force_x", i) ==
                      doctest::Approx(-0.3 * normal).epsilon(1e-4));
        }
    }
}

TEST_CASE("where a rod lies on faces or edges does not matter: the whole turned gives the same")
{
    const Eigen::Quaterniond turn =
        Eigen::AngleAxisd(2.1, Vec3(0.3, -0.8, 0.5).normalized()) * Eigen::Quaterniond::Identity();
    const Eigen::AngleAxisd axis(turn);
    const Vec3 v = axis.angle() * axis.axis();
    const auto list = [](const Vec3& x) {
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", x.x(), x.y(), x.z());
    };
    const auto made = [&](bool turned) {
        const auto to = [&](const Vec3& x) { return turned ? Vec3(turn * x) : x; };
        return run(
            R"("bodies": {)" +
            soft_block("[8, 4, 3]",
                       turned ? fmt::format(R"(, "start": {{"turn": {}}})", list(v)) : "") +
            fmt::format(
                R"(, "rod": {{"kind": "rod", "segments": [{{"length": 0.3, "radius": 0.003, "EI": 0.05,
                "EA": 1e4, "element": 0.02}}], "shape": {{"start": {}, "direction": {}, "normal": {}}},
                "hold": [{{"set": "start"}}], "loads": [{{"at": 0.3, "force": {}}}]}}}},
                "contact": [{{"between": ["rod", "block"], "friction": 0.2}}],
                "time": {{"step": 0.5, "end": 1}})",
                list(to({-0.14, 0.01, 0.004})), list(to({1, 0.1, 0})), list(to({0, 0, 1})),
                list(to({0, 0.1, -2}))));
    };
    const Result plain = made(false), other = made(true);
    REQUIRE_MESSAGE(plain.summary.status == "done", plain.summary.message);
    REQUIRE_MESSAGE(other.summary.status == "done", other.summary.message);
    const Vec3 force = plain.vector("block_on_rod_force");
    CHECK(force.norm() > 0.5);
    CHECK((turn * force - other.vector("block_on_rod_force")).norm() < 1e-5 * force.norm());
    CHECK((turn * plain.vector("rod_end") - other.vector("rod_end")).norm() < 1e-7);
}

TEST_CASE(
    "rods press on linear and corotational and hyperelastic blocks while work and energy balance")
{
    for (const char* more : {"", R"(, "motion": "corotational")",
                             R"(, "material": {"law": "neo_hooke", "youngs_modulus": 1e5,
                                "poisson_ratio": 0.3})"}) {
        CAPTURE(more);
        std::string solid = soft_block(R"([10, 5, 3], "element": "H8")", more);
        if (std::string(more).find("law") != std::string::npos)
            solid.erase(solid.find("\"youngs_modulus\": 1e5"),
                        std::string("\"youngs_modulus\": 1e5, \"poisson_ratio\": 0.3, ").size());
        const Result r =
            run(rod_on_block(solid + ", " + across(0.002, 0.003, 4e-3, 0), 0.2, 0.1, 1));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        const EnergyRecord& e = r.records.back().energy;
        CHECK(r.value("block_on_rod_force_z") > 15);
        CHECK(e.work == doctest::Approx(e.elastic + e.friction).epsilon(3e-3));
        for (const StepRecord& s : r.records)
            CHECK(s.certificate.certified);
    }
}

TEST_CASE("a rod that strikes a free block takes its momentum from it")
{
    const Result r = run(
        R"("bodies": {)" + soft_block(R"([6, 4, 3], "element": "H8")", R"(, "density": 1000)", "") +
        R"(, "rod": {"kind": "rod", "segments": [{"length": 0.16, "radius": 0.004, "EI": 0.2,
            "EA": 1e5, "element": 0.01, "density": 1000}],
            "shape": {"start": [-0.09, 0.02, 0.006], "direction": [1, 0.1, 0], "normal": [0, 0, 1]},
            "velocity": [0.3, 0, -1]}},
        "contact": [{"between": ["block", "rod"], "friction": 0.3}],
        "time": {"kind": "dynamic", "step": 5e-4, "end": 0.02})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    const Vec3 before = r.vector("momentum", 0);
    bool struck = false;
    for (std::size_t i = 1; i < r.records.size(); ++i) {
        CHECK((r.vector("momentum", i) - before).norm() < 1e-11 * before.norm());
        struck |= !r.records[i].contacts.empty();
    }
    CHECK(struck);
    CHECK(r.records.back().beams.at(0).points.front().z() > 0.004); // thrown back
    const EnergyRecord& e = r.records.back().energy;
    const double thrown = 0.5 * before.squaredNorm() / 8.04e-3; // [J]
    CHECK(e.kinetic_start == doctest::Approx(thrown));
    CHECK(std::abs(e.error()) < 1e-3 * thrown);
}

TEST_CASE("a rod does not pass through a thin plate however long the step")
{
    // Thrown, 0.25 to 1 m a step, at 5 mm.
    for (const double speed : {50.0, 200.0}) {
        CAPTURE(speed);
        const Result r = run(fmt::format(
            R"("bodies": {{"block": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.2, 0.2, 0.005],
                "cells": [6, 6, 1], "element": "H8"}}, "youngs_modulus": 1e8, "poisson_ratio": 0.3,
                "density": 1000, "hold": [{{"set": "x_min"}}, {{"set": "x_max"}}]}},
            "rod": {{"kind": "rod", "segments": [{{"length": 0.1, "radius": 0.002, "EI": 0.2, "EA": 1e5,
                "element": 0.01, "density": 1000}}],
                "shape": {{"start": [-0.053, 0.004, 0.1], "normal": [0, 0, 1]}},
                "velocity": [0, 0, {}]}}}},
            "contact": [{{"between": ["block", "rod"]}}],
            "time": {{"kind": "dynamic", "step": 5e-3, "end": 0.01}})",
            -speed));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        const std::vector<BodyRecord> bodies = r.simulation->body_records();
        REQUIRE(!bodies.empty());
        REQUIRE(!r.records.back().beams.at(0).points.empty());
        for (const BodyRecord& b : bodies) {
            double lowest = 1;
            REQUIRE(!b.points.empty());
            for (const Vec3& x : b.points)
                lowest = std::min(lowest, x.z());
            for (const Vec3& x : r.records.back().beams.at(0).points)
                CHECK(x.z() > lowest);
        }
    }
    // Led, sideways at the plate's edge: no contact is near before.
    const Result led = run(
        R"("bodies": {"block": {"kind": "solid", "mesh": {"generate": "box", "size": [0.2, 0.2, 0.004],
            "cells": [8, 8, 1], "element": "H8"}, "youngs_modulus": 1e8, "poisson_ratio": 0.3,
            "hold": [{"set": "x_min"}]},
        "rod": {"kind": "rod", "segments": [{"length": 1, "radius": 0.004, "EI": 1, "EA": 1e5,
            "element": 0.05}], "shape": {"start": [-0.3, -0.13, 0], "normal": [0, 0, 1]},
            "hold": [{"set": "start", "x": 0, "y": [[0, 0], [1, 0.2]], "z": 0}]}},
        "contact": [{"between": ["rod", "block"], "reach": 0.002}], "time": {"step": 1, "end": 1})");
    double last = -1;
    for (const StepRecord& s : led.records)
        for (const Vec3& x : s.beams.at(0).points)
            if (std::abs(x.x()) < 0.09 && std::abs(x.z()) < 0.004) last = std::max(last, x.y());
    CHECK(last > -1); // some of it was there
    CHECK(last < -0.1 - 0.0035);
    CHECK(led.records.size() > 2);
}

TEST_CASE("a step continues from a state as it would have" * doctest::test_suite("slow"))
{
    const std::string text = rod_on_block(
        soft_block("[8, 4, 3]", "") + ", " + across(0.003, 0.004, 2e-3, 0.01), 0.3, 0.125, 2);
    const auto made = [&] {
        return make_simulation(parse_scene("{\"schema\": 1, " + text + "}", "test.json"), {});
    };
    auto first = made(), second = made();
    Keep whole, half, rest;
    std::atomic<bool> stop{false}, no_stop{false};
    half.stop = &stop;
    half.stop_at = 9;
    const auto all = made();
    REQUIRE(all->run(whole, no_stop).status == "done");
    REQUIRE(first->run(half, stop).status == "interrupted");
    second->restore(first->save());
    REQUIRE(second->run(rest, no_stop).status == "done");
    REQUIRE(whole.records.size() == 17);
    REQUIRE(!rest.records.empty());
    REQUIRE(half.records.size() + rest.records.size() == whole.records.size());
    for (const char* name : {"block_on_rod_force_x", "block_on_rod_force_z", "rod_end_x"})
        CHECK(value(whole.records.back(), name) == value(rest.records.back(), name));
}

TEST_CASE("a rod that begins inside a solid is refused with the place")
{
    const auto issue = [](double z, const std::string& between) {
        try {
            run(fmt::format(
                R"("bodies": {{{}, "rod": {{"kind": "rod", "segments": [{{"length": 0.3, "radius": 0.002,
                "EI": 1, "element": 0.05}}], "shape": {{"start": [-0.15, 0, {}], "normal": [0, 0, 1]}},
                "hold": [{{"set": "start"}}]}}}}, "contact": [{{"between": {}}}],
                "time": {{"step": 1, "end": 1}})",
                soft_block("[4, 2, 2]", ""), z, between));
        } catch (const InputError& error) {
            return error.issues().at(0).place + ": " + error.issues().at(0).found;
        }
        return std::string();
    };
    CHECK(issue(-0.02, R"(["rod", "block"])").find("/contact: rod and block overlap by ") == 0);
    CHECK(issue(-0.02, R"(["*", "*"])").find("/contact: rod and block overlap by ") == 0);
    CHECK(issue(0.003, R"(["rod", "block"])") == "");
}

TEST_CASE("a rope over an elastic drum is drawn as a belt: exp(mu theta) at its surface" *
          doctest::test_suite("slow"))
{
    // It hangs a little off it, takes up 10 N at its end, some of it before the first step, and is
    // drawn over it. It is never slack: then round-off would determine where it lies.
    const double R = 0.05, r = 0.001, mu = 0.2;
    for (const auto& [element, off, first] : {std::tuple("H8", 2e-4, 0.02),
                                              {"T4", 2e-4, 0.02},
                                              {"T4", 2e-4, 0.2},
                                              {"H8", 3e-4, 0.2},
                                              {"T4", 3e-4, 0.2}}) {
        CAPTURE(std::string(element));
        CAPTURE(off);
        CAPTURE(first);
        const Result rope = run(fmt::format(
            R"("bodies": {{"drum": {{"kind": "solid", "mesh": {{"generate": "cylinder",
                "centre": [0, -0.005, 0], "axis": [0, 1, 0], "radius": {}, "length": 0.01, "around": 16,
                "along": 2, "element": "{}"}}, "youngs_modulus": 1e7, "poisson_ratio": 0.3,
                "hold": [{{"set": "start"}}, {{"set": "end"}}]}},
            "rope": {{"kind": "rod", "segments": [{{"length": {}, "radius": {}, "EI": 1e-4, "EA": 1e5,
                "element": 0.004}}], "plane": [0, 1, 0],
                "shape": {{"curve": {{"pieces": [{{"length": 0.1}}, {{"radius": {},
                    "angle": 3.141592653589793}}, {{"length": 0.1}}], "start": [{}, 0, -0.1],
                    "direction": [0, 0, 1], "normal": [1, 0, 0]}}, "stress_free": true}},
                "hold": [{{"set": "start", "x": [[0, 0], [1, 0]], "z": [[0, 0], [1, -0.004], [1.5, -0.012]]}}],
                "loads": [{{"set": "end", "force": [0, 0, -10], "over": [[0, {}], [1, 1]]}}]}}}},
            "contact": [{{"between": ["rope", "drum"], "friction": {}}}],
            "time": {{"step": 0.05, "end": 1.5}})",
            R, element, 0.2 + 3.141592653589793 * (R + r + off), r, R + r + off, -(R + r + off),
            first, mu));
        REQUIRE_MESSAGE(rope.summary.status == "done", rope.summary.message);
        CHECK(-rope.value("rope_start_force_z") ==
              doctest::Approx(10 * std::exp(mu * 3.141592653589793 * R / (R + r))).epsilon(6e-3));
        CHECK(rope.value("drum_max_displacement") > 1e-5);
    }
}
