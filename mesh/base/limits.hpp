#pragma once

#include <limits>

// Of double; for .cpp files alone.

namespace amontons {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

} // namespace amontons
