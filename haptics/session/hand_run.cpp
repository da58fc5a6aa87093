#include "haptics/session/hand_run.hpp"

#include "haptics/device/recorded.hpp"
#include "haptics/device/spacemouse.hpp"
#include "haptics/device/turned.hpp"
#include "haptics/device/udp.hpp"
#include "haptics/real_time.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/base/file.hpp"
#include "solver/scene/build.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

/// "kind:rest" of a device's name.
struct DeviceChoice {
    std::string kind, rest;
};

DeviceChoice choose_device(const std::string& text)
{
    const std::size_t colon = text.find(':');
    DeviceChoice d{text.substr(0, colon), colon == std::string::npos ? "" : text.substr(colon + 1)};
    const std::vector<std::string> names{"simulated", "recorded", "udp", "spacemouse"};
    const bool known = std::find(names.begin(), names.end(), d.kind) != names.end();
    const bool needs_rest = d.kind == "recorded" || d.kind == "udp";
    if (known && needs_rest == !d.rest.empty()) return d;
    const std::string near = known ? "" : nearest_name(d.kind, names);
    throw InputError({{"(--device)", "", quoted_text(text),
                       "simulated, recorded:FILE, udp:PORT or spacemouse" +
                           (near.empty() ? "" : "; nearest: " + near)}});
}

/// Settings that the scene's profile gives; the scene is to blame for its name.
HapticSettings settings_of(const Scene& scene, int late)
{
    try {
        return make_settings(scene.haptic, device_profile(scene.haptic.device), late);
    } catch (const InputError& error) {
        std::vector<Issue> issues = error.issues();
        for (Issue& i : issues) {
            i.file = scene.file;
            i.place = "/haptic/device";
        }
        throw InputError(std::move(issues));
    }
}

/// One push along its x, one twist about it.
bool pushes_and_twists(const DeviceSpec& device)
{
    return device.free == std::array<bool, 6>{true, false, false, true, false, false};
}

// What takes too long in a tick is done in this order: sweeps end at the budget, those of a new
// operator that is solved by itself too, then fewer contacts are handed over.
constexpr double kBudget = 0.5;     // of a period: no sweep of a tick begins later
constexpr double kOverloaded = 0.1; // share of ticks that the budget ended
constexpr double kFewer = 0.8;      // of the contacts, then
constexpr int kFewestContacts = 16;
/// Of a run: each leaves a record of half a kilobyte.
constexpr double kMostTicks = 4e6;

/// What a hand cannot feel.
void check_felt(const Scene& scene, double duration)
{
    if (duration * scene.haptic.rate > kMostTicks)
        throw InputError({{scene.file, "/haptic/rate",
                           fmt::format("{:g} Hz for {:g} s", scene.haptic.rate, duration),
                           fmt::format("{:g} s at most: every tick is recorded",
                                       kMostTicks / scene.haptic.rate)}});
    for (const BeamInput& b : scene.beams)
        if (b.hold.given)
            throw InputError({{scene.file, "/bodies/" + b.name + "/hold", "a tip that is held",
                               "none: a hand feels wires whose tip is free"}});
    if (scene.contact_solver.given())
        throw InputError({{scene.file, "/contact_solver", "a solver for a hand's scene",
                           "none: what a hand feels is solved by ours, at its rate"}});
}

} // namespace

HandRun::HandRun(Scene scene, const HandRunOptions& options, ReadAgain read)
    : scene_(std::move(scene))
    , options_(options)
    , read_(std::move(read))
    , duration_(scene_.time.end)
{
    const DeviceChoice choice = choose_device(options_.device);
    if (options_.virtual_time && (choice.kind == "udp" || choice.kind == "spacemouse"))
        throw InputError({{"(--virtual-time)", "--device", quoted_text(options_.device),
                           "simulated or recorded:FILE: the others live by the clock"}});
    if (choice.kind == "recorded") {
        Trajectory path = parse_trajectory(read_file(choice.rest), choice.rest);
        duration_ = path.end();
        if (duration_ == 0)
            throw InputError({{choice.rest, "", "one point", "two at least: a run lasts as long"}});
        device_ = std::make_unique<RecordedDevice>(std::move(path));
    } else if (choice.kind == "udp") {
        device_ = std::make_unique<UdpDevice>(choice.rest);
    } else if (choice.kind == "spacemouse") {
        device_ = std::make_unique<SpaceMouse>();
    }
    if (options_.duration > 0) duration_ = options_.duration;
    check_felt(scene_, duration_);
    place_introducers(scene_);
}

HandRun::~HandRun() = default;

void HandRun::prepare(MakeObstacles make)
{
    make_ = std::move(make);
    obstacles_ = make_(scene_);
    // Ticks by the clock, and poses from elsewhere, come when they come.
    const int late = options_.late > 0 ? 3 : options_.virtual_time ? 0 : 2;
    set_ = settings_of(scene_, late);
    set_.link.cache = options_.cache;
    set_.link.threads = options_.threads;
    set_.link.duration = duration_;
    set_.link.condense.latency = options_.latency;
    if (!options_.control) set_.loop.passivity.control = false;
    if (!options_.virtual_time) {
        set_.loop.proxy.budget = kBudget * set_.loop.period;
        set_.link.snap_in_parts = true;
    }
    first_ = make_link(scene_, obstacles_, set_.link);
    link_ = first_.get();
    if (!device_) {
        HandOptions how = set_.hand;
        how.path = [first = first_.get()](double t) { return first->path(t); };
        auto simulated = std::make_unique<SimulatedHand>(how);
        hand_ = simulated.get();
        device_ = std::move(simulated);
    } else if (pushes_and_twists(set_.device) && !first_->axis().isZero()) {
        device_ = std::make_unique<TurnedDevice>(std::move(device_),
                                                 rotation_between(Vec3::UnitX(), first_->axis()));
    }
    device_->open();
}

std::vector<std::string> HandRun::warnings() const
{
    std::vector<std::string> all;
    if (set_.device.max_stiffness > 0 && scene_.haptic.stiffness > set_.device.max_stiffness)
        all.push_back(fmt::format("{}: /haptic/stiffness: {:g} N/m, but {} is stable up to "
                                  "{:g} N/m: it may buzz",
                                  scene_.file, scene_.haptic.stiffness, set_.device.name,
                                  set_.device.max_stiffness));
    for (const Issue& w : first_->warnings())
        all.push_back(InputError({w}).what());
    return all;
}

/// Why a step was not handed over.
std::string HandRun::refused() const
{
    const std::string why = link_->refusal();
    return why.empty() ? "what the step found has no finite compliance"
                       : "the simulation found no balance at its start: " + why;
}

HapticOutcome HandRun::run(const HandRunHooks& hooks, const std::atomic<bool>& stop)
{
    const auto say = [&](const std::string& text) {
        if (hooks.say) hooks.say(text);
    };
    HapticLoop<float> loop(scene_.haptic.contacts, set_.loop);
    LinkChanges changes(read_, make_, set_.link, options_.virtual_time);
    bool published = false, remade = false; // anything
    const Publisher<float> publish = [&](ReducedOperator<float>& op, const HandPose& handle,
                                         double time, std::uint64_t sequence) {
        if (hooks.changes) changes.ask(hooks.changes());
        if (ChangedLink next = changes.next(*link_, say); next.link) {
            changed_.link.reset(); // before its obstacles
            changed_ = std::move(next);
            link_ = changed_.link.get();
            remade = true;
        }
        const bool done = link_->step(sequence == 1 ? link_->start() : handle) &&
                          link_->publish(op, time, sequence);
        // Before the first one nothing is stale, and nobody would tell why there is no force.
        if (sequence == 1 && !done) say("no force yet: " + refused());
        published |= done;
        if (hooks.after_step)
            hooks.after_step(*link_, changed_.link ? changed_.obstacles : obstacles_, remade);
        remade = false;
        return done;
    };
    HapticOutcome out;
    out.real_time = !options_.virtual_time;
    out.contacts_asked = out.contacts_left = scene_.haptic.contacts;
    if (options_.virtual_time)
        run_virtual(publish, loop, out, stop);
    else
        run_by_clock(publish, loop, out, hooks, stop);
    if (!published && out.status == "done") {
        out.status = "failed";
        out.message = "there was no force: " + refused();
    }
    device_->close();
    changes.end(say);
    out.summary = summarise<float>(out.records, loop, set_.loop.period, out.real_time);
    if (stop) out.status = "interrupted";
    if (out.summary.faults > 0 && !told_)
        say(std::string(name(out.summary.last_fault)) + ": " + reason(out.summary.last_fault));
    return out;
}

void HandRun::run_virtual(const Publisher<float>& publish, HapticLoop<float>& loop,
                          HapticOutcome& out, const std::atomic<bool>& stop)
{
    VirtualOptions options;
    options.duration = duration_;
    options.operator_period = set_.link.condense.period;
    options.operator_latency = options_.latency;
    options.late_share = options_.late;
    options.stop = &stop;
    out.records = run_in_virtual_time<float>(
        loop, *device_,
        [&] {
            if (hand_) hand_->advance();
        },
        scene_.haptic.contacts, publish, set_.loop.period, options);
}

void HandRun::run_by_clock(const Publisher<float>& publish, HapticLoop<float>& loop,
                           HapticOutcome& out, const HandRunHooks& hooks,
                           const std::atomic<bool>& stop)
{
    const auto say = [&](const std::string& text) {
        if (hooks.say) hooks.say(text);
    };
    bool told_limited = false; // once
    SafetyState said = SafetyState::running;
    RealTimeOptions options;
    options.duration = duration_;
    options.period = set_.loop.period;
    options.operator_period = set_.link.condense.period;
    options.own_process = options_.own_process;
    options.stop = &stop;
    options.budget = set_.loop.proxy.budget;
    options.on_state = [&](SafetyState state) {
        if (state == SafetyState::starting) return;
        if (state == SafetyState::limited) { // it comes and goes: once is enough
            if (!told_limited)
                say(std::string(name(state)) + ": " + reason(state) +
                    " (the report counts these ticks)");
            told_limited = true;
            return;
        }
        if (state != said) say(std::string(name(state)) + ": " + reason(state));
        said = state;
        told_ = told_ || state != SafetyState::running;
    };
    options.on_slow = [&](double rate) {
        say(fmt::format(
            "warning: {:.0f} of {:g} steps a second: the hand feels old operators; set "
            "/haptic/simulation_rate to {:.0f}, or make the scene smaller: coarser meshes, "
            "fewer /haptic/contacts, a looser /accuracy/contact; or allow more --threads",
            rate, 1 / set_.link.condense.period, std::max(1.0, std::floor(rate))));
    };
    options.on_overload = [&](double share) {
        if (share <= kOverloaded || out.contacts_left <= kFewestContacts) return;
        out.contacts_left = std::max(kFewestContacts, static_cast<int>(kFewer * out.contacts_left));
        link_->set_most_contacts(out.contacts_left);
    };
    if (hand_)
        options.advance = [&](long periods) {
            for (long i = 0; i < std::min(periods, 100L); ++i)
                hand_->advance();
        };
    RealTimeRun run =
        run_in_real_time<float>(loop, *device_, scene_.haptic.contacts, publish, options);
    out.records = std::move(run.records);
    out.scheduling = run.scheduling;
    out.step_rate = run.step_rate;
    out.page_faults = run.page_faults;
    out.pages_moved = run.pages_moved;
    out.preempted = run.preempted;
    out.bare_missed = run.bare_missed;
    out.bare_wake = percentiles(std::move(run.bare_wake));
    if (!run.fifo || !run.locked) say("warning: " + run.scheduling);
    if (!run.stopped.empty()) {
        out.status = "failed";
        out.message = "the simulation stopped: " + run.stopped;
    }
}

} // namespace amontons
