// amontons haptic SCENE --device D: a hand feels the scene at 1 kHz.

#include "haptics/link/handle_link.hpp"
#include "haptics/session/hand_run.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/folder_lock.hpp"
#include "solver/output/output_folder.hpp"
#include "solver/output/view_maker.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/scene_arguments.hpp"
#include "solver/program/scene_lines.hpp"
#include "solver/program/session.hpp"
#include "solver/program/viewer.hpp"
#include "solver/scene/build.hpp"
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

void haptic(HapticArguments& a, Session& session)
{
    settle(a.scene);
    a.how.control = !a.free;
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
    if (!a.output.empty()) { // before the run, not after
        check_output_folder(a.output, scene);
        make_output(a.output);
        lock.emplace(a.output, "amontons haptic " + scene.file);
    }
    run.prepare([](const Scene& s) { return build_obstacles(s); });
    for (const std::string& w : run.warnings())
        session.say("warning: " + w);

    std::optional<Viewer> viewer;
    if (a.view)
        viewer.emplace(scene.title.empty() ? "amontons" : scene.title, ::isatty(STDERR_FILENO));
    std::optional<ViewMaker> frames;
    SceneLines lines;
    HandRunHooks hooks;
    hooks.say = [&](const std::string& text) { session.say(text); };
    if (viewer) {
        hooks.changes = [&] { return lines.take(session); };
        hooks.after_step = [&](const HandleLink& link, const std::vector<Obstacle>& obstacles,
                               bool remade) {
            if (!frames || remade) frames.emplace(obstacles, contact_bodies(scene));
            if (viewer->wants())
                viewer->offer(frames->frame(link.time(), link.beam_records(), link.body_records(),
                                            link.contact_records()));
        };
    }
    HapticOutcome out = run.run(hooks, stop_on_interrupt());
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
    if (session.json)
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
    command->callback([a, &session] { haptic(*a, session); });
}

} // namespace amontons
