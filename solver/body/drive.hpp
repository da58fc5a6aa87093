#pragma once

#include "mesh/volume_mesh.hpp"
#include "solver/body/body.hpp"
#include "solver/scene/scene.hpp"

namespace amontons {

/// A rotation vector from a rotation, |.| <= pi, and back.
Vec3 rotation_vector(const Eigen::Quaterniond& q);
/// The quaternion of a rotation vector [rad].
Eigen::Quaterniond rotation(const Vec3& vector);

/// "shift along (0, 0, 1)", "turn about ...", or both where neither is small.
/// @param turn  times the body's size, to be compared with the shift [m]
std::string name_of_motion(const Vec3& shift, const Vec3& turn);

/// Where a body begins.
Placement start_placement(const StartInput& start);

/// Rotates the mesh of a body that starts turned, so that x, y and z of its holds are the world's
/// axes, like those of its loads. Not if its holds use the body's own axes, or hold all three at 0:
/// bodies with the same mesh can then share their factor.
void turn_with_mesh(SolidInput& input, VolumeMesh& mesh);

/// Where a drive puts a body at time t.
/// @param centre  the body's own, before it is placed: the turn is about it unless specified
/// otherwise
/// @param t  [s]
Placement driven_placement(const DriveInput& drive, const Placement& start, const Vec3& centre,
                           double t);

} // namespace amontons
