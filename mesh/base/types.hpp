#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace amontons {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

} // namespace amontons
