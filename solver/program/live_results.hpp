#pragma once

#include "solver/output/run_writer.hpp"
#include "solver/step/stepped_scene.hpp"

#include <atomic>
#include <memory>
#include <string>

namespace amontons {

/// Makes the first folder BASE-001, BASE-002, ... that is not there yet. @throws WriteError
std::string make_numbered_folder(const std::string& base);

/// The results of a scene that is led by hand, as `amontons run` writes them (docs/outputs.md): a
/// numbered folder for each stretch of steps in one scene without a jump back. What the folder's
/// manifest has as command continues with it, with --resume.
class LiveResults {
public:
    /// @param base  of the folders' names, absolute
    explicit LiveResults(std::string base);
    ~LiveResults();

    /// Continues where a folder ends. The simulation is brought to its checkpoint.
    /// @throws InputError  as RunWriter
    void resume(SteppedScene& scene, const std::string& folder);
    /// Writes the last step of the scene.
    /// @return  false if a file could not be written: then nothing is written any more
    bool add(const SteppedScene& scene);
    /// No step continues from the last one: the next one begins another folder.
    /// @param why  for the manifest
    void end(const std::string& why);

    /// That is written; "": none.
    std::string folder() const;
    /// Why nothing is written; "": all is well.
    const std::string& failure() const { return failure_; }

private:
    struct Open;
    void begin(const SteppedScene& scene, const std::string& folder, bool resume);

    std::string base_, failure_;
    std::unique_ptr<Open> open_;
};

} // namespace amontons
