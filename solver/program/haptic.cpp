// amontons haptic SCENE --device D: a hand feels the scene at 1 kHz.

#include "haptics/device/recorded.hpp"
#include "haptics/device/spacemouse.hpp"
#include "haptics/device/turned.hpp"
#include "haptics/device/udp.hpp"
#include "haptics/link/settings.hpp"
#include "haptics/real_time.hpp"
#include "haptics/summary.hpp"
#include "haptics/virtual_time.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/folder_lock.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/output/output_folder.hpp"
#include "solver/output/view_maker.hpp"
#include "solver/program/haptic_report.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/scene_arguments.hpp"
#include "solver/program/scene_lines.hpp"
#include "solver/program/session.hpp"
#include "solver/program/viewer.hpp"
#include "solver/scene/build.hpp"
#include "solver/scene/json_text.hpp"
#include "solver/scene/read.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <deque>
#include <fmt/format.h>
#include <future>
#include <optional>
#include <unistd.h>

namespace amontons {
namespace {

struct HapticArguments {
    SceneArguments scene;
    std::string device = "simulated", output, cache;
    double duration = 0; ///< [s]; 0: the scene's end
    bool virtual_time = false;
    bool view = false;
    bool free = false; ///< no passivity control
    double late = 0;
    int latency = 1;
    int threads = 1;
};

/// "kind:rest" of --device.
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

void make_output(const std::string& folder)
{
    std::string found;
    try {
        make_folder(folder);
        if (::access(folder.c_str(), W_OK | X_OK) != 0)
            found = "a folder that may not be written to";
    } catch (const WriteError& error) {
        found = error.what();
    }
    if (!found.empty())
        throw InputError({{folder, "", found, "a folder that can be made and written to"}});
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

/// Why a step was not handed over.
std::string refused(const HandleLink& link)
{
    const std::string why = link.refusal();
    return why.empty() ? "what the step found has no finite compliance"
                       : "the simulation found no balance at its start: " + why;
}

/// A scene with one of its values replaced, ready to continue with.
struct ChangedLink {
    std::string line; ///< PATH=VALUE
    std::vector<std::string> overrides;
    std::vector<Obstacle> obstacles; // before the link, which uses them
    std::unique_ptr<HandleLink> link;
    std::string refusal;
};

/// Reads, meshes and factors it.
ChangedLink build_changed_link(const std::string& file, std::vector<std::string> overrides,
                               std::string line, const LinkOptions& options)
{
    ChangedLink c;
    overrides.push_back(line);
    c.line = std::move(line);
    c.overrides = std::move(overrides);
    try {
        Scene scene = read_scene(file, c.overrides);
        place_introducers(scene);
        c.obstacles = build_obstacles(scene);
        c.link = make_link(scene, c.obstacles, options);
    } catch (const InputError& error) {
        c.refusal = std::string("not set: ") + error.what();
    }
    return c;
}

/// Values of the scene that the user changes while it is felt. What a value needs, factors above
/// all, is made in a thread of its own: the simulation continues as it is until that is there.
class LinkChanges {
public:
    /// @param waits  for each: where time stands meanwhile
    LinkChanges(std::string file, std::vector<std::string> overrides, const LinkOptions& options,
                bool waits)
        : file_(std::move(file))
        , overrides_(std::move(overrides))
        , options_(options)
        , waits_(waits)
    {
    }

    void ask(std::vector<std::string> lines)
    {
        for (std::string& line : lines)
            asked_.push_back(std::move(line));
    }
    /// The next change that is ready, taken over from where the simulation is; or no link.
    ChangedLink next(const HandleLink& now, const Session& session)
    {
        if (!pending_.valid() && !asked_.empty()) {
            pending_ = std::async(std::launch::async, build_changed_link, file_, overrides_,
                                  asked_.front(), options_);
            asked_.pop_front();
        }
        ChangedLink c;
        if (!pending_.valid() ||
            (!waits_ && pending_.wait_for(std::chrono::seconds(0)) != std::future_status::ready))
            return c;
        c = pending_.get();
        if (c.link && !c.link->take_over(now)) {
            c.refusal = "not set, the bodies would be others: " + c.line;
            c.link.reset();
        }
        if (c.link) overrides_ = c.overrides;
        session.say(c.link ? "set " + c.line : c.refusal);
        return c;
    }
    /// The run is over.
    void end(const Session& session)
    {
        if (pending_.valid()) asked_.push_front(pending_.get().line);
        for (const std::string& line : asked_)
            session.say("not set, the run ended before: " + line);
        asked_.clear();
    }

private:
    std::string file_;
    std::vector<std::string> overrides_;
    LinkOptions options_;
    bool waits_;
    std::deque<std::string> asked_;
    std::future<ChangedLink> pending_;
};

void haptic(HapticArguments& a, Session& session)
{
    settle(a.scene);
    const DeviceChoice choice = choose_device(a.device);
    Scene scene = read_scene(a.scene.scene, a.scene.overrides);

    // ---- Checks of the arguments
    if (a.virtual_time && (choice.kind == "udp" || choice.kind == "spacemouse"))
        throw InputError({{"(--virtual-time)", "--device", quoted_text(a.device),
                           "simulated or recorded:FILE: the others live by the clock"}});
    std::unique_ptr<Device> device;
    double duration = scene.time.end;
    if (choice.kind == "recorded") {
        Trajectory path = parse_trajectory(read_file(choice.rest), choice.rest);
        duration = path.end();
        if (duration == 0)
            throw InputError({{choice.rest, "", "one point", "two at least: a run lasts as long"}});
        device = std::make_unique<RecordedDevice>(std::move(path));
    } else if (choice.kind == "udp") {
        device = std::make_unique<UdpDevice>(choice.rest);
    } else if (choice.kind == "spacemouse") {
        device = std::make_unique<SpaceMouse>();
    }
    if (a.duration > 0) duration = a.duration;

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
    std::optional<FolderLock> lock;
    if (!a.output.empty()) { // before the run, not after
        check_output_folder(a.output, scene);
        make_output(a.output);
        lock.emplace(a.output, "amontons haptic " + scene.file);
    }

    // ---- Settings, simulation, device
    place_introducers(scene);
    const std::vector<Obstacle> obstacles = build_obstacles(scene);
    // Ticks by the clock, and poses from elsewhere, come when they come.
    const int late = a.late > 0 ? 3 : a.virtual_time ? 0 : 2;
    HapticSettings set = settings_of(scene, late);
    set.link.cache = a.cache;
    set.link.threads = a.threads;
    set.link.duration = duration;
    set.link.condense.latency = a.latency;
    if (a.free) set.loop.passivity.control = false;
    if (!a.virtual_time) {
        set.loop.proxy.budget = kBudget * set.loop.period;
        set.link.snap_in_parts = true;
    }
    // The first one stays: the hand asks it for its path, from another thread.
    const std::unique_ptr<HandleLink> first = make_link(scene, obstacles, set.link);
    ChangedLink changed;
    HandleLink* link = first.get();
    LinkChanges changes(a.scene.scene, a.scene.overrides, set.link, a.virtual_time);
    if (set.device.max_stiffness > 0 && scene.haptic.stiffness > set.device.max_stiffness)
        session.say(fmt::format("warning: {}: /haptic/stiffness: {:g} N/m, but {} is stable up to "
                                "{:g} N/m: it may buzz",
                                scene.file, scene.haptic.stiffness, set.device.name,
                                set.device.max_stiffness));
    for (const Issue& w : link->warnings())
        session.say(std::string("warning: ") + InputError({w}).what());

    SimulatedHand* hand = nullptr;
    if (!device) {
        HandOptions options = set.hand;
        options.path = [&first](double t) { return first->path(t); };
        auto simulated = std::make_unique<SimulatedHand>(options);
        hand = simulated.get();
        device = std::move(simulated);
    } else if (pushes_and_twists(set.device) && !first->axis().isZero()) {
        device = std::make_unique<TurnedDevice>(std::move(device),
                                                rotation_between(Vec3::UnitX(), first->axis()));
    }
    device->open();

    std::optional<Viewer> viewer;

    // ---- View and publication of operators
    if (a.view)
        viewer.emplace(scene.title.empty() ? "amontons" : scene.title, ::isatty(STDERR_FILENO));
    auto frames = std::make_unique<ViewMaker>(obstacles, contact_bodies(scene));
    SceneLines lines;
    std::atomic<bool>& stop = stop_on_interrupt();
    const int most = scene.haptic.contacts;
    HapticLoop<float> loop(most, set.loop);
    bool published = false; // anything
    const Publisher<float> publish = [&](ReducedOperator<float>& op, const HandPose& handle,
                                         double time, std::uint64_t sequence) {
        if (viewer) changes.ask(lines.take(session));
        if (ChangedLink next = changes.next(*link, session); next.link) {
            changed.link.reset(); // before its obstacles
            changed = std::move(next);
            link = changed.link.get();
            frames = std::make_unique<ViewMaker>(changed.obstacles, contact_bodies(scene));
        }
        const bool done =
            link->step(sequence == 1 ? link->start() : handle) && link->publish(op, time, sequence);
        // Before the first one nothing is stale, and nobody would show why there is no force.
        if (sequence == 1 && !done) session.say("no force yet: " + refused(*link));
        published |= done;
        if (viewer && viewer->wants())
            viewer->offer(frames->frame(link->time(), link->beam_records(), link->body_records(),
                                        link->contact_records()));
        return done;
    };

    // ---- The run
    HapticOutcome out;
    std::vector<TickRecord> records;
    out.real_time = !a.virtual_time;
    out.contacts_asked = out.contacts_left = most;
    bool told = false, told_limited = false; // a fault, while it lasted; the other, once
    SafetyState said = SafetyState::running;
    if (a.virtual_time) {
        VirtualOptions options;
        options.duration = duration;
        options.operator_period = set.link.condense.period;
        options.operator_latency = a.latency;
        options.late_share = a.late;
        options.stop = &stop;
        records = run_in_virtual_time<float>(
            loop, *device,
            [&] {
                if (hand) hand->advance();
            },
            most, publish, set.loop.period, options);
    } else {
        RealTimeOptions options;
        options.duration = duration;
        options.period = set.loop.period;
        options.operator_period = set.link.condense.period;
        options.stop = &stop;
        options.budget = set.loop.proxy.budget;
        options.on_state = [&](SafetyState state) {
            if (state == SafetyState::starting) return;
            if (state == SafetyState::limited) { // it appears and disappears: once is enough
                if (!told_limited)
                    session.say(std::string(name(state)) + ": " + reason(state) +
                                " (the report counts these ticks)");
                told_limited = true;
                return;
            }
            if (state != said) session.say(std::string(name(state)) + ": " + reason(state));
            said = state;
            told = told || state != SafetyState::running;
        };
        options.on_slow = [&](double rate) {
            session.say(fmt::format(
                "warning: {:.0f} of {:g} steps a second: the hand feels old operators; set "
                "/haptic/simulation_rate to {:.0f}, or make the scene smaller: coarser meshes, "
                "fewer /haptic/contacts, a looser /accuracy/contact; or allow more --threads",
                rate, 1 / set.link.condense.period, std::max(1.0, std::floor(rate))));
        };
        options.on_overload = [&](double share) {
            if (share <= kOverloaded || out.contacts_left <= kFewestContacts) return;
            out.contacts_left =
                std::max(kFewestContacts, static_cast<int>(kFewer * out.contacts_left));
            link->set_most_contacts(out.contacts_left);
        };
        if (hand)
            options.advance = [&](long periods) {
                for (long i = 0; i < std::min(periods, 100L); ++i)
                    hand->advance();
            };
        RealTimeRun run = run_in_real_time<float>(loop, *device, most, publish, options);
        records = std::move(run.records);
        out.scheduling = run.scheduling;
        out.step_rate = run.step_rate;
        out.page_faults = run.page_faults;
        out.pages_moved = run.pages_moved;
        out.preempted = run.preempted;
        out.bare_missed = run.bare_missed;
        out.bare_wake = percentiles(std::move(run.bare_wake));
        if (!run.fifo || !run.locked) session.say("warning: " + run.scheduling);
        if (!run.stopped.empty()) {
            out.status = "failed";
            session.exit_code = kSolveFailed;
            session.error("the simulation stopped: " + run.stopped);
        }
    }

    // ---- Result files and messages
    if (!published && out.status == "done") {
        out.status = "failed";
        session.exit_code = kSolveFailed;
        session.error("there was no force: " + refused(*link));
    }
    device->close();
    changes.end(session);
    if (viewer) out.shown = viewer->close();

    out.summary = summarise<float>(records, loop, set.loop.period, out.real_time);
    if (!a.output.empty()) {
        out.output = a.output + "/haptics.csv";
        write_file(out.output, trace_csv(records), Flush::to_disk, Links::replace);
    }
    if (was_interrupted()) {
        out.status = "interrupted";
        session.exit_code = kInterrupted;
    }
    if (out.summary.faults > 0 && !told)
        session.say(std::string(name(out.summary.last_fault)) + ": " +
                    reason(out.summary.last_fault));
    if (session.json)
        session.print(haptic_json(out, set, *link));
    else if (!session.quiet)
        session.print(haptic_table(out, set, *link));
}

/// CLI::Range takes what is not a number for one within it.
CLI::Validator within(double low, double high)
{
    CLI::Validator range = CLI::Range(low, high);
    return {[low, high](std::string& text) {
                double x = 0;
                const bool is_number = CLI::detail::lexical_cast(text, x);
                return is_number && x >= low && x <= high
                           ? std::string()
                           : fmt::format("\"{}\" is no number from {:g} to {:g}", text, low, high);
            },
            range.get_description()};
}

} // namespace

void add_haptic(CLI::App& program, Session& session)
{
    const auto a = std::make_shared<HapticArguments>(); // lives as long as the callback
    CLI::App* command =
        program.add_subcommand("haptic", "Feel a scene by a device, or by a simulated hand");
    add_scene_arguments(*command, a->scene);
    command
        ->add_option("--device,-d", a->device, "simulated, recorded:FILE, udp:PORT or spacemouse")
        ->type_name("DEVICE")
        ->capture_default_str();
    command->add_option("--duration", a->duration, "How long (default: the scene's end) [s]")
        ->type_name("SECONDS")
        ->check(within(0.001, 3600));
    CLI::Option* virtual_time = command->add_flag("--virtual-time", a->virtual_time,
                                                  "Without a clock: the same ticks in every run");
    command->add_flag("--view", a->view, "Show the simulation in a window");
    command->add_option("--output,-o", a->output, "Folder for the trace, haptics.csv")
        ->type_name("DIR");
    command->add_option("--late", a->late, "Virtual time: share of ticks that come 3 ticks late")
        ->check(within(0, 0.5))
        ->needs(virtual_time);
    command
        ->add_option("--latency", a->latency,
                     "Virtual time: periods that a step of the simulation takes")
        ->check(CLI::Range(0, 20))
        ->needs(virtual_time);
    command->add_flag("--no-control", a->free, "Count the energy, but do not control it");
    command->add_option("--threads", a->threads, "Threads; the result is the same for any number")
        ->check(CLI::Range(1, 1024));
    command->add_option("--cache", a->cache, "Folder where factors of solids are kept")
        ->type_name("DIR");
    command->add_flag("--json", session.json, "One JSON object on stdout");
    command->callback([a, &session] { haptic(*a, session); });
}

} // namespace amontons
