#pragma once

#include <Eigen/Core>

// Numbers that a vector register holds, for kernels written by registers.

namespace amontons {

#ifdef __AVX512F__
/// Doubles in one register.
constexpr int kLanes = 8;
#else
/// Doubles in one register.
constexpr int kLanes = 4;
#endif
using Lanes = Eigen::Array<double, kLanes, 1>;

} // namespace amontons
