#include "contact/surface/choose_slave.hpp"

#include "contact/surface/facets.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kContrast = 30; ///< of stiffness: decides before fineness
constexpr double kAlike = 1e-2;  ///< difference of area per multiplier that does not count

/// Where two surfaces overlap, or the room between them.
BoundingBox between(const BoundingBox& a, const BoundingBox& b)
{
    const Eigen::Array3d low = a.low.max(b.low), high = a.high.min(b.high);
    BoundingBox box;
    box.low = low.min(high);
    box.high = low.max(high);
    return box;
}

/// Area per multiplier of the faces that touch a box [m^2].
double coarseness(const ExternalSurface& surface, std::span<const Vec3> places,
                  const BoundingBox& near)
{
    double area = 0, multipliers = 0;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> face = surface.face(f);
        BoundingBox box;
        for (const std::int32_t n : face)
            box.add(places[static_cast<std::size_t>(n)]);
        if (!box.touches(near)) continue;
        const auto at = [&](std::size_t i) -> const Vec3& {
            return places[static_cast<std::size_t>(face[i])];
        };
        const bool four = face.size() == 4;
        area += (at(four ? 2 : 1) - at(0)).cross(at(four ? 3 : 2) - at(four ? 1 : 0)).norm() / 2;
        // A regular mesh has a vertex to two triangles or one quadrilateral, an edge to 2/3.
        multipliers += four ? 1 : face.size() == 6 ? 1.5 : 0.5;
    }
    return multipliers > 0 ? area / multipliers : 0;
}

} // namespace

bool first_is_slave(const ExternalSurface& a, std::span<const Vec3> a_places, double a_stiffness,
                    const ExternalSurface& b, std::span<const Vec3> b_places, double b_stiffness)
{
    if (std::isinf(a_stiffness) != std::isinf(b_stiffness)) return std::isinf(b_stiffness);
    if (a_stiffness >= kContrast * b_stiffness && !std::isinf(a_stiffness)) return false;
    if (b_stiffness >= kContrast * a_stiffness && !std::isinf(b_stiffness)) return true;
    const BoundingBox near = between(box_of(a, a_places), box_of(b, b_places));
    const double of_a = coarseness(a, a_places, near), of_b = coarseness(b, b_places, near);
    if (std::abs(of_a - of_b) > kAlike * std::max(of_a, of_b)) return of_a > of_b;
    return a_stiffness <= b_stiffness;
}

} // namespace amontons
