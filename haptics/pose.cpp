#include "haptics/pose.hpp"

#include <cmath>

namespace amontons {

Vec3 turn_vector(const Eigen::Quaterniond& rotation)
{
    const double sine = rotation.vec().norm();
    const double angle = 2 * std::atan2(sine, std::abs(rotation.w()));
    const double sign = rotation.w() < 0 ? -1 : 1; // q and -q are the same turn
    return (sine > 1e-150 ? sign * angle / sine : 2 * sign) * rotation.vec();
}

Eigen::Quaterniond turn(const Vec3& v)
{
    const double half = v.norm() / 2;
    const Vec3 axis = (half > 1e-150 ? std::sin(half) / half / 2 : 0.5) * v;
    return {std::cos(half), axis[0], axis[1], axis[2]};
}

Vec6 displacement(const HandPose& from, const HandPose& to)
{
    Vec6 d;
    d << to.position - from.position, turn_vector(to.rotation * from.rotation.conjugate());
    return d;
}

bool is_broken(const HandPose& pose)
{
    return !pose.position.allFinite() || !(std::abs(pose.rotation.squaredNorm() - 1) < 1e-3);
}

bool is_broken(const Wrench& wrench)
{
    return !wrench.force.allFinite() || !wrench.torque.allFinite();
}

} // namespace amontons
