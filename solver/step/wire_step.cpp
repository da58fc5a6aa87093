#include "solver/step/soft_balance.hpp"
#include "solver/step/wire_group.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

// A step is refused if its energy balance misses more than this share of what it turned over:
// an equilibrium that jumped leaves energy unaccounted for, and a kink of the push force is
// resolved by shorter steps.
constexpr double kEnergyShare = 0.02;
// ... and more than this share of the wire's own force times its element.
constexpr double kEnergyFloor = 0.5;
constexpr const char* kBalanceRefused = "energy balance";

/// Largest error of the trapezoid rule for the work at the bases, if the loads vary monotonically
/// between the ends of the step [J].
double most_of_course(const WireGroup& g, const GroupState& old,
                      const std::vector<BaseLoad>& before)
{
    double sum = 0;
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        const WireState &a = old.wires[w], &s = g.wires[w]->wire.state;
        if (!g.wires[w]->course || !g.wires[w]->wire.sheath) continue;
        const BaseLoad load = base_load(g.wires[w]->wire);
        sum +=
            0.5 * std::abs((load.push - before[w].push) * (s.base_insertion - a.base_insertion)) +
            0.5 * std::abs((load.torque - before[w].torque) * (s.base_twist - a.base_twist));
        sum += 0.5 * std::abs((s.tip_force - a.tip_force).dot(s.tip_moved - a.tip_moved));
    }
    return sum;
}

} // namespace

WireBody make_wire_body(Wire wire, std::vector<WireWall> walls, WireMotion motion, double tolerance)
{
    WireBody b;
    b.wire = std::move(wire);
    b.walls = std::move(walls);
    b.motion = std::move(motion);
    b.tolerance = tolerance;
    b.wire.state.reaction.assign(b.wire.material.point.size() * b.walls.size(), {});
    rest_walls(b.wire, b.walls);
    WireDynamics& d = b.dynamics;
    for (auto* list : {&d.velocity, &d.spin, &d.inertia_force, &d.inertia_moment})
        list->assign(b.wire.material.node.size(), Vec3::Zero());
    for (auto* list : {&d.contact_force, &d.contact_arm})
        list->assign(b.wire.state.reaction.size(), Vec3::Zero());
    double EI = 0;
    for (const ElementLaw& law : b.wire.material.law) {
        b.element_size = std::max(b.element_size, law.length);
        EI = std::max({EI, law.S[4] / law.length, law.S[5] / law.length});
    }
    b.scale_force = EI / (b.wire.material.length * b.wire.material.length);
    b.work = std::make_unique<NewtonWorkspace>(b.wire, b.walls.size());
    return b;
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
    std::vector<ViscousPull> anchors(g.wires.size());
    for (std::size_t w = 0; w < anchors.size() && dynamic; ++w)
        anchors[w] = inertia_pull(*g.wires[w], old.wires[w], length);
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
        const double shift = std::abs(to[w].insertion - old.wires[w].base_insertion) +
                             (to[w].tip - old.wires[w].tip_moved).norm();
        turned_over += b.scale_force * (shift + kEnergyFloor * b.element_size);
    }
    const double may_miss = kEnergyShare * turned_over + most_of_course(g, old, load_before);
    if (!dynamic && !any_balance && std::abs(r.missed) > may_miss) {
        r.missed_by = std::abs(r.missed) / may_miss;
        refuse(g, old, r, kBalanceRefused);
        return r;
    }
    r.passed_through = count_passages(g, start);
    if (r.passed_through > 0) {
        refuse(g, old, r, "a wall was passed");
        return r;
    }
    if (dynamic) update_dynamics(g, old, start, length, r.energy);
    r.energy.work_absolute = std::abs(r.energy.work);
    r.accepted = true;
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
    r.newton.wall_evaluations += tried.newton.wall_evaluations;
    r.newton.wall_tangents += tried.newton.wall_tangents;
    return r;
}

StepReport try_step(WireBody& b, double insertion, double twist, double length, bool any_balance)
{
    WireGroup g{{&b}};
    return try_step(g, {{insertion, twist}}, length, any_balance);
}

} // namespace amontons
