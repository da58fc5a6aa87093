#include "solver/step/wall_force.hpp"

#include <algorithm>
#include <limits>

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

void note_forces(const SurfaceMesh& surface, int number, const std::vector<ContactRecord>& contacts,
                 WallForce& force)
{
    if (surface.triangles.empty()) return;
    std::vector<WallForce::Found> now;
    const std::vector<WallForce::Found>& last = force.last;
    std::size_t k = 0; // the contact of the last record that is probably next to this one
    for (const ContactRecord& c : contacts) {
        if (c.body_b != number) continue;
        if (!force.tree) force.tree = std::make_unique<BoundingTree>(surface);
        if (force.largest.empty()) force.largest.assign(surface.points.size(), 0);
        const auto squared = [&](std::size_t i) {
            return last[i].body == c.body_a ? (last[i].point - c.point).squaredNorm()
                                            : std::numeric_limits<double>::infinity();
        };
        while (k + 1 < last.size() && squared(k + 1) <= squared(k))
            ++k;
        const std::int32_t near = k < last.size() ? last[k].triangle : -1;
        const std::int32_t triangle = force.tree->nearest_within(c.point, near).triangle;
        now.push_back({c.body_a, c.point, triangle});
        double& f = force.largest[std::size_t(nearest_corner(surface, triangle, c.point))];
        f = std::max(f, c.clustered_force);
    }
    force.last = std::move(now);
}

} // namespace amontons
