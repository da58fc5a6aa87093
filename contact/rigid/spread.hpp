#pragma once

#include "contact/rigid/shape.hpp"

#include <cmath>
#include <numbers>

// Points spread evenly over a flat face, for Box::spread and Cylinder::spread.

namespace amontons {

/// Calls visit(Vec3, std::size_t number) for the centres of equal cells of a box's face, at least
/// `spread` of them, as square as they can be.
/// @param face  as in BoxPolyhedron
template <class Visit> void spread_over(const Box& box, int face, Visit visit)
{
    const int k = face / 2, u = (k + 1) % 3, w = (k + 2) % 3;
    const Vec3& h = box.half_extents;
    const auto cells = [](double n) { return std::max(1, static_cast<int>(std::ceil(n - 1e-9))); };
    const int along_u = cells(std::sqrt(box.spread * h[u] / h[w]));
    const int along_w = cells(static_cast<double>(box.spread) / along_u);
    std::size_t number = 0;
    for (int i = 0; i < along_u; ++i)
        for (int j = 0; j < along_w; ++j) {
            Vec3 x;
            x[k] = face % 2 == 0 ? -h[k] : h[k];
            x[u] = h[u] * ((2 * i + 1.0) / along_u - 1);
            x[w] = h[w] * ((2 * j + 1.0) / along_w - 1);
            visit(x, number++);
        }
}

/// The same for an end of a cylinder: rings of 4, 12, 20, ... cells, each point as far from the
/// axis as its cell is on average, so that the torque of friction under pure spin is exact.
/// @param end  0: at -z, 1: at +z
template <class Visit> void spread_over(const Cylinder& cylinder, int end, Visit visit)
{
    const int rings = static_cast<int>(std::ceil(std::sqrt(cylinder.spread / 4.0) - 1e-9));
    const double z = end == 0 ? -cylinder.half_length : cylinder.half_length;
    std::size_t number = 0;
    for (int ring = 0; ring < rings; ++ring) {
        const double inner = static_cast<double>(ring) / rings, outer = (ring + 1.0) / rings;
        const double r = cylinder.radius * 2 / 3 * (outer * outer + outer * inner + inner * inner) /
                         (outer + inner);
        const int cells = 4 * (2 * ring + 1);
        for (int i = 0; i < cells; ++i) {
            const double angle = 2 * std::numbers::pi * (i + 0.5) / cells;
            visit(Vec3{r * std::cos(angle), r * std::sin(angle), z}, number++);
        }
    }
}

} // namespace amontons
