#pragma once

#include "solver/body/body.hpp"
#include "solver/scene/scene.hpp"

namespace amontons {

/// A rotation vector from a rotation, |.| <= pi, and back.
Vec3 rotation_vector(const Eigen::Quaterniond& q);
Eigen::Quaterniond rotation(const Vec3& vector);

/// "shift along (0, 0, 1)", "turn about ...", or both where neither is small.
/// @param turn  times the body's size, to be compared with the shift [m]
std::string name_of_motion(const Vec3& shift, const Vec3& turn);

/// Where a body begins.
Placement start_placement(const StartInput& start);

/// Where a drive puts a body at time t.
/// @param centre  the body's own, before it is placed: the turn goes about it unless said otherwise
Placement driven_placement(const DriveInput& drive, const Placement& start, const Vec3& centre,
                           double t);

} // namespace amontons
