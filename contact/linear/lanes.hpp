#pragma once

#include <Eigen/Core>

// Numbers that a vector register holds, for kernels written by registers.

namespace amontons {

#ifdef __AVX512F__
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;
#endif
using Lanes = Eigen::Array<double, kLanes, 1>;

} // namespace amontons
