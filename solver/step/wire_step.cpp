#include "solver/step/wire_step.hpp"

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
constexpr double kNoJump = 0.25;          // of an increment's way: the wire has not jumped in it

NewtonOptions newton_options(const WireBody& b, double shift)
{
    NewtonOptions o;
    o.tolerance = b.tolerance;
    double radius = 0;
    for (const BeamSegment& g : b.wire.material.segments)
        radius = std::max(radius, g.radius);
    o.reach = std::max(1.35 * radius, 1.5 * std::abs(shift));
    o.longest_move = 0.8 * b.grain;
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

void refuse(WireBody& b, const WireState& keep, StepReport& r, std::string why)
{
    b.wire.state = keep;
    r.accepted = false;
    r.refusal = std::move(why);
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
std::vector<Node6> weakest_mode(WireBody& b)
{
    std::vector<Node6> v = b.work->increment;
    unsigned seed = 1;
    for (int i = b.wire.state.first; i <= b.wire.last(); ++i) {
        Node6& n = v[std::size_t(i)];
        n.column = Column6{};
        if (i > b.wire.state.first)
            for (int k = 0; k < 6; ++k) {
                seed = seed * 1664525u + 1013904223u;
                n.value[k] = (double(seed >> 8) / 8388608.0 - 1) * (k < 3 ? b.grain : 1);
            }
        if (i > b.wire.state.first) {
            // along the section's axes: no axis of space decides which way it goes
            const Vec3 x = rotation_matrix(b.wire.state.nodes[std::size_t(i)].q) *
                           Vec3(n.value[0], n.value[1], n.value[2]);
            for (int k = 0; k < 3; ++k)
                n.value[k] = x[k];
        }
    }
    for (int round = 0; round < 6; ++round) {
        b.work->system.solve(v);
        double largest = 0;
        for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i)
            for (int k = 0; k < 3; ++k)
                largest = std::max(largest, std::abs(v[std::size_t(i)].value[k]));
        if (!(largest > 0)) break;
        for (int i = b.wire.state.first; i <= b.wire.last(); ++i)
            v[std::size_t(i)].column *= splat6(1 / largest);
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
        const double h = m.node[i + 1] - m.node[i], r2 = g.radius * g.radius;
        const double mass = 0.5 * g.density * 3.14159265358979323846 * r2 * h;
        for (std::size_t n : {i, i + 1}) {
            motion.mass[n] += mass;
            motion.inertia[n] += mass * r2 * Vec3(0.5, 0.25, 0.25);
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

StepReport try_step(WireBody& b, double insertion, double twist, double length, bool any_balance)
{
    StepReport r;
    const WireState old = b.wire.state;
    const double shift = insertion - old.base_insertion, turn = twist - old.base_twist;
    const double elastic_before = elastic_energy(b.wire);
    const BaseLoad load_before = base_load(b.wire);
    const StepStart start = mark_step_start(b.wire);
    const std::vector<ContactBefore> touched = contacts_before(b.wire, b.walls, b.work->proximity);

    drive_base(b.wire, insertion, twist);
    Anchor anchor;
    if (b.motion.dynamic) anchor = inertia_anchor(b, old, length);
    const NewtonReport newton =
        solve_equilibrium(b.wire, b.walls, start, anchor, newton_options(b, shift), *b.work);
    add(r.newton, newton);
    if (!newton.converged) {
        refuse(b, old, r, "no convergence");
        return r;
    }
    if (!newton.stable) {
        refuse(b, old, r, "unstable");
        return r;
    }

    const BaseLoad load = base_load(b.wire);
    r.energy.work = 0.5 * (load_before.push + load.push) * shift +
                    0.5 * (load_before.torque + load.torque) * turn;
    r.energy.elastic = elastic_energy(b.wire);
    if (b.wire.outside())
        r.energy.friction = friction_work(b.wire, start, touched, b.work->candidates);
    r.missed = r.energy.work - (r.energy.elastic - elastic_before) - r.energy.friction;
    const double turned_over = std::abs(r.energy.work) + std::abs(r.energy.friction) +
                               b.scale_force * (std::abs(shift) + kEnergyFloor * b.grain);
    if (!b.motion.dynamic && !any_balance && std::abs(r.missed) > kEnergyShare * turned_over) {
        refuse(b, old, r, kBalanceRefused);
        return r;
    }
    if (b.wire.outside()) r.passed_through = count_passages(b, start);
    if (r.passed_through > 0) {
        refuse(b, old, r, "a wall was passed");
        return r;
    }
    if (b.motion.dynamic) update_dynamics(b, old, start, length, r.energy);
    r.energy.work_absolute = std::abs(r.energy.work);
    r.accepted = true;
    return r;
}

// Gradient flow with implicit steps: each solves the wire with a viscous pull towards where it
// was, w |dx| per node. What it dissipates is the pull's work, by the trapezoid rule over the
// increment (the pull at its start is that left from the increment before). w follows the
// motion: about a quarter of an element per increment.
StepReport relax_step(WireBody& b, double insertion, double twist)
{
    StepReport r;
    const WireState old = b.wire.state;
    const double shift = insertion - old.base_insertion, turn = twist - old.base_twist;
    const BaseLoad load_before = base_load(b.wire);
    NewtonOptions options = newton_options(b, shift);
    NewtonOptions attempt = options;
    options.max_iterations = 10;
    attempt.max_iterations = 10;
    const std::size_t nodes = b.wire.material.node.size();
    const double unit =
        *std::max_element(b.wire.material.stiffness.begin(), b.wire.material.stiffness.end());
    const double target = 0.1 * b.grain;
    const double elastic_before = elastic_energy(b.wire);
    double weight = 1e-3 * unit, energy = elastic_before;
    const double energy_floor = 1e-3 * b.scale_force * b.grain;
    std::vector<Node6> pull(nodes), pull_before(nodes);
    for (Node6& n : pull_before)
        n.column = Column6{};
    bool base_moved = false, pushed_off = false, failed = false;
    int until_attempt = 1; // increments before the wire is tried at rest
    double base_work = 0;

    for (r.relaxations = 0; r.relaxations < kMostRelaxations; ++r.relaxations) {
        const WireState before = b.wire.state;
        const StepStart start = mark_step_start(b.wire);
        const std::vector<ContactBefore> touched =
            contacts_before(b.wire, b.walls, b.work->proximity);
        if (!base_moved) drive_base(b.wire, insertion, twist);

        // At rest already? Only without a further jump.
        if (base_moved && --until_attempt <= 0) {
            const NewtonReport still =
                solve_equilibrium(b.wire, b.walls, start, {}, attempt, *b.work);
            add(r.newton, still);
            if (still.converged && still.stable) {
                const double e = elastic_energy(b.wire);
                const double friction = friction_work(b.wire, start, touched, b.work->candidates);
                const double missed = energy - e - friction;
                const double allowed =
                    std::max(energy_floor, kRelaxationShare * (r.released + std::abs(friction)));
                if (std::abs(missed) <= allowed && count_passages(b, start) == 0) {
                    r.energy.friction += friction;
                    r.energy.elastic = e;
                    r.energy.released = r.released;
                    r.energy.work = base_work;
                    r.energy.work_absolute = std::abs(base_work);
                    r.missed = base_work - (e - elastic_before) - r.energy.friction - r.released;
                    r.snapped = true;
                    r.accepted = true;
                    return r;
                }
            } else if (still.converged && !pushed_off) {
                // An unstable equilibrium holds the flow: push it off along its weakest mode.
                const std::vector<Node6> mode = weakest_mode(b);
                move_wire(b.wire, mode, 1e-3 * b.grain);
                pushed_off = true;
                energy = elastic_energy(b.wire);
                for (Node6& n : pull_before)
                    n.column = Column6{};
                continue;
            }
            b.wire.state = before;
            until_attempt = 4;
        }

        Anchor anchor;
        anchor.reference = b.wire.state.nodes;
        anchor.linear.assign(nodes, 0);
        anchor.angular.assign(nodes, Vec3::Zero());
        for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i) {
            const std::size_t k = std::size_t(i);
            const double h = b.wire.material.law[k - 1].length;
            anchor.linear[k] = weight * h / b.grain;
            anchor.angular[k].setConstant(anchor.linear[k] * h * h / 12);
        }
        const NewtonReport newton =
            solve_equilibrium(b.wire, b.walls, start, anchor, options, *b.work);
        add(r.newton, newton);
        double move = 0, viscous = 0;
        if (newton.converged) {
            for (int i = b.wire.state.first + 1; i <= b.wire.last(); ++i) {
                const std::size_t k = std::size_t(i);
                const BeamNode &a = anchor.reference[k], &c = b.wire.state.nodes[k];
                const Vec3 dx = c.position() - a.position();
                const Vec3 dt = rotation_between(a.q, c.q);
                move = std::max(move, dx.norm());
                // The base's own step takes the nodes along to where the pull holds them.
                const BeamNode from = base_moved ? a : node_in(b.wire, before, i);
                const Vec3 way = c.position() - from.position();
                const Vec3 turned = rotation_between(from.q, c.q);
                for (int j = 0; j < 3; ++j) {
                    pull[k].value[j] = anchor.linear[k] * dx[j];
                    pull[k].value[j + 3] = anchor.angular[k][j] * dt[j];
                    viscous +=
                        0.5 * (pull[k].value[j] + pull_before[k].value[j]) * way[j] +
                        0.5 * (pull[k].value[j + 3] + pull_before[k].value[j + 3]) * turned[j];
                }
            }
        }
        const int passages = newton.converged ? count_passages(b, start) : 0;
        const double friction =
            newton.converged ? friction_work(b.wire, start, touched, b.work->candidates) : 0;
        const double after = newton.converged ? elastic_energy(b.wire) : energy;
        double given = 0; // by the base in this increment
        if (!base_moved) {
            const BaseLoad load = base_load(b.wire);
            given = 0.5 * (load_before.push + load.push) * shift +
                    0.5 * (load_before.torque + load.torque) * turn;
        }
        // The trapezoid must account for the energy that the increment set free. With the base also
        // the mesh can change, which costs some energy without a motion.
        const double still = base_moved ? 0.02 * target : kNoJump * target;
        const bool accounted =
            move < still ||
            std::abs(energy + given - after - friction - viscous) <=
                kRelaxationShare * (std::abs(viscous) + std::abs(friction) + std::abs(given)) +
                    0.01 * energy_floor;
        if (!newton.converged || move > 4 * target || passages > 0 || !accounted) {
            b.wire.state = before;
            weight *= failed ? 4 : 2;
            failed = true;
            if (weight > 1e6 * unit) {
                refuse(b, old, r, "no convergence in the damped relaxation");
                return r;
            }
            continue;
        }
        if (!base_moved) {
            base_work = given;
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
    refuse(b, old, r, "the damped relaxation did not come to rest");
    return r;
}

StepReport try_or_relax(WireBody& b, double insertion, double twist)
{
    const WireState old = b.wire.state;
    const StepReport tried = try_step(b, insertion, twist, 0);
    if (tried.accepted) return tried;
    StepReport r = relax_step(b, insertion, twist);
    const bool balance_only = tried.refusal == kBalanceRefused;
    if (balance_only && !(r.accepted && std::abs(r.missed) < std::abs(tried.missed))) {
        b.wire.state = old;
        r = try_step(b, insertion, twist, 0, true);
    }
    r.newton.iterations += tried.newton.iterations;
    r.newton.factorisations += tried.newton.factorisations;
    return r;
}

} // namespace amontons
