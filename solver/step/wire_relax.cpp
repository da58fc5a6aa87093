#include "solver/step/wire_group.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

constexpr int kMostInIncrement = 16;   // of Newton's method in an increment
constexpr int kLeastRelaxations = 600; // that are made before a flow ends without an equilibrium
constexpr double kRelaxationShare = 0.001; // of what an increment turned over: its balance misses
constexpr double kRoomShare = 0.1;         // of the room for misses, of one increment
constexpr int kMostCuts = 4; // increments that the way needs, times this: contacts make them short
constexpr int kFirstPause = 4, kLongestPause = 32; // increments between tries of the wires at rest
constexpr int kMostPushes = 6;   // off an unstable equilibrium, by 1e-3 to 0.1 elements
constexpr double kNoJump = 0.25; // of an increment's way: the wire has not jumped in it

/// Of turns, in the square of a length: places and turns as one vector do not depend on the unit of
/// length. What the sheath holds has no weight.
void weigh_turns(const Wire& wire, std::vector<Node6>& mode)
{
    mode[std::size_t(wire.state.first)].column = Column6{};
    for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
        const double h = wire.material.law[std::size_t(i) - 1].length;
        for (int k = 3; k < 6; ++k)
            mode[std::size_t(i)].value[k] *= h * h;
    }
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
            if (b->wire.tip && i == b->wire.last()) continue;
            for (int k = 0; k < 6; ++k) {
                seed = seed * 1664525u + 1013904223u;
                n.value[k] = (double(seed >> 8) / 8388608.0 - 1) * (k < 3 ? b->element_size : 1);
            }
            // along the section's axes: no axis of space decides which way it passes
            const Vec3 x = rotation_matrix(b->wire.state.nodes[std::size_t(i)].q) *
                           Vec3(n.value[0], n.value[1], n.value[2]);
            for (int k = 0; k < 3; ++k)
                n.value[k] = x[k];
        }
    }
    for (int round = 0; round < 6; ++round) {
        for (std::size_t w = 0; w < v.size(); ++w)
            weigh_turns(g.wires[w]->wire, v[w]);
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

// Gradient flow with implicit steps: each solves the wires with a viscous pull towards where they
// were, w |dx| per node. What it dissipates is the pull's work, by the trapezoid rule over the
// increment (the pull at its start is that left from the increment before). w follows the
// motion: about a quarter of an element per increment.
StepReport relax_step(WireGroup& g, const std::vector<BaseTarget>& to, GradientFlow* part)
{
    StepReport r;
    const GroupState old = state_of(g);
    const std::vector<BaseLoad> load_before = loads_of(g);
    NewtonOptions options = newton_options(g, to);
    NewtonOptions attempt = options;

    // ---- Options and the pull of the first increment
    options.max_iterations = kMostInIncrement;
    attempt.max_iterations = 10;
    const std::size_t wires = g.wires.size();
    double unit = 0, element_size = std::numeric_limits<double>::infinity(), energy_floor = 0;
    std::vector<std::vector<Node6>> pull(wires), pull_before(wires);
    std::vector<ViscousPull> held; // of the last increment that was taken
    for (std::size_t w = 0; w < wires; ++w) {
        const WireBody& b = *g.wires[w];
        const std::vector<double>& stiffness = b.wire.material.stiffness;
        unit = std::max(unit, *std::max_element(stiffness.begin(), stiffness.end()));
        element_size = std::min(element_size, b.element_size);
        energy_floor = std::max(energy_floor, 1e-3 * b.scale_force * b.element_size);
        pull[w].resize(b.wire.material.node.size());
        pull_before[w].resize(pull[w].size());
    }
    const auto drop_pull = [&] {
        for (std::vector<Node6>& all : pull_before)
            for (Node6& n : all)
                n.column = Column6{};
    };
    drop_pull();
    const double target = 0.1 * element_size;

    // ---- Limits and state of the flow
    // A jump may move a wire by its length.
    double longest = 0;
    for (const BaseTarget& t : to)
        longest = std::max(longest, t.insertion);
    const int most = std::max(kLeastRelaxations, int(std::min(1e6, longest / target)));
    double unexplained = 0; // misses of increments' balances that the flow's own work hides [J]
    const double elastic_before = elastic_energy_of(g);
    double weight = 1e-3 * unit, energy = elastic_before;
    int pushed_off = 0;
    bool base_moved = false, failed = false;
    // Increments before the wires are tried at rest. One that fails costs as much as some fifty
    // increments do: the next comes after twice as many.
    int until_attempt = 1, pause = kFirstPause;
    double work_of_base = 0;
    if (part && part->under_way) {
        weight = part->weight;
        pull_before = part->pull;
        until_attempt = part->until_attempt;
        pushed_off = part->pushed_off;
    }

    // ---- Increments: move, then try the wires at rest
    int taken = 0;
    for (r.relaxations = 0; r.relaxations < kMostCuts * most; ++r.relaxations) {
        if (part && taken > 0 && r.newton.iterations >= part->most) break;
        if (stopped(options)) {
            refuse(g, old, r, "interrupted");
            return r;
        }
        const GroupState before = state_of(g);
        const GroupStart start = start_of(g);
        const bool lags = std::any_of(g.wires.begin(), g.wires.end(), [](const WireBody* b) {
            return first_element_lags(b->wire);
        });
        if (!base_moved || lags) drive(g, to);
        bool meshed = base_moved && lags;
        std::vector<ViscousPull> anchors(wires);

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
                    if (part) *part = {part->most, false, {}, 0, {}, 1, false};
                    return r;
                }
            } else if (still.converged && pushed_off < kMostPushes) {
                // The flow stops at an unstable equilibrium: it is displaced along its weakest
                // mode: one way, where friction may hold it, then the other, and then farther.
                const std::vector<std::vector<Node6>> mode = weakest_mode(g);
                for (std::size_t w = 0; w < wires; ++w)
                    move_wire(g.wires[w]->wire, mode[w],
                              (pushed_off % 2 == 0 ? 1 : -1) * std::pow(10, pushed_off / 2 - 3) *
                                  element_size);
                ++pushed_off;
                const double now = elastic_energy_of(g);
                r.released += energy - now;
                energy = now;
                drop_pull();
                continue;
            }
            restore(g, before);
            meshed = false;
            until_attempt = pause;
            pause = std::min(2 * pause, kLongestPause);
        }

        for (std::size_t w = 0; w < wires; ++w)
            anchors[w] = make_viscous_pull(g.wires[w]->wire, weight / element_size);
        const NewtonReport newton = solve(g, start, anchors, options);
        add(r.newton, newton);
        double move = 0, viscous = 0;
        for (std::size_t w = 0; newton.converged && w < wires; ++w) {
            const WireBody& b = *g.wires[w];
            const ViscousPull& anchor = anchors[w];
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
        // Where a contact opens or closes the pull jumps, and the rule misses a share of the
        // increment's work however short it is. What the whole flow has set free leaves room for
        // such misses.
        const double missed = std::abs(energy + given - after - friction - viscous);
        const double room =
            kRelaxationShare * (r.released + std::abs(r.energy.friction)) - unexplained;
        const bool fits = missed <= kRelaxationShare * (std::abs(viscous) + std::abs(friction) +
                                                        std::abs(given)) +
                                        0.01 * energy_floor;
        const bool accounted = move < still || meshed || fits || missed <= kRoomShare * room;
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
        // Another mesh holds the same shape with another energy (what was one element with the mean
        // of two curvatures is two, and its middle line is found anew): what follows that is no
        // work of the pull along the nodes' motion. There what is released is what is lost.
        r.released += meshed ? energy - after - friction : viscous;
        r.energy.friction += friction;
        energy = after;
        if (!fits && move >= still && !meshed) unexplained += missed;
        ++taken;
        pull_before = pull;
        if (part) held = std::move(anchors);
        weight *= std::clamp(move / target, failed ? 0.7 : 0.25, 2.0);
        failed = false;
        weight = std::max(weight, 1e-12 * unit);
    }

    // ---- A part of a snap, or no equilibrium
    if (part && taken > 0) {
        r.energy.elastic = energy;
        r.energy.released = r.released;
        r.energy.work = work_of_base;
        r.energy.work_absolute = std::abs(work_of_base);
        r.missed = work_of_base - (energy - elastic_before) - r.energy.friction - r.released;
        r.accepted = true;
        *part = {part->most,    true,      std::move(held), weight, std::move(pull_before),
                 until_attempt, pushed_off};
        return r;
    }
    refuse(
        g, old, r,
        "the damped relaxation did not come to rest: the wire moves on without finding a balance, "
        "as friction can make it; less friction, another drive or \"time\": {\"kind\": "
        "\"dynamic\"} may find one");
    return r;
}

} // namespace amontons
