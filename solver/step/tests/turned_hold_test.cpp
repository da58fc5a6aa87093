// Holds that turn their set, or give it a gradient, with their forces and moments.

#include "mesh/generate/solid_box.hpp"
#include "solver/body/solid_conditions.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <atomic>
#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <numbers>
#include <string>

using namespace amontons;

namespace {

/// @param bar  members of a solid
Result held(const std::string& bar, const std::string& time = R"("step": 1, "end": 1)")
{
    return done(fmt::format(R"("bodies": {{"b": {{"kind": "solid", {}}}}},
                        "time": {{{}}}, "accuracy": {{"contact": 1e-12}})",
                            bar, time));
}

constexpr double kYoung = 1e6, kPoisson = 0.3, kShear = kYoung / (2 * (1 + kPoisson));

std::string material(const std::string& motion)
{
    if (motion == "hyperelastic")
        return fmt::format(R"("material": {{"law": "neo_hooke", "youngs_modulus": {},
                              "poisson_ratio": {}}})",
                           kYoung, kPoisson);
    return fmt::format(R"("youngs_modulus": {}, "poisson_ratio": {}, "motion": "{}")", kYoung,
                       kPoisson, motion);
}

} // namespace

TEST_CASE("a twisted square bar takes the moment of Saint-Venant's torsion")
{
    // Ends that turn in their plane and are free to warp: G J / L with J = 0.1405770 a^4.
    const double a = 0.02, L = 0.06, angle = 1e-4;
    const double exact = kShear * 0.140577015 * std::pow(a, 4) * angle / L;
    double before = 1;
    for (const int n : {2, 4, 8}) {
        CAPTURE(n);
        const Result h = held(fmt::format(
            R"({}, "mesh": {{"generate": "box", "size": [{a}, {a}, {L}], "cells": [{n}, {n}, 3],
               "element": "T10"}}, "start": {{"place": [0.1, 0.2, 0]}},
               "sets": {{"one": {{"ball": {{"centre": [0, 0, -0.03], "radius": 1e-5}},
               "of": "nodes"}}}}, "hold": [{{"set": "z_min", "x": 0, "y": 0}},
               {{"set": "one", "z": 0}}, {{"set": "z_max", "x": 0, "y": 0, "angle": [[0, 0], [1, {angle}]],
               "about": [0.1, 0.2, 0]}}])",
            material("linear"), fmt::arg("a", a), fmt::arg("L", L), fmt::arg("n", n),
            fmt::arg("angle", angle)));
        const double error = std::abs(h.value("b_z_max_moment_z") / exact - 1);
        CAPTURE(error);
        CHECK(error < 0.3 * before);
        CHECK(h.vector("b_z_max_force").norm() < 1e-9 * exact / a);
        CHECK(std::hypot(h.value("b_z_max_moment_x"), h.value("b_z_max_moment_y")) < 1e-3 * exact);
        const EnergyRecord& e = h.summary.energy;
        CHECK(e.elastic ==
              doctest::Approx(0.5 * h.value("b_z_max_moment_z") * angle).epsilon(1e-7));
        CHECK(e.work == doctest::Approx(e.elastic).epsilon(1e-7));
        before = error;
    }
    CHECK(before < 4e-4);
}

TEST_CASE("a twisted round bar takes G J / L in the limit")
{
    const double r = 0.01, L = 0.04, angle = 1e-4;
    const double exact = kShear * std::numbers::pi * std::pow(r, 4) / 2 * angle / L;
    double before = 1;
    for (const int n : {8, 16, 32}) {
        CAPTURE(n);
        // No section warps: ends are held whole.
        const Result h = held(fmt::format(
            R"({}, "mesh": {{"generate": "cylinder", "radius": {}, "length": {}, "around": {},
               "along": 4, "element": "H8"}}, "hold": [{{"set": "start"}}, {{"set": "end",
               "angle": [[0, 0], [1, {}]]}}])",
            material("corotational"), r, L, n, angle));
        const double error = std::abs(h.value("b_end_moment_z") / exact - 1);
        CAPTURE(error);
        CHECK(error < 0.35 * before);
        before = error;
    }
    CHECK(before < 0.01);
}

TEST_CASE("simple shear of many elements in one hold is exact")
{
    // Linear: W = G g^2 / 2. Neo-Hooke: P = G (F - F^-T) without change of volume, W the same.
    const Vec3 size(0.3, 0.2, 0.1);
    const double volume = size.prod();
    for (const char* element : {"H8", "T4", "T10"})
        for (const char* motion : {"linear", "hyperelastic"}) {
            CAPTURE(std::string(element));
            CAPTURE(std::string(motion));
            const double g = *motion == 'l' ? 1e-3 : 0.4;
            const auto run = [&](const std::string& hold) {
                return held(fmt::format(
                    R"({}, "mesh": {{"generate": "box", "size": [0.3, 0.2, 0.1], "cells": [3, 2, 2],
                       "element": "{}"}}, "start": {{"place": [1, 2, 3]}}, "sets": {{"skin": {{"box":
                       {{"from": [-1, -1, -1], "to": [1, 1, 1]}}}}}}, "hold": [{}])",
                    material(motion), element, hold));
            };
            const std::string shear = fmt::format(
                R"("gradient": [[0, 0, {}], [0, 0, 0], [0, 0, 0]], "about": [1, 2, 2.95],
                               "over": [[0, 0], [1, 1]])",
                g);
            const Result whole = run(R"({"set": "skin", )" + shear + "}");
            const double exact = 0.5 * kShear * g * g * volume;
            CHECK(whole.summary.energy.elastic == doctest::Approx(exact).epsilon(1e-9));
            CHECK(whole.vector("b_skin_force").norm() < 1e-9 * kShear * g * 0.06);
            CHECK(whole.vector("b_skin_moment").norm() < 1e-9 * kShear * g * volume);
            CHECK(whole.value("b_max_displacement") == doctest::Approx(g * 0.1).epsilon(1e-12));
            // The top by itself: G g on its area. Tractions beside it are +-G g along z: of both
            // sides they cancel, but for their moment.
            const Result parts =
                run(R"({"set": "z_max", )" + shear + R"(}, {"set": "skin", )" + shear + "}");
            const double top = kShear * g * 0.06;
            CHECK((parts.vector("b_z_max_force") - Vec3(top, 0, 0)).norm() < 1e-9 * top);
            CHECK((parts.vector("b_skin_force") + Vec3(top, 0, 0)).norm() < 1e-9 * top);
            CHECK((parts.vector("b_z_max_moment") + parts.vector("b_skin_moment")).norm() <
                  1e-9 * top * 0.1);
        }
}

TEST_CASE("a solid whose holds turn it as a whole bears no strain, wherever it begins")
{
    for (const char* motion : {"corotational", "hyperelastic"})
        for (const char* axes : {"world", "body"}) {
            CAPTURE(std::string(motion));
            CAPTURE(std::string(axes));
            const std::string turn = fmt::format(
                R"("axis": [1, 2, -1], "about": [0.3, -0.2, 0.1], "angle": [[0, 0], [1, 2]], "axes": "{}")",
                axes);
            const Result h = held(
                fmt::format(
                    R"({}, "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.2], "cells": [1, 1, 2],
                       "element": "T10"}}, "start": {{"turn": [0.4, 0.2, -0.9], "place": [0.5, 0, 1]}},
                       "hold": [{{"set": "z_min", {}}}, {{"set": "z_max", {}}}])",
                    material(motion), turn, turn),
                R"("step": 0.1, "end": 1)");
            CHECK(h.records.size() == 11);
            const double force = kYoung * 0.01;
            CHECK(h.vector("b_z_max_force").norm() < 1e-9 * force);
            CHECK(h.vector("b_z_min_moment").norm() < 1e-9 * force);
            CHECK(h.summary.energy.elastic < 1e-12 * force * 0.1);
            // The farthest node from the axis has moved by 2 sin(1) of its distance.
            const Eigen::Quaterniond own(
                Eigen::AngleAxisd(Vec3(0.4, 0.2, -0.9).norm(), Vec3(0.4, 0.2, -0.9).normalized()));
            const Vec3 axis = Vec3(1, 2, -1).normalized(), about(0.3, -0.2, 0.1);
            double farthest = 0;
            for (int i = 0; i < 8; ++i) {
                const Vec3 X(i & 1 ? 0.05 : -0.05, i & 2 ? 0.05 : -0.05, i & 4 ? 0.1 : -0.1);
                const Vec3 arm =
                    *axes == 'w' ? Vec3(own * X + Vec3(0.5, 0, 1) - about) : Vec3(X - about);
                farthest = std::max(farthest, axis.cross(arm).norm());
            }
            CHECK(h.value("b_max_displacement") ==
                  doctest::Approx(2 * std::sin(1.0) * farthest).epsilon(1e-9));
        }
}

TEST_CASE("a bar that is bent by its ends takes its moment through them, turned with the scene")
{
    // The same bar along x, and turned by its start with holds along the world's axes.
    const auto bent = [](const std::string& start, const Eigen::Quaterniond& turn) {
        const auto text = [&](const Vec3& v) {
            const Vec3 w = turn * v;
            return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", w.x(), w.y(), w.z());
        };
        const Result h = held(
            fmt::format(
                R"({}, "mesh": {{"generate": "box", "size": [0.2, 0.02, 0.02], "cells": [6, 1, 1],
                   "element": "H8"}}, {} "hold": [{{"set": "x_min", "axis": {}, "about": {},
                   "angle": [[0, 0], [1, -0.3]]}}, {{"set": "x_max", "axis": {}, "about": {},
                   "angle": [[0, 0], [1, 0.3]]}}])",
                material("corotational"), start, text(Vec3::UnitZ()), text(Vec3(-0.1, 0, 0)),
                text(Vec3::UnitZ()), text(Vec3(0.1, 0, 0))),
            R"("step": 0.1, "end": 1)");
        CHECK(std::abs(h.summary.energy.error()) < 0.01 * h.summary.energy.elastic);
        return std::array{Vec3(turn.conjugate() * h.vector("b_x_max_moment")),
                          Vec3(turn.conjugate() * h.vector("b_x_min_moment")),
                          Vec3(turn.conjugate() * h.vector("b_x_max_force"))};
    };
    const Vec3 vector(0.5, -0.8, 1.1);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(vector.norm(), vector.normalized()));
    const auto straight = bent("", Eigen::Quaterniond::Identity()),
               turned = bent(R"("start": {"turn": [0.5, -0.8, 1.1]},)", turn);
    CHECK(straight[0].z() > 0);
    CHECK((straight[0] + straight[1]).norm() < 1e-6 * straight[0].norm());
    for (std::size_t k = 0; k < 3; ++k)
        CHECK((straight[k] - turned[k]).norm() < 1e-7 * straight[0].norm() * (k == 2 ? 100 : 1));
}

TEST_CASE(
    "holds that contradict themselves are refused, those that agree at an edge are not reported")
{
    const auto issue = [](const std::string& hold) {
        try {
            held(R"("youngs_modulus": 1e6, "poisson_ratio": 0.3, "mesh": {"generate": "box",
                "size": [1, 1, 1], "element": "H8"}, "hold": [)" +
                 hold + "]");
        } catch (const InputError& error) {
            return error.issues().at(0).place + ": " + error.issues().at(0).allowed;
        }
        return std::string();
    };
    const std::string gradient = R"("gradient": [[0, 0, 1], [0, 0, 0], [0, 0, 0]])";
    CHECK(issue(R"({"set": "z_min", "angle": 1, )" + gradient + "}") ==
          "/bodies/b/hold/0/angle: one of the two");
    CHECK(issue(R"({"set": "z_min", "over": 1})").find("a \"gradient\" beside it") !=
          std::string::npos);
    CHECK(issue(R"({"set": "z_min", "about": [0, 0, 1]})").find("/about") != std::string::npos);
    CHECK(issue(R"({"set": "z_min", "gradient": [[0, 0, 1], [0, 0, 0]]})").find("three rows") !=
          std::string::npos);
    // Nodes that two holds take along: reported where these differ, however they are written.
    const auto reported = [](const std::string& other) {
        const Scene scene = parse_scene(
            R"({"schema": 1, "bodies": {"b": {"kind": "solid", "youngs_modulus": 1e6,
            "poisson_ratio": 0.3, "mesh": {"generate": "box", "size": [1, 1, 1]}, "hold": [
            {"set": "z_min"}, {"set": "x_max", "about": [0, 0, -0.5], "gradient": )" +
                other + R"(, "over": [[0, 0], [1, 1e-3]]}]}}, "time": {"step": 1, "end": 1}})",
            "test.json", {});
        const VolumeMesh mesh = make_solid_box({Vec3::Constant(-0.5), Vec3::Constant(0.5)});
        return find_conditions(scene.solids[0], mesh, "test.json").warnings.size();
    };
    CHECK(reported("[[0, 0, 1], [0, 0, 0.5], [0, 0, 2]]") == 0);
    CHECK(reported("[[0, 1, 0], [0, 0, 0], [0, 0, 0]]") == 1);
}
