// Joints, springs and distances that act on patches of solids (docs/theory/joints.md).

#include "mesh/format/read_volume.hpp"
#include "mesh/generate/solid_box.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <atomic>
#include <cmath>
#include <doctest/doctest.h>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <unistd.h>

using namespace amontons;

namespace {

constexpr double kE = 1e6, kLong = 0.1, kWide = 0.02; // a square bar
constexpr double kEA = kE * kWide * kWide, kEI = kE * kWide * kWide * kWide * kWide / 12;

std::string text(const Vec3& v)
{
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z());
}

/// A bar from (0, 0, 0) along x as a file of plain text, its inner nodes moved about and its nodes
/// in any order.
std::string bar_file(ElementKind kind, std::array<std::int32_t, 3> cells, double shake,
                     bool reorder)
{
    VolumeMesh mesh = make_solid_box({Vec3(0, -kWide / 2, -kWide / 2),
                                      Vec3(kLong, kWide / 2, kWide / 2),
                                      cells,
                                      {1, 1, 1},
                                      kind == ElementKind::T10 ? ElementKind::T4 : kind});
    std::mt19937 engine(5);
    std::uniform_real_distribution<> random(-1, 1);
    const Vec3 cell(kLong / cells[0], kWide / cells[1], kWide / cells[2]);
    const auto inside = [](double x, double low, double high) { return x > low && x < high; };
    for (Vec3& x : mesh.nodes) {
        const Vec3 by =
            shake * cell.cwiseProduct(Vec3(random(engine), random(engine), random(engine)));
        const double w = kWide / 2 * (1 - 1e-9), l = kLong * 1e-9;
        if (inside(x.x(), l, kLong - l)) x.x() += by.x();
        if (inside(x.y(), -w, w)) x.y() += by.y();
        if (inside(x.z(), -w, w)) x.z() += by.z();
    }
    if (kind == ElementKind::T10) { // straight edges
        std::map<std::array<std::int32_t, 2>, std::int32_t> middle;
        ElementBlock block{ElementKind::T10, {}};
        const std::vector<std::int32_t> corners = mesh.blocks[0].nodes;
        for (std::size_t e = 0; e < corners.size(); e += 4) {
            block.nodes.insert(block.nodes.end(), &corners[e], &corners[e] + 4);
            for (const auto& [i, j] : {std::array{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}) {
                const auto [a, b] =
                    std::minmax(corners[e + std::size_t(i)], corners[e + std::size_t(j)]);
                const auto [at, is_new] = middle.insert({{a, b}, std::int32_t(mesh.nodes.size())});
                if (is_new)
                    mesh.nodes.push_back(0.5 *
                                         (mesh.nodes[std::size_t(a)] + mesh.nodes[std::size_t(b)]));
                block.nodes.push_back(at->second);
            }
        }
        mesh.blocks = {block};
    }
    if (reorder) {
        std::vector<std::int32_t> order(mesh.nodes.size());
        std::iota(order.begin(), order.end(), 0);
        std::ranges::shuffle(order, engine);
        std::vector<Vec3> nodes(mesh.nodes.size());
        for (std::size_t i = 0; i < order.size(); ++i)
            nodes[std::size_t(order[i])] = mesh.nodes[i];
        mesh.nodes = nodes;
        for (std::int32_t& n : mesh.blocks[0].nodes)
            n = order[std::size_t(n)];
    }
    mesh.face_sets.clear();
    mesh.node_sets.clear();
    mesh.element_sets.clear();
    // Tests that run side by side have folders of their own.
    const auto folder =
        std::filesystem::temp_directory_path() / fmt::format("amontons_patch_joint_{}", getpid());
    std::filesystem::create_directories(folder);
    const std::string path = (folder / "bar.nodes").string();
    write_volume(path, mesh);
    return path;
}

struct Loaded {
    double force = 0, torque = 0; ///< along and about the world's z where not turned; x: pull
    double pull = 0;
    double poisson = 0;
    std::string patch = R"("set": "tip")";
    std::string axis;                                         ///< of the weld
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity(); ///< of the whole scene
};

/// A bar that is held at x = 0, with a rigid arm welded to its tip that loads it.
/// @return  how the arm moved, turned back [m], and its turn about the bar's z [rad]
struct Moved {
    Vec3 shift, turn;
};
Moved loaded_bar(const std::string& mesh, const std::string& motion, const Loaded& l)
{
    const Eigen::AngleAxisd own(l.turn);
    const Vec3 arm(kLong + 0.01, 0, 0);
    const std::string material =
        motion == "hyperelastic"
            ? fmt::format(R"("material": {{"law": "neo_hooke", "youngs_modulus": {},
                             "poisson_ratio": {}}})",
                          kE, l.poisson)
            : fmt::format(R"("youngs_modulus": {}, "poisson_ratio": {}, "motion": "{}")", kE,
                          l.poisson, motion);
    const Result d = done(fmt::format(
        R"("bodies": {{"bar": {{"kind": "solid", {}, "mesh": {{"file": "{}"}}, "start": {{"turn": {}}},
            "sets": {{"root": {{"plane": {{"at": [0, 0, 0], "normal": [1, 0, 0]}}}},
                      "tip": {{"plane": {{"at": [{}, 0, 0], "normal": [1, 0, 0]}}}}}},
            "hold": [{{"set": "root"}}]}},
            "arm": {{"kind": "rigid", "mass": 1, "force": {}, "torque": {}, "start": {{"place": {},
            "turn": {}}}, "shape": {{"generate": "box", "size": [0.02, 0.02, 0.02]}}}}}},
            "couplings": [{{"kind": "weld", "between": ["bar", "arm"], "at": {}, {}{}}}],
            "accuracy": {{"contact": 1e-11}}, "time": {{"step": 1, "end": 1}})",
        material, mesh, text(own.angle() * own.axis()), kLong,
        text(l.turn * Vec3(l.pull, l.force, 0)), text(l.turn * Vec3(0, 0, l.torque)),
        text(l.turn * arm), text(own.angle() * own.axis()), text(l.turn * Vec3(kLong, 0, 0)),
        l.patch, l.axis));
    return {l.turn.conjugate() * d.vector("arm") - arm, l.turn.conjugate() * d.vector("arm_turn")};
}

} // namespace

TEST_CASE("a welded bar without Poisson's ratio is EA/L long on every mesh and bends by EI/L")
{
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T4, ElementKind::T10})
        for (const double shake : {0.0, 0.3}) {
            const std::string mesh = bar_file(kind, {4, 2, 2}, shake, false);
            for (const char* motion : {"linear", "corotational", "hyperelastic"}) {
                CAPTURE(shape_of(kind).name);
                CAPTURE(shake);
                CAPTURE(std::string(motion));
                Loaded pulled, bent;
                pulled.pull = 1e-7 * kEA; // small: neo-Hooke is not linear
                CHECK(loaded_bar(mesh, motion, pulled).shift.x() * kEA / kLong ==
                      doctest::Approx(pulled.pull).epsilon(1e-6));
                bent.torque = 1e-5 * kEI / kLong;
                const double turned = loaded_bar(mesh, motion, bent).turn.z() * kEI / kLong;
                if (kind == ElementKind::T10 || (kind == ElementKind::H8 && shake == 0))
                    CHECK(turned == doctest::Approx(bent.torque).epsilon(1e-6));
            }
        }
    // Elsewhere it converges.
    for (const ElementKind kind : {ElementKind::T4, ElementKind::H8}) {
        CAPTURE(shape_of(kind).name);
        double before = 10;
        for (const std::int32_t n : {1, 2, 4}) {
            Loaded bent;
            bent.torque = 1e-5 * kEI / kLong;
            const Moved m =
                loaded_bar(bar_file(kind, {4 * n, 2 * n, 2 * n}, 0.2, false), "linear", bent);
            const double error = std::abs(m.turn.z() * kEI / kLong / bent.torque - 1);
            CAPTURE(error);
            CHECK(error < (kind == ElementKind::T4 ? 0.7 : 0.4) * before);
            before = error;
        }
        CHECK(before < (kind == ElementKind::T4 ? 0.25 : 0.03));
    }
}

TEST_CASE("a joint on a solid depends on no order of nodes, no axis that it has not and no turn")
{
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10})
        for (const char* patch : {R"("set": "tip")", R"("radius": 0.008)"})
            for (const char* motion : {"linear", "corotational", "hyperelastic"}) {
                CAPTURE(shape_of(kind).name);
                CAPTURE(std::string(patch));
                CAPTURE(std::string(motion));
                Loaded l;
                l.pull = 2e-3 * kEA;
                l.force = 0.3 * kEI / (kLong * kLong);
                l.torque = 0.1 * kEI / kLong;
                l.poisson = 0.3;
                l.patch = patch;
                const std::string mesh = bar_file(kind, {3, 2, 2}, 0.2, false);
                const Moved as_it_is = loaded_bar(mesh, motion, l);
                const auto same = [&](const Moved& m) {
                    CHECK((m.shift - as_it_is.shift).norm() < 1e-7 * as_it_is.shift.norm());
                    return (m.turn - as_it_is.turn).norm() < 1e-7 * as_it_is.turn.norm();
                };
                l.axis = R"(, "axis": [1, 2, -1])";
                CHECK(same(loaded_bar(mesh, motion, l)));
                l.axis = "";
                CHECK(same(loaded_bar(bar_file(kind, {3, 2, 2}, 0.2, true), motion, l)));
                l.turn = Eigen::AngleAxisd(1.4, Vec3(0.7, -1.1, 0.4).normalized());
                same(
                    loaded_bar(mesh, motion, l)); // its turn is distinguished from where it started
            }
}

TEST_CASE("a weld within a radius converges with the mesh" * doctest::test_suite("slow"))
{
    // A pad that an arm turns about its normal by a disc in the middle of its top.
    const auto stiffness = [](const char* element, int n) {
        const Result d = done(fmt::format(
            R"("bodies": {{"pad": {{"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
                "mesh": {{"generate": "box", "size": [0.06, 0.06, 0.03], "cells": [{0}, {0}, {1}],
                "element": "{2}"}}, "hold": [{{"set": "z_min"}}]}},
                "arm": {{"kind": "rigid", "mass": 1, "torque": [0, 0, 1e-4], "force": [0, 0, -0.01],
                "shape": {{"generate": "ball", "radius": 0.01}}, "start": {{"place": [0, 0, 0.025]}}}}}},
                "couplings": [{{"kind": "weld", "between": ["arm", "pad"], "at": [0, 0, 0.015],
                "radius": 0.012}}], "time": {{"step": 1, "end": 1}})",
            n, n / 2, element));
        return std::array{1e-4 / d.value("arm_turn_z"), 0.01 / (0.025 - d.value("arm_z"))};
    };
    const auto fine = stiffness("T10", 16);
    std::array<double, 2> before{10, 10};
    for (const int n : {4, 8, 16}) {
        CAPTURE(n);
        const auto now = stiffness("H8", n);
        for (std::size_t k = 0; k < 2; ++k) {
            const double error = std::abs(now[k] / fine[k] - 1);
            CAPTURE(error);
            CHECK(error < 0.75 * before[k]);
            before[k] = error;
        }
    }
    CHECK(before[0] < 0.1);
    CHECK(before[1] < 0.05);
}

TEST_CASE("two welded bars are one, and springs act on patches with their own stiffness")
{
    const std::string half = R"("kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0,
        "motion": "corotational", "mesh": {"generate": "box", "size": [0.1, 0.02, 0.02],
        "cells": [4, 2, 2], "element": "H8")";
    const double pull = 1e-5 * kEA, torque = 1e-5 * kEI / kLong;
    // The second bar begins where the first ends; a spring and a turn spring hold the first.
    const double k = 2 * kEA / kLong, k_turn = 3 * kEI / kLong;
    const auto run = [&](double force, double moment, const std::string& root) {
        return done(fmt::format(
            R"("bodies": {{"a": {{{}, "centre": [0.05, 0, 0]}}}}, "b": {{{}, "centre": [0.15, 0, 0]}}}},
                "arm": {{"kind": "rigid", "mass": 1, "force": [{:.17g}, 0, 0],
                "torque": [0, 0, {:.17g}], "start": {{"place": [0.21, 0, 0]}}, "shape": {{"generate":
                "box", "size": [0.02, 0.02, 0.02]}}}}}}, "couplings": [
                {{"kind": "weld", "between": ["a", "b"], "at": [0.1, 0, 0], "set": "x_max",
                  "to_set": "x_min"}},
                {{"kind": "weld", "between": ["b", "arm"], "at": [0.2, 0, 0], "set": "x_max"}}, {}],
                "accuracy": {{"contact": 1e-10}}, "time": {{"step": 1, "end": 1}})",
            half, half, force, moment, root));
    };
    const std::string slider = R"({"kind": "slider", "between": ["a", "world"], "at": [0, 0, 0],
        "axis": [1, 0, 0], "set": "x_min"}, )";
    const Result longer = run(pull, 0,
                              slider + fmt::format(R"({{"kind": "spring", "between": ["a", "world"],
        "at": [0, 0, 0], "to": [-0.1, 0, 0], "stiffness": {:.17g}, "set": "x_min"}})",
                                                   k));
    CHECK(longer.value("arm_x") - 0.21 ==
          doctest::Approx(pull * (1 / k + 2 * kLong / kEA)).epsilon(1e-6));
    const Result turned = run(0, torque,
                              R"({"kind": "hinge", "between": ["a", "world"], "at": [0, 0, 0],
        "axis": [0, 0, 1], "set": "x_min"}, )" +
                                  fmt::format(R"({{"kind": "turn_spring", "between": ["a", "world"],
        "axis": [0, 0, 1], "stiffness": {:.17g}, "set": "x_min"}})",
                                              k_turn));
    CHECK(turned.value("arm_turn_z") ==
          doctest::Approx(torque * (1 / k_turn + 2 * kLong / kEI)).epsilon(1e-6));
    CHECK(std::abs(turned.value("a_on_world_coupling_3_moment_z")) ==
          doctest::Approx(torque).epsilon(1e-6));
}

TEST_CASE("a pad that is welded at its top takes the force of the whole top")
{
    const auto pressed = [](const char* patch, const char* element, int n) {
        return done(fmt::format(
            R"("bodies": {{"floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
            "pad": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.06, 0.06, 0.06],
                "cells": [{0}, {0}, {0}], "element": "{1}"}}, "start": {{"place": [0, 0, 0.03]}},
                "youngs_modulus": 100000, "poisson_ratio": 0.2}},
            "arm": {{"kind": "rigid", "shape": {{"generate": "box", "size": [0.06, 0.06, 0.02]}},
                "start": {{"place": [0, 0, 0.07]}}, "drive": {{"z": [[0, 0], [1, -0.0012]]}}}}}},
            "couplings": [{{"kind": "weld", "between": ["pad", "arm"], "at": [0, 0, 0.06]{2}}}],
            "contact": [{{"between": ["pad", "floor"], "friction": 0.8}}],
            "time": {{"step": 0.5, "end": 1}})",
            n, element, patch));
    };
    for (const char* element : {"T4", "T10", "H8"})
        CHECK(pressed(R"(, "set": "z_max")", element, 3).value("floor_on_pad_force_z") > 7.2);
    const auto refused = [&](const char* patch, const char* place, const char* words) {
        try {
            pressed(patch, "H8", 1);
            FAIL("accepted");
        } catch (const InputError& error) {
            REQUIRE(error.issues().size() == 1);
            CHECK(error.issues()[0].place == place);
            CHECK(error.issues()[0].allowed.find(words) != std::string::npos);
        }
    };
    refused("", "/couplings/0/set",
            R"("set": a set of faces of "pad", or "radius" [m] about "at")");
    refused(R"(, "set": "z_mx")", "/couplings/0/set", R"("z_max" (nearest name))");
    refused(R"(, "set": "z_max", "radius": 0.01)", "/couplings/0/set", "either a set or a radius");
    refused(R"(, "set": "z_max", "to_set": "z_min")", "/couplings/0/to_set", "\"set\"");
}

namespace {

struct Swing {
    double end = 0, drift = 0; ///< largest displacement [m]; of energy, of the largest kinetic one
};

/// An elastic bar that is released on a joint at its end.
Swing swing(const std::string& material, const std::string& joint, const std::string& rule,
            double h, double end)
{
    const Result d = done(fmt::format(
        R"("bodies": {{"bar": {{"kind": "solid", {}, "density": 1000, "mesh": {{"generate": "box",
            "size": [0.2, 0.02, 0.02], "centre": [0.1, 0, 0], "cells": [8, 1, 1],
            "element": "H8"}}}}}}, "gravity": [0, 0, -9.81], "couplings": [{{"between":
            ["bar", "world"], {}}}], "accuracy": {{"contact": 1e-11}},
            "time": {{"kind": "dynamic", "step": {:.17g}, "end": {:.17g}, {}}})",
        material, joint, h, end, rule));
    Swing s{d.value("bar_max_displacement"), 0};
    double kinetic = 0, first = 0, most = 0;
    for (std::size_t k = 0; k < d.records.size(); ++k) {
        const EnergyRecord& e = d.records[k].energy;
        const double total = e.kinetic + e.elastic - e.work;
        if (k == 0) first = total;
        kinetic = std::max(kinetic, e.kinetic);
        most = std::max(most, std::abs(total - first));
    }
    s.drift = most / kinetic;
    return s;
}

const std::string kLinear = R"("youngs_modulus": 2e6, "poisson_ratio": 0.3)";
const std::string kCorotational = kLinear + R"(, "motion": "corotational")";
const std::string kNeoHooke =
    R"("material": {"law": "neo_hooke", "youngs_modulus": 2e6, "poisson_ratio": 0.3})";
const std::string kHinge = R"("kind": "hinge", "at": [0, 0, 0], "axis": [0, 1, 0], "set": "x_min")";
const std::string kBall = R"("kind": "ball", "at": [0, 0, 0.01], "radius": 0.012)";
const std::string kSpring =
    R"("kind": "spring", "at": [0, 0, 0], "to": [0, 0.01, 0.1], "stiffness": 60, "set": "x_min")";
const std::string kMidpointRule = R"("theta": 0.5)";
const std::string kAlphaRule = R"("rule": "generalised_alpha", "spectral_radius": 0.8)";

} // namespace

TEST_CASE("elastic bars on patches move with an error of second order" *
          doctest::test_suite("slow"))
{
    // Linear and corotational ones with stiffness damping: no step here follows single elements.
    const std::string damped = R"(, "stiffness_damping": 3e-4)";
    for (const std::string& material : {kLinear + damped, kNeoHooke})
        for (const std::string& joint : {kHinge, kBall, kSpring})
            for (const std::string& rule : {kMidpointRule, kAlphaRule}) {
                CAPTURE(material);
                CAPTURE(joint);
                CAPTURE(rule);
                const auto end = [&](double h) {
                    return swing(material, joint, rule, h, 0.15).end;
                };
                const double exact = end(1e-3 / 32), whole = std::abs(end(1e-3) - exact),
                             quarter = std::abs(end(2.5e-4) - exact);
                CAPTURE(whole);
                CAPTURE(quarter);
                CHECK(whole < 5e-5);
                CHECK(0.5 * std::log2(whole / quarter) > 1.8);
            }
}

TEST_CASE("joints on patches keep the energy of the solids on them" * doctest::test_suite("slow"))
{
    for (const std::string& material : {kCorotational, kNeoHooke})
        for (const std::string& joint : {kHinge, kBall, kSpring})
            for (const std::string& rule : {kMidpointRule, kAlphaRule}) {
                CAPTURE(material);
                CAPTURE(joint);
                CAPTURE(rule);
                // What the solids' own rule misses is of this size, whatever holds them.
                CHECK(swing(material, joint, rule, 1e-3, 1).drift <
                      (rule == kMidpointRule ? 3e-4 : 3e-3));
            }
}

TEST_CASE("a linear solid on springs that does not turn keeps its energy to rounding")
{
    const Result d = done(R"("bodies": {"block": {"kind": "solid", "youngs_modulus": 1e5,
        "poisson_ratio": 0.3, "density": 1000, "start": {"velocity": [0, 0, 0.3]}, "mesh":
        {"generate": "box", "size": [0.04, 0.04, 0.1], "cells": [2, 2, 5], "element": "H8"}}},
        "couplings": [{"kind": "spring", "between": ["block", "world"], "at": [0, 0, 0.05],
        "to": [0, 0, 0.3], "stiffness": 300, "set": "z_max"}],
        "accuracy": {"contact": 1e-12},
        "time": {"kind": "dynamic", "step": 1e-3, "end": 1, "theta": 0.5})");
    double drift = 0;
    const auto total = [&](std::size_t k) {
        const EnergyRecord& e = d.records[k].energy;
        return e.kinetic + e.elastic - e.work;
    };
    for (std::size_t k = 0; k < d.records.size(); ++k)
        drift = std::max(drift, std::abs(total(k) - total(0)));
    CHECK(drift < 1e-10 * total(0));
}

TEST_CASE("stiffness damping of a corotational solid takes rates of strain, not turns")
{
    // One that spins freely keeps energy and angular momentum, stretched by its spin as it is.
    const auto spin = [](const char* rule) {
        const Result d = done(fmt::format(R"("bodies": {{"bar": {{"kind": "solid", "density": 1000,
            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "motion": "corotational",
            "stiffness_damping": 1e-3, "start": {{"spin": [0, 0, 10]}}, "mesh": {{"generate": "box",
            "size": [0.1, 0.02, 0.02], "cells": [4, 1, 1], "element": "H8"}}}}}},
            "accuracy": {{"contact": 1e-11}},
            "time": {{"kind": "dynamic", "step": 1e-3, "end": 0.5, {}}})",
                                          rule));
        const double L = value(d.records.front(), "angular_momentum_z");
        CHECK(d.value("angular_momentum_z") == doctest::Approx(L).epsilon(1e-6));
        const EnergyRecord &first = d.records.front().energy, &last = d.summary.energy;
        return (last.kinetic + last.elastic) / first.kinetic;
    };
    CHECK(spin(R"("theta": 0.5)") == doctest::Approx(1).epsilon(1e-4));
    CHECK(spin(R"("rule": "generalised_alpha", "spectral_radius": 0.8)") ==
          doctest::Approx(1).epsilon(1e-3));
    // A bending mode that does not turn is damped as a linear solid's.
    const auto bends = [](const char* motion) {
        return done(fmt::format(R"("bodies": {{"bar": {{"kind": "solid", "density": 1000,
            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "motion": "{}", "stiffness_damping": 2e-3,
            "hold": [{{"set": "x_min"}}], "loads": [{{"set": "x_max", "force": [0, 0, 1e-4],
            "over": [[0, 1], [0.02, 1], [0.0201, 0]]}}], "mesh": {{"generate": "box",
            "size": [0.1, 0.02, 0.02], "cells": [4, 1, 1], "element": "H8"}}}}}},
            "accuracy": {{"contact": 1e-11}},
            "time": {{"kind": "dynamic", "step": 1e-3, "end": 0.2, "theta": 0.5}})",
                                motion));
    };
    const Result linear = bends("linear"), turning = bends("corotational");
    double most = 0;
    for (const StepRecord& r : linear.records)
        most = std::max(most, value(r, "bar_max_displacement"));
    CHECK(linear.value("bar_max_displacement") < 0.5 * most);
    for (std::size_t k = 0; k < linear.records.size(); ++k)
        CHECK(std::abs(value(linear.records[k], "bar_max_displacement") -
                       value(turning.records[k], "bar_max_displacement")) < 1e-3 * most);
}
