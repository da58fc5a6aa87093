#pragma once

#include "validation/random/kinds.hpp"
#include "validation/random/laws.hpp"

#include <functional>
#include <string>
#include <vector>

namespace amontons::validation {

/// What came of a run of the program.
struct ProgramAnswer {
    int exit_code = -1; ///< -1: a signal ended it
    int signal = 0;
    bool out_of_time = false;
    double seconds = 0, cpu_seconds = 0;
    std::string last_words; ///< the last line on stderr
};
/// How the program that is tried is run.
struct ProgramJob {
    std::vector<std::string> arguments;
    int most_cpu_seconds = 0; ///< it is killed after that much processor time
    std::string history = ""; ///< killed once this history.csv has `steps` steps; "": not
    int steps = 0;
};
using RunProgram = std::function<ProgramAnswer(const ProgramJob&)>;

/// What came of a scene and its variants.
struct SceneResult {
    std::string suite;
    int number = 0;
    std::string kind, drawn;
    std::string outcome;           ///< "done", "refused", "known", "wrong"
    std::vector<Finding> findings; ///< why it is not done
    std::string reason;            ///< why it is known
    std::string folder;            ///< what is kept of it, "" if nothing
    int runs = 0;
    double seconds = 0, cpu_seconds = 0;
};

/// Draws a scene, runs it and its variants, and judges what they wrote.
/// @param folder  scene files and results; made here, the caller removes it
SceneResult try_scene(const SceneSuite& suite, std::uint64_t seed, int number,
                      const std::string& folder, const RunProgram& run);

/// One JSON object, and back.
std::string json_of(const SceneResult& result);
/// @throws std::exception  if it is none
SceneResult read_scene_result(const std::string& json);

/// Kinds against drawn, done, refused, known, wrong: for people, for a page, for a spreadsheet.
std::string table_text(const std::vector<SceneResult>& results);
std::string table_markdown(const std::vector<SceneResult>& results);
std::string table_csv(const std::vector<SceneResult>& results);
/// What was found of a scene, and how it is repeated; "" if it is done.
std::string findings_text(const SceneResult& result, std::uint64_t seed);

} // namespace amontons::validation
