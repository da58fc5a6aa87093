#include "solver/step/wire_simulation.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/step/energy_balance.hpp"
#include "solver/step/knots.hpp"
#include "solver/step/run_summary.hpp"
#include "solver/step/wire_build.hpp"
#include "solver/step/wire_problem.hpp"
#include "solver/step/wire_record.hpp"
#include "solver/step/wire_simulation_state.hpp"
#include "solver/step/wire_start.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

void add_energy(EnergyRecord& sum, const EnergyRecord& step)
{
    sum.work += step.work;
    sum.work_absolute += step.work_absolute;
    sum.friction += step.friction;
    sum.released += step.released;
}

/// Prefix of the names of a wire's quantities; "" for a single wire.
std::string wire_prefix(const Scene& scene, std::size_t wire)
{
    return scene.beams.size() > 1 ? scene.beams[wire].name + "_" : "";
}

} // namespace

double WireSimulation::State::next_knot() const
{
    std::vector<const CurvePoints*> curves;
    for (const BeamInput& b : scene.beams)
        curves.insert(curves.end(), {&b.insertion, &b.twist});
    return amontons::next_knot(curves, time, scene.time.end);
}

std::shared_ptr<const WireSimulation::State::Kept> WireSimulation::State::keep() const
{
    auto k = std::make_shared<Kept>();
    k->wires.reserve(wires.size());
    for (const WireBody& b : wires)
        k->wires.push_back({b.wire.state, b.dynamics});
    for (const auto& c : coaxial)
        for (const Nesting& n : c->nestings)
            k->nested.push_back(n.reaction);
    return k;
}

void WireSimulation::State::put_back(const Kept& k)
{
    for (std::size_t w = 0; w < wires.size(); ++w) {
        wires[w].wire.state = k.wires[w].state;
        wires[w].dynamics = k.wires[w].dynamics;
    }
    auto next = k.nested.begin();
    for (const auto& c : coaxial)
        for (Nesting& n : c->nestings)
            n.reaction = *next++;
}

WireSimulation::State::Unmoved WireSimulation::State::unmoved() const
{
    Unmoved u;
    u.kept = keep();
    u.wires.reserve(wires.size());
    for (const WireBody& b : wires)
        u.wires.push_back({b.halvings, b.work->proximity});
    for (const SoftVessel& v : vessels)
        u.tangents.push_back(v.tube->hyperelastic() ? v.tube->tangent_at() : nullptr);
    u.overlap = overlap;
    u.history = history;
    u.retries = retries;
    return u;
}

void WireSimulation::State::undo(const Unmoved& u)
{
    for (std::size_t w = 0; w < wires.size(); ++w)
        set_halvings(wires[w], u.wires[w].halvings);
    for (std::size_t v = 0; v < vessels.size(); ++v)
        if (u.tangents[v]) restore_tangent(*vessels[v].tube, *u.tangents[v]);
    put_back(*u.kept);
    for (std::size_t w = 0; w < wires.size(); ++w)
        wires[w].work->proximity = u.wires[w].proximity;
    overlap = u.overlap;
    history = u.history;
    retries = u.retries;
}

/// Solves a step group by group; not all of them may have moved where it is not accepted.
bool WireSimulation::State::solve_groups(double h, bool relax, StepReport& sum,
                                         std::vector<StepReport>& reports)
{
    reports.clear();
    for (std::size_t k = 0; k < groups.size(); ++k) {
        WireGroup& g = groups[k];
        const bool may_relax = relax && !g.wires[0]->motion.dynamic;
        const std::vector<BaseTarget> to = targets(g, time + h);
        const StepReport r = may_relax ? try_or_relax(g, to) : try_step(g, to, h);
        reports.push_back(r);
        sum.newton.iterations += r.newton.iterations;
        sum.newton.factorisations += r.newton.factorisations;
        sum.newton.wall_evaluations += r.newton.wall_evaluations;
        sum.newton.wall_tangents += r.newton.wall_tangents;
        sum.newton.seconds_elements += r.newton.seconds_elements;
        sum.newton.seconds_detection += r.newton.seconds_detection;
        sum.newton.seconds_contact += r.newton.seconds_contact;
        sum.newton.seconds_rest += r.newton.seconds_rest;
        const double error = r.newton.residual.error();
        if (k == 0 || !(error < sum.newton.residual.error()))
            sum.newton.residual = r.newton.residual;
        if (!r.accepted) {
            sum.refusal = scene.beams[first_of(g)].name + ": " + r.refusal;
            sum.missed_by = r.missed_by;
            return false;
        }
    }
    return true;
}

/// One step of all wires; either all move or none. Where a wire overlaps a wall between its contact
/// points, their distance is halved and the step is repeated.
/// @param kept  the state that it begins from; with closer points, if they were put so
bool WireSimulation::State::advance(double h, StepReport& sum, std::string& refusal, bool relax,
                                    std::shared_ptr<const Kept>& kept)
{
    std::vector<StepReport> reports;
    const double t = time + h;
    for (;;) {
        if (!solve_groups(h, relax, sum, reports)) {
            refusal = sum.refusal;
            put_back(*kept);
            return false;
        }
        for (std::size_t w = 0; w < wires.size(); ++w)
            overlap[w] = deepest_overlap(wires[w]);
        std::vector<std::size_t> closer;
        for (std::size_t w = 0; w < wires.size(); ++w) {
            const WireOverlap& o = overlap[w];
            if (!(o.depth > o.allowed)) continue;
            if (may_halve_spacing(wires[w])) {
                closer.push_back(w);
            } else if (o.depth > o.most) {
                refusal = never_done(o, scene.beams[w].name, wall_name(walls[w][o.wall]));
                sum.lasting = true;
                put_back(*kept);
                return false;
            }
        }
        if (closer.empty()) break;
        put_back(*kept);
        for (const std::size_t w : closer)
            halve_spacing(wires[w]);
        kept = keep();
    }
    for (std::size_t k = 0; k < groups.size(); ++k) {
        const StepReport& r = reports[k];
        const std::size_t w = first_of(groups[k]);
        add_energy(energy, r.energy);
        history[w].elastic = r.energy.elastic;
        history[w].kinetic = r.energy.kinetic;
        sum.passed_through += r.passed_through;
        const double noticeable = 0.1 * wires[w].scale_force * wires[w].element_size;
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

/// The same for the balance that a group starts from.
void WireSimulation::State::measure_start(WireGroup& g, const std::vector<BaseTarget>& to,
                                          StepReport& report)
{
    for (;;) {
        bool closer = false;
        for (WireBody* b : g.wires) {
            const auto w = std::size_t(b - wires.data());
            WireOverlap& o = overlap[w];
            o = deepest_overlap(*b);
            if (!(o.depth > o.allowed)) continue;
            if (may_halve_spacing(*b)) {
                halve_spacing(*b);
                closer = true;
            } else if (o.depth > o.most) {
                report.accepted = false;
                report.refusal = never_done(o, scene.beams[w].name, wall_name(walls[w][o.wall]));
            }
        }
        if (!closer || !report.accepted) return;
        report = try_or_relax(g, to);
        if (!report.accepted) return;
    }
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
                    [](const SoftVessel& v) { return v.tube->hyperelastic() != nullptr; })) {
        out.quantities.push_back({"wall_balances", "", double(r.newton.wall_evaluations)});
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
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
        amontons::note_forces(int(o), r.contacts, force[o]);
        if (many_pending(force[o])) assign_forces(*obstacles[o].model.surface, force[o]);
    }
}

/// Examines compliant walls at their present state: at frames, and at the end.
void WireSimulation::State::note_walls()
{
    wall_moved.resize(vessels.size(), 0);
    for (std::size_t v = 0; v < vessels.size(); ++v)
        wall_moved[v] = std::max(wall_moved[v], wall_motion(vessels[v]));
}

/// Of the accepted state.
void WireSimulation::State::note_overlap(std::size_t w, OverlapRecord& worst)
{
    const WireOverlap& o = overlap[w];
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
            // Pulled back from an opening: it may continue another way.
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
    }
    report_branches(s);
}

void WireSimulation::State::report_branches(RunSummary& s) const
{
    s.texts.clear();
    for (std::size_t w = 0; w < wires.size(); ++w) {
        const WireHistory& k = history[w];
        std::string branch = k.branch.name(obstacles);
        if (k.opening >= 0)
            branch =
                obstacles[std::size_t(k.opening_wall)].model.openings[std::size_t(k.opening)].name;
        s.texts.push_back({wire_prefix(scene, w) + "branch", branch});
    }
}

WireSimulation::WireSimulation(const Scene& scene, std::vector<Obstacle> obstacles)
    : state_(std::make_unique<State>())
{
    State& s = *state_;
    s.scene = scene;
    s.obstacles = std::move(obstacles);
    s.force.resize(s.obstacles.size());
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
    s.overlap.resize(s.wires.size());
    if (!issues.empty()) throw InputError(issues);
    s.groups = make_groups(scene, s.wires, s.coaxial);
    for (std::size_t w = 0; w < s.wires.size(); ++w) {
        BeamInput& beam = s.scene.beams[w];
        const Wire& wire = s.wires[w].wire;
        // Something of the wire must stay in the sheath's rigid part: its compliance is the
        // drive's.
        const double longest = (1 - 1e-9) * (wire.material.length - wire.sheath->fade);
        s.inputs.add({beam.name + ".insertion", "m", 0, longest}, beam.insertion);
        s.inputs.add({beam.name + ".twist", "rad"}, beam.twist);
    }
}

WireSimulation::~WireSimulation() = default;

/// What every accepted state is followed by.
StepResult WireSimulation::State::record_accepted(StepRecord r)
{
    PhaseSeconds& sum = summary.seconds;
    sum.free_motion += r.phases.free_motion;
    sum.detection += r.phases.detection;
    sum.contact_solve += r.phases.contact_solve;
    sum.correction += r.phases.correction;
    const Stopwatch watch;
    r.phases = sum;
    note_forces(r);
    finish(summary);
    sum.output += watch.seconds();
    return accepted_step(std::move(r));
}

/// The state that a run begins from.
StepResult WireSimulation::State::begin(const std::atomic<bool>& stop)
{
    StepReport first;
    for (std::size_t k = 0; k < groups.size(); ++k) {
        WireGroup& g = groups[k];
        const std::vector<BaseTarget> to = targets(g, 0);
        const bool dynamic = g.wires[0]->motion.dynamic;
        g.wires[0]->motion.dynamic = false;
        StepReport r = start_wires(g, to, stop);
        if (r.accepted) measure_start(g, to, r);
        g.wires[0]->motion.dynamic = dynamic;
        if (!r.accepted && stop) return interrupted_step();
        if (!r.accepted) return failed_step("the initial state: " + r.refusal);
        WireHistory& h = history[first_of(g)];
        h.elastic = h.elastic_start = r.energy.elastic;
        if (k == 0) first = r;
    }
    for (const WireGroup& g : groups) {
        energy.elastic += history[first_of(g)].elastic;
        energy.elastic_start += history[first_of(g)].elastic;
    }
    started = true;
    return record_accepted(record(first, 0, 0));
}

StepResult WireSimulation::step(const std::atomic<bool>& stop, double not_beyond)
{
    State& s = *state_;
    RunSummary& sum = s.summary;
    sum.status = "running";
    sum.message.clear();
    const State::Unmoved before = s.unmoved();
    const Listening listening(s.groups, stop);
    if (!s.started) {
        StepResult first = s.begin(stop);
        if (first.outcome != StepResult::Outcome::accepted) s.undo(before);
        return first;
    }
    const double end = std::min(s.scene.time.end, not_beyond);
    if (!(s.time < end * (1 - 1e-12))) return {};
    if (stop) return interrupted_step();
    const Stopwatch watch;
    StepReport report;
    std::string refusal;
    s.inputs.begin(s.time);
    const double reach = s.next_knot() - s.time;
    const double uncut = s.step_length;
    double h = std::min(uncut, reach);
    const double sliver = 1e-6 * s.longest();
    if (reach - h < sliver) h = reach; // none before a knot
    const CutStep cut = cut_step(s.time, h, not_beyond, h < reach ? sliver : 0);
    h = cut.h;
    s.inputs.lead(s.time, h);
    std::vector<Vec3> tips;
    for (const WireBody& b : s.wires)
        tips.push_back(wire_tip(b.wire));
    s.retries = 0;
    std::shared_ptr<const State::Kept> kept = before.kept;
    for (;;) {
        const bool unstable = refusal.ends_with("unstable");
        const bool relax = h <= (unstable ? kRelaxUnstable : kRelaxFailed) * s.longest();
        if (s.advance(h, report, refusal, relax, kept)) break;
        if (stop) {
            s.undo(before);
            return interrupted_step();
        }
        ++s.retries;
        if (report.lasting || h <= s.smallest()) {
            std::string why =
                "step " + std::to_string(s.step + 1) + " (t = " + std::to_string(s.time) +
                " s): " + refusal +
                describe_worst(s.wires, report.newton.residual, s.scene.accuracy.contact);
            s.undo(before);
            return failed_step(std::move(why));
        }
        h = s.shorter(h, report.missed_by);
    }
    s.inputs.accept();
    report.refusal = refusal;
    s.step_length = std::min(2 * h, s.longest());
    if (cut.cut && s.retries == 0) {
        s.time = not_beyond;
        s.step_length = uncut;
    }
    s.note_openings(tips);
    StepRecord r = s.record(report, h, watch.seconds());
    add_step(sum, r);
    s.contacts_sum += double(r.contacts.size());
    ++s.contact_steps;
    for (const ContactRecord& c : r.contacts)
        s.energy.largest_force = std::max(s.energy.largest_force, c.force.norm());
    return s.record_accepted(std::move(r));
}

RunSummary WireSimulation::conclude(const StepResult& last)
{
    State& s = *state_;
    RunSummary& sum = s.summary;
    sum.status = status_of(last.outcome);
    sum.message = last.message;
    s.finish(sum);
    s.note_walls();
    RunSummary whole = sum; // a run that continues adds its own
    for (std::size_t v = 0; v < s.vessels.size(); ++v)
        if (std::string warning = wall_warning(s.vessels[v], s.wall_moved[v]); !warning.empty())
            whole.warnings.push_back(std::move(warning));
    double size = 0;
    for (const WireBody& b : s.wires)
        size = std::max(size, b.wire.material.length);
    const bool dynamic = s.wires[0].motion.dynamic;
    if (std::string warning = energy_warning(s.energy, {s.scene.accuracy.contact, size, dynamic});
        !warning.empty())
        whole.warnings.push_back(std::move(warning));
    for (std::size_t w = 0; w < s.wires.size(); ++w) {
        const WireOverlapLog& log = s.history[w].overlap;
        if (!(log.depth > 0)) continue;
        std::string warning = log.warning(s.scene.beams[w].name, s.wall_name(log.wall));
        if (!warning.empty()) whole.warnings.push_back(std::move(warning));
    }
    return whole;
}

void WireSimulation::spent_on_output(double seconds)
{
    state_->summary.seconds.output += seconds;
}

const RunSummary& WireSimulation::so_far() const
{
    return state_->summary;
}

const std::vector<InputInfo>& WireSimulation::inputs() const
{
    return state_->inputs.all();
}

double WireSimulation::input(std::size_t number) const
{
    return state_->inputs.value(number, state_->time);
}

void WireSimulation::set_input(std::size_t number, double value)
{
    state_->inputs.set(number, value, state_->time);
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
    const SurfaceMesh& surface = *state_->obstacles[obstacle].model.surface;
    WallForce& force = state_->force[obstacle];
    assign_forces(surface, force);
    return force.largest.empty() ? std::vector<double>(surface.points.size(), 0) : force.largest;
}

} // namespace amontons
