#pragma once

#include "solver/record/step_record.hpp"
#include "solver/scene/json_text.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace amontons {

/// Contents of a manifest besides the summary of the run.
struct ManifestInput {
    std::string scene_file; ///< as the user wrote it
    std::uint64_t scene_hash = 0;
    std::string resolved_scene;       ///< JSON
    std::vector<std::string> command; ///< the program's arguments
    std::string started;              ///< date and time, UTC
    int threads = 1;
    bool resumed = false;
    bool checkpoint = false;           ///< there is one to continue from
    std::vector<std::string> warnings; ///< probable mistakes of the scene, even with --quiet
    std::vector<std::string> modules;  ///< loaded
    std::vector<std::string> files;    ///< what to open: collections, history, plots, picture
};

/// "0.1.0", and the output of `git describe` when the program was configured ("" without a clone).
std::string program_version();
/// The program's version and commit, in words.
std::string program_describe();

/// System, processor and number of cores, in a line.
std::string machine_text();

/// "2026-11-21T19:22:00Z"
std::string now_utc();

/// Peak resident memory of this process so far [bytes]; 0 if the system does not provide it.
double peak_memory();

/// 0 done, 3 failed, 130 interrupted.
int exit_code(const RunSummary& summary);

/// Adds the members of `certificate` and of `energy` to an open object.
void write_certificate(JsonText& json, const RunSummary& summary);
/// Writes the energy balance as JSON.
void write_energy(JsonText& json, const EnergyRecord& energy);

/// Adds the members of `amontons run --json` to an open object.
/// @param warnings  of the scene; those of the steps are in the summary
void write_summary(JsonText& json, const RunSummary& summary,
                   const std::vector<std::string>& modules,
                   const std::vector<std::string>& warnings = {});

/// The bytes of manifest.json.
std::string manifest_bytes(const ManifestInput& input, const RunSummary& summary);

} // namespace amontons
