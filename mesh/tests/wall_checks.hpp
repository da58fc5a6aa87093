#pragma once

#include "mesh/wall.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

// What the tests of every kind of wall have in common.

namespace amontons {

struct DerivativeErrors {
    double normal = 0;  ///< against central differences of the distance [-]
    double hessian = 0; ///< against central differences of the normal, times `scale` [-]
    double unit = 0;    ///< | |n| - 1 |
};

template <class AnyWall>
DerivativeErrors derivative_errors(const AnyWall& wall, const Vec3& x, double step, double scale)
{
    WallHint hint;
    const WallSample s = wall.sample(x, hint);
    DerivativeErrors e;
    e.unit = std::abs(s.normal.norm() - 1);
    for (int a = 0; a < 3; ++a) {
        const Vec3 d = step * Vec3::Unit(a);
        const WallSample up = wall.sample(x + d, hint), down = wall.sample(x - d, hint);
        e.normal =
            std::max(e.normal, std::abs((up.distance - down.distance) / (2 * step) - s.normal[a]));
        // The part along the normal is zero for a true distance and left out elsewhere.
        Vec3 change = (up.normal - down.normal) / (2 * step) - s.hessian.col(a);
        const double off = s.normal[a]; // symmetric projection: compare across the normal only
        if (off * off < 0.9)
            e.hessian = std::max(e.hessian, scale * change.norm() * (1 - off * off));
    }
    return e;
}

struct WallSurfaceReport {
    int odd_edges = 0;          ///< edges with more than two triangles, or two of opposite sense
    int rims = 0;               ///< closed loops of edges with one triangle
    int wrong_way = 0;          ///< triangles whose normal points out of the free space
    double rim_error = 0;       ///< of rim vertices against the openings' circles, over the radius
    double least_quality = 1e9; ///< 4 sqrt(3) area / sum of squared edges; 1: equilateral
    double vertex_error = 0;    ///< largest |distance| of the wall at a vertex [m]
};

inline WallSurfaceReport report_surface(const WallModel& model)
{
    WallSurfaceReport report;
    const auto& points = model.surface->points;
    const auto at = [&](std::int32_t i) -> const Vec3& {
        return points[static_cast<std::size_t>(i)];
    };
    std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
    WallHint hint;
    for (const auto& t : model.surface->triangles) {
        const Vec3 &a = at(t[0]), &b = at(t[1]), &c = at(t[2]);
        const Vec3 area = 0.5 * (b - a).cross(c - a);
        const Vec3 centroid = (a + b + c) / 3;
        report.wrong_way += area.dot(model.wall.sample(centroid, hint).normal) <= 0;
        report.least_quality =
            std::min(report.least_quality,
                     4 * std::sqrt(3.0) * area.norm() /
                         ((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm()));
        for (int k = 0; k < 3; ++k)
            ++edges[{t[static_cast<std::size_t>(k)], t[static_cast<std::size_t>((k + 1) % 3)]}];
    }
    std::map<std::int32_t, std::int32_t> next;
    for (const auto& [edge, count] : edges) {
        report.odd_edges += count != 1;
        if (!edges.contains({edge.second, edge.first})) {
            report.odd_edges += next.contains(edge.first);
            next[edge.first] = edge.second;
        }
    }
    for (const auto& [from, to] : next) {
        double error = 1e300;
        for (const Opening& o : model.openings)
            error = std::min(error, std::hypot((at(from) - o.centre).norm() - o.radius,
                                               (at(from) - o.centre).dot(o.outward)) /
                                        o.radius);
        report.rim_error = std::max(report.rim_error, error);
    }
    while (!next.empty()) {
        ++report.rims;
        std::int32_t v = next.begin()->first;
        while (next.contains(v)) {
            const std::int32_t after = next[v];
            next.erase(v);
            v = after;
        }
    }
    for (const Vec3& p : points)
        report.vertex_error = std::max(report.vertex_error, std::abs(model.wall.distance(p, hint)));
    return report;
}

} // namespace amontons
