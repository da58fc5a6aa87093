#include "solver/step/wire_simulation.hpp"

#include "mesh/base/curve.hpp"
#include "mesh/base/error.hpp"
#include "mesh/base/phase_timer.hpp"
#include "mesh/bounding_tree.hpp"
#include "solver/step/branch_log.hpp"
#include "solver/step/coaxial.hpp"
#include "solver/step/energy_balance.hpp"
#include "solver/step/run_summary.hpp"
#include "solver/step/soft_vessel.hpp"
#include "solver/step/wire_build.hpp"
#include "solver/step/wire_overlap.hpp"
#include "solver/step/wire_problem.hpp"
#include "solver/step/wire_record.hpp"
#include "solver/step/wire_start.hpp"
#include "solver/step/wire_step.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons {
namespace {

// Half a step of smooth motion misses a quarter of what the whole misses of its balance, relative
// to what it turns over. What misses more than that has jumped, and is quartered.
constexpr double kJumped = 4;

void add_energy(EnergyRecord& sum, const EnergyRecord& step)
{
    sum.work += step.work;
    sum.work_absolute += step.work_absolute;
    sum.friction += step.friction;
    sum.released += step.released;
}

/// Before the names of a wire's quantities: of one wire alone nothing tells it apart.
std::string wire_prefix(const Scene& scene, std::size_t wire)
{
    return scene.beams.size() > 1 ? scene.beams[wire].name + "_" : "";
}

} // namespace

/// Plain numbers that a wire's history needs; copied to and from checkpoints as they are.
struct WireHistory {
    double elastic_start = 0; ///< J, of the initial state
    double elastic = 0, kinetic = 0;
    double cap = std::numeric_limits<double>::infinity(); ///< insertion at an opening [m]
    double max_push = 0, max_torque = 0, max_depth = 0, max_cluster = 0;
    int opening = -1, opening_wall = -1;
    BranchLog branch;
    WireOverlapLog overlap;
};

struct WireSimulation::State {
    Scene scene;
    std::vector<Obstacle> obstacles;
    std::vector<SoftVessel> vessels;
    std::vector<WireBody> wires;
    std::vector<std::unique_ptr<Coaxial>> coaxial; ///< wires in one another
    std::vector<WireGroup> groups;                 ///< every wire is in one
    std::vector<std::vector<int>> walls;           ///< obstacles of each wire's walls
    std::vector<WireHistory> history;
    std::vector<std::unique_ptr<BoundingTree>> tree; ///< made when a contact first needs it
    std::vector<std::vector<double>> max_force;      ///< per obstacle and vertex [N]
    std::vector<double> wall_moved; ///< of each vessel's wall the most that was looked at [m]

    bool started = false;
    double time = 0, step_length = 0;
    int step = 0, retries = 0, contact_steps = 0;
    double contacts_sum = 0;
    EnergyRecord energy;
    RunSummary summary;

    double longest() const { return scene.time.step; }
    double smallest() const
    {
        return scene.time.smallest_step > 0 ? scene.time.smallest_step
                                            : kDefaultSmallest * longest();
    }
    /// The length that is tried after h, which was refused.
    double shorter(double h, double missed_by) const
    {
        const double relaxed = kRelaxFailed * longest();
        const double least = h > relaxed ? std::max(relaxed, smallest()) : smallest();
        return std::max((missed_by > kJumped ? 0.25 : 0.5) * h, least);
    }
    double insertion(std::size_t w, double t) const
    {
        // The base counts from the sheath's rigid end; the scene from its very end.
        const double fade = wires[w].wire.sheath->fade;
        return std::min(curve_value(scene.beams[w].insertion, t) + fade, history[w].cap);
    }
    double twist(std::size_t w, double t) const
    {
        const CurvePoints& c = scene.beams[w].twist;
        return c.empty() ? 0 : curve_value(c, t);
    }
    /// Where the bases of a group are at a time.
    std::vector<BaseTarget> targets(const WireGroup& g, double t) const
    {
        std::vector<BaseTarget> to;
        for (const WireBody* b : g.wires) {
            const auto w = std::size_t(b - wires.data());
            to.push_back({insertion(w, t), twist(w, t)});
        }
        return to;
    }
    /// The wire that a group's energy is kept with.
    std::size_t first_of(const WireGroup& g) const
    {
        return std::size_t(g.wires[0] - wires.data());
    }
    double next_knot() const;
    bool advance(double h, StepReport& sum, std::string& refusal, bool relax);
    StepRecord record(const StepReport& r, double h, double seconds);
    void note_forces(const StepRecord& r);
    void note_overlap(std::size_t w, OverlapRecord& worst);
    const std::string& wall_name(int number) const
    {
        const auto o = std::size_t(number);
        return o < obstacles.size() ? obstacles[o].name
                                    : vessels[o - obstacles.size() - wires.size()].name;
    }
    void note_openings(const std::vector<Vec3>& tips_before);
    void note_walls();
    void finish(RunSummary& s) const;
};

double WireSimulation::State::next_knot() const
{
    double next = scene.time.end;
    for (const BeamInput& b : scene.beams)
        for (const CurvePoints* c : {&b.insertion, &b.twist})
            for (const auto& p : *c)
                if (p[0] > time * (1 + 1e-12) && p[0] < next) next = p[0];
    return next;
}

/// One step of all wires; either all move or none.
bool WireSimulation::State::advance(double h, StepReport& sum, std::string& refusal, bool relax)
{
    struct Kept {
        WireState state;
        WireDynamics dynamics;
    };
    std::vector<Kept> kept;
    std::vector<std::vector<std::vector<Reaction>>> kept_nested;
    std::vector<StepReport> reports;
    const double t = time + h;
    bool accepted = true;
    if (groups.size() > 1) {
        for (const WireBody& b : wires)
            kept.push_back({b.wire.state, b.dynamics});
        for (const auto& c : coaxial) {
            kept_nested.emplace_back();
            for (const Nesting& n : c->nestings)
                kept_nested.back().push_back(n.reaction);
        }
    }
    for (std::size_t k = 0; k < groups.size() && accepted; ++k) {
        WireGroup& g = groups[k];
        const bool may_relax = relax && !g.wires[0]->motion.dynamic;
        const std::vector<BaseTarget> to = targets(g, t);
        const StepReport r = may_relax ? try_or_relax(g, to) : try_step(g, to, h);
        if (!r.accepted) {
            refusal = scene.beams[first_of(g)].name + ": " + r.refusal;
            sum.missed_by = r.missed_by;
        }
        accepted = r.accepted;
        reports.push_back(r);
        sum.newton.iterations += r.newton.iterations;
        sum.newton.factorisations += r.newton.factorisations;
        sum.newton.wall_looks += r.newton.wall_looks;
        sum.newton.wall_tangents += r.newton.wall_tangents;
        sum.newton.seconds_elements += r.newton.seconds_elements;
        sum.newton.seconds_detection += r.newton.seconds_detection;
        sum.newton.seconds_contact += r.newton.seconds_contact;
        sum.newton.seconds_rest += r.newton.seconds_rest;
        const double error = r.newton.residual.error();
        if (k == 0 || !(error < sum.newton.residual.error()))
            sum.newton.residual = r.newton.residual;
    }
    if (!accepted) {
        for (std::size_t w = 0; w < kept.size(); ++w) {
            wires[w].wire.state = kept[w].state;
            wires[w].dynamics = kept[w].dynamics;
        }
        for (std::size_t c = 0; c < kept_nested.size(); ++c)
            for (std::size_t n = 0; n < kept_nested[c].size(); ++n)
                coaxial[c]->nestings[n].reaction = kept_nested[c][n];
        return false;
    }
    for (std::size_t k = 0; k < groups.size(); ++k) {
        const StepReport& r = reports[k];
        const std::size_t w = first_of(groups[k]);
        add_energy(energy, r.energy);
        history[w].elastic = r.energy.elastic;
        history[w].kinetic = r.energy.kinetic;
        sum.passed_through += r.passed_through;
        const double noticeable = 0.1 * wires[w].scale_force * wires[w].grain;
        if (r.snapped && r.released > noticeable) {
            sum.snapped = true;
            summary.snaps.push_back({step + 1, t, wire_depth(wires[w].wire), r.released});
        }
    }
    energy.elastic = energy.kinetic = energy.elastic_start = 0;
    for (const WireHistory& k : history) {
        energy.elastic += k.elastic;
        energy.elastic_start += k.elastic_start;
        energy.kinetic += k.kinetic;
    }
    follow(energy);
    time = t;
    ++step;
    return true;
}

StepRecord WireSimulation::State::record(const StepReport& r, double h, double seconds)
{
    StepRecord out;
    out.step = step;
    out.time = time;
    out.step_length = h;
    out.seconds = seconds;
    out.iterations = r.newton.iterations;
    out.factorisations = r.newton.factorisations;
    out.retries = retries;
    out.remark = r.snapped ? "snap" : retries > 0 ? "halved: " + r.refusal : "";
    out.phases.free_motion = r.newton.seconds_elements;
    out.phases.detection = r.newton.seconds_detection;
    out.phases.contact_solve = r.newton.seconds_contact;
    out.phases.correction = r.newton.seconds_rest;
    out.energy = energy;
    const Residual& res = r.newton.residual;
    out.certificate.tolerance = std::max(scene.accuracy.contact, res.floor);
    out.certificate.error = res.scale > 0 ? res.error() : 0;
    out.certificate.worst_penetration = res.penetration;
    out.certificate.worst_cone_violation = std::max(0.0, res.cone);
    out.certificate.certified = out.certificate.error <= out.certificate.tolerance;
    for (std::size_t w = 0; w < wires.size(); ++w) {
        const std::string prefix = wire_prefix(scene, w);
        record_wire(wires[w], scene.beams[w].name, int(obstacles.size() + w), walls[w], prefix,
                    scene.output.cluster, out);
        WireHistory& k = history[w];
        note_overlap(w, out.certificate.worst_overlap);
        for (const Quantity& q : out.quantities) {
            if (q.name == prefix + "push_force") k.max_push = std::max(k.max_push, q.value);
            if (q.name == prefix + "torque")
                k.max_torque = std::max(k.max_torque, std::abs(q.value));
            if (q.name == prefix + "depth") {
                const bool is_most = q.value >= k.max_depth;
                k.branch.note(obstacles, walls[w], wire_tip(wires[w].wire), q.value, is_most);
                if (is_most) k.max_depth = q.value;
            }
            if (q.name == prefix + "clustered_force")
                k.max_cluster = std::max(k.max_cluster, q.value);
        }
    }
    if (std::any_of(vessels.begin(), vessels.end(),
                    [](const SoftVessel& v) { return v.tube->beyond() != nullptr; })) {
        out.quantities.push_back({"wall_balances", "", double(r.newton.wall_looks)});
        out.quantities.push_back({"wall_tangents", "", double(r.newton.wall_tangents)});
    }
    for (const auto& c : coaxial)
        for (std::size_t n = 0; n < c->nestings.size(); ++n) {
            const auto index = [&](int k) {
                return int(c->wires[std::size_t(c->pairs[n][std::size_t(k)])] - wires.data());
            };
            record_nesting(*c, n, int(obstacles.size()) + index(0),
                           int(obstacles.size()) + index(1),
                           scene.beams[std::size_t(index(1))].name + "_over_" +
                               scene.beams[std::size_t(index(0))].name + "_",
                           out);
        }
    return out;
}

void WireSimulation::State::note_forces(const StepRecord& r)
{
    for (const ContactRecord& c : r.contacts) {
        const std::size_t o = std::size_t(c.body_b);
        if (o >= obstacles.size()) continue; // in a bore
        const SurfaceMesh& mesh = *obstacles[o].model.surface;
        if (mesh.triangles.empty()) continue;
        if (!tree[o]) tree[o] = std::make_unique<BoundingTree>(mesh);
        if (max_force[o].empty()) max_force[o].assign(mesh.points.size(), 0);
        const NearestTriangle at = tree[o]->nearest(c.point, -1);
        const auto& corners = mesh.triangles[std::size_t(at.triangle)];
        int best = corners[0];
        for (int v : corners)
            if ((mesh.points[std::size_t(v)] - c.point).squaredNorm() <
                (mesh.points[std::size_t(best)] - c.point).squaredNorm())
                best = v;
        double& f = max_force[o][std::size_t(best)];
        f = std::max(f, c.clustered_force);
    }
}

/// Looks at walls that give way as they are now: at frames, and at the end.
void WireSimulation::State::note_walls()
{
    wall_moved.resize(vessels.size(), 0);
    for (std::size_t v = 0; v < vessels.size(); ++v)
        wall_moved[v] = std::max(wall_moved[v], wall_motion(vessels[v]));
}

/// Of the accepted state.
void WireSimulation::State::note_overlap(std::size_t w, OverlapRecord& worst)
{
    const WireOverlap o = deepest_overlap(wires[w]);
    const int wall = walls[w].empty() ? -1 : walls[w][o.wall];
    history[w].overlap.note(o, wall, step);
    if (o.depth > worst.depth)
        worst = {o.depth, scene.beams[w].name, wall_name(wall), o.point, step};
}

void WireSimulation::State::note_openings(const std::vector<Vec3>& tips_before)
{
    for (std::size_t w = 0; w < wires.size(); ++w) {
        WireHistory& k = history[w];
        const WireState& s = wires[w].wire.state;
        if (s.base_insertion < k.cap) {
            // Pulled back from an opening: it may go on another way.
            if (insertion(w, time) < k.cap)
                k.cap = std::numeric_limits<double>::infinity(), k.opening = -1;
        }
        if (k.opening >= 0) continue;
        const Vec3 tip = wire_tip(wires[w].wire);
        for (int o : walls[w]) {
            if (std::size_t(o) >= obstacles.size()) continue; // the wall of a vessel
            const WallModel& m = obstacles[std::size_t(o)].model;
            if (const Opening* p = opening_passed(m, tips_before[w], tip)) {
                k.opening = int(p - m.openings.data());
                k.opening_wall = o;
                k.cap = s.base_insertion;
            }
        }
    }
}

void WireSimulation::State::finish(RunSummary& s) const
{
    s.steps = step;
    s.time = time;
    s.energy = energy;
    s.contacts_mean = contact_steps > 0 ? contacts_sum / contact_steps : 0;
    s.not_measured.clear();
    if (!coaxial.empty())
        s.not_measured.push_back("instruments in one another: gaps at their points of contact are "
                                 "certified, what is between them is not measured");
    s.undetermined_not_examined = {"instruments: they are elastic"};
    s.quantities.clear();
    s.texts.clear();
    for (std::size_t w = 0; w < wires.size(); ++w) {
        const std::string prefix = wire_prefix(scene, w);
        const Wire& wire = wires[w].wire;
        const WireHistory& k = history[w];
        s.quantities.push_back({prefix + "depth", "m", wire_depth(wire)});
        s.quantities.push_back({prefix + "max_depth", "m", k.max_depth});
        s.quantities.push_back({prefix + "max_push_force", "N", k.max_push});
        s.quantities.push_back({prefix + "max_torque", "N m", k.max_torque});
        s.quantities.push_back({prefix + "max_clustered_force", "N", k.max_cluster});
        s.quantities.push_back({prefix + "passed_through", "", double(count_outside(wires[w]))});
        const Vec3 tip = wire_tip(wire);
        for (int i = 0; i < 3; ++i)
            s.quantities.push_back({prefix + "tip_" + "xyz"[i], "m", tip[i]});
        std::string branch = k.branch.name(obstacles);
        if (k.opening >= 0)
            branch =
                obstacles[std::size_t(k.opening_wall)].model.openings[std::size_t(k.opening)].name;
        s.texts.push_back({prefix + "branch", branch});
    }
}

WireSimulation::WireSimulation(const Scene& scene, std::vector<Obstacle> obstacles)
    : state_(std::make_unique<State>())
{
    State& s = *state_;
    s.scene = scene;
    s.obstacles = std::move(obstacles);
    s.tree.resize(s.obstacles.size());
    s.max_force.resize(s.obstacles.size());
    s.step_length = scene.time.step;
    s.vessels = build_soft_vessels(scene);
    std::vector<Issue> issues;
    for (const BeamInput& beam : scene.beams) {
        std::vector<int> near;
        s.wires.push_back(build_wire(scene, beam, s.obstacles, s.vessels, near));
        s.walls.push_back(near);
        std::vector<std::string> names;
        for (const int k : near)
            names.push_back(
                std::size_t(k) < s.obstacles.size()
                    ? s.obstacles[std::size_t(k)].name
                    : s.vessels[std::size_t(k) - s.obstacles.size() - scene.beams.size()].name);
        check_start(scene, beam, s.wires.back(), names, s.obstacles, issues);
    }
    s.history.resize(s.wires.size());
    if (!issues.empty()) throw InputError(issues);
    s.groups = make_groups(scene, s.wires, s.coaxial);
}

WireSimulation::~WireSimulation() = default;

RunSummary WireSimulation::run(StepObserver& observer, const std::atomic<bool>& stop)
{
    State& s = *state_;
    RunSummary& sum = s.summary;
    sum.status = "running";
    sum.message.clear();
    const auto finish = [&](const char* status, std::string message) {
        sum.status = status;
        sum.message = std::move(message);
        s.finish(sum);
        s.note_walls();
        RunSummary whole = sum; // a run that goes on says it at its own end
        for (std::size_t v = 0; v < s.vessels.size(); ++v)
            if (std::string told = wall_warning(s.vessels[v], s.wall_moved[v]); !told.empty())
                whole.warnings.push_back(std::move(told));
        double size = 0;
        for (const WireBody& b : s.wires)
            size = std::max(size, b.wire.material.length);
        const bool dynamic = s.wires[0].motion.dynamic;
        if (std::string told = energy_warning(s.energy, {s.scene.accuracy.contact, size, dynamic});
            !told.empty())
            whole.warnings.push_back(std::move(told));
        for (std::size_t w = 0; w < s.wires.size(); ++w) {
            const WireOverlapLog& log = s.history[w].overlap;
            if (!(log.depth > 0)) continue;
            std::string told = log.warning(s.scene.beams[w].name, s.wall_name(log.wall));
            if (!told.empty()) whole.warnings.push_back(std::move(told));
        }
        return whole;
    };
    const auto observe = [&](StepRecord r) {
        sum.seconds.free_motion += r.phases.free_motion;
        sum.seconds.detection += r.phases.detection;
        sum.seconds.contact_solve += r.phases.contact_solve;
        sum.seconds.correction += r.phases.correction;
        const Stopwatch watch;
        r.phases = sum.seconds;
        s.note_forces(r);
        s.finish(sum);
        observer.on_step(r);
        sum.seconds.output += watch.seconds();
    };

    if (!s.started) {
        StepReport first;
        std::string refusal;
        for (std::size_t k = 0; k < s.groups.size(); ++k) {
            WireGroup& g = s.groups[k];
            const std::vector<BaseTarget> to = s.targets(g, 0);
            const bool dynamic = g.wires[0]->motion.dynamic;
            g.wires[0]->motion.dynamic = false;
            const StepReport r = start_wires(g, to, stop);
            g.wires[0]->motion.dynamic = dynamic;
            if (!r.accepted && stop) return finish("interrupted", "interrupted by the user");
            if (!r.accepted) return finish("failed", "the initial state: " + r.refusal);
            WireHistory& h = s.history[s.first_of(g)];
            h.elastic = h.elastic_start = r.energy.elastic;
            s.energy.elastic += h.elastic;
            s.energy.elastic_start += h.elastic;
            if (k == 0) first = r;
        }
        s.started = true;
        observe(s.record(first, 0, 0));
    }

    const double end = s.scene.time.end;
    while (s.time < end * (1 - 1e-12)) {
        if (stop) return finish("interrupted", "interrupted by the user");
        const Stopwatch watch;
        StepReport report;
        std::string refusal;
        const double reach = s.next_knot() - s.time;
        double h = std::min(s.step_length, reach);
        if (reach - h < 1e-6 * s.longest()) h = reach; // no sliver before a knot
        std::vector<Vec3> tips;
        for (const WireBody& b : s.wires)
            tips.push_back(wire_tip(b.wire));
        bool failed = false;
        s.retries = 0;
        for (;;) {
            const bool unstable = refusal.ends_with("unstable");
            const bool relax = h <= (unstable ? kRelaxUnstable : kRelaxFailed) * s.longest();
            if (s.advance(h, report, refusal, relax)) break;
            ++s.retries;
            if (h <= s.smallest()) {
                failed = true;
                break;
            }
            h = s.shorter(h, report.missed_by);
        }
        if (failed)
            return finish("failed", "step " + std::to_string(s.step + 1) +
                                        " (t = " + std::to_string(s.time) + " s): " + refusal +
                                        describe_worst(s.wires, report.newton.residual));
        report.refusal = refusal;
        s.step_length = std::min(2 * h, s.longest());
        s.note_openings(tips);
        StepRecord r = s.record(report, h, watch.seconds());
        add_step(sum, r);
        s.contacts_sum += double(r.contacts.size());
        ++s.contact_steps;
        for (const ContactRecord& c : r.contacts)
            s.energy.largest_force = std::max(s.energy.largest_force, c.force.norm());
        observe(r);
    }
    return finish("done", "");
}

const std::vector<Obstacle>& WireSimulation::obstacles() const
{
    return state_->obstacles;
}

std::vector<RecordedProblem> WireSimulation::contact_problems() const
{
    // One a wire, in their order; none of instruments in one another, which share theirs.
    std::vector<RecordedProblem> all(state_->wires.size());
    for (const WireGroup& g : state_->groups)
        if (!g.coaxial) all[state_->first_of(g)] = contact_problem(*g.wires[0]);
    return all;
}

std::vector<BodyRecord> WireSimulation::body_records() const
{
    state_->note_walls();
    std::vector<BodyRecord> all;
    for (const SoftVessel& v : state_->vessels)
        all.push_back(record_vessel(v));
    return all;
}

std::vector<BodyPlan> WireSimulation::plan() const
{
    std::vector<BodyPlan> plan;
    for (const Obstacle& o : state_->obstacles)
        plan.push_back({o.name, "obstacle", 0});
    for (std::size_t w = 0; w < state_->wires.size(); ++w)
        plan.push_back({state_->scene.beams[w].name, "beam",
                        6 * int(state_->wires[w].wire.material.node.size())});
    for (const SoftVessel& v : state_->vessels)
        plan.push_back(
            {v.name, "solid", 3 * int(v.tube->mesh().nodes.size()), set_sizes(v.tube->mesh())});
    return plan;
}

std::vector<double> WireSimulation::max_contact_force(std::size_t obstacle) const
{
    const State& s = *state_;
    if (!s.max_force[obstacle].empty()) return s.max_force[obstacle];
    return std::vector<double>(s.obstacles[obstacle].model.surface->points.size(), 0);
}

std::vector<std::byte> WireSimulation::save() const
{
    const State& s = *state_;
    ByteWriter out;
    out.value(s.started);
    out.value(s.time);
    out.value(s.step_length);
    out.value(s.step);
    out.value(s.contact_steps);
    out.value(s.contacts_sum);
    out.value(s.energy);
    for (const SoftVessel& v : s.vessels)
        save_tangent(*v.tube, out);
    for (std::size_t w = 0; w < s.wires.size(); ++w) {
        save_wire(s.wires[w], out);
        out.value(s.history[w]);
    }
    for (const auto& c : s.coaxial)
        for (const Nesting& n : c->nestings)
            save_reactions(n.reaction, out);
    for (const std::vector<double>& f : s.max_force)
        out.vector(f);
    out.vector(s.wall_moved);
    save_summary(s.summary, out);
    return out.take();
}

void WireSimulation::restore(const std::vector<std::byte>& state)
{
    // Read into copies first: a damaged state changes nothing.
    State& s = *state_;
    ByteReader in(state);
    const auto started = in.value<bool>();
    const auto time = in.value<double>();
    const auto step_length = in.value<double>();
    const auto step = in.value<int>();
    const auto contact_steps = in.value<int>();
    const auto contacts_sum = in.value<double>();
    const auto energy = in.value<EnergyRecord>();
    std::vector<Eigen::VectorXd> tangents;
    for (const SoftVessel& v : s.vessels)
        tangents.push_back(read_tangent(*v.tube, in));
    std::vector<SavedWire> wires;
    std::vector<WireHistory> history;
    for (const WireBody& b : s.wires) {
        wires.push_back(read_wire(b, in));
        history.push_back(in.value<WireHistory>());
    }
    std::vector<std::vector<Reaction>> nested;
    for (const auto& c : s.coaxial)
        for (const Nesting& n : c->nestings)
            nested.push_back(read_reactions(n.reaction.size(), in));
    std::vector<std::vector<double>> force;
    for (const Obstacle& o : s.obstacles)
        force.push_back(in.vector<double>(o.model.surface->points.size()));
    auto wall_moved = in.vector<double>(s.vessels.size());
    RunSummary sum = read_summary(in);
    in.end();

    s.wall_moved = std::move(wall_moved);
    for (std::size_t v = 0; v < s.vessels.size(); ++v)
        restore_tangent(*s.vessels[v].tube, tangents[v]);
    s.started = started;
    s.time = time;
    s.step_length = step_length;
    s.step = step;
    s.contact_steps = contact_steps;
    s.contacts_sum = contacts_sum;
    s.energy = energy;
    for (std::size_t w = 0; w < wires.size(); ++w)
        restore_wire(s.wires[w], wires[w]);
    auto next = nested.begin();
    for (const auto& c : s.coaxial)
        for (Nesting& n : c->nestings)
            n.reaction = std::move(*next++);
    s.history = std::move(history);
    s.max_force = std::move(force);
    s.summary = std::move(sum);
}

} // namespace amontons
