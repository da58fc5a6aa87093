#include "validation/families/wires/wires.hpp"
#include "validation/scene_run.hpp"
#include "validation/vibrating_wire.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <stdexcept>

namespace amontons::validation {
namespace {

constexpr double kRoot = 1.87510406871196; // first of cosh x cos x = -1

double frequency(const VibratingWire& w)
{
    return kRoot * kRoot * std::sqrt(w.EI / (w.mass_per_length() * std::pow(w.length, 4)));
}

enum class Mode { bending, torsion };

/// The first mode of a wire that was bent or twisted at its tip and released.
/// @param h  step [s]
Oscillation vibrate(const VibratingWire& w, double omega, double h, Mode mode = Mode::bending)
{
    WireBody b = make_body(w);
    const bool bend = mode == Mode::bending;
    const auto step = [&] {
        const StepReport r = try_step(b, w.length, 0, h);
        if (!r.accepted) throw std::runtime_error(r.refusal);
    };
    // 1e-3 of the length: bending by more would lower the frequency by more than 1e-6
    b.wire.dead_force.assign(b.wire.material.node.size(), Vec3::Zero());
    b.wire.dead_moment = b.wire.dead_force;
    if (bend)
        b.wire.dead_force.back().y() = 3e-3 * w.EI / (w.length * w.length);
    else
        b.wire.dead_moment.back().x() = 1e-3 * w.EI / w.length;
    b.motion.dynamic = false;
    step();
    b.motion.dynamic = true;
    b.wire.dead_force.clear();
    b.wire.dead_moment.clear();
    // Higher modes die out first: 3 periods, then 2 to measure.
    const double period = 2 * std::numbers::pi / omega;
    std::vector<double> tip;
    for (int i = 0; i < int(std::lround(5 * period / h)); ++i) {
        step();
        const BeamNode& n = b.wire.state.nodes.back();
        if (i * h >= 3 * period) tip.push_back(bend ? n.x[1] : n.q[1]);
    }
    return fit_oscillation(tip);
}

double order(double coarse, double fine)
{
    return std::log2(std::abs(coarse / fine));
}

} // namespace

// For one mode implicit Euler is z = 1 / (1 - i omega h): frequency atan(omega h) / h and decay
// ln(1 + omega^2 h^2) / (2 h). Undone, it leaves the frequency of the mesh.
std::vector<Measured> cantilever_frequency()
{
    std::vector<Measured> rows;
    VibratingWire w;
    w.radius = 1e-3 * w.length; // rotary inertia of the sections: 6e-7 of the frequency
    const double omega = frequency(w), period = 2 * std::numbers::pi / omega;

    double miss[3];
    for (int k = 0; k < 3; ++k) {
        w.elements = 10 << k;
        const double h = period / 40;
        const double found = std::tan(vibrate(w, omega, h).angle) / h;
        miss[k] = found / omega - 1;
        // Masses at the nodes are the trapezoid rule: its error is known at the free end.
        const double lumped = omega * (1 - 0.4588 / (w.elements * w.elements));
        rows.push_back(
            relative(fmt::format("frequency, {} elements, lumped masses [rad/s]", w.elements),
                     lumped, found, 2e-4));
    }
    rows.push_back(relative("frequency, 40 elements [rad/s]", omega, omega * (1 + miss[2]), 5e-4));
    rows.push_back(absolute("order in the element's length", 2, order(miss[1], miss[2]), 0.1));

    w.elements = 80;
    double slower[3], decay[3];
    for (int k = 0; k < 3; ++k) {
        const double h = period / (20 << k), x = omega * h;
        const Oscillation o = vibrate(w, omega, h);
        slower[k] = omega - o.angle / h;
        decay[k] = o.decay / h;
        rows.push_back(relative(fmt::format("frequency, {} steps a period [rad/s]", 20 << k),
                                std::atan(x) / h, o.angle / h, 2e-4));
        rows.push_back(relative(fmt::format("numerical damping, {} steps a period [1/s]", 20 << k),
                                std::log(1 + x * x) / (2 * h), decay[k], 5e-4));
    }
    rows.push_back(absolute("order in the step, frequency", 2, order(slower[1], slower[2]), 0.1));
    rows.push_back(absolute("order in the step, damping", 1, order(decay[1], decay[2]), 0.1));

    // Torsion, the held part as a spring without mass: b tan(b L) = 1 / held, omega^2 = b^2 GJ / J
    VibratingWire t;
    t.held = 0.05 * t.length;
    t.radius = 0.02 * t.length;
    t.elements = 40;
    double low = 0, high = 0.5 * std::numbers::pi / t.length;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (middle * std::tan(middle * t.length) < 1 / t.held ? low : high) = middle;
    }
    const double polar = 0.5 * t.mass_per_length() * t.radius * t.radius;
    const double twist = low * std::sqrt(t.torsion_of_bending * t.EI / polar);
    const double dt = 2 * std::numbers::pi / twist / 40;
    rows.push_back(relative("frequency of torsion, 40 elements [rad/s]", twist,
                            std::tan(vibrate(t, twist, dt, Mode::torsion).angle) / dt, 2e-4));

    // m (a + c v) + k x = 0: (1 + c h + x^2) z^2 - (2 + c h) z + 1 = 0
    w.damping = 0.1 * omega;
    const double h = period / 40, x = omega * h, c = w.damping * h;
    const double rho = 1 / std::sqrt(1 + c + x * x);
    const Oscillation o = vibrate(w, omega, h);
    rows.push_back(
        relative("frequency, damped [rad/s]", std::acos((2 + c) / 2 * rho) / h, o.angle / h, 2e-4));
    rows.push_back(relative("damping, both [1/s]", -std::log(rho) / h, o.decay / h, 5e-4));
    return rows;
}

// A steel wire. Pushed slowly its inertia does not matter; at 1 m/s it does, and the balance holds.
std::vector<Measured> double_u_dynamic()
{
    const std::string density = "bodies/wire/segments/0/density=7900", kind = "time/kind=dynamic";
    const Run still = run(scene("double-u"));
    const Run slow = run(scene("double-u", {density, kind}));
    const Run fast = run(scene("double-u", {density, kind, "time/step=4e-4", "time/end=0.3",
                                            "bodies/wire/drive/insertion=[[0,0],[0.3,0.3]]"}));
    std::vector<Measured> rows;
    for (double depth : {0.100, 0.140, 0.220, 0.240, 0.300}) // away from the snaps
        rows.push_back(
            relative(fmt::format("mean push force before {:.0f} mm, at 20 mm/s and at rest [N]",
                                 1e3 * depth),
                     mean(still, &Step::push, depth - 0.005, depth),
                     mean(slow, &Step::push, depth - 0.005, depth), 0.01));
    add_energy_and_certificates(rows, slow, 2e-3, ", 20 mm/s");
    add_energy_and_certificates(rows, fast, 2e-3, ", 1 m/s");
    return rows;
}

} // namespace amontons::validation
