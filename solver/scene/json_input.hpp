#pragma once

#include "mesh/base/error.hpp"

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

// A scene's text and the overrides of the command line as JSON, before fields are interpreted.

namespace amontons {

/// JSON with its members in the order of the file.
using Json = nlohmann::ordered_json;

/// A value from the file, short enough for a message.
std::string shown(const Json& value);

/// Parses the text. A field given twice is an Issue, since JSON does not define which one counts.
/// @throws InputError  if the text is no JSON, with line and column
Json parse_json(std::string_view text, const std::string& file, std::vector<Issue>& issues);

/// Replaces the value of one override. Missing objects of its path are made, items of lists are not.
/// @param text    "PATH=VALUE"
/// @param places  gets the place of the value as a JSON pointer
void apply_override(Json& scene, const std::string& text, std::vector<std::string>& places,
                    std::vector<Issue>& issues);

} // namespace amontons
