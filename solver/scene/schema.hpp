#pragma once

#include <string>

namespace amontons {

/// The JSON schema (draft-07) of a scene, from the declarations that the reader uses.
std::string scene_schema();

/// The same as a page for people, in Markdown.
std::string scene_reference();

} // namespace amontons
