#include "solver/output/run_writer.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/folder_lock.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/module.hpp"
#include "solver/output/beam_tube.hpp"
#include "solver/output/frame_bytes.hpp"
#include "solver/scene/fingerprint.hpp"
#include "solver/scene/read.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <optional>
#include <unistd.h>
#include <utility>

namespace fs = std::filesystem;

namespace amontons {
namespace {

constexpr int kCorners = 10;           // of the rings of a wire's surface
constexpr double kProgressPause = 0.1; // between two checkpoints of a running run [s]
constexpr double kPatience = 20;       // what is written again and again takes 1/20 of the time
constexpr double kManifestPause = 1;   // between two manifests of a running run [s]

const char* const kContacts = "contacts";

std::string frame_file(const std::string& part, std::int64_t step, const char* suffix = ".vtp")
{
    return fmt::format("frames/{}.{:06}{}", part, step, suffix);
}

/// The files of a frame: names of the parts, and of their files.
std::vector<std::pair<std::string, std::string>> frame_files(const Scene& scene, std::int64_t step)
{
    std::vector<std::pair<std::string, std::string>> files;
    for (const BeamInput& b : scene.beams) {
        files.emplace_back(b.name, frame_file(b.name, step));
        files.emplace_back(b.name + "_surface", frame_file(b.name + ".tube", step));
    }
    for (const RodInput& b : scene.rods) {
        files.emplace_back(b.name, frame_file(b.name, step));
        files.emplace_back(b.name + "_surface", frame_file(b.name + ".tube", step));
    }
    for (const SolidInput& b : scene.solids)
        files.emplace_back(b.name, frame_file(b.name, step, ".vtu"));
    for (const RigidInput& b : scene.rigids)
        files.emplace_back(b.name, frame_file(b.name, step));
    files.emplace_back(kContacts, frame_file(kContacts, step));
    return files;
}

/// True of a file that a run of this scene has written into frames/.
bool is_frame_file(const std::string& file, const std::vector<std::string>& parts)
{
    for (const std::string& part : parts) {
        if (file == part + ".start.vtp" || file == part + ".end.vtp") return true;
        if (file.size() <= part.size() + 5 || file.compare(0, part.size() + 1, part + ".") != 0 ||
            !(file.ends_with(".vtp") || file.ends_with(".vtu")))
            continue;
        const std::string digits = file.substr(part.size() + 1, file.size() - part.size() - 5);
        if (!digits.empty() && digits.find_first_not_of("0123456789") == std::string::npos)
            return true;
    }
    return false;
}

/// Takes away what write_file or a run that begins had begun when a run was killed.
void remove_unfinished(const fs::path& folder)
{
    std::vector<fs::path> unfinished;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (name.front() != '.' || !name.ends_with(".tmp")) continue;
        for (const char* ours :
             {".vtp.", ".vtu.", ".pvd.", ".checkpoint.", ".manifest.json.", ".history.csv."})
            if (name.find(ours) != std::string::npos) {
                unfinished.push_back(entry->path());
                break;
            }
    }
    for (const fs::path& file : unfinished)
        fs::remove(file, error);
}

} // namespace

std::uint64_t hash_of_run(const Scene& scene, const std::vector<Obstacle>& obstacles)
{
    Scene decisive = scene;
    decisive.title.clear();
    decisive.output.picture = decisive.output.plots = false;
    std::string bytes;
    const auto add = [&](std::uint64_t hash) {
        bytes.append(reinterpret_cast<const char*>(&hash), sizeof hash);
    };
    const auto hash_of = [](const auto& items) {
        using Item = typename std::decay_t<decltype(items)>::value_type;
        return hash_bytes(
            {reinterpret_cast<const char*>(items.data()), items.size() * sizeof(Item)});
    };
    FileHashes files;
    add(fingerprint(decisive, files));
    for (const Obstacle& o : obstacles) {
        add(hash_of(o.model.surface->points));
        add(hash_of(o.model.surface->triangles));
    }
    return hash_bytes(bytes);
}

std::string run_name(const std::string& scene_file)
{
    std::error_code error;
    const fs::path file = fs::absolute(scene_file, error);
    std::string name = file.stem().string();
    if (name == "scene") name = file.parent_path().filename().string();
    if (name.empty() || name == "/" || name == kContacts) name = "run";
    for (char& c : name) // it becomes part of an XML attribute and of file names
        if (c == '"' || c == '<' || c == '>' || c == '&' || static_cast<unsigned char>(c) < 0x20)
            c = '_';
    return name;
}

struct RunWriter::State {
    State(const Scene& s, Simulation& sim, RunWriterOptions o, std::atomic<bool>& stop_flag)
        : scene(s)
        , simulation(sim)
        , options(std::move(o))
        , stop(stop_flag)
    {
    }

    std::string path(const std::string& file) const { return options.directory + "/" + file; }
    void write(const std::string& file, std::string_view bytes)
    {
        // A killed process loses nothing.
        write_file(staged_at(file), bytes, Flush::to_system, Links::replace);
    }
    /// While a run begins, its files stand beside their places: what was there is whole until all
    /// that can fail has been done.
    std::string staged_at(const std::string& file);
    void put_in_place();
    void begin();
    void make_directory();
    void take_lock();
    void remove_old_files();
    void resume();
    void add_to_collections(const Checkpoint::Frame& frame, bool last);
    void write_collections();
    void write_frame(const StepRecord& record);
    void write_obstacles(const char* suffix, double time, bool with_forces);
    void write_checkpoint();
    void write_progress();
    void write_manifest(const RunSummary& summary);
    void remove_extra_frame();
    template <class Action> void attempt(Action&& action);

    const Scene& scene;
    Simulation& simulation;
    RunWriterOptions options;
    std::atomic<bool>& stop;
    ManifestInput manifest;
    std::optional<FolderLock> lock;
    bool staging = false;
    std::vector<std::string> staged; ///< files, as path() takes them
    History history;
    Collection collection, contacts;
    std::vector<Checkpoint::Frame> frames;
    bool stale_collections = false;               ///< those on the disk do not name all frames yet
    std::optional<Checkpoint::Frame> extra_frame; ///< stands there only because a run ended with it
    StepRecord last;                              ///< the last step
    bool has_last = false;
    TubeSurface tube;
    ContactBodies bodies = contact_bodies(scene);
    RunSummary so_far; ///< for the manifest of a running run
    Stopwatch since_manifest, since_progress;
    double progress_cost = 0; ///< of the last write_progress [s]
    double seconds = 0;       ///< spent in here
    std::string failure;      ///< why something could not be written, "" if all could
};

void RunWriter::State::make_directory()
{
    const auto refuse = [&](const std::string& found) {
        throw InputError(
            {{options.directory, "", found, "a folder that can be made and written to"}});
    };
    const auto writable = [&](const std::string& folder) {
        try {
            make_folder(folder);
        } catch (const WriteError& error) {
            refuse(error.what());
        }
        if (::access(folder.c_str(), W_OK | X_OK) != 0)
            refuse("a folder that may not be written to");
    };
    writable(options.directory);
    take_lock();
    drop_link(path("frames"));
    writable(path("frames"));
}

void RunWriter::State::take_lock()
{
    std::string who = "amontons run";
    if (!scene.file.empty()) who += " " + scene.file;
    try {
        lock.emplace(options.directory, who);
    } catch (const WriteError& error) {
        throw InputError(
            {{options.directory, "", error.what(), "a folder that can be made and written to"}});
    }
}

std::string RunWriter::State::staged_at(const std::string& file)
{
    if (!staging) return path(file);
    if (std::find(staged.begin(), staged.end(), file) == staged.end()) staged.push_back(file);
    const fs::path place = path(file);
    return (place.parent_path() / ("." + place.filename().string() + ".new.tmp")).string();
}

void RunWriter::State::put_in_place()
{
    for (const std::string& file : staged)
        if (const std::string from = staged_at(file);
            ::rename(from.c_str(), path(file).c_str()) != 0)
            throw WriteError(path(file), std::strerror(errno));
    staging = false;
}

/// Of a new run. What was there passes when all that the run begins with is on the disk.
void RunWriter::State::begin()
{
    staging = true;
    try {
        history.start(path("history.csv"), staged_at("history.csv"));
        write_obstacles("start", 0, false);
        write_manifest(so_far);
    } catch (...) {
        for (const std::string& file : staged)
            ::unlink(staged_at(file).c_str());
        throw;
    }
    remove_old_files();
    put_in_place();
}

void RunWriter::State::remove_old_files()
{
    std::vector<std::string> parts{kContacts};
    for (const ObstacleInput& o : scene.obstacles)
        parts.push_back(o.name);
    for (const BeamInput& b : scene.beams) {
        parts.push_back(b.name);
        parts.push_back(b.name + ".tube");
    }
    for (const RodInput& b : scene.rods) {
        parts.push_back(b.name);
        parts.push_back(b.name + ".tube");
    }
    for (const SolidInput& b : scene.solids)
        parts.push_back(b.name);
    for (const RigidInput& b : scene.rigids)
        parts.push_back(b.name);
    std::error_code error;
    fs::remove(path("checkpoint"),
               error); // first: it must never outlive the run that it belongs to
    fs::remove(path(options.name + ".pvd"), error);
    fs::remove(path("contacts.pvd"), error);
    std::vector<fs::path> old;
    for (fs::directory_iterator entry(path("frames"), error), end; !error && entry != end;
         entry.increment(error))
        if (is_frame_file(entry->path().filename().string(), parts)) old.push_back(entry->path());
    // A collection of a run by another name that loses frames is none any more.
    std::vector<fs::path> bare;
    for (fs::directory_iterator entry(options.directory, error), end; !error && entry != end;
         entry.increment(error)) {
        if (entry->path().extension() != ".pvd") continue;
        const std::string text = read_file(entry->path().string());
        if (std::ranges::any_of(old, [&](const fs::path& frame) {
                return text.find("frames/" + frame.filename().string()) != std::string::npos;
            }))
            bare.push_back(entry->path());
    }
    for (const fs::path& file : bare)
        fs::remove(file, error);
    for (const fs::path& file : old)
        fs::remove(file, error);
}

void RunWriter::State::resume()
{
    std::error_code error;
    if (fs::is_symlink(path("frames"), error))
        throw InputError({{path("frames"), "", "a link", "the files as the run left them"}});
    const std::string file = path("checkpoint");
    const Checkpoint checkpoint = read_checkpoint(read_file(file), file);
    if (checkpoint.scene_hash != manifest.scene_hash)
        throw InputError(
            {{file, "", "the state of another scene",
              "a checkpoint of " + scene.file + " as it is now, with the same --set"}});
    for (const Checkpoint::Frame& frame : checkpoint.frames)
        for (const auto& part : frame_files(scene, frame.step))
            if (const std::string name = path(part.second); !fs::exists(name))
                throw InputError({{name, "", "no such file", "the files as the run left them"}});
    history.resume(path("history.csv"), checkpoint.history_bytes, checkpoint.history_hash);
    simulation.restore(checkpoint.state);
    frames = checkpoint.frames;
    if (!frames.empty() && frames.back().step % scene.output.every != 0) {
        extra_frame = frames.back();
        frames.pop_back();
    }
    so_far.steps = static_cast<int>(checkpoint.step);
    so_far.time = checkpoint.time;
    for (const Checkpoint::Frame& frame : frames)
        add_to_collections(frame, false);
}

void RunWriter::State::add_to_collections(const Checkpoint::Frame& frame, bool is_last)
{
    int part = 0;
    for (const auto& [name, file] : frame_files(scene, frame.step))
        collection.add({frame.time, part++, name, file});
    contacts.add({frame.time, 0, kContacts, frame_file(kContacts, frame.step)});
    // A reader takes only what stands at the time it shows, so the walls stand at each time.
    for (const ObstacleInput& o : scene.obstacles)
        collection.add({frame.time, part++, o.name,
                        fmt::format("frames/{}.{}.vtp", o.name, is_last ? "end" : "start")});
}

void RunWriter::State::write_collections()
{
    write(options.name + ".pvd", collection.bytes());
    write("contacts.pvd", contacts.bytes());
    stale_collections = false;
}

void RunWriter::State::write_frame(const StepRecord& r)
{
    for (const BeamRecord& beam : r.beams) {
        write(frame_file(beam.name, r.step), beam_bytes(beam, r.time));
        make_tube_surface(beam, kCorners, tube);
        write(frame_file(beam.name + ".tube", r.step), tube_bytes(tube, r.time));
    }
    for (const BodyRecord& body : simulation.body_records())
        write(frame_file(body.name, r.step, body.elements ? ".vtu" : ".vtp"),
              body_bytes(body, r.time));
    write(frame_file(kContacts, r.step), contacts_bytes(r, bodies));
    frames.push_back({r.step, r.time});
    add_to_collections(frames.back(), false);
    stale_collections = true;
}

void RunWriter::State::write_obstacles(const char* suffix, double time, bool with_forces)
{
    const std::vector<Obstacle>& obstacles = simulation.obstacles();
    for (std::size_t i = 0; i < obstacles.size(); ++i) {
        const SurfaceMesh& surface = *obstacles[i].model.surface;
        std::vector<double> force = simulation.max_contact_force(i);
        if (!with_forces) std::ranges::fill(force, 0.0);
        PolyData data;
        data.points = surface.points;
        data.triangles = surface.triangles;
        if (!force.empty()) data.point_arrays = {{"max_contact_force", "N", 1, force}};
        write(fmt::format("frames/{}.{}.vtp", obstacles[i].name, suffix), vtp_bytes(data, time));
    }
}

void RunWriter::State::write_checkpoint()
{
    Checkpoint c;
    c.scene_hash = manifest.scene_hash;
    c.step = so_far.steps;
    c.time = so_far.time;
    c.history_bytes = history.bytes();
    c.history_hash = history.hash();
    c.frames = frames;
    c.state = simulation.save();
    write("checkpoint", checkpoint_bytes(c));
    if (!std::exchange(manifest.checkpoint, true))
        write_manifest(so_far); // it specifies that there is one
}

/// What a reader or a resumed run needs besides the frames. It replaces files, which some file
/// systems make slow, so it waits where that would cost more than its share of the time.
void RunWriter::State::write_progress()
{
    const Stopwatch watch;
    if (stale_collections) write_collections();
    write_checkpoint();
    remove_extra_frame();
    progress_cost = watch.seconds();
    since_progress = {};
}

void RunWriter::State::write_manifest(const RunSummary& summary)
{
    manifest.modules = mapped_modules();
    write("manifest.json", manifest_bytes(manifest, summary));
    since_manifest = {};
}

/// A run that continues leaves the frames of a run that was never interrupted. The frame is removed
/// only when a checkpoint that does not name it is on the disk.
void RunWriter::State::remove_extra_frame()
{
    if (!extra_frame) return;
    std::error_code ignored; // a file that stays is named by no collection
    for (const auto& part : frame_files(scene, extra_frame->step))
        fs::remove(path(part.second), ignored);
    extra_frame.reset();
}

template <class Action> void RunWriter::State::attempt(Action&& action)
{
    const PhaseTimer timer(seconds);
    try {
        action();
    } catch (const WriteError& error) {
        if (failure.empty()) failure = error.what();
        stop = true;
    }
}

RunWriter::RunWriter(const Scene& scene, Simulation& simulation, RunWriterOptions options,
                     std::atomic<bool>& stop)
    : state_(std::make_unique<State>(scene, simulation, std::move(options), stop))
{
    State& s = *state_;
    const PhaseTimer timer(s.seconds);
    s.manifest.scene_file = scene.file;
    s.manifest.scene_hash = hash_of_run(scene, simulation.obstacles());
    s.manifest.resolved_scene = resolved_scene(scene);
    s.manifest.command = s.options.command;
    s.manifest.warnings = s.options.warnings;
    s.manifest.threads = s.options.threads;
    s.manifest.resumed = s.options.resume;
    s.manifest.started = now_utc();
    s.manifest.files = {s.options.name + ".pvd", "contacts.pvd", "history.csv"};
    if (s.options.resume) {
        if (!fs::is_directory(s.options.directory))
            throw InputError({{s.options.directory, "", "no such folder",
                               "the folder of the run that --resume continues with"}});
        s.take_lock();
        s.resume();
        s.manifest.checkpoint = true;
    } else {
        s.make_directory();
    }
    remove_unfinished(s.options.directory);
    remove_unfinished(s.path("frames"));
    if (s.options.resume)
        s.write_manifest(s.so_far);
    else
        s.begin();
}

bool has_no_checkpoint_yet(const std::string& directory)
{
    std::error_code error;
    if (fs::exists(directory + "/checkpoint", error)) return false;
    const std::string file = directory + "/manifest.json";
    if (!fs::is_regular_file(file, error)) return false;
    // As manifest_bytes has it; in a text its quotes would be escaped.
    return read_file(file).find("\n  \"checkpoint\": false") != std::string::npos;
}

RunWriter::~RunWriter() = default;

void RunWriter::on_step(const StepRecord& record)
{
    State& s = *state_;
    if (!s.failure.empty()) return;
    s.attempt([&] {
        s.last = record;
        s.has_last = true;
        s.so_far.steps = record.step;
        s.so_far.time = record.time;
        s.so_far.energy = record.energy;
        s.so_far.contacts_max =
            std::max(s.so_far.contacts_max, static_cast<int>(record.contacts.size()));
        s.so_far.worst_error = std::max(s.so_far.worst_error, record.certificate.error);
        s.history.append(record);
        if (record.step % s.scene.output.every != 0) return;
        s.write_frame(record);
        const double pause = std::max(kProgressPause, kPatience * s.progress_cost);
        if (s.progress_cost == 0 || s.since_progress.seconds() >= pause) s.write_progress();
        if (s.since_manifest.seconds() > kManifestPause) s.write_manifest(s.so_far);
    });
}

void RunWriter::finish(RunSummary& summary)
{
    State& s = *state_;
    const bool complete = s.failure.empty();
    if (complete) {
        s.attempt([&] {
            if (!s.has_last) { // nothing was left to do
                if (s.extra_frame) s.frames.push_back(*s.extra_frame);
                return;
            }
            if (s.frames.empty() || s.frames.back().step != s.last.step) s.write_frame(s.last);
            s.write_progress();
        });
    }
    s.attempt([&] {
        if (s.frames.empty()) return;
        s.write_obstacles("end", s.frames.back().time, true);
        s.collection = {};
        s.contacts = {};
        for (const Checkpoint::Frame& f : s.frames)
            s.add_to_collections(f, &f == &s.frames.back());
        s.write_collections();
    });
    if (!s.failure.empty()) {
        summary.message = s.failure + (summary.status == "failed" ? "; " + summary.message : "");
        summary.status = "failed";
    }
    summary.seconds.output = s.seconds;
    summary.extremes = s.history.extremes();
    // Every quantity of a step is one of the run, by its last value.
    for (const Quantity& q : s.history.last())
        if (std::ranges::find(summary.quantities, q.name, &Quantity::name) ==
            summary.quantities.end())
            summary.quantities.push_back(q);
    s.attempt([&] { s.write_manifest(summary); });
    summary.seconds.output = s.seconds;
}

void RunWriter::add_files(const std::vector<std::string>& files, const RunSummary& summary)
{
    State& s = *state_;
    s.manifest.files.insert(s.manifest.files.end(), files.begin(), files.end());
    s.attempt([&] { s.write_manifest(summary); });
}

} // namespace amontons
