#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// What a study keeps of each point that was run, so that it can continue where it stopped.

namespace amontons::study {

/// The numbers of a JSON document by their dotted path: {"energy.error", 1e-9}.
using Numbers = std::vector<std::pair<std::string, double>>;

/// Its texts by their dotted path: {"quantities.branch", "left_carotid"}.
using Texts = std::vector<std::pair<std::string, std::string>>;
Texts texts_of(std::string_view json, const std::string& file);
std::optional<std::string> find(const Texts& texts, const std::string& name);

/// @param json  e.g. what `amontons run --json` prints
/// @param file  for messages
/// @throws InputError  if it is no JSON object
Numbers numbers_of(std::string_view json, const std::string& file);

/// A number by its path, or by its name among "quantities".
std::optional<double> find(const Numbers& numbers, const std::string& name);

/// What is wrong with a name, with the nearest one and all there are.
std::string allowed_names(const Numbers& numbers, const Texts& texts, const std::string& name);

/// One point that was run.
struct PointRecord {
    std::string hash;                   ///< of the scene with the point's values, and its files
    std::vector<std::string> overrides; ///< "PATH=VALUE"
    std::string status;  ///< "done" | "failed" | "bad_input" | "out_of_time" | "crashed"
    std::string reason;  ///< why it is not done, or what is odd about it; "" if nothing
    std::string program; ///< version
    double seconds = 0;  ///< wall time of the run [s]
    double cpu_seconds = 0;
    Numbers numbers; ///< of the run's JSON
    Texts texts;
};

std::string record_text(const PointRecord& record);
/// @throws InputError
PointRecord read_record(std::string_view text, const std::string& file);

/// What a folder of a study is about.
struct Definition {
    std::string scene;               ///< file
    std::string hash;                ///< of the scene without the sweeps' values
    std::vector<std::string> set;    ///< further overrides
    std::vector<std::string> sweeps; ///< as they were written
    std::string quantity;
    std::string reference; ///< as the user wrote it: a number, a file or "finest"
    std::string shard;     ///< "i/n"
};

std::string definition_text(const Definition& definition);
/// @throws InputError
Definition read_definition(std::string_view text, const std::string& file);

} // namespace amontons::study
