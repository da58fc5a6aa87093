#pragma once

#include "validation/measure.hpp"

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// A case that is a folder, and no C++: case.json, the scenes it runs, reference curves, README.md.
// docs/new_case.md makes one.

namespace amontons::validation {

/// A scene that the case runs.
struct CaseScene {
    std::string name;             ///< "" if there is only one
    std::string file;             ///< beside case.json
    std::vector<std::string> set; ///< "PATH=VALUE"
};

/// One thing that the case examines.
struct CaseMeasure {
    enum class Kind { number, text, curve, order, refusal, problem, left_out } kind = Kind::number;
    std::string scene; ///< by its name
    std::string what;  ///< in words
    std::string note;
    double tolerance = 0;
    // a number
    std::string quantity; ///< of `amontons run --json`
    double reference = 0;
    bool absolute = false; ///< else the error is relative to the reference
    double scale = 1;      ///< the quantity is multiplied with this first
    // an order: of the quantity's error, over runs with these values of a field
    std::string path;                ///< as after --set
    std::vector<std::string> values; ///< JSON, three or more
    bool finest = false;             ///< the reference is the finest of them
    double at_least = 0;             ///< of the order; `reference` is what it is an error against
    // a curve: columns of history.csv against those of the file
    std::string file, x, y;
    // a refusal: the run must fail and state this; a problem: its status; what is left out: why; a
    // text: what the quantity is
    std::string expected;
    // `file` of a problem: an FCLib file, solved to the tolerance
};

struct FolderCase {
    std::string name, folder;
    std::string suite, source, verified;
    std::string about; ///< the first paragraph of its README.md
    std::string data;  ///< folder of the data that it is measured on, below that of --data, or ""
    std::vector<CaseScene> scenes;
    std::vector<CaseMeasure> measures;
};

/// What a run of a scene gave: `amontons run --json`, its folder, its last words on stderr.
struct SceneAnswer {
    int exit_code = -1;
    std::string json, folder, last_words;
};
using RunScene =
    std::function<SceneAnswer(const std::string& file, const std::vector<std::string>&)>;
/// `amontons solve FILE --tolerance T --json`.
using SolveProblem = std::function<SceneAnswer(const std::string& file, double tolerance)>;

/// @param folder  with a case.json; its last part is the case's name
/// @throws InputError  with everything that is wrong with it
FolderCase read_folder_case(const std::string& folder);
/// What a case is: the first paragraph of the README.md in its folder, "" if there is none.
std::string about_case(const std::string& folder);
/// The text of a case.json. @param exists  whether a file lies beside it
FolderCase parse_folder_case(std::string_view text, const std::string& file,
                             const std::function<bool(const std::string&)>& exists);

/// Folders with a case.json in a folder of cases, sorted; nothing if that is not there.
std::vector<std::string> case_folders(const std::string& folder);

/// Runs the case's scenes, each once, solves its problems, and compares.
/// @param data  the folder that c.data names, "" if it names none: "{data}" in the settings of
///              scenes, and where the problems are (else they are beside case.json)
std::vector<Measured> measure(const FolderCase& c, const RunScene& run,
                              const SolveProblem& solve = {}, const std::string& data = "");

} // namespace amontons::validation
