#include "solver/step/wire_group.hpp"

#include <algorithm>
#include <cmath>

// Inertia of a wire: masses lumped at its nodes, implicit Euler.

namespace amontons {
namespace {

double kinetic_energy_of(const WireBody& b, std::size_t node)
{
    return 0.5 * b.motion.mass[node] * b.dynamics.velocity[node].squaredNorm() +
           0.5 * b.dynamics.spin[node].dot(
                     b.motion.inertia[node].cwiseProduct(b.dynamics.spin[node]));
}

/// Work that contact did on the wire in the step, by the trapezoid rule; keeps its forces.
double contact_work(WireBody& b, const StepStart& start)
{
    const Wire& w = b.wire;
    const std::size_t walls = b.walls.size();
    std::vector<Vec3>&force = b.dynamics.contact_force, &arm = b.dynamics.contact_arm;
    double work = 0;
    // The surface point that a force acts on: moved by the centreline and turned by the section.
    const auto half_of_work = [&](std::size_t index, bool arm_is_of_now) {
        const std::size_t p = index / walls;
        const MaterialPoint& m = w.material.point[p];
        const auto place = place_of(w, w.state, m.s, m.element, m.xi);
        const Vec3 x = place ? centreline_point(w.state, *place) : held_point(w, w.state, m.s);
        const Quaternion q =
            place ? section_rotation(w.state, *place) : held_rotation(w, w.state, m.s);
        const Mat3 turn = rotation_matrix(q.q) * rotation_matrix(start.section[p].q).transpose();
        const Vec3 a = arm[index];
        const Vec3 by_arm = arm_is_of_now ? Vec3(a - turn.transpose() * a) : Vec3(turn * a - a);
        return 0.5 * force[index].dot(x - start.point[p] + by_arm);
    };
    for (std::size_t k = 0; k < force.size(); ++k)
        if (!force[k].isZero(0)) {
            work += half_of_work(k, false);
            force[k].setZero();
        }
    if (!w.outside()) return work;
    for (const Candidate& c : b.work->candidates) {
        if (!(c.normal > 0)) continue;
        const std::size_t k = std::size_t(c.index);
        force[k] = c.normal * c.n + c.tangential[0] * c.t1 + c.tangential[1] * c.t2;
        arm[k] = -c.radius * c.n;
        work += half_of_work(k, true);
    }
    return work;
}
} // namespace

WireMotion make_motion(const WireMaterial& m, double damping)
{
    WireMotion motion;
    motion.dynamic = true;
    motion.damping = damping;
    motion.mass.assign(m.node.size(), 0);
    motion.inertia.assign(m.node.size(), Vec3::Zero());
    for (std::size_t i = 0; i + 1 < m.node.size(); ++i) {
        const double middle = 0.5 * (m.node[i] + m.node[i + 1]);
        std::size_t k = m.segments.size() - 1;
        while (k > 0 && m.segment_start[k] > middle)
            --k;
        const BeamSegment& g = m.segments[k];
        const double h = m.node[i + 1] - m.node[i];
        const double r2 = g.radius * g.radius, bore2 = g.inner_radius * g.inner_radius;
        const double mass = 0.5 * g.density * 3.14159265358979323846 * (r2 - bore2) * h;
        for (std::size_t n : {i, i + 1}) {
            motion.mass[n] += mass;
            motion.inertia[n] += mass * (r2 + bore2) * Vec3(0.5, 0.25, 0.25);
        }
    }
    return motion;
}

Vec3 rotation_between(const double from[4], const double to[4])
{
    const double conj[4] = {from[0], -from[1], -from[2], -from[3]};
    double r[4];
    quaternion_product(conj, to, r);
    if (r[0] < 0)
        for (double& v : r)
            v = -v;
    const Vec3 v(r[1], r[2], r[3]);
    const double s = v.norm();
    return s < 1e-12 ? Vec3(2 * v) : Vec3(2 * std::atan2(s, r[0]) / s * v);
}

BeamNode node_in(const Wire& wire, const WireState& state, int i)
{
    if (i > state.first) return state.nodes[std::size_t(i)];
    const double s = wire.material.node[std::size_t(i)];
    BeamNode n;
    const Vec3 x = held_point(wire, state, s);
    const Quaternion q = held_rotation(wire, state, s);
    for (int k = 0; k < 3; ++k)
        n.x[k] = x[k];
    std::copy(q.q, q.q + 4, n.q);
    return n;
}

ViscousPull inertia_pull(const WireBody& b, const WireState& old, double h)
{
    ViscousPull a;
    const std::size_t n = b.wire.material.node.size();
    a.reference = b.wire.state.nodes;
    a.linear.assign(n, 0);
    a.angular.assign(n, Vec3::Zero());
    const double d = 1 + b.motion.damping * h;
    for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i) {
        const std::size_t k = std::size_t(i);
        BeamNode& r = a.reference[k];
        r = node_in(b.wire, old, i);
        for (int c = 0; c < 3; ++c)
            r.move(c, h / d * b.dynamics.velocity[k][c]);
        rotate_in_body(r.q, h / d * b.dynamics.spin[k]);
        a.linear[k] = b.motion.mass[k] * d / (h * h);
        a.angular[k] = b.motion.inertia[k] * d / (h * h);
    }
    return a;
}

namespace {

// What implicit Euler, damping and impact take out is the work against inertia and damping, less
// what became kinetic energy, less what contact gave beside friction; each by the trapezoid rule
// of the force. For an oscillator that is 1/2 m |dv|^2 + 1/2 k |dx|^2 a step. Mass that comes out
// of the sheath brings its kinetic energy along, and the drive has given it; what enters takes it
// away.
/// Of one wire; returns what it dissipated and the friction of walls.
double update_inertia(WireBody& b, const WireState& old, const StepStart& start, double h,
                      EnergyRecord& energy)
{
    double against = 0, gained = 0;
    for (int i = 0; i <= b.wire.last(); ++i) {
        const std::size_t k = std::size_t(i);
        const bool was_out = i > old.first, is_out = i > b.wire.state.first;
        const BeamNode before = node_in(b.wire, old, i), now = node_in(b.wire, b.wire.state, i);
        const Vec3 move(now.difference(before, 0), now.difference(before, 1),
                        now.difference(before, 2));
        const Vec3 turn = rotation_between(before.q, now.q);
        Vec3 &velocity = b.dynamics.velocity[k], &spin = b.dynamics.spin[k];
        const Vec3 v = move / h, w = turn / h, v0 = velocity, w0 = spin;
        if (was_out != is_out) energy.work += (is_out ? 1 : -1) * kinetic_energy_of(b, k);
        if (is_out) gained -= kinetic_energy_of(b, k);
        velocity = v;
        spin = w;
        Vec3 &force = b.dynamics.inertia_force[k], &moment = b.dynamics.inertia_moment[k];
        if (!is_out) {
            force = moment = Vec3::Zero();
            continue;
        }
        gained += kinetic_energy_of(b, k);
        const Vec3 f0 = force, m0 = moment;
        force = b.motion.mass[k] * ((v - v0) / h + b.motion.damping * v);
        moment = b.motion.inertia[k].cwiseProduct((w - w0) / h + b.motion.damping * w);
        against += 0.5 * (f0 + force).dot(move) + 0.5 * (m0 + moment).dot(turn);
    }
    energy.kinetic += kinetic_energy(b);
    return against - gained - contact_work(b, start);
}

} // namespace

void update_dynamics(WireGroup& g, const GroupState& old, const GroupStart& start, double h,
                     EnergyRecord& energy)
{
    energy.kinetic = 0;
    energy.released = -energy.friction;
    for (std::size_t w = 0; w < g.wires.size(); ++w)
        energy.released += update_inertia(*g.wires[w], old.wires[w], start.wires[w], h, energy);
    if (g.coaxial) // of what acts in the bores friction is the one part, impacts are the other
        energy.released += coaxial_friction_work(*g.coaxial, start.nested) -
                           coaxial_normal_work(*g.coaxial, start.nested);
}

double kinetic_energy(const WireBody& b)
{
    if (!b.motion.dynamic) return 0;
    double sum = 0;
    for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i)
        sum += kinetic_energy_of(b, std::size_t(i));
    return sum;
}

} // namespace amontons
