#include "solver/step/wire_group.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

// What enters the linear problem of an iteration, over the longest move of a node in it: places
// between nodes move a little farther.
constexpr double kReachOfMove = 1.25;

// A distance to a wall changes hardly faster than the point moves, so a straight way is free if the
// two distances at its ends cover it; else it is followed in steps of the distance itself. Bounds
// of the distance take no samples of the wall: far from it they are enough.
bool way_is_free(const Wall& wall, const Vec3& from, const Vec3& to, double radius, WallHint& hint)
{
    const double length = (to - from).norm();
    const double clear_from = wall.clearance(from, hint), clear_to = wall.clearance(to, hint);
    if (clear_from + clear_to >= kSteepestWall * length) return true;
    const auto enough = [&](const Vec3& x, double clear) {
        return clear > radius ? clear : wall.distance(x, hint);
    };
    const double a = enough(from, clear_from), b = enough(to, clear_to);
    if (b < 0) return false;
    if (a + b >= kSteepestWall * length) return true;
    double t = std::max(a, 0.0);
    while (t < length - b) {
        const Vec3 x = from + t / length * (to - from);
        const double d = enough(x, wall.clearance(x, hint));
        if (d < 0) return false;
        t += std::max(d, 0.1 * radius);
    }
    return true;
}

/// Contact points that left the free space in the step, on their way or at its end.
int count_wire_passages(const WireBody& b, const StepStart& start)
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
            if (b.walls[k].foundation > 0) continue; // springs have no other side
            // Known to be far, and the whole way shorter than that.
            if (near.distance >= 0 && near.distance > kSteepestWall * ((x - near.at).norm() +
                                                                       (start.point[p] - x).norm()))
                continue;
            const WireWall& wall = b.walls[k];
            if (!way_is_free(*wall.wall, pulled_back(wall, start.point[p], near.hint),
                             pulled_back(wall, x, near.hint), m.radius, near.hint))
                ++count;
        }
    }
    return count;
}

/// Strains of the elements of a wire that was moved along itself: what they were where these are
/// now. Their own err where a place passed a node, and times EA that would be a load.
void strains_along(const Wire& wire, const WireState& before, double shift,
                   std::vector<std::array<double, 6>>& strains)
{
    strains.clear();
    if (!wire.sheath || !wire.outside() || before.first >= wire.last()) return;
    const std::vector<double>& node = wire.material.node;
    const double end = wire.material.length - before.inserted;
    std::vector<std::array<double, 6>> old(wire.material.law.size());
    for (int i = before.first; i < wire.last(); ++i) {
        const std::size_t n = std::size_t(i);
        const double length = i == before.first ? node[n + 1] - end : node[n + 1] - node[n];
        old[n] = element_strain(before.nodes[n], before.nodes[n + 1], length);
    }
    strains.resize(old.size());
    int j = before.first;
    for (int i = wire.state.first; i < wire.last(); ++i) {
        const std::size_t n = std::size_t(i);
        const double at = 0.5 * (node[n] + node[n + 1]) + shift;
        while (j + 1 < wire.last() && node[std::size_t(j) + 1] < at)
            ++j;
        strains[n] = old[std::size_t(j)];
    }
}

} // namespace

NewtonOptions newton_options(const WireGroup& g, const std::vector<BaseTarget>& to)
{
    NewtonOptions o;
    o.tolerance = g.wires[0]->tolerance;
    o.longest_move = std::numeric_limits<double>::infinity();
    o.stop = g.stop;
    double largest_radius = 0, longest_shift = 0;
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        const WireBody& b = *g.wires[w];
        double radius = 0;
        for (const BeamSegment& segment : b.wire.material.segments)
            radius = std::max(radius, segment.radius);
        longest_shift =
            std::max({longest_shift, std::abs(to[w].insertion - b.wire.state.base_insertion),
                      (to[w].tip - b.wire.state.tip_moved).norm()});
        largest_radius = std::max(largest_radius, radius);
        o.longest_move = std::min(o.longest_move, 0.8 * b.element_size);
    }
    // An iteration reaches no contact that is farther away than its longest move: the next one
    // finds it.
    o.reach = std::max(1.35 * largest_radius,
                       std::min(1.5 * longest_shift, kReachOfMove * o.longest_move));
    return o;
}

void add(NewtonReport& sum, const NewtonReport& r)
{
    sum.converged = r.converged;
    sum.stable = r.stable;
    sum.iterations += r.iterations;
    sum.factorisations += r.factorisations;
    sum.shifted += r.shifted;
    sum.wall_evaluations += r.wall_evaluations;
    sum.wall_tangents += r.wall_tangents;
    sum.residual = r.residual;
    sum.seconds_elements += r.seconds_elements;
    sum.seconds_detection += r.seconds_detection;
    sum.seconds_contact += r.seconds_contact;
    sum.seconds_rest += r.seconds_rest;
}

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

GroupStart start_of(const WireGroup& g)
{
    GroupStart s;
    for (const WireBody* b : g.wires) {
        s.wires.push_back(mark_step_start(b->wire));
        mark_soft_walls(b->wire, b->walls);
        s.touched.push_back(contacts_before(b->wire, b->walls, b->work->proximity));
    }
    if (g.coaxial) s.nested = mark_coaxial_start(*g.coaxial);
    return s;
}

NewtonReport solve(WireGroup& g, const GroupStart& start, const std::vector<ViscousPull>& anchors,
                   const NewtonOptions& options)
{
    if (g.coaxial) return solve_coaxial(*g.coaxial, start.wires, start.nested, anchors, options);
    WireBody& b = *g.wires[0];
    const NewtonReport report =
        solve_equilibrium(b.wire, b.walls, start.wires[0], anchors[0], options, *b.work);
    if (b.wire.tip) {
        b.wire.state.tip_force = b.work->tip.force;
        b.wire.state.tip_moment = b.work->tip.moment;
    }
    return report;
}

void drive(WireGroup& g, const std::vector<BaseTarget>& to)
{
    std::vector<double> shift;
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        Wire& wire = g.wires[w]->wire;
        shift.push_back(to[w].insertion - wire.state.base_insertion);
        const WireState before = g.coaxial ? wire.state : WireState{}; // a large copy
        drive_base(wire, to[w].insertion, to[w].twist);
        if (wire.tip && wire.outside()) move_held_tip(wire, to[w].tip);
        if (g.coaxial && shift.back() != 0)
            strains_along(wire, before, shift.back(), g.wires[w]->work->predicted);
    }
    if (g.coaxial) shift_coaxial_reactions(*g.coaxial, shift);
}

double elastic_energy_of(const WireGroup& g)
{
    double sum = 0;
    for (const WireBody* b : g.wires)
        sum += elastic_energy(b->wire) + b->wire.state.wall_energy;
    return sum;
}

std::vector<BaseLoad> loads_of(const WireGroup& g)
{
    std::vector<BaseLoad> loads;
    for (const WireBody* b : g.wires)
        loads.push_back(base_load(b->wire));
    return loads;
}

double base_work(const WireGroup& g, const GroupState& old, const std::vector<BaseLoad>& before)
{
    double sum = 0;
    for (std::size_t w = 0; w < g.wires.size(); ++w) {
        const WireState &a = old.wires[w], &s = g.wires[w]->wire.state;
        if (!g.wires[w]->wire.sheath) continue; // a clamp, moved by its holder
        const BaseLoad load = base_load(g.wires[w]->wire);
        sum += 0.5 * (before[w].push + load.push) * (s.base_insertion - a.base_insertion) +
               0.5 * (before[w].torque + load.torque) * (s.base_twist - a.base_twist);
        sum += 0.5 * (a.tip_force + s.tip_force).dot(s.tip_moved - a.tip_moved);
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
        if (g.wires[w]->wire.outside()) count += count_wire_passages(*g.wires[w], start.wires[w]);
    return count;
}

} // namespace amontons
