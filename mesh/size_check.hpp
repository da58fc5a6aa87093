#pragma once

#include "mesh/base/error.hpp"
#include "mesh/base/types.hpp"

#include <string>
#include <vector>

namespace amontons {

/// A box longer than this is probably not in metres [m].
constexpr double kLargestSize = 3.0;

/// One Issue, with the measured size, if a shape is so large that its file is probably in
/// millimetres; else none.
/// @param size  of its box [m]
std::vector<Issue> size_warnings(const Vec3& size, const std::string& file,
                                 double largest = kLargestSize);

/// The same for the bounding box of points [m].
std::vector<Issue> size_warnings(const std::vector<Vec3>& points, const std::string& file);

} // namespace amontons
