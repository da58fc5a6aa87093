#include "haptics/link/body_link.hpp"

#include "contact/options.hpp"
#include "haptics/link/condense.hpp"
#include "mesh/base/curve.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/scene/instrument_rods.hpp"
#include "solver/step/body_build.hpp"
#include "solver/step/body_record.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace amontons {
namespace {

constexpr int kMostHalvings = 4; // of the way to the device
constexpr int kPatience = 3; // iterations without progress: a step half way to the device is faster
constexpr double kMostRise =
    5; // of the error: contacts appear and disappear, as those on an edge do

bool is_of(const ContactLaw& law, const std::string& name)
{
    return law.between[0] == name || law.between[1] == name;
}

bool is_named(const Scene& scene, const ContactLaw& pair)
{
    return std::ranges::any_of(scene.contact, [&](const ContactLaw& law) {
        return is_of(law, pair.between[0]) && is_of(law, pair.between[1]);
    });
}

/// The scene with its handle's motion prescribed by the device.
Scene with_driven_handle(Scene scene)
{
    const HapticInput& h = scene.haptic;
    if (!h.given)
        throw InputError({{scene.file, "/haptic", "nothing",
                           "{\"handle\": NAME}: the body that the device moves"}});
    if (instruments_are_rods(scene)) scene = with_instruments_as_rods(std::move(scene));
    for (SolidInput& s : scene.solids) {
        if (s.name != h.handle) continue;
        s.drive.given = true;
        if (scene.time.kind == "dynamic")
            throw InputError({{scene.file, "/time/kind", "\"dynamic\"",
                               "\"quasi_static\", or a rigid handle: an elastic one has no "
                               "dynamics yet"}});
    }
    for (RigidInput& r : scene.rigids) {
        if (r.name != h.handle) continue;
        // The handle moves on its spring: pairs of "*" that are left out for two fixed bodies are
        // needed, and are replaced by a law between two names.
        r.drive.given = false;
        for (const ContactLaw& law : written_out(scene))
            if (is_of(law, h.handle) && !is_named(scene, law)) scene.contact.push_back(law);
        r.drive.given = true;
    }
    return scene;
}

} // namespace

struct BodyLink::State {
    Scene scene;
    LinkOptions options;
    std::vector<Issue> warnings;
    std::vector<std::string> messages;
    std::unique_ptr<BodySystem> system;
    std::unique_ptr<Body> in_hand; // by `held`, which is in its place in the system
    HeldBody* held = nullptr;
    int handle = -1;
    Vec3 origin = Vec3::Zero();
    HandPose start;
    StepInput last_step;
    BodyStepReport report;
    std::string refusal; ///< of the last try that was not accepted
    bool started = false;

    State(const Scene& s, const LinkOptions& o) : scene(with_driven_handle(s)), options(o) {}
    StepInput input(double time, double h) const
    {
        StepInput step;
        step.start = time;
        step.h = h;
        step.dynamic = scene.time.kind == "dynamic" && h > 0;
        step.rule = time_rule(scene.time);
        step.gravity = scene.gravity;
        return step;
    }
    void check_holds() const;
};

/// W of a body that its contacts alone hold is infinite until it is solved for: not in a tick.
void BodyLink::State::check_holds() const
{
    if (scene.time.kind == "dynamic") return;
    std::vector<Issue> issues;
    for (const BodyRef& b : system->refs) {
        const bool free = b.rigid ? !b.rigid->driven()
                          : b.rod ? !b.rod->free_motions().empty()
                                  : !b.solid->free_motions().empty();
        if (free)
            issues.push_back({scene.file, "/bodies/" + b.name,
                              "a body that nothing but its contacts holds",
                              "a hold or a drive, or \"kind\": \"dynamic\" in /time, for haptics"});
    }
    if (!issues.empty()) throw InputError(std::move(issues));
}

BodyLink::BodyLink(const Scene& scene, const std::vector<Obstacle>& obstacles,
                   const LinkOptions& options)
    : HandleLink(options.condense)
    , state_(std::make_unique<State>(scene, options))
{
    State& s = *state_;
    s.system = build_bodies(s.scene, obstacles, s.warnings);
    s.check_holds();
    for (std::size_t b = 0; b < s.system->refs.size(); ++b)
        if (s.system->refs[b].name == s.scene.haptic.handle) s.handle = int(b);
    s.system->finder.search_farther(s.system->refs, s.handle, options.condense.farthest());
    BodyRef& ref = s.system->refs[std::size_t(s.handle)];
    const double step = options.condense.period;
    for (const BodyRef& b : s.system->refs)
        if (b.solid) {
            b.solid->expect_steps(options.duration / step);
            b.solid->make_ready(s.input(0, s.scene.time.kind == "dynamic" ? step : 0),
                                options.cache, s.messages);
        }
    // The middle of the body: what its drive turns about, too.
    if (ref.rigid) {
        s.origin = ref.rigid->placement().turn.conjugate() *
                   (ref.rigid->centre() - ref.rigid->placement().shift);
    } else {
        for (const Vec3& X : ref.solid->mesh().nodes)
            s.origin += X / double(ref.solid->mesh().nodes.size());
    }
    auto held = std::make_unique<HeldBody>(ref, s.origin, options.spring);
    ref.body = s.held = held.get();
    s.in_hand = std::exchange(s.system->bodies[std::size_t(s.handle)], std::move(held));
    s.start = s.held->pose();
}

BodyLink::~BodyLink() = default;

HandPose BodyLink::start() const
{
    return state_->start;
}

Vec6 BodyLink::path(double t) const
{
    const State& s = *state_;
    const auto along = [&](const auto& body) {
        const auto at = [&](double time) {
            const Placement p =
                driven_placement(body.drive, start_placement(body.start), s.origin, time);
            return Vec3(p * s.origin);
        };
        const CurvePoints& angle = body.drive.angle;
        const double turned = angle.empty() ? 0 : curve_value(angle, t) - curve_value(angle, 0);
        Vec6 x;
        x << at(t) - at(0), turned * body.drive.axis.normalized();
        return x;
    };
    for (const SolidInput& b : s.scene.solids)
        if (b.name == s.scene.haptic.handle) return along(b);
    for (const RigidInput& b : s.scene.rigids)
        if (b.name == s.scene.haptic.handle) return along(b);
    return Vec6::Zero();
}

const std::vector<Issue>& BodyLink::warnings() const
{
    return state_->warnings;
}

bool BodyLink::step(const HandPose& device)
{
    State& s = *state_;
    BodyStepOptions settings;
    settings.tolerance = s.scene.accuracy.contact;
    settings.solver = contact_solver(s.scene.accuracy.solver);
    settings.threads = s.options.threads;
    settings.patience = kPatience;
    settings.most_rise = kMostRise;
    settings.explain = false;
    const double h = s.started ? s.options.condense.period : 0;
    const StepInput input = s.input(count_.time, h);
    if (!s.started && s.scene.time.kind == "dynamic") { // nothing to balance
        s.started = true;
        return step(device);
    }
    const HandPose from = s.held->device();
    double share = 1;
    for (int i = 0; i <= kMostHalvings; ++i, share /= 2) {
        s.held->aim(i == 0 ? device : between(from, device, share));
        BodyStepReport report = try_body_step(*s.system, input, settings);
        if (!report.accepted) {
            ++count_.refused;
            s.refusal = report.refusal;
            continue;
        }
        s.report = std::move(report);
        s.last_step = input;
        count_.time = input.end();
        s.started = true;
        count_.steps += h > 0;
        count_.not_touched += i > 0;
        return true;
    }
    s.held->aim(from);
    ++count_.not_touched;
    return false;
}

Condensed BodyLink::condense_step(int most)
{
    State& s = *state_;
    ReductionOptions options = condense_;
    options.most_contacts = most;
    return condense(*s.system, s.handle, *s.held, s.last_step, s.report, options);
}

bool BodyLink::take_over(const HandleLink& before)
{
    const auto* link = dynamic_cast<const BodyLink*>(&before);
    if (!link) return false;
    State& s = *state_;
    const State& old = *link->state_;
    if (s.system->refs.size() != old.system->refs.size()) return false;
    std::vector<std::vector<double>> states;
    for (std::size_t b = 0; b < s.system->refs.size(); ++b) {
        const BodyRef &now = s.system->refs[b], &then = old.system->refs[b];
        if (now.name != then.name) return false;
        states.push_back(now.body->state_from(*then.body));
        if (states.back().size() != now.body->state().size()) return false;
    }
    for (std::size_t b = 0; b < states.size(); ++b)
        s.system->refs[b].body->set_state(states[b]);
    s.system->warm = old.system->warm;
    s.held->aim(old.held->device());
    s.last_step = old.last_step;
    s.started = old.started;
    s.start = old.start;
    count_ = link->count_;
    return true;
}

std::vector<BeamRecord> BodyLink::beam_records() const
{
    std::vector<BeamRecord> out;
    for (const BodyRef& b : state_->system->refs)
        if (b.rod) out.push_back(record_rod(*b.rod, b.name));
    return out;
}

std::vector<BodyRecord> BodyLink::body_records() const
{
    std::vector<BodyRecord> out;
    for (std::size_t b = 0; b < state_->system->refs.size(); ++b)
        if (!state_->system->refs[b].rod)
            out.push_back(record_body(*state_->system, b, state_->report));
    return out;
}

std::vector<ContactRecord> BodyLink::contact_records() const
{
    return contact_records_of(*state_->system, state_->report, int(state_->scene.obstacles.size()));
}

const HeldBody& BodyLink::held() const
{
    return *state_->held;
}

const BodyStepReport& BodyLink::report() const
{
    return state_->report;
}

HandPose BodyLink::device() const
{
    return state_->held->device();
}

Wrench BodyLink::force() const
{
    return state_->held->force();
}

std::string BodyLink::refusal() const
{
    return state_->refusal;
}

} // namespace amontons
