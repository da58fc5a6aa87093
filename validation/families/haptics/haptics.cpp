#include "validation/families/haptics/haptics.hpp"

#include "contact/solvers/solve.hpp"
#include "haptics/link/body_link.hpp"
#include "haptics/link/settings.hpp"
#include "haptics/tests/closed_forms.hpp"
#include "haptics/tests/virtual_wall.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

using namespace amontons::test;

constexpr double kStiffness = 500, kSpeed = 0.1, kTick = 1e-3; // [N/m], [m/s], [s]

template <class Real> constexpr const char* kName = sizeof(Real) == 8 ? "double" : "single";
/// What the loop is allowed in either precision.
template <class Real> constexpr double kSame = sizeof(Real) == 8 ? 1e-9 : 1e-5;
template <class Real> constexpr double kConsistent = sizeof(Real) == 8 ? 1e-8 : 1e-5;

// ---- F03

/// Largest change of the force from tick to tick, and largest error, on a line swept at 0.1 m/s.
struct Sweep {
    double error = 0, jump = 0; // [N]
    Vec3 last = Vec3::Zero();
    bool begun = false;

    void add(const Vec3& force, const Vec3& expected)
    {
        raise_to(error, (force - expected).norm());
        if (begun) raise_to(jump, (force - last).norm());
        last = force;
        begun = true;
    }
};

template <class Real> void add_god_object(std::vector<Measured>& rows)
{
    const auto row = [&](const char* what, double error) {
        rows.push_back(at_most(fmt::format("{}, {}: error of the force", what, kName<Real>), error,
                               kSame<Real>));
    };
    const auto jump_row = [&](const char* what, double jump, double speed) {
        rows.push_back(
            at_most(fmt::format("{}, {}: largest change of the force in a tick, of K v T", what,
                                kName<Real>),
                    jump / (kStiffness * speed * kTick), 1 + 1e-3));
    };
    for (const double mu : {0.0, 0.5}) {
        const ReducedOperator<Real> op = planes<Real>({Vec3::UnitZ()}, mu, kStiffness);
        ProxyLoop<Real> loop(1, exact<Real>());
        loop.take(op, 0);
        Sweep sweep;
        for (int k = 0; k <= 200; ++k) { // 5 mm deep; with friction the proxy lags by 2.5 mm
            const Vec3 d{kSpeed * kTick * k, 0, -0.005};
            const double lag = mu > 0 ? std::min(d[0], mu * 0.005) : 0;
            sweep.add(loop.tick(at(d), kTick * k).wrench.force, kStiffness * Vec3(-lag, 0, 0.005));
        }
        const char* what = mu > 0 ? "plane, friction 0.5" : "plane";
        row(what, sweep.error / 2.5);
        if (mu > 0) jump_row(what, sweep.jump, kSpeed); // without, the force is constant
    }

    const ReducedOperator<Real> corner =
        planes<Real>({Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()}, 0, kStiffness);
    ProxyLoop<Real> in_corner(3, exact<Real>());
    in_corner.take(corner, 0);
    const Vec3 F = in_corner.tick(at({-0.001, -0.002, -0.003}), 0).wrench.force;
    row("corner", (F - Vec3(0.5, 1, 1.5)).norm() / Vec3(0.5, 1, 1.5).norm());

    double error = 0, jump = 0, speed = 0;
    const Vec3 a = Vec3{1, 0.2, 0}.normalized();
    for (const Vec3& b :
         {Vec3(0, 0, 1), Vec3(Vec3{-0.3, 0, 1}.normalized()), Vec3(Vec3{0.7, 0, 1}.normalized())}) {
        const ReducedOperator<Real> wedge = planes<Real>({a, b}, 0, kStiffness);
        ProxyLoop<Real> loop(2, exact<Real>());
        loop.take(wedge, 0);
        Sweep sweep;
        const Vec3 way{-1e-4, 0, 0.9e-4}; // a tick
        for (int k = 0; k <= 400; ++k) {
            const Vec3 d = Vec3{0.015, 0.01, -0.018} + k * way;
            sweep.add(loop.tick(at(d), kTick * k).wrench.force,
                      kStiffness * (nearest(a, b, d) - d));
        }
        raise_to(error, sweep.error / (kStiffness * 0.02));
        raise_to(jump, sweep.jump);
        speed = way.norm() / kTick;
    }
    row("edges of two planes, three angles", error);
    jump_row("edges of two planes", jump, speed);
}

// ---- F06

/// The force of the loop at the operator's own state, against `solve` of the same problem.
template <class Real> void add_same_state(std::vector<Measured>& rows)
{
    Bed bed; // twelve points of a rigid tool on an elastic half-space
    bed.points = grid(12, 6e-3);
    bed.shear = 2e4;
    ReducedOperator<Real> op(12);
    double worst = 0, worst_torque = 0;
    for (const bool tilted : {false, true}) {
        const HandPose pose{{0.001, 0, -0.002},
                            turn(tilted ? Vec3(0.02, -0.05, 0.3) : Vec3(0, 0, 0))};
        publish(op, bed, pose, 0, 1);
        for (int i = 0; i < op.contacts; ++i) // some stick, some slip
            op.contact[static_cast<std::size_t>(i)].q += Vec3{0, 2e-4, -4e-4 * i / 12.0};
        SolverOptions options;
        options.tolerance = 1e-12;
        const ContactSolution full = solve(contact_problem(op), options);
        ProxyLoop<Real> loop(12, exact<Real>());
        loop.take(op, 0);
        const Wrench w = loop.tick(pose, 0).wrench;
        Vec6 F = Vec6::Zero();
        for (int i = 0; i < op.contacts; ++i)
            F += op.contact[static_cast<std::size_t>(i)].J.transpose() *
                 full.reaction.segment<3>(3 * i);
        raise_to(worst, (w.force - F.head<3>()).norm() / F.head<3>().norm());
        raise_to(worst_torque, (w.torque - F.tail<3>()).norm() / F.tail<3>().norm());
    }
    rows.push_back(at_most(
        fmt::format("same state, {}: force of the loop against the full solve", kName<Real>), worst,
        kConsistent<Real>));
    rows.push_back(at_most(fmt::format("the same of its torque, {}", kName<Real>), worst_torque,
                           kConsistent<Real>));
}

/// An elastic tool, clamped to the hand, on a clamped elastic block: beside its middle, for a
/// torque.
const char* const kBlocks = R"({
  "schema": 1,
  "bodies": {
    "block": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
              "mesh": {"generate": "box", "size": [0.08, 0.04, 0.02], "cells": [8, 4, 2],
                       "element": "H8"},
              "hold": [{"set": "z_min"}]},
    "tool": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
             "mesh": {"generate": "box", "size": [0.02, 0.02, 0.02], "cells": [3, 3, 3],
                      "element": "H8"},
             "start": {"place": [0.006, 0.004, 0.0205]},
             "hold": [{"set": "z_max"}], "drive": {"z": [[0, 0], [1, -0.004]]}}
  },
  "contact": [{"between": ["tool", "block"], "friction": 0.3, "sliding": "small"}],
  "accuracy": {"contact": 1e-12},
  "haptic": {"handle": "tool", "device": "touch", "simulation_rate": 50},
  "time": {"step": 0.02, "end": 1}
})";

/// Reduced against full forces of a scene, at the operator's pose and a way further on.
struct StackedBlocks {
    Scene scene = parse_scene(kBlocks, "(haptics)");
    std::vector<Obstacle> obstacles = build_obstacles(scene);
    HapticSettings set = make_settings(scene.haptic, device_profile(scene.haptic.device), 0);
    BodyLink link{scene, obstacles, set.link};

    HandPose down(double depth) const
    {
        HandPose pose = link.start();
        pose.position[2] -= depth;
        return pose;
    }
    /// Presses 2 mm deep in four steps, waits, publishes, and continues by `way` in 20 ticks.
    /// @return  error of the force and of the torque
    std::pair<double, double> errors(double way)
    {
        link.step(link.start());
        // A step's torque is that about arms of its start: they come to rest.
        for (const double depth : {5e-4, 1e-3, 1.5e-3, 2e-3, 2e-3, 2e-3, 2e-3})
            link.step(down(depth));
        ReducedOperator<double> op(300);
        link.publish(op, 0, 1);
        ProxyLoop<double> loop(300, exact<double>());
        loop.take(op, 0);
        ProxyTick tick = loop.tick(op.handle, 0);
        for (int k = 1; way > 0 && k <= 20; ++k)
            tick = loop.tick(down(2e-3 + way * k / 20), kTick * k);
        if (way > 0) link.step(down(2e-3 + way));
        const Wrench full = link.held().force();
        return {(tick.wrench.force - full.force).norm() / full.force.norm(),
                (tick.wrench.torque - full.torque).norm() / full.torque.norm()};
    }
};

} // namespace

std::vector<Measured> virtual_wall()
{
    std::vector<Measured> rows;
    const auto row = [&](const VirtualWall& w, double reference) {
        rows.push_back(relative(fmt::format("largest stable stiffness, {:g} kg, damper {:g} N s/m, "
                                            "delay {} ticks [N/m]",
                                            w.mass, w.B, w.delay),
                                reference, stable_limit(w), 0.01));
    };
    row({0, 0.1, 0.5, 0}, 1000.83403);
    row({0.2, 0.1, 0.5, 0}, 1398.37509);
    row({0, 0.01, 0.5, 0}, 1008.40301);
    row({0, 0.1, 0.5, 1}, 333.7956);
    row({0.2, 0.1, 0.5, 1}, 466.2798);
    row({0, 1, 0.5, 1}, 333.3796);
    rows.push_back(left_out("F01: passive stiffness, 2 (b - |B|)/T = 1000 and 600 N/m",
                            "passivity is against every hand; simulated is one mass, its limit of "
                            "stability"));
    rows.push_back(
        at_most("stable without any damping, 20 N/m", stable({0, 0.1, 0, 0}, 20) ? 1 : 0, 0));
    return rows;
}

std::vector<Measured> god_object()
{
    std::vector<Measured> rows;
    add_god_object<double>(rows);
    add_god_object<float>(rows);
    return rows;
}

std::vector<Measured> reduced_operator()
{
    std::vector<Measured> rows;
    add_same_state<double>(rows);
    add_same_state<float>(rows);
    const std::pair<const char*, double> ways[] = {{"same state", 0}, {"1 mm further on", 1e-3}};
    for (const auto& [where, way] : ways) {
        const auto [force, torque] = StackedBlocks().errors(way);
        rows.push_back(at_most(fmt::format("two elastic blocks, {}: force", where), force, 1e-8));
        rows.push_back(at_most(fmt::format("two elastic blocks, {}: torque", where), torque, 1e-8));
    }
    rows.push_back(left_out("F06: error of a stale state, sweeps at 0.05 and 0.5 m/s",
                            "of the order of the way since the last update, with no number to "
                            "compare with; haptic_truth measures it by distance"));
    return rows;
}

} // namespace amontons::validation
