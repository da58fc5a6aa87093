#pragma once

#include "mesh/base/error.hpp"
#include "mesh/base/types.hpp"

#include <string>
#include <vector>

namespace amontons {

/// A box longer than this is probably not in metres [m].
constexpr double kLargestSize = 3.0;

/// One Issue, with the size that was measured, of a shape that looks as if its file were in
/// millimetres; none of one that does not.
/// @param size  of its box [m]
std::vector<Issue> size_warnings(const Vec3& size, const std::string& file,
                                 double largest = kLargestSize);

/// The same of points.
std::vector<Issue> size_warnings(const std::vector<Vec3>& points, const std::string& file);

} // namespace amontons
