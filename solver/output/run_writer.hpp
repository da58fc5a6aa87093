#pragma once

#include "solver/output/checkpoint.hpp"
#include "solver/output/history.hpp"
#include "solver/output/manifest.hpp"
#include "solver/output/vtk_writer.hpp"
#include "solver/step/simulation.hpp"

#include <atomic>
#include <memory>
#include <string>

namespace amontons {

/// Where a run is written, and the command that started it.
struct RunWriterOptions {
    /// Folder of the run's files.
    std::string directory;
    std::string name;                  ///< of the collection: NAME.pvd
    std::vector<std::string> command;  ///< for the manifest
    std::vector<std::string> warnings; ///< for the manifest
    int threads = 1;
    bool resume = false; ///< continue from the folder's checkpoint
};

/// Hash of what decides the results: the scene without its title and pictures, the files that it
/// names, and the obstacles' surfaces.
std::uint64_t hash_of_run(const Scene& scene, const std::vector<Obstacle>& obstacles);

/// "catheter" of examples/catheter/scene.json, "narrow" of narrow.json.
std::string run_name(const std::string& scene_file);

/// True if by the manifest in a folder its run ended, or was killed, before there was a
/// checkpoint: nothing is lost by a run that begins anew.
bool has_no_checkpoint_yet(const std::string& directory);

/// Writes all files of a run: frames and their collections, history.csv, manifest.json and
/// the checkpoint. Each file is whole at any time; history.csv grows by whole lines.
///
/// When a file cannot be written, the writer sets `stop`, so that the run ends after this
/// step, and finish() reports it; what was finished stays readable.
class RunWriter : public StepObserver {
public:
    /// Makes the folder, locks it for as long as the writer lives, and the manifest (status
    /// "running"). What was there stays until all that the run begins with is on the disk. With
    /// `resume`, restores the simulation from the checkpoint and cuts the history there.
    /// @param simulation  outlives the writer, which reads its state after a step
    /// @throws InputError  folder that cannot be made or written, or that another process works in;
    ///                     missing, damaged or foreign
    ///                     checkpoint (nothing is changed then)
    /// @throws WriteError  full disk
    RunWriter(const Scene& scene, Simulation& simulation, RunWriterOptions options,
              std::atomic<bool>& stop);
    ~RunWriter() override;

    void on_step(const StepRecord& record) override;

    /// Writes the last frame, the obstacles with their largest forces, the last checkpoint
    /// and the manifest. Sets seconds.output, and the status if something was not written.
    void finish(RunSummary& summary);

    /// Writes the manifest again, with what came after the run (plots, a picture).
    void add_files(const std::vector<std::string>& files, const RunSummary& summary);

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
