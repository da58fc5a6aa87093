#include "contact/rigid/shape_surface.hpp"

#include <cmath>
#include <numbers>

namespace amontons {
namespace {

constexpr int kFacets = 24; // around a circle

} // namespace

SurfaceMesh surface_of(const RigidShape& shape)
{
    SurfaceMesh m;
    if (const auto* triangles = std::get_if<TriangleShape>(&shape)) return triangles->mesh;
    const auto ring = [&](double radius, double z, int n) {
        for (int i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * i / n;
            m.points.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
        }
    };
    const auto band = [&](int from, int to, int n) {
        for (int i = 0; i < n; ++i) {
            const int j = (i + 1) % n;
            m.triangles.push_back({from + i, from + j, to + j});
            m.triangles.push_back({from + i, to + j, to + i});
        }
    };
    const auto fan = [&](int tip, int from, int n, bool up) {
        for (int i = 0; i < n; ++i) {
            const int j = (i + 1) % n;
            if (up)
                m.triangles.push_back({tip, from + i, from + j});
            else
                m.triangles.push_back({tip, from + j, from + i});
        }
    };
    const int n = kFacets;
    // A ball, its halves pulled apart.
    const auto rounded = [&](double radius, double half_length) {
        m.points.emplace_back(0, 0, -radius - half_length);
        int rings = 0;
        const auto at = [&](int k, double shift) {
            const double a = std::numbers::pi * k / (n / 2);
            ring(radius * std::sin(a), shift - radius * std::cos(a), n);
            ++rings;
        };
        for (int k = 1; k <= n / 4; ++k)
            at(k, -half_length);
        for (int k = half_length > 0 ? n / 4 : n / 4 + 1; k < n / 2; ++k)
            at(k, half_length);
        m.points.emplace_back(0, 0, radius + half_length);
        fan(0, 1, n, false);
        for (int k = 0; k + 1 < rings; ++k)
            band(1 + k * n, 1 + (k + 1) * n, n);
        fan(int(m.points.size()) - 1, 1 + (rings - 1) * n, n, true);
    };
    if (const auto* box = std::get_if<Box>(&shape)) {
        for (int i = 0; i < 8; ++i)
            m.points.emplace_back((i & 1 ? 1 : -1) * box->half_extents.x(),
                                  (i & 2 ? 1 : -1) * box->half_extents.y(),
                                  (i & 4 ? 1 : -1) * box->half_extents.z());
        m.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                       {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    } else if (const auto* ball = std::get_if<Ball>(&shape)) {
        rounded(ball->radius, 0);
    } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
        rounded(capsule->radius, capsule->half_length);
    } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) {
        rounded(1, 0);
        for (Vec3& x : m.points)
            x = x.cwiseProduct(ellipsoid->radii);
    } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
        m.points.emplace_back(0, 0, -cylinder->half_length);
        ring(cylinder->radius, -cylinder->half_length, n);
        ring(cylinder->radius, cylinder->half_length, n);
        m.points.emplace_back(0, 0, cylinder->half_length);
        fan(0, 1, n, false);
        band(1, 1 + n, n);
        fan(1 + 2 * n, 1 + n, n, true);
    }
    return m;
}

SurfaceMesh flat_ends(const Cylinder& c)
{
    constexpr int kCorners = 64;
    SurfaceMesh m;
    for (const int side : {-1, 1}) {
        const auto centre = int(m.points.size());
        m.points.emplace_back(0, 0, side * c.half_length);
        for (int i = 0; i < kCorners; ++i) {
            const double angle = 2 * std::numbers::pi * i / kCorners;
            m.points.emplace_back(c.radius * std::cos(angle), c.radius * std::sin(angle),
                                  side * c.half_length);
            const int here = centre + 1 + i, next = centre + 1 + (i + 1) % kCorners;
            m.triangles.push_back(side > 0 ? std::array{centre, here, next}
                                           : std::array{centre, next, here});
        }
    }
    return m;
}

ExternalSurface surface_of_triangles(const SurfaceMesh& mesh)
{
    ExternalSurface s;
    s.starts.push_back(0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const int p : mesh.triangles[i])
            s.nodes.push_back(p);
        s.starts.push_back(std::int64_t(s.nodes.size()));
        s.corners.push_back(3);
        s.faces.push_back({std::int32_t(i), 0});
    }
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        s.used_nodes.push_back(std::int32_t(i));
        s.surface_nodes.push_back(std::int32_t(i));
    }
    return s;
}

} // namespace amontons
