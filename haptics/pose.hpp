#pragma once

#include "mesh/base/types.hpp"

#include <Eigen/Geometry>

// Messages between a device and the loop. Six degrees of freedom always; a device with
// fewer leaves the others still (a catheter's base: x and the turn about x).

namespace amontons {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// Where the handle is.
struct HandPose {
    Vec3 position{0, 0, 0};                                       ///< [m]
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity(); ///< of unit length
};

/// Force and torque about the handle's origin, world axes.
struct Wrench {
    Vec3 force{0, 0, 0};  ///< [N]
    Vec3 torque{0, 0, 0}; ///< [N m]
};

/// The rotation vector of a unit quaternion, 3 [rad], |.| <= pi.
Vec3 turn_vector(const Eigen::Quaterniond& rotation);
/// Its inverse: the turn by |v| about v.
Eigen::Quaterniond turn(const Vec3& v);

/// From one pose to another: translation [m] and rotation vector [rad], world axes, so that
/// to.rotation = turn(tail) * from.rotation. Endless turns are found piece by piece: |tail| <= pi.
Vec6 displacement(const HandPose& from, const HandPose& to);

/// Any of its numbers is not finite, or the quaternion is not of unit length within 1e-3.
bool is_broken(const HandPose& pose);
bool is_broken(const Wrench& wrench);

} // namespace amontons
