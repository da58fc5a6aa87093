#include "solver/step/body_simulation_state.hpp"

#include "mesh/base/memory.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_build.hpp"
#include "solver/step/body_record.hpp"
#include "solver/step/couplings.hpp"
#include "solver/step/recorded_problem.hpp"
#include "solver/step/run_summary.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr std::size_t kQuick = 6;  // iterations of a step in a medium: the next ...
constexpr double kGrowth = 1.5;    // ... may be so much longer
constexpr double kLagBelow = 0.13; // of the step asked for: see body_lag.cpp
constexpr int kMostTold = 8;       // of warnings of a kind
constexpr double kSticks = 1e-9;   // slip per step below this share of the body sticks

} // namespace

bool BodySimulation::State::in_medium() const
{
    return std::ranges::any_of(system->refs,
                               [](const BodyRef& b) { return b.rod && b.rod->in_medium(); });
}

/// The offline stage, once.
void BodySimulation::State::make_ready()
{
    if (ready) return;
    ready = true;
    const Stopwatch watch;
    StepInput input;
    input.h = dynamic() ? scene.time.step : 0;
    input.dynamic = dynamic();
    input.rule = time_rule(scene.time);
    input.gravity = scene.gravity;
    std::vector<SolidBody*> solids;
    for (const BodyRef& b : system->refs)
        if (b.solid) {
            b.solid->expect_steps((scene.time.end - time) / scene.time.step);
            for (const SolidBody* other : solids)
                if (b.solid->share_matrix(*other)) break;
            b.solid->make_ready(input, options.cache, messages);
            solids.push_back(b.solid);
        }
    summary.seconds.offline += watch.seconds();
    summary.memory.offline = peak_memory_so_far();
}

/// One step; either all bodies move or none.
/// @param relaxed  by gradient flow, where no step leads on
/// @param share  of loads and gravity
bool BodySimulation::State::advance(double h, bool relaxed, double share)
{
    StepInput input;
    input.start = time;
    input.h = h;
    input.dynamic = dynamic() && h > 0;
    input.rule = time_rule(scene.time);
    input.gravity = share * scene.gravity;
    input.load = share;
    BodyStepOptions settings = step_options();
    settings.may_lag = !relaxed && h <= kLagBelow * scene.time.step;
    last = relaxed ? relax_rods(*system, input, settings) : try_body_step(*system, input, settings);
    summary.seconds.free_motion += last.free_motion;
    summary.seconds.detection += last.detection;
    summary.seconds.compliance += last.compliance;
    summary.seconds.contact_solve += last.contact_solve;
    summary.seconds.correction += last.correction;
    if (!last.accepted) return false;
    time = input.end();
    energy.work += last.energy.work;
    energy.work_absolute += last.energy.work_absolute;
    energy.friction += last.friction;
    energy.released += last.energy.dissipated - (dynamic() ? last.normal_work : 0);
    energy.elastic = last.energy.elastic;
    energy.kinetic = last.energy.kinetic;
    for (const Vec3& force : last.force)
        energy.largest_force = std::max(energy.largest_force, force.norm());
    follow(energy);
    return true;
}

/// A quasi-static step so short that what is prescribed moves no farther than contacts are looked
/// for: of a longer one equal parts.
double BodySimulation::State::within_reach(double h) const
{
    if (dynamic() || h <= 0) return h;
    const double share = system->finder.motion_over_reach(system->refs, time, time + h);
    return share > 1 ? h / std::ceil(share) : h;
}

EnergyScale BodySimulation::State::energy_scale() const
{
    constexpr double kRoundOff = 1e-15; // of the modulus times the volume around a body
    EnergyScale scale{scene.accuracy.contact, 0, dynamic(), 0};
    for (const BodyRef& b : system->refs) {
        const double size = b.body->size();
        scale.size = std::max(scale.size, size);
        if (b.rod) scale.round_off += kRoundOff * b.rod->energy_scale();
        if (b.solid) scale.round_off += kRoundOff * b.solid->stiffness() * size * size * size;
    }
    return scale;
}

/// Of a step that has just been taken.
EnergyVerdict BodySimulation::State::judge_energy(const BeforeStep& before, double h)
{
    constexpr double kLeft = 2;
    const EnergyScale scale = energy_scale();
    if (dynamic()) {
        if (!(energy_fault(energy, scale) > kEnergyRefused)) return EnergyVerdict::stands;
        last.refusal = "the step makes energy: " + energy_warning(energy, scale);
        return EnergyVerdict::refused;
    }
    const auto left_by_meshes = [&] { // forces times the gaps that meshes cannot resolve [J]
        double left = 0;
        for (const ContactSize& c : contact_sizes(*system, last)) {
            const double curvature = 4 * c.indentation / (c.width * c.width);
            left += kLeft * c.force * std::max(c.face * c.face * curvature / 8, 0.01 * c.face);
        }
        return left;
    };
    const double whole = refinement.whole;
    const StepJudgement j = judge_step(refinement, {before.energy.error(), energy, scale, time, h},
                                       jumps < kMostTold, left_by_meshes);
    if (whole > 0 && refinement.level == 0) step_length = whole; // what comes next is another step
    if (!j.message.empty()) last.remarks.push_back(j.message);
    if (j.verdict == EnergyVerdict::refused) last.refusal = j.message;
    if (j.verdict == EnergyVerdict::stands && j.jump && jumps++ < kMostTold)
        summary.warnings.push_back(fmt::format("step {}: {}", step + 1, j.message));
    return j.verdict;
}

/// Quasi-static: the balance that the first loads and places ask for; where it is not found at
/// once, under shares of the loads that grow to all of them.
bool BodySimulation::State::find_first_balance()
{
    constexpr double kLeast = 1.0 / 256;
    if (system->finder.has_start_overlaps()) return resolve_start();
    if (advance(0) || (may_snap() && advance(0, true))) return true;
    const std::string refusal = last.refusal;
    double reached = 0;
    for (double part = 0.25; reached < 1 && part >= kLeast && !*stop;) {
        const double share = std::min(1.0, reached + part);
        if (advance(0, false, share)) {
            reached = share;
            part *= 2;
        } else {
            part /= 2;
        }
    }
    if (reached == 1) return true;
    last.refusal = reached > 0 ? fmt::format("{}; of its loads {:.3g} were reached, then: {}",
                                             refusal, reached, last.refusal)
                               : refusal;
    return false;
}

/// One step along the path of a rod's balances.
bool BodySimulation::State::advance_path()
{
    RodBody& rod = *system->refs[0].rod;
    constexpr int kQuick = 5, kSlow = 9; // iterations
    constexpr double kGrowth = 1.5, kShortest = 1e-6;
    retries = 0;
    const double before = time;
    while (true) {
        const int iterations = rod.path_step(path_length, scene.time.step, scene.time.end,
                                             scene.accuracy.contact, scene.gravity, time);
        last = {};
        last.iterations = last.factorisations = iterations;
        if (iterations > 0) {
            if (iterations <= kQuick)
                path_length = std::min(kGrowth * path_length, scene.time.path);
            if (iterations >= kSlow) path_length *= 0.5;
            break;
        }
        path_length *= 0.5;
        ++retries;
        if (path_length < kShortest * scene.time.path) {
            last.refusal =
                fmt::format("no balance found along the path after t = {:.6g} s", before);
            return false;
        }
    }
    const BodyEnergy e = rod.accept({});
    energy.work += e.work;
    energy.work_absolute += e.work_absolute;
    energy.elastic = e.elastic;
    follow(energy);
    last.threshold = scene.accuracy.contact;
    return true;
}

StepRecord BodySimulation::State::record(double h, double seconds)
{
    StepRecord out;
    out.step = step;
    out.time = time;
    out.step_length = h;
    out.seconds = seconds;
    out.iterations = last.iterations;
    out.factorisations = last.factorisations;
    out.errors = last.errors;
    out.retries = retries;
    out.energy = energy;
    for (const std::string& r : last.remarks)
        out.remark += (out.remark.empty() ? "" : "; ") + r;
    out.certificate.error = last.error;
    out.certificate.tolerance = std::max(last.threshold, scene.accuracy.contact);
    out.certificate.worst_penetration = last.penetration;
    if (dynamic()) { // the laws of its steps are of velocities: where gaps ended, instead
        out.certificate.worst_penetration = 0;
        for (const BodyContact& k : last.contacts.contact)
            out.certificate.worst_penetration = std::max(out.certificate.worst_penetration, -k.gap);
    }
    out.certificate.worst_cone_violation = last.cone;
    if (const BodyOverlap& o = last.overlap; o.depth > 0) {
        OverlapRecord& worst = out.certificate.worst_overlap;
        worst.depth = o.depth;
        worst.a = system->refs[std::size_t(o.a)].name;
        worst.b = o.b >= 0          ? system->refs[std::size_t(o.b)].name
                  : o.obstacle >= 0 ? obstacles[std::size_t(o.obstacle)].name
                                    : "";
        worst.point = o.point;
        worst.step = step;
    }
    out.certificate.certified = out.certificate.error <= out.certificate.tolerance;
    const auto number = [&](int body, int obstacle) { // obstacles first, then bodies
        return body < 0 ? obstacle : int(obstacles.size()) + body;
    };
    const std::vector<ContactPair>& pairs = system->finder.pairs();
    for (std::size_t c = 0; c < last.contacts.contact.size(); ++c) {
        const BodyContact& k = last.contacts.contact[c];
        if (last.force[c].isZero(0)) continue;
        const ContactPair& pair = pairs[std::size_t(k.pair)];
        ContactRecord r;
        r.point = k.point;
        r.force = last.force[c];
        r.normal = k.frame.col(0);
        r.slip = last.slip[c];
        r.normal_force = r.normal.dot(r.force);
        r.clustered_force = r.normal_force;
        r.gap = k.gap;
        r.pressure = k.area > 0 ? r.normal_force / k.area : 0;
        r.area = k.area;
        const Vec3 tangential = r.force - r.normal_force * r.normal;
        const double size = system->refs[std::size_t(k.a)].body->size();
        const bool slips = tangential.norm() >= (1 - 1e-6) * pair.friction * r.normal_force ||
                           r.slip.norm() > kSticks * size;
        r.status = slips ? ContactStatus::slip : ContactStatus::stick;
        r.body_a = number(k.a, 0);
        r.body_b = number(k.b, pair.obstacle);
        out.contacts.push_back(r);
    }
    for (const BodyRef& b : system->refs)
        if (b.rod) out.beams.push_back(record_rod(*b.rod, b.name));
    out.quantities = body_quantities(scene, obstacles, *system, last);
    return out;
}

void BodySimulation::State::finish()
{
    summary.steps = step;
    summary.time = time;
    summary.energy = energy;
    summary.contacts_mean = step > 0 ? contacts_sum / step : 0;
    summary.not_measured = system->finder.not_measured(system->refs);
}

BodySimulation::BodySimulation(const Scene& scene, std::vector<Obstacle> obstacles,
                               const SimulationOptions& options)
    : state_(std::make_unique<State>())
{
    State& s = *state_;
    s.scene = scene;
    s.obstacles = std::move(obstacles);
    s.options = options;
    s.step_length = scene.time.step;
    s.path_length = scene.time.path;
    s.system = build_bodies(s.scene, s.obstacles, s.warnings, options.refuse);
    for (const BodyRef& b : s.system->refs)
        if (b.solid) b.solid->use_threads(options.threads);
    s.curves = curves_of(s.scene);
}

BodySimulation::~BodySimulation() = default;

void BodySimulation::prepare()
{
    state_->make_ready();
}

RunSummary BodySimulation::run(StepObserver& observer, const std::atomic<bool>& stop)
{
    State& s = *state_;
    RunSummary& sum = s.summary;
    sum.status = "running";
    sum.message.clear();
    const auto finish = [&](const char* status, std::string message) {
        sum.status = status;
        sum.message = std::move(message);
        s.finish();
        RunSummary whole = sum; // a run that goes on says it at its own end
        for (std::string& sentence : s.overlaps.small_contacts(*s.system))
            whole.warnings.push_back(std::move(sentence));
        if (std::string told = energy_warning(s.energy, s.energy_scale()); !told.empty())
            whole.warnings.push_back(std::move(told));
        return whole;
    };
    const auto observe = [&](StepRecord r) {
        const Stopwatch watch;
        r.phases = sum.seconds;
        sum.quantities = r.quantities;
        s.finish();
        observer.on_step(r);
        sum.seconds.output += watch.seconds();
    };
    s.stop = &stop;
    s.make_ready();
    if (!s.started) {
        // Quasi-static: the balance that the first loads and places ask for.
        if (!s.dynamic() && !s.find_first_balance()) {
            if (stop) return finish("interrupted", "interrupted by the user");
            return finish("failed", "the initial state: " + s.last.refusal);
        }
        if (s.dynamic() && s.system->finder.has_start_overlaps()) {
            if (!s.resolve_start()) {
                if (stop) return finish("interrupted", "interrupted by the user");
                return finish("failed", "the initial state: " + s.last.refusal);
            }
            sum.warnings.push_back(fmt::format("bodies that began inside each other were pressed "
                                               "out before the first step; elastic energy of it: "
                                               "{:.6g} J",
                                               s.last.energy.elastic));
            s.energy.elastic = s.last.energy.elastic;
        }
        const double elastic = s.energy.elastic; // of the first balance
        s.energy = {};
        s.energy.elastic = elastic;
        if (s.dynamic()) {
            for (const BodyRef& b : s.system->refs)
                s.energy.kinetic += b.body->kinetic_energy();
            s.energy.elastic += spring_energy(s.system->couplings, s.system->coupling_memory);
        }
        s.energy.elastic_start = s.energy.elastic;
        s.energy.kinetic_start = s.energy.kinetic;
        s.started = true;
        observe(s.record(0, 0));
    }
    const double end = s.scene.time.end;
    while (s.time < end * (1 - 1e-12)) {
        if (stop) return finish("interrupted", "interrupted by the user");
        const Stopwatch watch;
        if (s.scene.time.path > 0) {
            const double before = s.time;
            if (!s.advance_path())
                return finish("failed", fmt::format("step {}: {}", s.step + 1, s.last.refusal));
            ++s.step;
            StepRecord r = s.record(s.time - before, watch.seconds());
            add_step(sum, r);
            observe(r);
            continue;
        }
        const double reach = s.next_stop() - s.time;
        double whole = std::min(s.step_length, reach);
        if (s.refinement.level > 0)
            whole = std::min({whole, s.refinement.length, s.refinement.until - s.time});
        double h = s.within_reach(whole);
        const double smallest = h / whole * s.smallest();
        if (reach - h < 1e-6 * s.scene.time.step) h = reach; // no sliver before a knot
        s.retries = 0;
        const BeforeStep before = s.before_step();
        BodyStepReport last = std::move(s.last);
        // Tries that end without a step leave marks in bodies and contacts: what is written then,
        // and what --resume goes on from, is of the last step.
        const auto take_back = [&] {
            s.last = std::move(last);
            s.put_back(before);
        };
        while (!s.advance(h)) {
            if (stop) {
                take_back();
                return finish("interrupted", "interrupted by the user");
            }
            if (h <= smallest * (1 + 1e-9)) {
                if (s.may_snap() && !s.in_medium() && s.advance(h, true)) break;
                if (stop) {
                    take_back();
                    return finish("interrupted", "interrupted by the user");
                }
                const std::string why = fmt::format(
                    "step {} (t = {:.6g} s): {}{}", s.step + 1, s.time, s.last.refusal,
                    s.retries == 0 ? "" : fmt::format("; steps down to {:.3g} s were tried", h));
                take_back();
                return finish("failed", why);
            }
            h = std::max(0.5 * h, smallest);
            ++s.retries;
        }
        const bool refined = s.refinement.level > 0;
        const EnergyVerdict verdict = s.judge_energy(before, h);
        if (verdict == EnergyVerdict::refused) {
            const std::string why =
                fmt::format("step {} (t = {:.6g} s): {}", s.step + 1, before.time, s.last.refusal);
            take_back();
            return finish("failed", why);
        }
        if (verdict == EnergyVerdict::again) {
            take_back();
            continue;
        }
        ++s.step;
        s.overlaps.add(*s.system, s.last, s.step, sum.warnings);
        if (s.last.lag > 0 && s.lagging++ < kMostTold)
            sum.warnings.push_back(fmt::format(
                "step {}: contacts jump at its end; their forces are those of contacts as the last "
                "iteration found them, {:.1g} of them away from those at the end",
                s.step, s.last.lag));
        if (std::abs(s.time - (s.next_stop())) < 1e-12 * end) s.time = s.next_stop();
        // In a medium a step that is too long costs more than some that are shorter.
        const double growth = !s.in_medium() ? 2 : s.last.errors.size() <= kQuick ? kGrowth : 1;
        if (!(refined && s.refinement.level == 0))
            s.step_length = std::min(growth * h, s.scene.time.step);
        if (h == reach && s.retries == 0 && !s.in_medium()) s.step_length = s.scene.time.step;
        StepRecord r = s.record(h, watch.seconds());
        add_step(sum, r);
        s.contacts_sum += double(r.contacts.size());
        observe(r);
    }
    return finish("done", "");
}

const std::vector<Obstacle>& BodySimulation::obstacles() const
{
    return state_->obstacles;
}

std::vector<BodyPlan> BodySimulation::plan() const
{
    std::vector<BodyPlan> plan;
    for (const Obstacle& o : state_->obstacles)
        plan.push_back({o.name, "obstacle", 0});
    for (const BodyRef& b : state_->system->refs)
        plan.push_back({b.name,
                        b.rigid ? "rigid"
                        : b.rod ? "rod"
                                : "solid",
                        b.solid ? 3 * int(b.solid->mesh().nodes.size()) : b.body->unknowns()});
    return plan;
}

LinearPlan BodySimulation::linear_plan() const
{
    return state_->system->linear;
}

std::vector<double> BodySimulation::max_contact_force(std::size_t obstacle) const
{
    return std::vector<double>(state_->obstacles[obstacle].model.surface->points.size(), 0);
}

std::vector<Issue> BodySimulation::warnings() const
{
    return state_->warnings;
}

std::vector<std::string> BodySimulation::messages() const
{
    return state_->messages;
}

std::vector<RecordedProblem> BodySimulation::contact_problems() const
{
    const BodyStepReport& r = state_->last;
    if (r.recorded.mu.size() == 0 || r.recorded.W.is_matrix_free()) return {};
    RecordedProblem p;
    if (r.recorded.W.rows() > 0) {
        p.problem = r.recorded;
        p.reaction = r.recorded_reaction;
        p.contact = r.recorded_identity;
    } else {
        p.problem = rods_problem(*state_->system, r, p.reaction);
        for (std::size_t c = 0; c < r.contacts.contact.size(); ++c)
            p.contact.push_back(int(c));
    }
    return {p};
}

std::vector<BodyRecord> BodySimulation::body_records() const
{
    const State& s = *state_;
    std::vector<BodyRecord> all;
    for (std::size_t b = 0; b < s.system->refs.size(); ++b)
        if (!s.system->refs[b].rod) all.push_back(record_body(*s.system, b, s.last));
    return all;
}

} // namespace amontons
