#pragma once

// A wire that lies on a plane, for tests.

namespace amontons {

inline constexpr double kLyingRadius = 4e-4; // [m]
inline constexpr double kLyingEI = 5.2e-4;   // [N m^2]
inline constexpr double kLyingFriction = 0.3;

} // namespace amontons
