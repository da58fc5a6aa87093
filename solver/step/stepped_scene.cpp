#include "solver/step/stepped_scene.hpp"

#include "mesh/base/file.hpp"
#include "solver/record/contact_bodies.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/plan.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fmt/format.h>

namespace amontons {
namespace {

/// A scene of the walls alone.
Scene walls_of(const Scene& scene)
{
    Scene only;
    only.file = scene.file;
    only.obstacles = scene.obstacles;
    for (const ObstacleInput& o : scene.obstacles)
        only.order.push_back(o.name);
    return only;
}

/// Fingerprint of what gives a state its meaning.
std::uint64_t state_fingerprint(Scene scene, FileHashes& files)
{
    scene.title.clear();
    scene.output = {};
    scene.time.end = 0;
    return fingerprint(scene, files);
}

constexpr char kStateMark[8] = {'a', 'm', 'o', 'n', 's', 't', '0', '3'};

/// What stands before the bytes of a state.
struct StateHead {
    char mark[8];
    std::uint64_t hash; // of all behind it
    std::uint64_t scene, record_size;
};
constexpr std::size_t kHashed = offsetof(StateHead, scene);

} // namespace

std::vector<Obstacle> SharedWalls::of(const Scene& scene, std::vector<Issue>& warnings,
                                      FileHashes& files)
{
    const std::lock_guard lock(mutex_);
    if (!made_) {
        warnings_.clear();
        files_.clear();
        fingerprint(walls_of(scene), files_);
        made_ = build_obstacles(scene, &warnings_);
    }
    warnings = warnings_;
    files.insert(files_.begin(), files_.end());
    std::vector<Obstacle> all;
    for (const Obstacle& o : *made_)
        all.push_back(o.share());
    return all;
}

SharedScene read_scene_text(std::string text, std::string file, std::vector<std::string> overrides)
{
    auto read = std::make_shared<SceneText>();
    read->scene = parse_scene(text, file, overrides);
    read->walls = std::make_shared<SharedWalls>();
    read->text = std::move(text);
    read->file = std::move(file);
    read->overrides = std::move(overrides);
    return read;
}

SharedScene change_scene(const SceneText& from, const std::vector<std::string>& more)
{
    std::vector<std::string> all = from.overrides;
    all.insert(all.end(), more.begin(), more.end());
    const auto next =
        std::const_pointer_cast<SceneText>(read_scene_text(from.text, from.file, std::move(all)));
    if (resolved_scene(walls_of(next->scene)) == resolved_scene(walls_of(from.scene)))
        next->walls = from.walls;
    return next;
}

std::string check_scene(const SceneText& from)
{
    Scene scene = from.scene;
    place_introducers(scene);
    std::vector<Issue> warnings;
    FileHashes files;
    std::vector<Obstacle> obstacles = from.walls->of(scene, warnings, files);
    SimulationOptions how;
    how.refuse = false;
    const std::unique_ptr<Simulation> simulation =
        make_simulation(scene, std::move(obstacles), how);
    return plan_json(
        make_plan(scene, simulation->plan(), simulation->obstacles(), simulation->linear_plan()));
}

SteppedScene::SteppedScene(SharedScene scene, const SimulationOptions& options) : options_(options)
{
    make(scene);
    scene_ = std::move(scene);
    bodies_ = std::make_shared<const std::vector<std::string>>(contact_bodies(scene_->scene).names);
}

void SteppedScene::make(const SharedScene& from)
{
    Scene scene = from->scene;
    std::vector<DepthLine> lines = place_introducers(scene);
    std::vector<Issue> warnings;
    FileHashes files;
    std::vector<Obstacle> obstacles = from->walls->of(scene, warnings, files);
    const std::uint64_t print = state_fingerprint(from->scene, files);
    auto made = make_simulation(scene, std::move(obstacles), options_);
    for (const Issue& w : made->warnings())
        warnings.push_back(w);
    simulation_ = std::move(made);
    fingerprint_ = print;
    lines_ = std::move(lines);
    warnings_ = std::move(warnings);
}

StepResult SteppedScene::step(const std::atomic<bool>& stop, double not_beyond)
{
    StepResult result = simulation_->step(stop, not_beyond);
    last_ = {result.outcome, result.message, {}};
    if (result.outcome == StepResult::Outcome::accepted) {
        if (any_depth_line(lines_)) add_centreline_depths(result.record, lines_);
        record_ =
            std::make_shared<const ReportedStep>(ReportedStep{std::move(result.record), bodies_});
    }
    return last_;
}

void SteppedScene::check_until(double until) const
{
    const auto refuse = [&](std::string allowed) {
        throw InputError({{"", "until", fmt::format("{}", until), std::move(allowed)}});
    };
    if (!std::isfinite(until)) refuse("a finite time [s]");
    if (until > end() * (1 + 1e-12))
        refuse(fmt::format("at most the scene's end, time.end = {} [s]", end()));
    if (until < time() * (1 - 1e-12))
        refuse(fmt::format("not before the time that is reached, {} [s]", time()));
}

RunSummary SteppedScene::conclude()
{
    StepResult last = last_;
    if (last.outcome == StepResult::Outcome::accepted)
        last.outcome = done() ? StepResult::Outcome::done : StepResult::Outcome::interrupted;
    return simulation_->conclude(last);
}

SteppedScene SteppedScene::changed(const std::vector<std::string>& overrides) const
{
    SteppedScene next(change_scene(*scene_, overrides), options_);
    next.simulation_->take_over(*simulation_);
    next.record_ = record_;
    next.last_ = last_;
    return next;
}

void SteppedScene::change(const std::vector<std::string>& overrides)
{
    *this = changed(overrides);
}

std::string SteppedScene::save() const
{
    const std::vector<std::byte> last_record =
                                     record_ ? bytes_of(record_->step) : std::vector<std::byte>{},
                                 state = simulation_->save();
    StateHead head{{}, 0, fingerprint_, last_record.size()};
    std::memcpy(head.mark, kStateMark, sizeof kStateMark);
    std::string all;
    all.reserve(sizeof head + last_record.size() + state.size());
    all.append(reinterpret_cast<const char*>(&head), sizeof head);
    all.append(reinterpret_cast<const char*>(last_record.data()), last_record.size());
    all.append(reinterpret_cast<const char*>(state.data()), state.size());
    head.hash = hash_bytes(std::string_view(all).substr(kHashed));
    std::memcpy(all.data() + offsetof(StateHead, hash), &head.hash, sizeof head.hash);
    return all;
}

void SteppedScene::restore(std::string_view text)
{
    const auto refuse = [](const char* found, const char* allowed = "what save gave") {
        throw InputError({{"", "state", found, allowed}});
    };
    StateHead head;
    if (text.size() < sizeof head || std::memcmp(text.data(), kStateMark, sizeof kStateMark) != 0)
        refuse("other bytes");
    std::memcpy(&head, text.data(), sizeof head);
    if (head.hash != hash_bytes(text.substr(kHashed)))
        refuse("bytes that were changed or are missing");
    if (head.scene != fingerprint_)
        refuse("the state of another scene",
               "a state of this scene with the same values and files; title, output and time.end "
               "may differ");
    if (head.record_size > text.size() - sizeof head) refuse("bytes that end early");
    const auto* first = reinterpret_cast<const std::byte*>(text.data()) + sizeof head;
    Record record;
    if (head.record_size > 0)
        record = std::make_shared<const ReportedStep>(
            ReportedStep{record_from({first, first + head.record_size}), bodies_});
    simulation_->restore(
        {first + head.record_size, reinterpret_cast<const std::byte*>(text.data()) + text.size()});
    record_ = std::move(record);
    last_ = {};
    if (record_) last_.outcome = StepResult::Outcome::accepted;
}

void SteppedScene::reset()
{
    *this = SteppedScene(scene_, options_);
}

void SteppedScene::follow(const SteppedScene& other)
{
    simulation_->restore(other.simulation_->save());
    record_ = other.record_;
    last_ = other.last_;
}

void SteppedScene::close()
{
    simulation_.reset();
    record_.reset();
}

} // namespace amontons
