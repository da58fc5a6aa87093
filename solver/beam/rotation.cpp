#include "solver/beam/rotation.hpp"

#include <Eigen/Geometry>

namespace amontons {

Quaternion quaternion_of(const Mat3& rotation)
{
    const Eigen::Quaterniond q(rotation);
    return {{q.w(), q.x(), q.y(), q.z()}};
}

} // namespace amontons
