#include "solver/step/wall_force.hpp"

#include <algorithm>
#include <utility>

namespace amontons {
namespace {

/// The corner of a triangle that is nearest to a point.
std::int32_t nearest_corner(const SurfaceMesh& surface, std::int32_t triangle, const Vec3& x)
{
    const auto& corners = surface.triangles[std::size_t(triangle)];
    const auto squared = [&](std::int32_t v) {
        return (surface.points[std::size_t(v)] - x).squaredNorm();
    };
    std::int32_t best = corners[0];
    for (const std::int32_t v : corners)
        if (squared(v) < squared(best)) best = v;
    return best;
}

} // namespace

void note_forces(int number, const std::vector<ContactRecord>& contacts, WallForce& force)
{
    for (const ContactRecord& c : contacts)
        if (c.body_b == number)
            force.pending.push_back({c.point[0], c.point[1], c.point[2], c.clustered_force});
}

bool many_pending(const WallForce& force)
{
    constexpr std::size_t kMost = 8192; // 256 kB
    return force.pending.size() > kMost;
}

void assign_forces(const SurfaceMesh& surface, WallForce& force)
{
    const std::vector<WallForce::Touch> pending = std::exchange(force.pending, {});
    if (surface.triangles.empty() || pending.empty()) return;
    if (!force.tree) force.tree = std::make_unique<BoundingTree>(surface);
    if (force.largest.empty()) force.largest.assign(surface.points.size(), 0);
    std::int32_t near = -1; // the next contact is probably beside the last one
    for (const auto& [x, y, z, size] : pending) {
        const Vec3 point{x, y, z};
        near = force.tree->nearest_within(point, near).triangle;
        double& f = force.largest[std::size_t(nearest_corner(surface, near, point))];
        f = std::max(f, size);
    }
}

} // namespace amontons
