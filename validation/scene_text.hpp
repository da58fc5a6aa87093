#pragma once

#include <string_view>

namespace amontons::validation {

/// Text of a scene that is built into the program, by its folder's name.
/// @throws std::out_of_range  if there is none
std::string_view scene_text(std::string_view name);

} // namespace amontons::validation
