#include "solver/step/wire_step.hpp"

#include "solver/step/coaxial.hpp"
#include "solver/step/wire_friction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

// A step is refused if its energy balance misses more than this share of what it turned over:
// an equilibrium that jumped leaves energy unaccounted for, and a kink of the push force is
// resolved by shorter steps.
constexpr double kEnergyShare = 0.02;
// ... and more than this share of the wire's own force times its element.
constexpr double kEnergyFloor = 0.5;
constexpr const char* kBalanceRefused = "energy balance";
constexpr int kMostRelaxations = 600;
constexpr double kRelaxationShare = 0.001; // as kEnergyShare, of an increment of the relaxation
constexpr double kNoJump = 0.25;           // of an increment's way: the wire has not jumped in it

NewtonOptions newton_options(const WireGroup& g, const std::vector<BaseTarget>& to)
{
    NewtonOptions o;
    o.tolerance = g.wires[0]->tolerance;
    o.longest_move = std::numeric_limits<double>::infinity();
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        const WireBody& b = *g.wires[w];
        double radius = 0;
        for (const BeamSegment& segment : b.wire.material.segments)
            radius = std::max(radius, segment.radius);
        const double shift = to[w].insertion - b.wire.state.base_insertion;
        o.reach = std::max({o.reach, 1.35 * radius, 1.5 * std::abs(shift)});
        o.longest_move = std::min(o.longest_move, 0.8 * b.grain);
    }
    return o;
}

void add(NewtonReport& sum, const NewtonReport& r)
{
    sum.converged = r.converged;
    sum.stable = r.stable;
    sum.iterations += r.iterations;
    sum.factorisations += r.factorisations;
    sum.shifted += r.shifted;
    sum.residual = r.residual;
    sum.seconds_elements += r.seconds_elements;
    sum.seconds_detection += r.seconds_detection;
    sum.seconds_contact += r.seconds_contact;
    sum.seconds_rest += r.seconds_rest;
}

// A distance to a wall changes hardly faster than the point moves, so a straight way is free if the
// two distances at its ends cover it; else it is followed in steps of the distance itself.
bool way_is_free(const Wall& wall, const Vec3& from, const Vec3& to, double radius, WallHint& hint)
{
    const double length = (to - from).norm();
    const double a = wall.distance(from, hint), b = wall.distance(to, hint);
    if (b < 0) return false;
    if (a + b >= kSteepestWall * length) return true;
    double t = std::max(a, 0.0);
    while (t < length - b) {
        const double d = wall.distance(from + t / length * (to - from), hint);
        if (d < 0) return false;
        t += std::max(d, 0.1 * radius);
    }
    return true;
}

/// Contact points that left the free space in the step, on their way or at its end.
int count_passages(const WireBody& b, const StepStart& start)
{
    int count = 0;
    const Wire& w = b.wire;
    for (std::size_t p = 0; p < w.material.point.size(); ++p) {
        const MaterialPoint& m = w.material.point[p];
        const auto place = place_of(w, w.state, m.s, m.element, m.xi);
        if (!place) break;
        const Vec3 x = centreline_point(w.state, *place);
        for (std::size_t k = 0; k < b.walls.size(); ++k) {
            Proximity& near = b.work->proximity[p * b.walls.size() + k];
            // Known to be far, and the whole way shorter than that.
            if (near.distance >= 0 && near.distance > kSteepestWall * ((x - near.at).norm() +
                                                                       (start.point[p] - x).norm()))
                continue;
            if (!way_is_free(*b.walls[k].wall, start.point[p], x, m.radius, near.hint)) ++count;
        }
    }
    return count;
}

/// What a step changes in the wires of a group, kept in case that it is refused.
struct GroupState {
    std::vector<WireState> wires;
    std::vector<std::vector<Reaction>> nested;
};

GroupState state_of(const WireGroup& g)
{
    GroupState s;
    for (const WireBody* b : g.wires)
        s.wires.push_back(b->wire.state);
    if (g.coaxial)
        for (const Nesting& n : g.coaxial->nestings)
            s.nested.push_back(n.reaction);
    return s;
}

void restore(WireGroup& g, const GroupState& s)
{
    for (std::size_t w = 0; w < g.wires.size(); ++w)
        g.wires[w]->wire.state = s.wires[w];
    for (std::size_t n = 0; n < s.nested.size(); ++n)
        g.coaxial->nestings[n].reaction = s.nested[n];
}

void refuse(WireGroup& g, const GroupState& keep, StepReport& r, std::string why)
{
    restore(g, keep);
    r.accepted = false;
    r.refusal = std::move(why);
}

/// Where an increment begins: slip and friction's work are counted from there.
struct GroupStart {
    std::vector<StepStart> wires;
    std::vector<std::vector<ContactBefore>> touched;
    CoaxialStart nested;
};

GroupStart start_of(const WireGroup& g)
{
    GroupStart s;
    for (const WireBody* b : g.wires) {
        s.wires.push_back(mark_step_start(b->wire));
        s.touched.push_back(contacts_before(b->wire, b->walls, b->work->proximity));
    }
    if (g.coaxial) s.nested = mark_coaxial_start(*g.coaxial);
    return s;
}

NewtonReport solve(WireGroup& g, const GroupStart& start, const std::vector<Anchor>& anchors,
                   const NewtonOptions& options)
{
    if (g.coaxial) return solve_coaxial(*g.coaxial, start.wires, start.nested, anchors, options);
    WireBody& b = *g.wires[0];
    return solve_equilibrium(b.wire, b.walls, start.wires[0], anchors[0], options, *b.work);
}

void drive(WireGroup& g, const std::vector<BaseTarget>& to)
{
    std::vector<double> shift;
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        Wire& wire = g.wires[w]->wire;
        shift.push_back(to[w].insertion - wire.state.base_insertion);
        drive_base(wire, to[w].insertion, to[w].twist);
    }
    if (g.coaxial) shift_coaxial_reactions(*g.coaxial, shift);
}

double elastic_energy_of(const WireGroup& g)
{
    double sum = 0;
    for (const WireBody* b : g.wires)
        sum += elastic_energy(b->wire);
    return sum;
}

std::vector<BaseLoad> loads_of(const WireGroup& g)
{
    std::vector<BaseLoad> loads;
    for (const WireBody* b : g.wires)
        loads.push_back(base_load(b->wire));
    return loads;
}

/// Of the bases from where they were to where they are, by the trapezoid rule [J].
double base_work(const WireGroup& g, const GroupState& old, const std::vector<BaseLoad>& before)
{
    double sum = 0;
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        const WireState &a = old.wires[w], &s = g.wires[w]->wire.state;
        const BaseLoad load = base_load(g.wires[w]->wire);
        sum += 0.5 * (before[w].push + load.push) * (s.base_insertion - a.base_insertion) +
               0.5 * (before[w].torque + load.torque) * (s.base_twist - a.base_twist);
    }
    return sum;
}

double friction_of(const WireGroup& g, const GroupStart& start)
{
    double sum = 0;
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        const WireBody& b = *g.wires[w];
        if (b.wire.outside())
            sum += friction_work(b.wire, start.wires[w], start.touched[w], b.work->candidates);
    }
    if (g.coaxial) sum += coaxial_friction_work(*g.coaxial, start.nested);
    return sum;
}

int count_passages(const WireGroup& g, const GroupStart& start)
{
    int count = 0;
    for (std::size_t w = 0; w < g.wires.size(); ++w)
        if (g.wires[w]->wire.outside()) count += count_passages(*g.wires[w], start.wires[w]);
    return count;
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

/// A material node in a state, also if it is in the sheath then.
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

/// Inertia of implicit Euler as a pull towards x_n + h v_n / (1 + damping h).
Anchor inertia_anchor(const WireBody& b, const WireState& old, double h)
{
    Anchor a;
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

// What implicit Euler, damping and impact take out is the work against inertia and damping, less
// what became kinetic energy, less what contact gave beside friction; each by the trapezoid rule
// of the force. For an oscillator that is 1/2 m |dv|^2 + 1/2 k |dx|^2 a step. Mass that comes out
// of the sheath brings its kinetic energy along, and the drive has given it; what goes in takes it
// away.
void update_dynamics(WireBody& b, const WireState& old, const StepStart& start, double h,
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
    energy.released = against - gained - contact_work(b, start) - energy.friction;
    energy.kinetic = kinetic_energy(b);
}

/// Lowest mode of the system that contact leaves free, by inverse iteration with the factor of
/// the last shifted solve; largest displacement 1.
std::vector<std::vector<Node6>> weakest_mode(WireGroup& g)
{
    std::vector<std::vector<Node6>> v;
    unsigned seed = 1;
    for (const WireBody* b : g.wires) {
        std::vector<Node6>& mode = v.emplace_back(b->work->increment);
        for (int i = b->wire.state.first; i <= b->wire.last(); ++i) {
            Node6& n = mode[std::size_t(i)];
            n.column = Column6{};
            if (i == b->wire.state.first) continue;
            for (int k = 0; k < 6; ++k) {
                seed = seed * 1664525u + 1013904223u;
                n.value[k] = (double(seed >> 8) / 8388608.0 - 1) * (k < 3 ? b->grain : 1);
            }
            // along the section's axes: no axis of space decides which way it goes
            const Vec3 x = rotation_matrix(b->wire.state.nodes[std::size_t(i)].q) *
                           Vec3(n.value[0], n.value[1], n.value[2]);
            for (int k = 0; k < 3; ++k)
                n.value[k] = x[k];
        }
    }
    for (int round = 0; round < 6; ++round) {
        if (g.coaxial)
            solve_last_system(*g.coaxial, v);
        else
            g.wires[0]->work->system.solve(v[0]);
        double largest = 0;
        for (std::size_t w = 0; w < v.size(); ++w)
            for (int i = g.wires[w]->wire.state.first + 1; i <= g.wires[w]->wire.last(); ++i)
                for (int k = 0; k < 3; ++k)
                    largest = std::max(largest, std::abs(v[w][std::size_t(i)].value[k]));
        if (!(largest > 0)) break;
        for (std::size_t w = 0; w < v.size(); ++w)
            for (int i = g.wires[w]->wire.state.first; i <= g.wires[w]->wire.last(); ++i)
                v[w][std::size_t(i)].column *= splat6(1 / largest);
    }
    return v;
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

WireBody make_wire_body(Wire wire, std::vector<WireWall> walls, WireMotion motion, double tolerance)
{
    WireBody b;
    b.wire = std::move(wire);
    b.walls = std::move(walls);
    b.motion = std::move(motion);
    b.tolerance = tolerance;
    b.wire.state.reaction.assign(b.wire.material.point.size() * b.walls.size(), {});
    WireDynamics& d = b.dynamics;
    for (auto* list : {&d.velocity, &d.spin, &d.inertia_force, &d.inertia_moment})
        list->assign(b.wire.material.node.size(), Vec3::Zero());
    for (auto* list : {&d.contact_force, &d.contact_arm})
        list->assign(b.wire.state.reaction.size(), Vec3::Zero());
    double EI = 0;
    for (const ElementLaw& law : b.wire.material.law) {
        b.grain = std::max(b.grain, law.length);
        EI = std::max(EI, law.S[4] / law.length);
    }
    b.scale_force = EI / (b.wire.material.length * b.wire.material.length);
    b.work = std::make_unique<NewtonWorkspace>(b.wire, b.walls.size());
    return b;
}

double kinetic_energy(const WireBody& b)
{
    if (!b.motion.dynamic) return 0;
    double sum = 0;
    for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i)
        sum += kinetic_energy_of(b, std::size_t(i));
    return sum;
}

StepReport try_step(WireGroup& g, const std::vector<BaseTarget>& to, double length,
                    bool any_balance)
{
    StepReport r;
    const GroupState old = state_of(g);
    const double elastic_before = elastic_energy_of(g);
    const std::vector<BaseLoad> load_before = loads_of(g);
    const GroupStart start = start_of(g);
    const NewtonOptions options = newton_options(g, to);
    const bool dynamic = g.wires[0]->motion.dynamic;

    drive(g, to);
    std::vector<Anchor> anchors(g.wires.size());
    if (dynamic) anchors[0] = inertia_anchor(*g.wires[0], old.wires[0], length);
    const NewtonReport newton = solve(g, start, anchors, options);
    add(r.newton, newton);
    if (!newton.converged) {
        refuse(g, old, r, "no convergence");
        return r;
    }
    if (!newton.stable) {
        refuse(g, old, r, "unstable");
        return r;
    }

    r.energy.work = base_work(g, old, load_before);
    r.energy.elastic = elastic_energy_of(g);
    r.energy.friction = friction_of(g, start);
    r.missed = r.energy.work - (r.energy.elastic - elastic_before) - r.energy.friction;
    double turned_over = std::abs(r.energy.work) + std::abs(r.energy.friction);
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        const WireBody& b = *g.wires[w];
        const double shift = to[w].insertion - old.wires[w].base_insertion;
        turned_over += b.scale_force * (std::abs(shift) + kEnergyFloor * b.grain);
    }
    if (!dynamic && !any_balance && std::abs(r.missed) > kEnergyShare * turned_over) {
        refuse(g, old, r, kBalanceRefused);
        return r;
    }
    r.passed_through = count_passages(g, start);
    if (r.passed_through > 0) {
        refuse(g, old, r, "a wall was passed");
        return r;
    }
    if (dynamic) update_dynamics(*g.wires[0], old.wires[0], start.wires[0], length, r.energy);
    r.energy.work_absolute = std::abs(r.energy.work);
    r.accepted = true;
    return r;
}

// Gradient flow with implicit steps: each solves the wires with a viscous pull towards where they
// were, w |dx| per node. What it dissipates is the pull's work, by the trapezoid rule over the
// increment (the pull at its start is that left from the increment before). w follows the
// motion: about a quarter of an element per increment.
StepReport relax_step(WireGroup& g, const std::vector<BaseTarget>& to)
{
    StepReport r;
    const GroupState old = state_of(g);
    const std::vector<BaseLoad> load_before = loads_of(g);
    NewtonOptions options = newton_options(g, to);
    NewtonOptions attempt = options;
    options.max_iterations = 10;
    attempt.max_iterations = 10;
    const std::size_t wires = g.wires.size();
    double unit = 0, grain = std::numeric_limits<double>::infinity(), energy_floor = 0;
    std::vector<std::vector<Node6>> pull(wires), pull_before(wires);
    for (std::size_t w = 0; w < wires; ++w) {
        const WireBody& b = *g.wires[w];
        const std::vector<double>& stiffness = b.wire.material.stiffness;
        unit = std::max(unit, *std::max_element(stiffness.begin(), stiffness.end()));
        grain = std::min(grain, b.grain);
        energy_floor = std::max(energy_floor, 1e-3 * b.scale_force * b.grain);
        pull[w].resize(b.wire.material.node.size());
        pull_before[w].resize(pull[w].size());
    }
    const auto forget_pull = [&] {
        for (std::vector<Node6>& all : pull_before)
            for (Node6& n : all)
                n.column = Column6{};
    };
    forget_pull();
    const double target = 0.1 * grain;
    const double elastic_before = elastic_energy_of(g);
    double weight = 1e-3 * unit, energy = elastic_before;
    bool base_moved = false, pushed_off = false, failed = false;
    int until_attempt = 1; // increments before the wires are tried at rest
    double work_of_base = 0;

    for (r.relaxations = 0; r.relaxations < kMostRelaxations; ++r.relaxations) {
        const GroupState before = state_of(g);
        const GroupStart start = start_of(g);
        if (!base_moved) drive(g, to);
        std::vector<Anchor> anchors(wires);

        // At rest already? Only without a further jump.
        if (base_moved && --until_attempt <= 0) {
            const NewtonReport still = solve(g, start, anchors, attempt);
            add(r.newton, still);
            if (still.converged && still.stable) {
                const double e = elastic_energy_of(g);
                const double friction = friction_of(g, start);
                const double missed = energy - e - friction;
                const double allowed =
                    std::max(energy_floor, kRelaxationShare * (r.released + std::abs(friction)));
                if (std::abs(missed) <= allowed && count_passages(g, start) == 0) {
                    r.energy.friction += friction;
                    r.energy.elastic = e;
                    r.energy.released = r.released;
                    r.energy.work = work_of_base;
                    r.energy.work_absolute = std::abs(work_of_base);
                    r.missed = work_of_base - (e - elastic_before) - r.energy.friction - r.released;
                    r.snapped = true;
                    r.accepted = true;
                    return r;
                }
            } else if (still.converged && !pushed_off) {
                // An unstable equilibrium holds the flow: push it off along its weakest mode.
                const std::vector<std::vector<Node6>> mode = weakest_mode(g);
                for (std::size_t w = 0; w < wires; ++w)
                    move_wire(g.wires[w]->wire, mode[w], 1e-3 * grain);
                pushed_off = true;
                energy = elastic_energy_of(g);
                forget_pull();
                continue;
            }
            restore(g, before);
            until_attempt = 4;
        }

        for (std::size_t w = 0; w < wires; ++w) {
            const WireBody& b = *g.wires[w];
            Anchor& anchor = anchors[w];
            anchor.reference = b.wire.state.nodes;
            anchor.linear.assign(anchor.reference.size(), 0);
            anchor.angular.assign(anchor.reference.size(), Vec3::Zero());
            for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i) {
                const std::size_t k = std::size_t(i);
                const double h = b.wire.material.law[k - 1].length;
                anchor.linear[k] = weight * h / grain;
                anchor.angular[k].setConstant(anchor.linear[k] * h * h / 12);
            }
        }
        const NewtonReport newton = solve(g, start, anchors, options);
        add(r.newton, newton);
        double move = 0, viscous = 0;
        for (std::size_t w = 0; newton.converged && w < wires; ++w) {
            const WireBody& b = *g.wires[w];
            const Anchor& anchor = anchors[w];
            for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i) {
                const std::size_t k = std::size_t(i);
                const BeamNode &a = anchor.reference[k], &c = b.wire.state.nodes[k];
                const Vec3 dx = c.position() - a.position();
                const Vec3 dt = rotation_between(a.q, c.q);
                move = std::max(move, dx.norm());
                // The base's own step takes the nodes along to where the pull holds them.
                const BeamNode from = base_moved ? a : node_in(b.wire, before.wires[w], i);
                const Vec3 way = c.position() - from.position();
                const Vec3 turned = rotation_between(from.q, c.q);
                Node6 &p = pull[w][k], &q = pull_before[w][k];
                for (int j = 0; j < 3; ++j) {
                    p.value[j] = anchor.linear[k] * dx[j];
                    p.value[j + 3] = anchor.angular[k][j] * dt[j];
                    viscous += 0.5 * (p.value[j] + q.value[j]) * way[j] +
                               0.5 * (p.value[j + 3] + q.value[j + 3]) * turned[j];
                }
            }
        }
        const int passages = newton.converged ? count_passages(g, start) : 0;
        const double friction = newton.converged ? friction_of(g, start) : 0;
        const double after = newton.converged ? elastic_energy_of(g) : energy;
        // by the base in this increment
        const double given = base_moved ? 0 : base_work(g, old, load_before);
        // The trapezoid must account for the energy that the increment set free. With the base also
        // the mesh can change, which costs some energy without a motion.
        const double still = base_moved ? 0.02 * target : kNoJump * target;
        const bool accounted =
            move < still ||
            std::abs(energy + given - after - friction - viscous) <=
                kRelaxationShare * (std::abs(viscous) + std::abs(friction) + std::abs(given)) +
                    0.01 * energy_floor;
        if (!newton.converged || move > 4 * target || passages > 0 || !accounted) {
            restore(g, before);
            weight *= failed ? 4 : 2;
            failed = true;
            if (weight > 1e6 * unit) {
                refuse(g, old, r, "no convergence in the damped relaxation");
                return r;
            }
            continue;
        }
        if (!base_moved) {
            work_of_base = given;
            base_moved = true;
        }
        r.released += viscous;
        r.energy.friction += friction;
        energy = after;
        pull_before = pull;
        weight *= std::clamp(move / target, failed ? 0.7 : 0.25, 2.0);
        failed = false;
        weight = std::max(weight, 1e-12 * unit);
    }
    refuse(g, old, r, "the damped relaxation did not come to rest");
    return r;
}

StepReport try_or_relax(WireGroup& g, const std::vector<BaseTarget>& to)
{
    const GroupState old = state_of(g);
    const StepReport tried = try_step(g, to, 0);
    if (tried.accepted) return tried;
    StepReport r = relax_step(g, to);
    const bool balance_only = tried.refusal == kBalanceRefused;
    if (balance_only && !(r.accepted && std::abs(r.missed) < std::abs(tried.missed))) {
        restore(g, old);
        r = try_step(g, to, 0, true);
    }
    r.newton.iterations += tried.newton.iterations;
    r.newton.factorisations += tried.newton.factorisations;
    return r;
}

StepReport try_step(WireBody& b, double insertion, double twist, double length, bool any_balance)
{
    WireGroup g{{&b}, nullptr};
    return try_step(g, {{insertion, twist}}, length, any_balance);
}

} // namespace amontons
