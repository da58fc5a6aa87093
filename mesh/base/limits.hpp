#pragma once

#include <limits>

// Of double; for .cpp files alone.

namespace amontons {

/// Infinity of doubles.
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Not a number.
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/// Distance from 1 to the next double, 2^-52 (relative).
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

} // namespace amontons
