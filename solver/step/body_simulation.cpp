#include "solver/step/body_simulation_state.hpp"

#include "mesh/base/memory.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_build.hpp"
#include "solver/step/couplings.hpp"
#include "solver/step/run_summary.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr std::size_t kQuick = 6;       // iterations of a step in a medium: the next ...
constexpr double kGrowth = 1.5;         // ... may be so much longer
constexpr double kLagBelow = 0.13;      // of the requested step: see body_lag.cpp
constexpr int kMostWarnings = 8;        // of warnings of a kind
constexpr double kShortRest = 0.1;      // of the requested step, in motion
constexpr double kManyTolerances = 100; // balances that differ by less are one

/// What the overlap rows of a pair hold.
struct RowLoad {
    double force = 0; ///< sum of their normal forces [N]
    double left = 0;  ///< the overlap that they leave, mean by force [m]
};

RowLoad load_of(const std::vector<PlaceRow>& rows, int pair,
                const std::map<BodySystem::Key, Vec3>& forces,
                const std::map<BodySystem::Key, Vec3>& friction)
{
    RowLoad sum;
    for (const PlaceRow& r : rows) {
        const auto acting = forces.find({pair, r.id});
        if (acting == forces.end()) continue;
        const auto rubbing = friction.find({pair, r.id});
        const double square = acting->second.squaredNorm() -
                              (rubbing == friction.end() ? 0 : rubbing->second.squaredNorm());
        const double force = std::sqrt(std::max(square, 0.0));
        sum.force += force;
        sum.left += force * r.tolerance;
    }
    if (sum.force > 0) sum.left /= sum.force;
    return sum;
}

} // namespace

bool BodySimulation::State::has_drag() const
{
    return std::ranges::any_of(system->refs,
                               [](const BodyRef& b) { return b.rod && b.rod->has_drag(); });
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
/// @param relaxed  by gradient flow, where no step converges
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
    settings.of_scene = !relaxed && !inputs.some_live();
    last = relaxed ? relax_rods(*system, input, settings) : try_body_step(*system, input, settings);
    add_seconds();
    if (!last.accepted) return false;
    last_input = input;
    time = input.end();
    add_energy();
    return true;
}

void BodySimulation::State::add_seconds()
{
    summary.seconds.free_motion += last.free_motion;
    summary.seconds.detection += last.detection;
    summary.seconds.compliance += last.compliance;
    summary.seconds.contact_solve += last.contact_solve;
    summary.seconds.correction += last.correction;
}

void BodySimulation::State::add_energy()
{
    energy.work += last.energy.work;
    energy.work_absolute += last.energy.work_absolute;
    energy.friction += last.friction;
    energy.released += last.energy.dissipated - (dynamic() ? last.normal_work : 0);
    energy.elastic = last.energy.elastic;
    energy.kinetic = last.energy.kinetic;
    for (const Vec3& force : last.force)
        energy.largest_force = std::max(energy.largest_force, force.norm());
    for (std::size_t c = 0; c < last.coupling_force.size(); ++c) // what stands on joints moves by
        if (!system->couplings[c].turns)                         // their rounding
            energy.largest_force = std::max(energy.largest_force, last.coupling_force[c].norm());
    follow(energy);
}

/// Work of the contact forces against the overlap that rows leave (docs/theory/certificate.md): it
/// grows with the load, and is given back with it. By the trapezoid rule, as all work at rest [J].
double BodySimulation::State::work_against_left(const BeforeStep& before) const
{
    const std::vector<std::vector<PlaceRow>>& now = system->finder.rows();
    double work = 0;
    for (std::size_t p = 0; p < now.size(); ++p) {
        RowLoad was;
        if (p < before.rows.size())
            was = load_of(before.rows[p], int(p), before.warm, before.warm_friction);
        const RowLoad is = load_of(now[p], int(p), system->warm, system->warm_friction);
        work += 0.5 * (was.force + is.force) * (is.left - was.left);
    }
    return work;
}

/// The length of a quasi-static step in which prescribed motions do not exceed the search distance
/// of contacts; a longer one is divided into equal parts.
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
        last.refusal = "the step generates energy: " + energy_warning(energy, scale);
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
                                       jumps < kMostWarnings, left_by_meshes);
    if (whole > 0 && refinement.level == 0) step_length = whole; // what comes next is another step
    if (!j.message.empty()) last.remarks.push_back(j.message);
    if (j.verdict == EnergyVerdict::refused) last.refusal = j.message;
    if (j.verdict == EnergyVerdict::stands && j.jump && jumps++ < kMostWarnings)
        summary.warnings.push_back(fmt::format("step {}: {}", step + 1, j.message));
    return j.verdict;
}

/// Quasi-static: the balance that the first loads and places request; where it is not found at
/// once, under shares of the loads that grow to all of them.
bool BodySimulation::State::find_first_balance()
{
    constexpr double kLeast = 1.0 / 256;
    if (system->finder.has_start_overlaps()) return resolve_start();
    if (advance(0) || (may_snap() && advance(0, true))) return leave_unstable(false);
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
    last.refusal = reached > 0 ? fmt::format("{}; {:.3g} of its loads were reached, then: {}",
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
    s.add_inputs();
    outside_of(s.scene); // a function that it names is registered
}

BodySimulation::~BodySimulation() = default;

void BodySimulation::prepare()
{
    state_->make_ready();
}

/// Actions after every accepted state.
StepResult BodySimulation::State::record_accepted(StepRecord r)
{
    const Stopwatch watch;
    r.phases = summary.seconds;
    summary.quantities = r.quantities;
    note_instruments(r);
    finish();
    summary.seconds.output += watch.seconds();
    return accepted_step(std::move(r));
}

/// The state that a run begins from. Quasi-static: the balance under the first loads and places.
StepResult BodySimulation::State::begin()
{
    const auto refused = [&] {
        return *stop ? interrupted_step() : failed_step("the initial state: " + last.refusal);
    };
    if (!dynamic() && !find_first_balance()) return refused();
    if (dynamic() && system->finder.has_start_overlaps()) {
        if (!resolve_start()) return refused();
        summary.warnings.push_back(fmt::format("bodies that overlapped at the start were "
                                               "separated before the first step; elastic energy: "
                                               "{:.6g} J",
                                               last.energy.elastic));
        energy.elastic = last.energy.elastic;
    } else if (const double apart = dynamic() ? slight_overlap(*system) : 0; apart > 0) {
        if (undo_slight_overlaps(*stop, [&]() -> const BodyStepReport& {
                return last = separation_step(*system, step_options());
            }))
            summary.warnings.push_back(fmt::format("bodies that overlapped by {:.3g} m at the "
                                                   "start were separated before the first step",
                                                   apart));
    }
    const double elastic = energy.elastic; // of the first balance
    energy = {};
    energy.elastic = elastic;
    if (dynamic()) {
        for (const BodyRef& b : system->refs)
            energy.kinetic += b.body->motion().kinetic_energy;
        energy.elastic += spring_energy(system->couplings, system->coupling_memory);
    }
    energy.elastic_start = energy.elastic;
    energy.kinetic_start = energy.kinetic;
    started = true;
    note_unstable();
    return record_accepted(record(0, 0));
}

StepResult BodySimulation::State::step_path()
{
    const Stopwatch watch;
    const double before = time, length = path_length;
    if (!advance_path()) {
        path_length = length;
        return failed_step(fmt::format("step {}: {}", step + 1, last.refusal));
    }
    ++step;
    note_unstable();
    StepRecord r = record(time - before, watch.seconds());
    add_step(summary, r);
    return record_accepted(std::move(r));
}

/// Drives, holds and loads: the bodies' own curves count. Along a path the time of a step is
/// unknown.
void BodySimulation::State::add_inputs()
{
    for (const BodyRef& b : system->refs)
        for (const LiveCurve& c : b.rigid   ? b.rigid->live_curves()
                                  : b.solid ? b.solid->live_curves()
                                            : b.rod->live_curves()) {
            curves.push_back(c.curve);
            if (scene.time.path == 0 && !c.name.empty())
                inputs.add({c.name, c.unit, c.lower, c.upper}, *c.curve, c.missing);
        }
}

/// @param not_beyond  as step()'s
/// @returns  none: a step that was accepted is to be done again, in shorter ones
std::optional<StepResult> BodySimulation::State::step_on(double not_beyond)
{
    const Stopwatch watch;
    const double end = scene.time.end;
    inputs.begin(time);
    const double reach = next_stop() - time;
    const double uncut = step_length, sliver = 1e-6 * scene.time.step;
    double whole = std::min(step_length, reach);
    // In motion a force is an impulse over the step: over a short rest it would be far from those
    // before, by what steps leave of velocities and places. Two equal steps are taken instead.
    if (const double rest = reach - whole;
        dynamic() && rest >= sliver && rest < kShortRest * scene.time.step)
        whole = 0.5 * reach;
    if (refinement.level > 0) whole = std::min({whole, refinement.length, refinement.until - time});
    const CutStep cut = cut_step(time, whole, not_beyond, whole < reach ? sliver : 0);
    whole = cut.h;
    inputs.lead(time, whole);
    double h = within_reach(whole);
    const double least = h / whole * smallest();
    if (!cut.cut && reach - h < sliver) h = reach; // none before a knot
    const bool at_cut = cut.cut && h == whole;
    retries = 0;
    const BeforeStep before = before_step();
    BodyStepReport kept = std::move(last);
    // Tries that end without a step leave marks in bodies and contacts: what is written then,
    // and what --resume continues from, is of the last step.
    const auto take_back = [&] {
        last = std::move(kept);
        put_back(before);
    };
    const auto refused = [&](const std::string& why) {
        take_back();
        return *stop ? interrupted_step() : failed_step(why);
    };
    // An iteration in motion that has left the solution ends where errors are small beside forces
    // that are huge.
    const auto generates_energy = [&] {
        const double gained = std::max(before.energy.error() - energy.error(),
                                       before.energy.released - energy.released);
        return dynamic() && energy_fault(gained, energy, energy_scale()) > kEnergyRefused;
    };
    while (true) {
        const bool shorter = h > least * (1 + 1e-9);
        if (advance(h)) {
            if (!(shorter && generates_energy()) && leave_unstable(shorter)) break;
            put_back(before);
        }
        if (*stop) return refused("");
        if (!shorter) {
            std::string why = last.refusal; // of the step itself, then of the way over a snap
            if (may_snap() && !has_drag()) {
                if (advance(h, true) && leave_unstable(false)) break;
                why += (why.empty() || last.refusal.empty() ? "" : "; ") + last.refusal;
            }
            return refused(fmt::format(
                "step {} (t = {:.6g} s): {}{}", step + 1, time, why,
                retries == 0 ? "" : fmt::format("; steps down to {:.3g} s were tried", h)));
        }
        h = std::max(0.5 * h, least);
        ++retries;
    }
    if (!dynamic()) energy.released += work_against_left(before);
    const bool refined = refinement.level > 0;
    const EnergyVerdict verdict = judge_energy(before, h);
    if (verdict == EnergyVerdict::refused) {
        const std::string why =
            fmt::format("step {} (t = {:.6g} s): {}", step + 1, before.time, last.refusal);
        take_back();
        return failed_step(why);
    }
    inputs.accept();
    if (verdict == EnergyVerdict::again) {
        take_back();
        return std::nullopt;
    }
    ++step;
    note_unstable();
    overlaps.add(*system, last, step, summary.warnings);
    if (last.lag > 0 && lagging++ < kMostWarnings)
        summary.warnings.push_back(fmt::format(
            "step {}: contacts jump at its end; their forces are those of contacts as the last "
            "iteration found them, {:.1g} of them away from those at the end",
            step, last.lag));
    if (last.spread > kManyTolerances * scene.accuracy.contact && lagging++ < kMostWarnings)
        summary.warnings.push_back(fmt::format(
            "step {}: contacts of edges and corners jump at its end, between faces of the mesh; "
            "several balances are certified there, and the forces of those that were found differ "
            "by {:.1e} of them; finer faces there leave less",
            step, last.spread));
    if (std::abs(time - next_stop()) < 1e-12 * end) time = next_stop();
    // In a medium a step that is too long costs more than some that are shorter.
    const double growth = !has_drag() ? 2 : last.errors.size() <= kQuick ? kGrowth : 1;
    if (!(refined && refinement.level == 0)) step_length = std::min(growth * h, scene.time.step);
    if (h == reach && retries == 0 && !has_drag()) step_length = scene.time.step;
    if (at_cut && retries == 0) {
        time = not_beyond;
        step_length = uncut;
    }
    StepRecord r = record(h, watch.seconds());
    add_step(summary, r);
    contacts_sum += double(r.contacts.size());
    return record_accepted(std::move(r));
}

StepResult BodySimulation::step(const std::atomic<bool>& stop, double not_beyond)
{
    State& s = *state_;
    s.summary.status = "running";
    s.summary.message.clear();
    if (s.scene.time.path > 0 && not_beyond < s.scene.time.end)
        throw InputError(
            {{s.scene.file, "/time/path",
              fmt::format("{:g}, and steps to a time that is given", s.scene.time.path),
              "no path: along it time is an unknown"}});
    s.stop = &stop;
    s.make_ready();
    if (!s.started) {
        const BeforeStep before = s.before_step();
        const std::vector<std::string> warnings = s.summary.warnings;
        StepResult first = s.begin();
        if (first.outcome != StepResult::Outcome::accepted) {
            s.put_back(before);
            s.summary.warnings = warnings;
        }
        return first;
    }
    const double until = std::min(s.scene.time.end, not_beyond);
    const StepRefinement refinement = s.refinement;
    const std::vector<char> waiting = s.inputs.waiting();
    const double length = s.step_length;
    std::optional<StepResult> result;
    while (!result) {
        if (!(s.time < until * (1 - 1e-12))) return {};
        if (stop)
            result = interrupted_step();
        else
            result = s.scene.time.path > 0 ? s.step_path() : s.step_on(not_beyond);
    }
    if (result->outcome != StepResult::Outcome::accepted) s.inputs.wait_again(waiting);
    if (result->outcome == StepResult::Outcome::failed) {
        s.refinement = refinement;
        s.step_length = length;
    }
    return *std::move(result);
}

RunSummary BodySimulation::conclude(const StepResult& last)
{
    State& s = *state_;
    RunSummary& sum = s.summary;
    sum.status = status_of(last.outcome);
    sum.message = last.message;
    s.finish();
    s.examine_forces();
    s.note_limits();
    RunSummary whole = sum; // a run that continues adds its own
    for (std::size_t b = 0; b < s.limits.size(); ++b)
        if (std::string warning = s.limits[b].warning(s.system->refs[b].name); !warning.empty())
            whole.warnings.push_back(std::move(warning));
    if (s.unstable > 1)
        whole.warnings.push_back(fmt::format("{} steps ended in unstable balances", s.unstable));
    for (std::string& sentence : s.overlaps.small_contacts(*s.system))
        whole.warnings.push_back(std::move(sentence));
    if (std::string warning = energy_warning(s.energy, s.energy_scale()); !warning.empty())
        whole.warnings.push_back(std::move(warning));
    return whole;
}

void BodySimulation::spent_on_output(double seconds)
{
    state_->summary.seconds.output += seconds;
}

const RunSummary& BodySimulation::so_far() const
{
    return state_->summary;
}

const std::vector<InputInfo>& BodySimulation::inputs() const
{
    return state_->inputs.all();
}

double BodySimulation::input(std::size_t number) const
{
    return state_->inputs.value(number, state_->time);
}

void BodySimulation::set_input(std::size_t number, double value)
{
    state_->inputs.set(number, value, state_->time);
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
        plan.push_back(
            {b.name,
             b.rigid ? "rigid"
             : b.rod ? "rod"
                     : "solid",
             b.solid ? 3 * int(b.solid->mesh().nodes.size()) : b.body->matrix().unknowns(),
             b.solid ? set_sizes(b.solid->mesh()) : std::vector<SetSize>{}});
    return plan;
}

LinearPlan BodySimulation::linear_plan() const
{
    return state_->system->linear;
}

std::vector<double> BodySimulation::max_contact_force(std::size_t) const
{
    return {};
}

std::vector<Issue> BodySimulation::warnings() const
{
    return state_->warnings;
}

std::vector<std::string> BodySimulation::messages() const
{
    return state_->messages;
}

} // namespace amontons
