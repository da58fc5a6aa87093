// amontons run SCENE: the scene from its file to results, plots and a picture.

#include "mesh/base/file.hpp"
#include "mesh/base/memory.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/module.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/output/output_folder.hpp"
#include "solver/output/plot.hpp"
#include "solver/output/problem_recorder.hpp"
#include "solver/output/run_writer.hpp"
#include "solver/output/view_maker.hpp"
#include "solver/program/changed_simulation.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/progress.hpp"
#include "solver/program/render.hpp"
#include "solver/program/scene_arguments.hpp"
#include "solver/program/session.hpp"
#include "solver/program/viewer.hpp"
#include "solver/scene/read.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <span>
#include <unistd.h>

namespace amontons {
namespace {

struct RunArguments {
    SceneArguments scene;
    std::string output;
    int threads = 1;
    bool any_order = false; // for scripts: every result is the same for any number of threads
    bool resume = false;
    bool record = false;
    bool view = false;
    std::string cache;
};

/// The one observer of a run: the files and the progress, and the depth along centrelines.
struct Observers : StepObserver {
    int iterations = 0; ///< since this start
    RunWriter& writer;
    Progress& progress;
    const std::vector<DepthLine>& lines;
    const ProblemRecorder* recorder;             ///< or null
    std::function<void(const StepRecord&)> show; ///< or none
    Observers(RunWriter& w, Progress& p, const std::vector<DepthLine>& l, const ProblemRecorder* r)
        : writer(w)
        , progress(p)
        , lines(l)
        , recorder(r)
    {
    }
    void on_step(const StepRecord& record) override
    {
        if (!any_depth_line(lines)) {
            writer.on_step(record);
        } else {
            StepRecord more = record;
            add_centreline_depths(more, lines);
            writer.on_step(more);
        }
        iterations += record.iterations;
        if (recorder) recorder->write(record);
        if (show) show(record);
        progress.step(record);
    }
};

constexpr std::size_t kMostRows = 24; // of quantities; more are for history.csv

/// @param shown  of the quantities, from the first
std::string run_table(const RunSummary& s, std::size_t shown, const Scene& scene,
                      const std::string& directory, const std::vector<std::string>& files)
{
    std::string t;
    const auto row = [&](const char* name, const std::string& value) {
        t += fmt::format("  {:<22} {}\n", name, value);
    };
    t += fmt::format("{}: {} steps to t = {:.6g} s\n", s.status, s.steps, s.time);
    if (shown <= kMostRows)
        for (const Quantity& q : std::span(s.quantities).first(shown))
            row(q.name.c_str(), fmt::format("{:.6g} {}", q.value, q.unit));
    else
        row("quantities", fmt::format("{}, in history.csv", s.quantities.size()));
    for (const NamedText& text : s.texts)
        row(text.name.c_str(), text.value.empty() ? "none" : text.value);
    row("contacts", fmt::format("{} at most, {:.3g} on average", s.contacts_max, s.contacts_mean));
    row("worst certificate",
        fmt::format("error {:.2e}, penetration {:.2e} m, cone {:.2e} N, {} steps without",
                    s.worst_error, s.worst_penetration, s.worst_cone_violation,
                    s.uncertified_steps));
    const OverlapRecord& o = s.worst_overlap;
    row("worst overlap",
        o.depth > 0    ? fmt::format("{:.2e} m of {} and {} in step {}", o.depth, o.a, o.b, o.step)
        : o.depth == 0 ? "none"
                       : "not measured");
    for (const std::string& left_out : s.not_measured)
        row("", "not measured: " + left_out);
    constexpr std::size_t kMostPairs = 6;
    for (std::size_t i = 0; i < std::min(kMostPairs, s.undetermined.size()); ++i) {
        const UndeterminedForce& u = s.undetermined[i];
        row(i == 0 ? "undetermined" : "",
            fmt::format("{} force of {} and {}, normal force {:.4g} to {} N",
                        !u.normal      ? "tangential"
                        : u.tangential ? "all"
                                       : "normal",
                        u.a, u.b, u.min,
                        std::isfinite(u.max) ? fmt::format("{:.4g}", u.max) : "any"));
    }
    if (s.undetermined.size() > kMostPairs)
        row("",
            fmt::format("and {} more pairs, in manifest.json", s.undetermined.size() - kMostPairs));
    row("energy",
        fmt::format("work {:.4e} J = elastic {:+.4e} + kinetic {:+.4e} + friction {:.4e} + "
                    "released {:.4e} + error {:.1e}",
                    s.energy.work, s.energy.elastic - s.energy.elastic_start,
                    s.energy.kinetic - s.energy.kinetic_start, s.energy.friction, s.energy.released,
                    s.energy.error()));
    if (!s.linear.taken.empty())
        row("linear systems",
            fmt::format("{}, {}: {:.3g} s predicted, {:.3g} s taken", s.linear.taken, s.linear.why,
                        s.linear.predicted, s.linear.seconds));
    const PhaseSeconds& p = s.seconds;
    row("time",
        fmt::format("{:.3f} s: read {:.3f}, offline {:.3f}, free motion {:.3f}, detection {:.3f}, "
                    "compliance {:.3f}, contact {:.3f}, correction {:.3f}, output {:.3f}",
                    p.total, p.read, p.offline, p.free_motion, p.detection, p.compliance,
                    p.contact_solve, p.correction, p.output));
    row("files", directory + ":");
    for (const std::string& f : files)
        t += fmt::format("  {:<22} {}\n", "", f);
    return t;
}

/// The signal came before the run had touched its folder: what is there stays.
void note_interrupted_before(const std::string& directory, Session& session)
{
    RunSummary s;
    s.status = "interrupted";
    s.message = "before the run began: what is in " + directory + " is as it was";
    session.exit_code = exit_code(s);
    session.error(s.status + ": " + s.message);
    if (!session.json) return;
    JsonText json;
    json.open('{');
    write_summary(json, s, {}, {});
    session.print(json.member("output", directory).close('}').text() + "\n");
}

void run_scene(RunArguments& arguments, Session& session)
{
    const Stopwatch watch;
    ParallelRun parallel; // outlives the simulation
    if (parallel.served()) {
        session.quiet = true;
        return;
    }
    std::atomic<bool>& stop = stop_on_interrupt();
    if (arguments.record) check_recorder();
    settle(arguments.scene);
    Scene scene = read_scene(arguments.scene.scene, arguments.scene.overrides);
    if (arguments.record) check_recordable(scene);
    const std::vector<DepthLine> depth_lines = place_introducers(scene);

    // ---- Scene and simulation
    std::vector<Issue> odd;
    std::vector<Obstacle> obstacles = build_obstacles(scene, &odd);
    const double read_seconds = watch.seconds();
    const double read_memory = peak_memory_so_far();
    session.detail(fmt::format("read in {:.3f} s", read_seconds));
    const SimulationOptions how{arguments.cache, arguments.threads};
    std::unique_ptr<Simulation> made;
    if (arguments.view)
        made = std::make_unique<ChangedSimulation>(scene, arguments.scene.overrides,
                                                   std::move(obstacles), how, session);
    else
        made = make_simulation(scene, std::move(obstacles), how);
    Simulation& simulation = *made;
    for (const Issue& w : simulation.warnings())
        odd.push_back(w);
    session.warn(odd);
    const double offline_seconds = watch.seconds() - read_seconds;
    simulation.prepare(); // counts its own time
    const double bodies_memory = peak_memory_so_far();

    RunWriterOptions options;
    options.name = run_name(scene.file);
    options.directory = arguments.output.empty() ? "out/" + options.name : arguments.output;

    // ---- Files of the run
    options.command = session.arguments;
    for (const Issue& w : odd)
        options.warnings.push_back(InputError({w}).what());
    options.threads = arguments.threads;
    const std::string directory = options.directory;
    check_output_folder(directory, scene);
    options.resume = arguments.resume && !has_no_checkpoint_yet(directory);
    if (options.resume != arguments.resume)
        session.print_line("no step had been finished in " + directory + ": the run begins anew");
    if (stop && std::filesystem::exists(directory + "/manifest.json"))
        return note_interrupted_before(directory, session);
    std::vector<std::string> files{options.name + ".pvd", "contacts.pvd", "history.csv",
                                   "manifest.json"};

    std::optional<Viewer> viewer; // before anything is written
    if (arguments.view)
        viewer.emplace(scene.title.empty() ? options.name : scene.title, ::isatty(STDERR_FILENO));
    RunWriter writer(scene, simulation, options, stop);
    Progress progress(session, scene.time.end);
    std::optional<ProblemRecorder> recorder;
    if (arguments.record)
        recorder.emplace(simulation, scene, directory + "/record", options.resume);
    Observers observers(writer, progress, depth_lines, recorder ? &*recorder : nullptr);
    ViewMaker frames(simulation.obstacles(), contact_bodies(scene));
    if (viewer) {
        observers.show = [&](const StepRecord& r) {
            if (r.time < scene.time.end && !viewer->frame_due()) return;
            viewer->offer(frames.frame(r.time, r.beams, simulation.body_records(), r.contacts));
        };
    }

    // ---- The run and its summary
    RunSummary summary = simulation.run(observers, stop);
    progress.end();
    for (const std::string& m : simulation.messages())
        session.detail(m);
    for (const Obstacle& o : simulation.obstacles())
        for (const std::string& m : o.model.wall.keep())
            session.detail(m);
    if (const LinearPlan linear = simulation.linear_plan(); !linear.taken.empty()) {
        const LinearPath* const path = linear.path(linear.taken);
        summary.linear.taken = linear.taken;
        summary.linear.why = linear.why;
        summary.linear.predicted = path ? path->seconds : 0;
        const PhaseSeconds& t = summary.seconds;
        summary.linear.seconds = t.offline + offline_seconds + t.free_motion + t.compliance +
                                 t.contact_solve + t.correction;
    }
    summary.memory.read = read_memory;
    summary.memory.bodies = bodies_memory;
    summary.memory.offline = std::max(summary.memory.offline, bodies_memory);
    summary.memory.steps = peak_memory_so_far();
    summary.memory.all_ranks = parallel_peak_memory();
    summary.seconds.read += read_seconds;
    summary.seconds.offline += offline_seconds;
    summary.seconds.total = watch.seconds();
    const std::size_t reported = summary.quantities.size(); // by the bodies; columns come after
    writer.finish(summary);
    summary.seconds.total = watch.seconds();
    session.exit_code = exit_code(summary);

    std::vector<std::string> pictures;

    // ---- Plots and pictures
    if (scene.output.plots && !was_interrupted()) {
        std::string message;
        pictures = plot_history(directory, message);
        if (!message.empty()) session.print_line(message);
    }
    if (scene.output.picture && !was_interrupted()) {
        const std::string picture = options.name + ".png";
        drop_link(directory + "/" + picture);
        const std::string message = render_in_child(directory, directory + "/" + picture);
        if (message.empty())
            pictures.push_back(picture);
        else
            session.print_line("no picture: " + message);
    }
    if (!pictures.empty()) writer.add_files(pictures, summary);
    files.insert(files.end(), pictures.begin(), pictures.end());

    Viewer::Counts shown;
    if (viewer) shown = viewer->close();

    // ---- Messages
    for (const std::string& w : summary.warnings)
        session.print_line("warning: " + w);
    if (summary.status != "done") session.error(summary.status + ": " + summary.message);
    if (session.json) {
        JsonText json;
        json.open('{');
        write_summary(json, summary, mapped_modules(), options.warnings);
        std::int64_t unknowns = 0;
        for (const BodyPlan& b : simulation.plan())
            unknowns += b.unknowns;
        json.member("unknowns", unknowns).member("iterations", observers.iterations);
        if (viewer) {
            json.key("view").open('{');
            json.member("frames", shown.frames).member("seconds", shown.seconds).close('}');
        }
        json.member("output", directory).close('}');
        session.print(json.text() + "\n");
    } else if (!session.quiet) {
        session.print(run_table(summary, reported, scene, directory, files));
    }
}

} // namespace

void add_run(CLI::App& program, Session& session)
{
    const auto arguments = std::make_shared<RunArguments>(); // lives as long as the callback
    CLI::App* command = program.add_subcommand("run", "Run a scene");
    add_scene_arguments(*command, arguments->scene);
    command
        ->add_option("--output,-o", arguments->output, "Folder for the results (default: out/NAME)")
        ->type_name("DIR");
    command
        ->add_option("--threads", arguments->threads,
                     "Threads; the result is the same for any number")
        ->check(CLI::Range(1, 1024));
    command->add_flag("--any-order", arguments->any_order,
                      "Allows sums in any order of the threads; no sum makes use of it so far");
    command
        ->add_option(
            "--cache", arguments->cache,
            "Folder where factors of solids and samples of walls are kept for the next run")
        ->type_name("DIR");
    command->add_flag("--view", arguments->view, "Show the run in a window while it lasts");
    command->add_flag("--resume", arguments->resume, "Continue from the folder's checkpoint");
    command->add_flag("--record", arguments->record,
                      "Keep every step's contact problem as an FCLib file, in DIR/record");
    command->add_flag("--json", session.json, "One JSON object on stdout");
    command->callback([arguments, &session] { run_scene(*arguments, session); });
}

} // namespace amontons
