// Solids under stiff or prescribed data: closed forms of uniform states.

#include "solver/step/tests/body_runs.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

using namespace amontons;

namespace {

/// Two unit cubes one on the other, the lower on a floor that slides.
/// @param lower, upper  further members of the bodies
Result stacked(double lower_E, double upper_E, const std::string& lower, const std::string& upper,
               const char* sliding)
{
    return run(fmt::format(
        R"("bodies": {{
        "lower": {{"kind": "solid", "mesh": {{"generate": "box", "size": [1, 1, 1],
            "centre": [0.5, 0.5, 0.5], "cells": [2, 2, 2], "element": "T4"}},
            "youngs_modulus": {}, "poisson_ratio": 0, {}}},
        "upper": {{"kind": "solid", "mesh": {{"generate": "box", "size": [1, 1, 1],
            "centre": [0.5, 0.5, 1.5], "cells": [3, 3, 2], "element": "T4"}},
            "youngs_modulus": {}, "poisson_ratio": 0, {}}}}},
        "contact": [{{"between": ["upper", "lower"], "surfaces": ["z_min", "z_max"],
            "sliding": "{}"}}],
        "accuracy": {{"contact": 1e-10}}, "time": {{"step": 1, "end": 1}})",
        lower_E, lower, upper_E, upper, sliding));
}

const char* const kFoot =
    R"({"set": "z_min", "z": 0}, {"set": "x_min", "x": 0}, {"set": "y_min", "y": 0})";
const char* const kAside = R"({"set": "x_min", "x": 0}, {"set": "y_min", "y": 0})";

} // namespace

TEST_CASE("a stiff block that only contact holds presses a soft one as springs in series do")
{
    for (const double soft : {1e12, 1e6, 1.0}) {
        CAPTURE(soft);
        const double p = 1e-3 * soft;
        const Result t =
            stacked(soft, 1e12, fmt::format(R"("hold": [{}])", kFoot),
                    fmt::format(R"("hold": [{}], "loads": [{{"set": "z_max", "pressure": {}}}])",
                                kAside, p),
                    "finite");
        REQUIRE(t.summary.message == "");
        double worst = 0;
        for (const ContactRecord& c : t.records.back().contacts)
            worst = std::max(worst, std::abs(c.pressure / p - 1));
        CHECK(!t.records.back().contacts.empty());
        CHECK(worst < 1e-8);
    }
}

TEST_CASE("what is prescribed at the start counts as motion and closes contacts")
{
    // The upper block's lower face is moved into the lower block by 1e-3 at once: p = E 1e-3.
    for (const char* sliding : {"small", "finite"}) {
        CAPTURE(sliding);
        const Result t = stacked(
            1e6, 1e6, fmt::format(R"("hold": [{}])", kFoot),
            fmt::format(R"("hold": [{}, {{"set": "z_min", "z": -1e-3}}])", kAside), sliding);
        REQUIRE(t.summary.message == "");
        double force = 0;
        for (const ContactRecord& c : t.records.back().contacts)
            force += c.normal_force;
        CHECK(std::abs(force / 1e3 - 1) < 1e-6);
        int nodes = 0;
        for (const BodyRecord& b : t.simulation->body_records())
            for (const Field& f : b.point_fields)
                if (f.name == "displacement" && b.name == "upper")
                    for (std::size_t i = 2; i < f.values.size(); i += 3) {
                        ++nodes;
                        CHECK(std::abs(f.values[i] + 1e-3) < 1e-9);
                    }
        CHECK(nodes >= 8);
    }
}

TEST_CASE("the feet of a solid carry its weight and its load")
{
    const std::string text = R"({"schema": 1, "bodies": {
        "block": {"kind": "solid", "mesh": {"generate": "box", "size": [1, 1, 1],
            "cells": [2, 2, 2], "element": "H8"}, "youngs_modulus": 1e6, "poisson_ratio": 0.3,
            "density": 100, "hold": [{"set": "z_min"}],
            "loads": [{"set": "z_max", "force": [3, 0, -50]}]}},
        "gravity": [0, 0, -9.81], "time": {"step": 1, "end": 1}})";
    for (const char* motion : {"linear", "corotational"}) {
        CAPTURE(motion);
        const std::unique_ptr<Simulation> simulation = make_simulation(
            parse_scene(text, "test.json", {std::string("bodies.block.motion=") + motion}), {});
        Keep keep;
        const std::atomic<bool> never{false};
        REQUIRE(simulation->run(keep, never).message == "");
        double up = 0, along = 0;
        for (const Quantity& q : keep.records.back().quantities) {
            if (q.name == "block_z_min_force_z") up = q.value;
            if (q.name == "block_z_min_force_x") along = q.value;
        }
        CHECK(std::abs(up / (981 + 50) - 1) < 1e-9);
        CHECK(std::abs(along + 3) < 1e-6);
    }
}

TEST_CASE("what a node of two holds needs is counted once and of the first")
{
    for (const char* motion : {"linear", "corotational", "hyperelastic"}) {
        CAPTURE(std::string(motion));
        const Result r = run(fmt::format(
            R"("bodies": {{"block": {{"kind": "solid", "motion": "{}", "mesh": {{"generate": "box",
               "size": [1, 1, 1], "cells": [2, 2, 2], "element": "H8"}}, "youngs_modulus": 1e6,
               "poisson_ratio": 0.3, "hold": [{{"set": "z_min"}}, {{"set": "x_min"}}],
               "loads": [{{"set": "z_max", "traction": [300, 100, -200]}}]}}}},
               "time": {{"step": 1, "end": 1}})",
            motion));
        REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
        const Vec3 sum = r.vector("block_z_min_force") + r.vector("block_x_min_force");
        CHECK((sum + Vec3(300, 100, -200)).norm() < 1e-5);
    }
}

namespace {

/// A slab of 0.3 x 0.3 x 0.1 m below z = 0, of 9 kg, and on it a cube of 0.1 m, of 1 kg, whose side
/// decreases by 2 mm and along x by 1 mm: its lower edge touches.
/// @param hold  further members of the cube, how its side is held and led
std::string pressed_by_edge(const std::string& motion, const std::string& hold, double friction,
                            const std::string& more)
{
    const auto solid = [&](const char* mesh) {
        return fmt::format(
            R"("kind": "solid", "motion": "{}", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
               "density": 1000, "mesh": {{"generate": "box", {}, "element": "H8"}})",
            motion, mesh);
    };
    return fmt::format(
        R"("bodies": {{
           "low": {{{}, "hold": [{{"set": "z_min"}}]}},
           "top": {{{}, {}}}}},
           "contact": [{{"between": ["top", "low"], "friction": {}{}}}])",
        solid(R"("size": [0.3, 0.3, 0.1], "centre": [0, 0, -0.05], "cells": [4, 4, 2])"),
        solid(R"("size": [0.1, 0.1, 0.1], "centre": [0, 0, 0.05], "cells": [2, 2, 2])"), hold,
        friction, more);
}

std::string held_side(double end)
{
    return fmt::format(R"("hold": [{{"set": "x_min", "x": [[0, 0], [{0}, 1e-3]], "y": 0,
                                    "z": [[0, 0], [{0}, -2e-3]]}}])",
                       end);
}

/// The same of a frame that stands turned, and at rest turns on: in motion linear solids take the
/// turn within a step to first order.
std::string driven_side(double end)
{
    return fmt::format(R"("hold": [{{"set": "x_min"}}], "start": {{"turn": [0, 0, 0.5]}},
                          "drive": {{"x": [[0, 0], [{0}, 1e-3]], "z": [[0, 0], [{0}, -2e-3]],
                          "axis": [0, 0, 1], "angle": [[0, 0], [{0}, {1}]]}})",
                       end, end < 1 ? 0 : 0.02);
}

/// Rules of time, and the end [s].
const std::pair<const char*, double> kRules[] = {
    {R"("time": {"step": 0.5, "end": 1})", 1.0},
    {R"("time": {"kind": "dynamic", "step": 1e-3, "end": 0.01})", 0.01},
    {R"("time": {"kind": "dynamic", "step": 1e-3, "end": 0.01, "theta": 0.5})", 0.01},
    {R"("time": {"kind": "dynamic", "step": 1e-3, "end": 0.01, "rule": "generalised_alpha",
                 "spectral_radius": 0.8})",
     0.01}};

} // namespace

TEST_CASE(
    "a block that is held everywhere presses a column together: all its hold feels is contact")
{
    // Of no Poisson's ratio: F = E A d / L, of neo-Hooke E A (1 / l - l) / 2.
    const double E = 1e6, A = 0.01, L = 0.1, d = 1e-3, l = 1 - d / L;
    for (const char* motion : {"linear", "corotational", "hyperelastic"})
        for (const char* sliding : {"small", "finite"}) {
            CAPTURE(std::string(motion));
            CAPTURE(std::string(sliding));
            const bool neo_hooke = motion == std::string("hyperelastic");
            if (neo_hooke && sliding == std::string("small")) continue;
            const auto cube = [&](double z, const char* hold) {
                return fmt::format(
                    R"("kind": "solid", "motion": "{}", "youngs_modulus": {}, "poisson_ratio": 0,
                       "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [0, 0, {}],
                       "cells": [2, 2, 2], "element": "H8"}}, "hold": [{{{}}}])",
                    motion, E, z, hold);
            };
            const Result r = run(fmt::format(
                R"("bodies": {{"low": {{{}}}, "top": {{{}}}}}, "contact": [{{"between":
                   ["top", "low"], "friction": 0.3, "sliding": "{}"}}],
                   "time": {{"step": 0.25, "end": 1}})",
                cube(-0.05, R"("set": "z_min")"),
                cube(0.05, R"("set": "all", "x": 0, "y": 0, "z": [[0, 0], [1, -1e-3]])"), sliding));
            REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
            const double force = neo_hooke ? E * A * (1 / l - l) / 2 : E * A * d / L;
            CHECK(r.value("top_all_force_z") == doctest::Approx(-force).epsilon(1e-7));
            CHECK(r.value("low_z_min_force_z") == doctest::Approx(force).epsilon(1e-7));
            const EnergyRecord& e = r.summary.energy;
            const double stored = neo_hooke ? E * A * L * (0.25 * (l * l - 1) - 0.5 * std::log(l))
                                            : 0.5 * E * A * d * d / L;
            CHECK(e.elastic == doctest::Approx(stored).epsilon(1e-7));
            // Work by the trapezoid, exact of a linear force: else (d / 4)^2 / 12 of its slope's
            // change.
            CHECK(std::abs(e.error()) < (neo_hooke ? 2e-4 : 1e-9) * stored);
        }
}

TEST_CASE(
    "holds and weight and momentum are in balance where held nodes touch in each law and rule" *
    doctest::test_suite("slow"))
{
    for (const char* motion : {"linear", "corotational", "hyperelastic"})
        for (const auto& [time, end] : kRules)
            for (const std::string& hold : {held_side(end), driven_side(end)}) {
                CAPTURE(std::string(motion));
                CAPTURE(std::string(time));
                CAPTURE(hold);
                const Result r = run(pressed_by_edge(motion, hold, 0.3, "") +
                                     R"(, "gravity": [0, 0, -9.81], )" + time);
                REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
                const Vec3 weight(0, 0, -10 * 9.81);
                for (std::size_t k = 1; k < r.records.size(); ++k) {
                    Vec3 sum =
                        weight + r.vector("low_z_min_force", k) + r.vector("top_x_min_force", k);
                    if (end < 1)
                        sum -= (r.vector("momentum", k) - r.vector("momentum", k - 1)) /
                               r.records[k].step_length;
                    CHECK(sum.norm() < 1e-6 * r.vector("top_on_low_force").norm());
                }
            }
}

TEST_CASE("what a spring pulls at a held node is in the force of its hold")
{
    // Solids beside couplings are not condensed: the same of the contacts.
    const double stiffness = 1000;
    const Vec3 at(-0.05, 0.05, 0.1), to(-0.05, 0.05, 0.3), moved(1e-3, 0, -2e-3);
    for (const char* motion : {"linear", "corotational", "hyperelastic"}) {
        CAPTURE(std::string(motion));
        const Result r =
            run(pressed_by_edge(motion, held_side(1), 0.3, "") + R"(, "couplings": [{"kind":
                "spring", "between": ["top", "world"], "at": [-0.05, 0.05, 0.1],
                "to": [-0.05, 0.05, 0.3], "stiffness": 1000, "length": 0.15,
                "set": "x_min"}],
                "time": {"step": 1, "end": 1})");
        REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
        const Vec3 line = to - at - moved;
        const Vec3 pull = stiffness * (line.norm() - 0.15) * line.normalized();
        const Vec3 sum = pull + r.vector("low_z_min_force") + r.vector("top_x_min_force");
        CHECK(sum.norm() < 1e-6 * pull.norm());
    }
}

TEST_CASE("the work of held nodes that touch is in the balance of energy" *
          doctest::test_suite("slow"))
{
    // Of contacts that stay as they are at the start nothing is lost: they do no work.
    const Result small = run(pressed_by_edge("linear", held_side(1), 0, R"(, "sliding": "small")") +
                             R"(, "time": {"step": 0.5, "end": 1})");
    REQUIRE_MESSAGE(small.summary.message == "", small.summary.message);
    CHECK(small.summary.energy.elastic > 0.1);
    CHECK(std::abs(small.summary.energy.error()) < 1e-10 * small.summary.energy.elastic);
    for (const char* motion : {"linear", "corotational", "hyperelastic"})
        for (const auto& [time, end] : kRules) {
            CAPTURE(std::string(motion));
            CAPTURE(std::string(time));
            const Result r = run(pressed_by_edge(motion, held_side(end), 0.3, "") + ", " + time);
            REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
            const EnergyRecord& e = r.summary.energy;
            // At rest friction is by its force at the end of a step.
            CHECK(std::abs(e.error()) <
                  (end < 1 ? 1e-4 : 5e-3) * e.elastic); // [regression] our own run
        }
}

TEST_CASE("friction on a face that is held along it is in the force of its hold")
{
    for (const char* floor : {R"("kind": "obstacle", "surface": {"generate": "plane"})",
                              R"("kind": "rigid", "shape": {"generate": "box",
                                 "size": [0.4, 0.4, 0.02]}, "start": {"place": [0, 0, -0.01]},
                                 "drive": {"y": [[0, 0], [1, 0], [2, 1e-3]]})"}) {
        CAPTURE(std::string(floor));
        const Result r = run(fmt::format(
            R"("bodies": {{"floor": {{{}}}, "block": {{"kind": "solid", "youngs_modulus": 1e6,
               "poisson_ratio": 0.3, "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.08],
               "cells": [5, 4, 4], "element": "T4", "centre": [0, 0, 0.04]}},
               "hold": [{{"set": "z_max", "y": 0, "z": [[0, 0], [1, -1e-3]]}},
                        {{"set": "x_min", "x": [[0, 0], [1, 0], [2, 2e-3]]}}]}}}},
               "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
               "time": {{"step": 1, "end": 2}})",
            floor));
        REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
        const Vec3 floor_force = r.vector("floor_on_block_force");
        CHECK(std::abs(floor_force.x()) > 10);
        const Vec3 sum =
            floor_force + r.vector("block_z_max_force") + r.vector("block_x_min_force");
        CHECK(sum.norm() < 1e-6 * floor_force.norm());
    }
}

TEST_CASE("steel stands on steel on what is 2e7 times softer whatever the order of the three")
{
    // A pressure on the top of a chain of blocks passes through each of its faces.
    for (const char* sliding : {"finite", "small"})
        for (const double friction : {0.0, 0.3})
            for (const std::array<double, 3>& E :
                 {std::array{1e4, 2e11, 2e11}, std::array{2e11, 1e4, 2e11},
                  std::array{2e11, 2e11, 1e4}}) {
                CAPTURE(std::string(sliding));
                CAPTURE(friction);
                CAPTURE(E[0]);
                CAPTURE(E[1]);
                std::string bodies, contact;
                for (int i = 0; i < 3; ++i) {
                    bodies += fmt::format(
                        R"({}"b{}": {{"kind": "solid", "youngs_modulus": {}, "poisson_ratio": 0.3,
                           "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.1], "cells": [{}, {}, 2],
                                     "element": "H8"}}, "start": {{"place": [0, 0, {}]}}, {}}})",
                        i == 0 ? "" : ", ", i, E[std::size_t(i)], 2 + i % 2, 2 + i % 2,
                        0.05 + 0.1 * i,
                        i == 0   ? R"("hold": [{"set": "z_min"}])"
                        : i == 2 ? R"("loads": [{"set": "z_max", "traction": [0, 0, -100]}])"
                                 : R"("loads": [])");
                    if (i > 0)
                        contact += fmt::format(
                            R"({}{{"between": ["b{}", "b{}"], "friction": {}, "sliding": "{}"}})",
                            i == 1 ? "" : ", ", i - 1, i, friction, sliding);
                }
                const Result r = run(fmt::format(
                    R"("bodies": {{{}}}, "contact": [{}], "time": {{"step": 1, "end": 1}})", bodies,
                    contact));
                REQUIRE(r.summary.message == "");
                double lower = 0, upper = 0;
                for (const ContactRecord& c : r.records.back().contacts)
                    (c.body_a + c.body_b == 1 ? lower : upper) += std::abs(c.force.z());
                CHECK(lower == doctest::Approx(1).epsilon(1e-7));
                CHECK(upper == doctest::Approx(1).epsilon(1e-7));
            }
}
