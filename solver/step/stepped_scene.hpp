#pragma once

#include "solver/obstacle/build.hpp"
#include "solver/scene/fingerprint.hpp"
#include "solver/step/simulation.hpp"

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// A scene that a caller advances, changes between two steps, saves and restores: the basis of the
// package of Python and of `amontons serve`.

namespace amontons {

/// The obstacles of a scene, made once for all its simulations: reading a vessel and filling its
/// field costs more than all else of making one. Safe for several threads.
class SharedWalls {
public:
    /// Shares of them, for one simulation. @throws InputError
    /// @param files  gets the hashes of the files that they were made of
    std::vector<Obstacle> of(const Scene& scene, std::vector<Issue>& warnings, FileHashes& files);

private:
    std::mutex mutex_;
    std::optional<std::vector<Obstacle>> made_;
    FileHashes files_;
    std::vector<Issue> warnings_;
};

/// A checked scene with the text that it was read from: what change_scene() reads again.
struct SceneText {
    /// Text of the scene, and its file for messages.
    std::string text, file;
    std::vector<std::string> overrides; ///< "PATH=VALUE"
    Scene scene;
    std::shared_ptr<SharedWalls> walls; ///< of all scenes that have the same obstacles
};
using SharedScene = std::shared_ptr<const SceneText>;

/// @param file  as the user wrote it: it stands in messages, and the scene's own files lie beside
/// it
/// @throws InputError
SharedScene read_scene_text(std::string text, std::string file, std::vector<std::string> overrides);
/// With more overrides; its walls are shared where they are the same. @throws InputError
SharedScene change_scene(const SceneText& from, const std::vector<std::string>& more);
/// The JSON of `amontons check --json`: bodies are made, nothing is run. @throws InputError
std::string check_scene(const SceneText& scene);

/// A step's record with the names of its bodies: never changed, shared by all views of it.
struct ReportedStep {
    /// The step.
    StepRecord step;
    std::shared_ptr<const std::vector<std::string>> bodies; ///< names by number
};
using Record = std::shared_ptr<const ReportedStep>;

/// A record as bytes, stored beside a simulation's state, so that the last record is available
/// after a restore.
std::vector<std::byte> bytes_of(const StepRecord& record);
/// The record in bytes of bytes_of(). @throws InputError  as ByteReader
StepRecord record_from(const std::vector<std::byte>& bytes);

/// A scene and its simulation. For one thread at a time.
class SteppedScene {
public:
    /// @throws InputError
    SteppedScene(SharedScene scene, const SimulationOptions& options);

    /// As Simulation::step; what it reported is record(), and the result has no record.
    /// @param not_beyond  latest end [s]
    StepResult step(const std::atomic<bool>& stop,
                    double not_beyond = std::numeric_limits<double>::infinity());
    /// @param until  where advance() is to end [s]: finite, within what is left of the scene
    /// @throws InputError  it is not
    void check_until(double until) const;

    Simulation& simulation() const { return *simulation_; }
    /// The simulation; views of arrays keep it.
    std::shared_ptr<Simulation> shared() const { return simulation_; }
    const SharedScene& scene() const { return scene_; }
    const SimulationOptions& options() const { return options_; }
    const std::vector<Issue>& warnings() const { return warnings_; }
    /// Of the last step, or null before the first.
    const Record& record() const { return record_; }
    /// Names, for contacts.
    const std::shared_ptr<const std::vector<std::string>>& body_names() const { return bodies_; }
    /// Reached [s].
    double time() const { return simulation_->so_far().time; }
    /// End of the run [s].
    double end() const { return scene_->scene.time.end; }
    /// True at the end of the run.
    bool done() const { return time() >= end() * (1 - 1e-12); }
    /// The summary of the run at its present time.
    RunSummary conclude();

    /// Changes fields of the scene and continues from the present state.
    /// @throws InputError  if the state does not fit the changed scene; nothing is changed
    void change(const std::vector<std::string>& overrides);
    /// The changed scene in the present state; this one stays as it is. @throws InputError  as
    /// change
    SteppedScene changed(const std::vector<std::string>& overrides) const;
    /// Everything, with the last record, for a bit-identical continuation.
    std::string save() const;
    /// @throws InputError  of a scene that differs from this one by more than title, output and
    ///         end, or of another version of its files; nothing is changed
    void restore(std::string_view state);
    /// Restarts the scene, with its present fields, at its beginning; all inputs follow the scene's
    /// curves again. @throws InputError
    void reset();
    /// Takes the state of another one of the same scene.
    void follow(const SteppedScene& other);
    /// Ends the simulation; views remain valid.
    void close();
    /// True after close().
    bool closed() const { return !simulation_; }

private:
    void make(const SharedScene& scene);

    SharedScene scene_;
    SimulationOptions options_;
    std::vector<DepthLine> lines_;
    std::vector<Issue> warnings_;
    std::shared_ptr<const std::vector<std::string>> bodies_;
    std::shared_ptr<Simulation> simulation_;
    std::uint64_t fingerprint_ = 0; ///< of the scene and its files, of which the simulation is made
    Record record_;
    StepResult last_;
};

} // namespace amontons
