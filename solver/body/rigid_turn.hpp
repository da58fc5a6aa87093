#pragma once

#include "mesh/base/types.hpp"

#include <Eigen/Geometry>

// The turn of a rigid body over a step of second order (docs/theory/motion.md).

namespace amontons {

/// The turn of a step with this mean spin times the step: about its axis by 2 atan(|a| / 2), so
/// that every point of the body moves by a x (the mean of its arms before and after), exactly.
/// @param a  [rad]
inline Eigen::Quaterniond cayley_turn(const Vec3& a)
{
    return Eigen::Quaterniond(1, 0.5 * a.x(), 0.5 * a.y(), 0.5 * a.z()).normalized();
}

/// The `a` whose cayley_turn this is; of turns below pi.
inline Vec3 cayley_vector(const Eigen::Quaterniond& turn)
{
    return 2 / turn.w() * turn.vec();
}

/// The mean spin W of a step, along the body's axes: W = J^-1 (share P' + past), where P', the
/// angular momentum at the step's end along the axes that the body has there, follows from the turn
/// by h W itself. With share 1/2 and past = P / 2 the energy changes by the work of impulses only.
/// Source: Simo & Wong 1991, the midpoint rule on momenta along the body's axes.
/// @param inertia  about the centre of mass, along the body's axes [kg m^2]; and its inverse
/// @param end      the angular momentum at the end, along the axes at the start [kg m^2/s]
/// @param past     of the mean momentum what is known before the step [kg m^2/s]
/// @param guess    where Newton's method begins [rad/s]; 0: as if the body did not turn
/// @return         [rad/s]
Vec3 mean_spin(const Mat3& inertia, const Mat3& inverse, double h, double share, const Vec3& end,
               const Vec3& past, const Vec3& guess = Vec3::Zero());

} // namespace amontons
