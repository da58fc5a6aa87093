#include "validation/families/rods/bends.hpp"
#include "validation/families/wires/wires.hpp"

#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/simulation.hpp"
#include "solver/step/wire_step.hpp"
#include "validation/scene_run.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <stdexcept>

// One wire in a curved channel: whip, torque lost to friction, tension lost to friction.

namespace amontons::validation {
namespace {

constexpr double kGuidewireRadius = 4.445e-4;

/// Complete elliptic integral of the first kind, modulus k, by the arithmetic-geometric mean.
double elliptic(double k)
{
    double a = 1, b = std::sqrt(1 - k * k);
    for (int i = 0; i < 60 && a - b > 1e-16; ++i) {
        const double c = 0.5 * (a + b);
        b = std::sqrt(a * b);
        a = c;
    }
    return std::numbers::pi / (a + b);
}

/// Amplitude of the pendulum that swings a quarter of its period over the length: half the jump.
double amplitude(double lambda)
{
    if (lambda <= std::numbers::pi / 2) return 0;
    double low = 0, high = std::numbers::pi;
    for (int i = 0; i < 200; ++i) {
        const double a = 0.5 * (low + high);
        (elliptic(std::sin(0.5 * a)) < lambda ? low : high) = a;
    }
    return low;
}

/// Rotation at the base for one at the tip: GJ phi'' = EI k k0 sin(phi), phi' = 0 at the tip.
double base_rotation(double lambda, double tip)
{
    constexpr int kSteps = 2000;
    const double h = 1.0 / kSteps, f = lambda * lambda;
    double phi = tip, rate = 0;
    for (int i = 0; i < kSteps; ++i) { // Runge-Kutta, from the tip to the base
        const auto slope = [&](double p) { return f * std::sin(p); };
        const double k1 = rate, m1 = slope(phi);
        const double k2 = rate + 0.5 * h * m1, m2 = slope(phi + 0.5 * h * k1);
        const double k3 = rate + 0.5 * h * m2, m3 = slope(phi + 0.5 * h * k2);
        const double k4 = rate + h * m3, m4 = slope(phi + h * k3);
        phi += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        rate += h / 6 * (m1 + 2 * m2 + 2 * m3 + m4);
    }
    return phi;
}

/// The tip's rotation before the jump, for a rotation of the base below pi.
double tip_rotation(double lambda, double base)
{
    double low = 0, high = base; // the tip follows more slowly than the base
    // Along the first branch the base's rotation grows with the tip's up to its fold.
    for (double t = 0; t < base; t += base / 400)
        if (base_rotation(lambda, t) >= base) {
            high = t;
            break;
        }
    for (int i = 0; i < 60; ++i) {
        const double t = 0.5 * (low + high);
        (base_rotation(lambda, t) < base ? low : high) = t;
    }
    return 0.5 * (low + high);
}

struct Turned {
    std::vector<double> base, tip; ///< [rad]
    RunSummary summary;
};

struct CollectTips : StepObserver {
    Turned& turned;
    explicit CollectTips(Turned& t) : turned(t) {}
    void on_step(const StepRecord& r) override
    {
        double base = 0, tip = 0;
        for (const Quantity& q : r.quantities) {
            if (q.name == "base_twist") base = q.value;
            if (q.name == "tip_rotation") tip = q.value;
        }
        turned.base.push_back(base);
        turned.tip.push_back(tip);
    }
};

/// A wire of natural curvature in a channel, turned by 360 degrees and back to 180.
Turned turn_in_channel(double lambda)
{
    const double EI = 5.2e-4, GJ = 4e-4, bend = 0.038, k0 = 50, clearance = 1e-7;
    const double length = lambda / std::sqrt(EI / bend * k0 / GJ);
    Scene scene = parse_scene(fmt::format(R"({{"schema": 1, "bodies": {{
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": {0},
          "centreline": {{"pieces": [{{"radius": {1}, "angle": {2}}}]}}}}}},
        "wire": {{"kind": "beam", "contact_spacing": 2.5e-4, "introducer": {{"normal": [0, 1, 0]}},
          "segments": [{{"length": {3}, "radius": {4}, "EI": {5}, "GJ": {6}, "curvature": {7},
          "element": 1e-3}}],
          "drive": {{"insertion": [[0, 0], [4, {8}]],
                     "twist": [[4, 0], [14, {9}], [24, {10}], [34, {9}]]}}}}}},
        "contact": [{{"between": ["wire", "tube"]}}], "time": {{"step": 0.1, "end": 34}}}})",
                                          kGuidewireRadius + clearance, bend, length / bend + 0.5,
                                          length + 2e-5, kGuidewireRadius, EI, GJ, k0, length,
                                          std::numbers::pi, 2 * std::numbers::pi),
                              "whip");
    const auto simulation = make_simulation(scene, build_obstacles(scene));
    Turned t;
    CollectTips collect(t);
    const std::atomic<bool> never{false};
    t.summary = simulation->run(collect, never);
    if (t.summary.status != "done") throw std::runtime_error(t.summary.message);
    return t;
}

} // namespace

std::vector<Measured> whip()
{
    std::vector<Measured> rows;
    const double degree = std::numbers::pi / 180;
    for (double lambda : {1.55, 1.6, 2.0}) {
        const Turned t = turn_in_channel(lambda);
        const std::string name = fmt::format(", lambda {}", lambda);
        // At a base rotation of 180 degrees on the way there and on the way back.
        double there = 0;
        for (std::size_t i = 0; i + 1 < t.base.size(); ++i)
            if (there == 0 && t.base[i] >= std::numbers::pi * (1 - 1e-9)) there = t.tip[i];
        const double jump = t.tip.back() - there, exact = 2 * amplitude(lambda);
        if (exact == 0)
            rows.push_back(at_most("hysteresis [rad]" + name, std::abs(jump), 1e-3));
        else {
            rows.push_back(
                relative("hysteresis [degrees]" + name, exact / degree, jump / degree, 0.03));
            // What lambda must be for this jump: near the threshold the jump's root amplifies.
            rows.push_back(relative("lambda of that jump" + name, lambda,
                                    elliptic(std::sin(0.25 * jump)), 3e-3));
        }
        double worst = 0;
        ReferenceCurve curve{"rotation of the base [rad]", "rotation of the tip [rad]", {}, {}, {}};
        for (std::size_t i = 0; i < t.base.size() && t.base[i] < 2.8; ++i)
            if (t.base[i] > 0) {
                curve.add(t.base[i], tip_rotation(lambda, t.base[i]), t.tip[i]);
                raise_to(worst, std::abs(curve.value.back() - curve.reference.back()));
            }
        rows.push_back(
            at_most("tip off the pendulum's, base to 160 degrees [rad]" + name, worst, 0.02));
        rows.back().curve = std::move(curve);
        rows.push_back(at_most("steps without certificate" + name, t.summary.uncertified_steps, 0));
    }
    return rows;
}

std::vector<Measured> torque_lag()
{
    // The torus example with friction, turned in place until every contact slips around.
    const double EI = 5.2e-4, mu = 0.1, R = 0.050 + 1e-3 - kGuidewireRadius, GJ = 0.77 * EI;
    Scene s = scene("torus", {"contact=[{\"between\":[\"wire\",\"tube\"],\"friction\":0.1}]",
                              "bodies/wire={\"kind\":\"beam\",\"segments\":[{\"length\":0.260,"
                              "\"radius\":4.445e-4,\"EI\":5.2e-4,\"EA\":5000,"
                              "\"element\":2.5e-3}],\"contact_spacing\":1.25e-3,"
                              "\"drive\":{\"insertion\":[[0,0],[12,0.230]],"
                              "\"twist\":[[12,0],[24,12.566]]}}",
                              "time/end=24", "time/step=0.04"});
    struct Last : StepObserver {
        StepRecord record;
        void on_step(const StepRecord& r) override { record = r; }
    } last;
    const auto simulation = make_simulation(s, build_obstacles(s));
    const std::atomic<bool> never{false};
    const RunSummary summary = simulation->run(last, never);
    if (summary.status != "done") throw std::runtime_error(summary.message);

    const BeamRecord& wire = last.record.beams[0];
    const Field *arc = nullptr, *torque = nullptr;
    for (const Field& f : wire.fields) {
        if (f.name == "arc_length") arc = &f;
        if (f.name == "torque") torque = &f;
    }
    // Two sections of the steady zone; what the farther one's torque turns is no lag of this
    // stretch. Torque steps from contact to contact: its mean over a few elements. The wire turns
    // less and less along its length: its torque is negative.
    const auto torque_at = [&](double at) {
        double sum = 0;
        int count = 0;
        for (std::size_t i = 0; i < arc->values.size(); ++i)
            if (std::abs(arc->values[i] - at) <= 0.0055) sum -= torque->values[i], ++count;
        return sum / count;
    };
    const double from = 0.105, to = 0.140, line = EI / (R * R * R);
    const double T1 = torque_at(from), T2 = torque_at(to);
    double lag = 0;
    for (std::size_t i = 0; i + 1 < arc->values.size(); ++i) {
        const double s0 = arc->values[i], s1 = arc->values[i + 1];
        const double a = std::max(from, s0), b = std::min(to, s1);
        if (!(b > a)) continue;
        const double t = (0.5 * (a + b) - s0) / (s1 - s0);
        const double here = -(torque->values[i] + t * (torque->values[i + 1] - torque->values[i]));
        lag += (b - a) * (here - T2) / GJ;
    }
    std::vector<Measured> rows;
    rows.push_back(relative("torque lost over 35 mm: mu q r L [N m]",
                            mu * line * kGuidewireRadius * (to - from), T1 - T2, 0.03));
    rows.push_back(relative("torque lag over 35 mm: mu q r L^2/(2 GJ) [rad]",
                            mu * line * kGuidewireRadius * std::pow(to - from, 2) / (2 * GJ), lag,
                            0.03));
    rows.push_back(at_most("steps without certificate", summary.uncertified_steps, 0));
    return rows;
}

namespace {

constexpr double kThin = 1e-4; // friction acts at the surface: a thick wire's arm is shorter
constexpr double kClearance = 1e-4, kBend = 0.05, kStraight = 0.04, kEnd = 0.06;

/// A place along bends of alternating sense, the first to +y; straight before and after each.
Vec3 on_bends(const std::vector<double>& angles, double s, Vec3& tangent)
{
    Vec3 x = Vec3::Zero();
    tangent = Vec3::UnitX();
    const auto straight = [&](double length) {
        const double d = std::min(s, length);
        x += d * tangent;
        s -= d;
    };
    straight(kStraight);
    double side = 1;
    for (double angle : angles) {
        if (side < 0) straight(kEnd);
        const double turned = std::min(s / kBend, angle);
        const Vec3 normal = side * Vec3::UnitZ().cross(tangent);
        x += kBend * (std::sin(turned) * tangent + (1 - std::cos(turned)) * normal);
        tangent = (std::cos(turned) * tangent + std::sin(turned) * normal).eval();
        s -= kBend * turned;
        side = -side;
    }
    straight(s);
    return x;
}

/// Force at the base when a wire is drawn back through bends against a pull at its tip [N].
double drawn_wire(const std::vector<double>& angles, double mu, double pull)
{
    std::string pieces = fmt::format("{{\"length\": {}}}", kStraight);
    double along = kStraight + kEnd, side = 0;
    for (double a : angles) {
        if (side > 0) {
            pieces += fmt::format(", {{\"length\": {}}}", kEnd);
            along += kEnd;
        }
        pieces += fmt::format(", {{\"radius\": {}, \"angle\": {}, \"direction\": {}}}", kBend, a,
                              side * std::numbers::pi);
        along += kBend * a;
        side = 1 - side;
    }
    const Scene scene =
        parse_scene(fmt::format(R"({{"schema": 1, "bodies": {{
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": {0},
          "centreline": {{"pieces": [{1}, {{"length": {2}}}]}}}}}},
        "wire": {{"kind": "beam", "segments": [{{"length": {3}, "radius": {4}, "EI": 1e-5,
          "EA": 5000, "element": 2.5e-3}}], "drive": {{"insertion": 0.1}}}}}},
        "time": {{"step": 1, "end": 1}}}})",
                                kThin + kClearance, pieces, kEnd, along + 0.05, kThin),
                    "bends");
    const std::vector<Obstacle> obstacles = build_obstacles(scene);
    Wire wire;
    wire.material = make_material(scene.beams[0].segments, 1.25e-3);
    wire.sheath = Sheath{};
    wire.plane = Vec3::UnitZ();
    const double out = along - 0.01;
    start_in_sheath(wire, out, 0);
    Vec3 tangent;
    for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
        const std::size_t k = std::size_t(i);
        BeamNode& n = wire.state.nodes[k];
        const Vec3 x =
            on_bends(angles, wire.material.node[k] - wire.material.length + out, tangent);
        Mat3 frame;
        frame << tangent, Vec3::UnitZ().cross(tangent), Vec3::UnitZ();
        const Quaternion q = quaternion_of(frame);
        n = BeamNode{};
        for (int j = 0; j < 3; ++j)
            n.x[j] = x[j];
        std::copy(q.q, q.q + 4, n.q);
    }
    wire.dead_force.assign(wire.material.node.size(), Vec3::Zero());
    wire.dead_force.back() = pull * tangent;
    WireWall wall;
    wall.wall = &obstacles[0].model.wall;
    wall.friction.assign(wire.material.point.size(), mu);
    WireBody body = make_wire_body(std::move(wire), {wall}, {}, 1e-8);
    // The dead load's work is in no balance.
    for (int step = 0; step <= 60; ++step) {
        const StepReport r = try_step(body, out - 5e-4 * step, 0, 0, true);
        if (!r.accepted) throw std::runtime_error("the drawn wire: " + r.refusal);
    }
    return -base_load(body.wire).push;
}

} // namespace

std::vector<Measured> belt_friction()
{
    std::vector<Measured> rows;
    for (const Bends& b : bent_tubes())
        for (double mu : {0.1, 0.2, 0.3}) {
            const double slope = drawn_wire(b.angles, mu, 2) - drawn_wire(b.angles, mu, 1);
            rows.push_back(relative(fmt::format("slope of the pull, {}, mu {}", b.name, mu),
                                    std::exp(mu * b.all()), slope, 0.02));
        }
    return rows;
}

} // namespace amontons::validation
