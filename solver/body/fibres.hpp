#pragma once

#include "mesh/base/types.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace amontons {

/// Directions of fibres: three numbers a line, separated by blanks, tabs, commas or semicolons;
/// lines that are empty or begin with # do not count.
/// @param count  lines that there must be: one of each element
/// @return  unit vectors
/// @throws InputError  with every line that is no direction
std::vector<Vec3> parse_fibres(std::string_view text, const std::string& file, std::size_t count);

/// Axes of a material: the fibre, and two across it.
Mat3 fibre_axes(const Vec3& fibre);

} // namespace amontons
