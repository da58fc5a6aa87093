#pragma once

#include <string>

namespace amontons {

/// Makes a picture of a result by running `amontons render` as a process of its own: what VTK
/// and the display do then harms no finished run.
/// @return  "" or why there is no picture
std::string render_in_child(const std::string& directory, const std::string& png);

} // namespace amontons
