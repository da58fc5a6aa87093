// amontons haptic SCENE --device D: a hand feels the scene at 1 kHz.

#include "haptics/link/handle_link.hpp"
#include "haptics/link/settings.hpp"
#include "haptics/session/hand_run.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/folder_lock.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/output/output_folder.hpp"
#include "solver/output/view_maker.hpp"
#include "solver/program/haptic_studio.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/live_results.hpp"
#include "solver/program/scene_arguments.hpp"
#include "solver/program/scene_lines.hpp"
#include "solver/program/session.hpp"
#include "solver/program/viewer.hpp"
#include "solver/scene/read.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <optional>
#include <unistd.h>

namespace amontons {
namespace {

struct HapticArguments {
    SceneArguments scene;
    HandRunOptions how;
    std::string output;
    bool view = false;
    bool free = false; ///< no passivity control
    // of the engine of amontons studio
    int frames = -1; ///< where frames are written
    std::string results;
};

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

/// Requests of the page, and what it shows, while the run lasts.
void connect_studio(HapticStudio& studio, HandRunHooks& hooks, const HandRun& run, bool by_clock)
{
    const auto resolved = std::make_shared<std::string>(); // empty: not made of the scene as it is
    hooks.changes = [&, resolved] {
        if (resolved->empty()) *resolved = resolved_scene(run.scene_now());
        std::vector<std::string> lines;
        for (const HapticStudio::Change& c : studio.take(*resolved))
            lines.push_back(c.path + "=" + c.value);
        return lines;
    };
    hooks.changed = [&studio, resolved](const std::string& line, const std::string& refusal,
                                        const HandleLink& link) {
        studio.report_change(line, link.time(), refusal);
        if (refusal.empty()) resolved->clear();
    };
    hooks.ticks = [&studio, by_clock, stiffness = run.settings().link.spring.stiffness](
                      std::span<const TickRecord> ticks, const HandleLink& link) {
        studio.report_health(ticks, link, stiffness, by_clock);
    };
    hooks.after_step = [&, frames = std::make_shared<std::optional<ViewMaker>>()](
                           const HandleLink& link, const std::vector<Obstacle>& obstacles,
                           bool remade) {
        if (!studio.frame_requested()) {
            if (remade) frames->reset();
            return;
        }
        const bool whole = studio.whole_requested();
        if (whole || remade || !*frames) frames->emplace(obstacles, contact_bodies(run.scene()));
        studio.send((*frames)->frame(link.time(), link.beam_records(), link.body_records(),
                                     link.contact_records()),
                    whole, link);
    };
}

void haptic(HapticArguments& a, Session& session)
{
    settle(a.scene);
    a.how.control = !a.free;
    a.how.watched = a.frames >= 0;
    const auto read = [file = a.scene.scene,
                       all = a.scene.overrides](std::vector<std::string> more) {
        more.insert(more.begin(), all.begin(), all.end());
        Scene changed = read_scene(file, more);
        place_introducers(changed);
        return changed;
    };
    HandRun run(read_scene(a.scene.scene, a.scene.overrides), a.how, read);
    const Scene& scene = run.scene();
    std::optional<FolderLock> lock;
    if (!a.results.empty()) a.output = make_numbered_folder(a.results + "-hand");
    if (!a.output.empty()) { // before the run, not after
        check_output_folder(a.output, scene);
        make_output(a.output);
        lock.emplace(a.output, "amontons haptic " + scene.file);
    }
    run.prepare([](const Scene& s) { return build_obstacles(s); });
    for (const std::string& w : run.warnings())
        session.print_line("warning: " + w);

    std::optional<Viewer> viewer;

    // ---- View and publication of operators
    if (a.view)
        viewer.emplace(scene.title.empty() ? "amontons" : scene.title, ::isatty(STDERR_FILENO));
    std::optional<ViewMaker> frames;
    SceneLines lines;
    HandRunHooks hooks;
    hooks.print_line = [&](const std::string& text) { session.print_line(text); };
    if (viewer) {
        hooks.changes = [&] { return lines.take(session); };
        hooks.after_step = [&](const HandleLink& link, const std::vector<Obstacle>& obstacles,
                               bool remade) {
            if (!frames || remade) frames.emplace(obstacles, contact_bodies(scene));
            if (viewer->frame_due())
                viewer->offer(frames->frame(link.time(), link.beam_records(), link.body_records(),
                                            link.contact_records()));
        };
    }
    std::atomic<bool>& stop = stop_on_interrupt();
    std::optional<HapticStudio> studio;
    if (a.frames >= 0) {
        session.quiet = true; // messages are sent to the page
        const HapticSettings& set = run.settings();
        studio.emplace(a.frames, session, stop, set.loop.period, 1 / set.link.condense.period);
        connect_studio(*studio, hooks, run, !a.how.virtual_time);
    }
    HapticOutcome out = run.run(hooks, stop);
    if (viewer) {
        const Viewer::Counts shown = viewer->close();
        out.shown = ShownFrames{shown.frames, shown.seconds};
    }
    if (!a.output.empty()) {
        out.output = a.output + "/haptics.csv";
        write_file(out.output, trace_csv(out.records), Flush::to_disk, Links::replace);
    }
    if (!out.message.empty()) {
        session.exit_code = kSolveFailed;
        session.error(out.message);
    }
    if (out.status == "interrupted") session.exit_code = kInterrupted;
    if (studio)
        studio->write_report_event(run.table(out));
    else if (session.json)
        session.print(run.json(out));
    else if (!session.quiet)
        session.print(run.table(out));
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
        ->add_option("--device,-d", a->how.device,
                     "simulated, recorded:FILE, udp:PORT or spacemouse")
        ->type_name("DEVICE")
        ->capture_default_str();
    command->add_option("--duration", a->how.duration, "How long (default: the scene's end) [s]")
        ->type_name("SECONDS")
        ->check(within(0.001, 3600));
    CLI::Option* virtual_time = command->add_flag("--virtual-time", a->how.virtual_time,
                                                  "Without a clock: the same ticks in every run");
    command->add_flag("--view", a->view, "Show the simulation in a window");
    command->add_option("--output,-o", a->output, "Folder for the trace, haptics.csv")
        ->type_name("DIR");
    command
        ->add_option("--late", a->how.late, "Virtual time: share of ticks that come 3 ticks late")
        ->check(within(0, 0.5))
        ->needs(virtual_time);
    command
        ->add_option("--latency", a->how.latency,
                     "Virtual time: periods that a step of the simulation takes")
        ->check(CLI::Range(0, 20))
        ->needs(virtual_time);
    command->add_flag("--no-control", a->free, "Count the energy, but do not control it");
    command
        ->add_option("--threads", a->how.threads, "Threads; the result is the same for any number")
        ->check(CLI::Range(1, 1024));
    command->add_option("--cache", a->how.cache, "Folder where factors of solids are kept")
        ->type_name("DIR");
    command->add_flag("--json", session.json, "One JSON object on stdout");
    // of amontons studio
    command->add_option("--frames", a->frames)->group("");
    command->add_option("--results", a->results)->group("");
    command->callback([a, &session] { haptic(*a, session); });
}

} // namespace amontons
