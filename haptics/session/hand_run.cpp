#include "haptics/session/hand_run.hpp"

#include "haptics/device/recorded.hpp"
#include "haptics/device/spacemouse.hpp"
#include "haptics/device/turned.hpp"
#include "haptics/device/udp.hpp"
#include "haptics/link/settings.hpp"
#include "haptics/session/link_changes.hpp"
#include "haptics/time/real_time.hpp"
#include "haptics/time/virtual_time.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/base/file.hpp"
#include "solver/obstacle/build.hpp"

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

/// The settings of the scene's profile; a wrong name is a fault of the scene.
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
void check_supported(const Scene& scene, double duration)
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
        throw InputError(
            {{scene.file, "/contact_solver", "a solver for a hand's scene",
              "none: the force on a hand is solved by the program's own solver, at its rate"}});
}

} // namespace

struct HandRun::State {
    Scene scene;
    HandRunOptions options;
    ReadAgain read;
    MakeObstacles make;
    double duration = 0; // [s]
    HapticSettings set;
    std::vector<Obstacle> obstacles; // before the links, which use them
    std::unique_ptr<HandleLink>
        first; // stays: the hand reads its path from it, from another thread
    ChangedLink changed;
    HandleLink* link = nullptr; // the one that is stepped
    std::unique_ptr<Device> device;
    SimulatedHand* hand = nullptr; // the device, if it is one
    bool fault_reported = false;   // a fault, while it lasted

    void run_virtual(const Publisher<float>& publish, HapticLoop<float>& loop, HapticOutcome& out,
                     const HandRunHooks& hooks, const std::atomic<bool>& stop);
    void run_by_clock(const Publisher<float>& publish, HapticLoop<float>& loop, HapticOutcome& out,
                      const HandRunHooks& hooks, const std::atomic<bool>& stop);
    std::string refused() const;
};

HandRun::HandRun(Scene scene, const HandRunOptions& options, ReadAgain read)
    : state_(std::make_unique<State>())
{
    State& s = *state_;
    s.scene = std::move(scene);
    s.options = options;
    s.read = std::move(read);
    s.duration = s.scene.time.end;
    const DeviceChoice choice = choose_device(s.options.device);
    if (s.options.virtual_time && (choice.kind == "udp" || choice.kind == "spacemouse"))
        throw InputError({{"(--virtual-time)", "--device", quoted_text(s.options.device),
                           "simulated or recorded:FILE: the others run in real time"}});
    if (choice.kind == "recorded") {
        Trajectory path = parse_trajectory(read_file(choice.rest), choice.rest);
        s.duration = path.end();
        if (s.duration == 0)
            throw InputError({{choice.rest, "", "one point", "two at least: a run lasts as long"}});
        s.device = std::make_unique<RecordedDevice>(std::move(path));
    } else if (choice.kind == "udp") {
        s.device = std::make_unique<UdpDevice>(choice.rest);
    } else if (choice.kind == "spacemouse") {
        s.device = std::make_unique<SpaceMouse>();
    }
    if (s.options.duration > 0) s.duration = s.options.duration;
    check_supported(s.scene, s.duration);
    place_introducers(s.scene);
}

HandRun::~HandRun() = default;

const Scene& HandRun::scene() const
{
    return state_->scene;
}

const Scene& HandRun::scene_now() const
{
    return state_->changed.link ? state_->changed.scene : state_->scene;
}

const HapticSettings& HandRun::settings() const
{
    return state_->set;
}

std::string HandRun::json(const HapticOutcome& o) const
{
    return haptic_json(o, state_->set, *state_->link);
}

std::string HandRun::table(const HapticOutcome& o) const
{
    return haptic_table(o, state_->set, *state_->link);
}

void HandRun::prepare(MakeObstacles make)
{
    State& s = *state_;
    s.make = std::move(make);
    s.obstacles = s.make(s.scene);
    // Ticks in real time and poses of real devices are not reproducible.
    const int late = s.options.late > 0 ? 3 : s.options.virtual_time ? 0 : 2;
    s.set = settings_of(s.scene, late);
    s.set.link.cache = s.options.cache;
    s.set.link.threads = s.options.threads;
    s.set.link.duration = s.duration;
    s.set.link.condense.latency = s.options.latency;
    if (!s.options.control) s.set.loop.passivity.control = false;
    if (!s.options.virtual_time) {
        s.set.loop.proxy.budget = kBudget * s.set.loop.period;
        s.set.link.snap_in_parts = true;
    }
    s.first = make_link(s.scene, s.obstacles, s.set.link);
    s.link = s.first.get();
    if (!s.device) {
        HandOptions how = s.set.hand;
        how.path = [first = s.first.get()](double t) { return first->path(t); };
        auto simulated = std::make_unique<SimulatedHand>(how);
        s.hand = simulated.get();
        s.device = std::move(simulated);
    } else if (pushes_and_twists(s.set.device) && !s.first->axis().isZero()) {
        s.device = std::make_unique<TurnedDevice>(std::move(s.device),
                                                  rotation_between(Vec3::UnitX(), s.first->axis()));
    }
    s.device->open();
}

std::vector<std::string> HandRun::warnings() const
{
    const State& s = *state_;
    std::vector<std::string> all;
    if (s.set.device.max_stiffness > 0 && s.scene.haptic.stiffness > s.set.device.max_stiffness)
        all.push_back(fmt::format("{}: /haptic/stiffness: {:g} N/m, but {} is stable up to "
                                  "{:g} N/m: it may buzz",
                                  s.scene.file, s.scene.haptic.stiffness, s.set.device.name,
                                  s.set.device.max_stiffness));
    for (const Issue& w : s.first->warnings())
        all.push_back(InputError({w}).what());
    return all;
}

/// Why a step was not handed over.
std::string HandRun::State::refused() const
{
    const State& s = *this;
    const std::string why = s.link->refusal();
    return why.empty() ? "what the step found has no finite compliance"
                       : "the simulation found no balance at its start: " + why;
}

HapticOutcome HandRun::run(const HandRunHooks& hooks, const std::atomic<bool>& stop)
{
    State& s = *state_;
    const auto print_line = [&](const std::string& text) {
        if (hooks.print_line) hooks.print_line(text);
    };
    HapticLoop<float> loop(s.scene.haptic.contacts, s.set.loop);
    LinkChanges changes(s.read, s.make, s.set.link, s.options.virtual_time);
    bool published = false, remade = false; // anything
    const Publisher<float> publish = [&](ReducedOperator<float>& op, const HandPose& handle,
                                         double time, std::uint64_t sequence) {
        if (hooks.changes) changes.request(hooks.changes());
        const auto report_change = [&](const std::string& line, const std::string& refusal) {
            if (hooks.changed) return hooks.changed(line, refusal, *s.link);
            print_line(refusal.empty() ? "set " + line : "not set: " + line + ": " + refusal);
        };
        if (ChangedLink next = changes.next(*s.link, report_change); next.link) {
            s.changed.link.reset(); // before its obstacles
            s.changed = std::move(next);
            s.link = s.changed.link.get();
            remade = true;
        }
        const bool done = s.link->step(sequence == 1 ? s.link->start() : handle) &&
                          s.link->publish(op, time, sequence);
        // Before the first one nothing is stale, and no state would show why there is no force.
        if (sequence == 1 && !done) print_line("no force yet: " + s.refused());
        published |= done;
        if (hooks.after_step)
            hooks.after_step(*s.link, s.changed.link ? s.changed.obstacles : s.obstacles, remade);
        remade = false;
        return done;
    };
    HapticOutcome out;
    out.real_time = !s.options.virtual_time;
    out.contacts_at_first = out.contacts_left = s.scene.haptic.contacts;
    if (s.options.virtual_time)
        s.run_virtual(publish, loop, out, hooks, stop);
    else
        s.run_by_clock(publish, loop, out, hooks, stop);
    if (!published && out.status == "done") {
        out.status = "failed";
        out.message = "there was no force: " + s.refused();
    }
    s.device->close();
    changes.end(print_line);
    out.summary = summarise<float>(out.records, loop, s.set.loop.period, out.real_time);
    if (stop) out.status = "interrupted";
    if (out.summary.faults > 0 && !s.fault_reported)
        print_line(std::string(name(out.summary.last_fault)) + ": " +
                   reason(out.summary.last_fault));
    return out;
}

void HandRun::State::run_virtual(const Publisher<float>& publish, HapticLoop<float>& loop,
                                 HapticOutcome& out, const HandRunHooks& hooks,
                                 const std::atomic<bool>& stop)
{
    State& s = *this;
    VirtualOptions options;
    options.duration = s.duration;
    options.operator_period = s.set.link.condense.period;
    options.operator_latency = s.options.latency;
    options.late_share = s.options.late;
    options.stop = &stop;
    options.by_clock = s.options.watched;
    if (hooks.ticks)
        options.on_ticks = [&](std::span<const TickRecord> ticks) { hooks.ticks(ticks, *s.link); };
    out.records = run_in_virtual_time<float>(
        loop, *s.device,
        [&] {
            if (s.hand) s.hand->advance();
        },
        s.scene.haptic.contacts, publish, s.set.loop.period, options);
}

void HandRun::State::run_by_clock(const Publisher<float>& publish, HapticLoop<float>& loop,
                                  HapticOutcome& out, const HandRunHooks& hooks,
                                  const std::atomic<bool>& stop)
{
    State& s = *this;
    const auto print_line = [&](const std::string& text) {
        if (hooks.print_line) hooks.print_line(text);
    };
    bool reported_limited = false; // once
    SafetyState last_state = SafetyState::running;
    RealTimeOptions options;
    options.duration = s.duration;
    options.period = s.set.loop.period;
    options.operator_period = s.set.link.condense.period;
    options.own_process = s.options.own_process;
    options.stop = &stop;
    options.budget = s.set.loop.proxy.budget;
    if (hooks.ticks)
        options.on_ticks = [&](std::span<const TickRecord> ticks) { hooks.ticks(ticks, *s.link); };
    options.on_state = [&](SafetyState state) {
        if (state == SafetyState::starting) return;
        if (state == SafetyState::limited) { // it appears and disappears: once is enough
            if (!reported_limited)
                print_line(std::string(name(state)) + ": " + reason(state) +
                           " (the report counts these ticks)");
            reported_limited = true;
            return;
        }
        if (state != last_state) print_line(std::string(name(state)) + ": " + reason(state));
        last_state = state;
        s.fault_reported = s.fault_reported || state != SafetyState::running;
    };
    options.on_slow = [&](double rate) {
        print_line(fmt::format(
            "warning: {:.0f} of {:g} steps a second: the hand feels old operators; set "
            "/haptic/simulation_rate to {:.0f}, or make the scene smaller: coarser meshes, "
            "fewer /haptic/contacts, a looser /accuracy/contact; or allow more --threads",
            rate, 1 / s.set.link.condense.period, std::max(1.0, std::floor(rate))));
    };
    options.on_overload = [&](double share) {
        if (share <= kOverloaded || out.contacts_left <= kFewestContacts) return;
        out.contacts_left = std::max(kFewestContacts, static_cast<int>(kFewer * out.contacts_left));
        s.link->set_most_contacts(out.contacts_left);
    };
    if (s.hand)
        options.advance = [&](long periods) {
            for (long i = 0; i < std::min(periods, 100L); ++i)
                s.hand->advance();
        };
    RealTimeRun run =
        run_in_real_time<float>(loop, *s.device, s.scene.haptic.contacts, publish, options);
    out.records = std::move(run.records);
    out.scheduling = run.scheduling;
    out.step_rate = run.step_rate;
    out.page_faults = run.page_faults;
    out.pages_moved = run.pages_moved;
    out.preempted = run.preempted;
    out.bare_missed = run.bare_missed;
    out.bare_wake = percentiles(std::move(run.bare_wake));
    if (!run.fifo || !run.locked) print_line("warning: " + run.scheduling);
    if (!run.stopped.empty()) {
        out.status = "failed";
        out.message = "the simulation stopped: " + run.stopped;
    }
}

} // namespace amontons
