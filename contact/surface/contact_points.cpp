#include "contact/surface/contact_points.hpp"

#include <Eigen/Geometry>

namespace amontons {

void set_tangents(SurfaceContact& contact)
{
    const Vec3& n = contact.normal;
    const auto projected = [&](int axis) -> Vec3 { return Vec3::Unit(axis) - n[axis] * n; };
    Vec3 t = projected(0);
    if (t.norm() < 1e-3) t = projected(1);
    contact.t1 = t.normalized();
    contact.t2 = n.cross(contact.t1);
}

Vec3 weighted(std::span<const StencilEntry> side, std::span<const Vec3> places)
{
    Vec3 sum = Vec3::Zero();
    for (const StencilEntry& e : side)
        sum += e.weight * places[static_cast<std::size_t>(e.node)];
    return sum;
}

} // namespace amontons
