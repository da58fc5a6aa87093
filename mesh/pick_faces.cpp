#include "mesh/pick_faces.hpp"

#include "mesh/closest_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace amontons {

double place_tolerance(const VolumeMesh& mesh)
{
    if (mesh.nodes.empty()) return 0;
    Vec3 low = mesh.nodes.front(), high = low;
    for (const Vec3& x : mesh.nodes) {
        low = low.cwiseMin(x);
        high = high.cwiseMax(x);
    }
    return 1e-6 * (high - low).norm();
}

Region inside_box(const Vec3& from, const Vec3& to, double slack)
{
    const Vec3 low = from.cwiseMin(to).array() - slack, high = from.cwiseMax(to).array() + slack;
    return [low, high](const Vec3& x) {
        return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
    };
}

Region inside_ball(const Vec3& centre, double radius, double slack)
{
    return [centre, most = radius + slack](const Vec3& x) { return (x - centre).norm() <= most; };
}

Region near_plane(const Vec3& at, const Vec3& normal, double within)
{
    return [at, n = normal.normalized().eval(), within](const Vec3& x) {
        return std::abs(n.dot(x - at)) <= within;
    };
}

std::vector<FaceRef> faces_in(const ExternalSurface& outside, const VolumeMesh& mesh,
                              const Region& region)
{
    std::vector<char> in(mesh.nodes.size(), 0);
    for (const std::int32_t node : outside.used_nodes)
        in[std::size_t(node)] = region(mesh.nodes[std::size_t(node)]);
    std::vector<FaceRef> faces;
    for (std::size_t f = 0; f < outside.faces.size(); ++f)
        if (std::ranges::all_of(outside.face(f),
                                [&](std::int32_t node) { return in[std::size_t(node)]; }))
            faces.push_back(outside.faces[f]);
    return faces;
}

std::vector<std::int32_t> nodes_in(const VolumeMesh& mesh, const Region& region)
{
    std::vector<std::int32_t> nodes;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        if (region(mesh.nodes[i])) nodes.push_back(std::int32_t(i));
    return nodes;
}

AlikeFaces faces_alike(const ExternalSurface& outside, const VolumeMesh& mesh, const Vec3& at,
                       double angle)
{
    AlikeFaces alike;
    const TriangulatedSurface flat = triangulate(outside, mesh);
    double least = std::numeric_limits<double>::infinity();
    std::size_t seed = 0;
    for (std::size_t t = 0; t < flat.mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = flat.mesh.triangles[t];
        const std::vector<Vec3>& x = flat.mesh.points;
        const TrianglePoint near =
            closest_on_triangle(at, x[std::size_t(a)], x[std::size_t(b)], x[std::size_t(c)]);
        const double away = (near.point - at).squaredNorm();
        if (!(away < least)) continue;
        least = away;
        alike.seed = near.point;
        seed = std::size_t(flat.faces[t]);
    }
    if (flat.mesh.triangles.empty()) return alike;
    alike.away = std::sqrt(least);
    const auto corner = [&](std::size_t k) {
        return mesh.nodes[std::size_t(outside.face(seed)[k])];
    };
    for (std::size_t k = 0; k < outside.corners[seed]; ++k)
        alike.size =
            std::max(alike.size, (corner(k) - corner((k + 1) % outside.corners[seed])).norm());

    // Neighbours across edges that turn by no more than the angle, face by face.
    std::vector<std::vector<std::int32_t>> next(outside.faces.size());
    for (const SurfaceEdge& e : find_edges(outside, mesh.nodes).edges)
        if (e.faces[1] >= 0 && std::abs(std::numbers::pi - e.angle) <= angle)
            for (std::size_t s = 0; s < 2; ++s)
                next[std::size_t(e.faces[s])].push_back(e.faces[1 - s]);
    std::vector<char> taken(outside.faces.size(), 0);
    std::vector<std::size_t> front{seed};
    taken[seed] = 1;
    while (!front.empty()) {
        const std::size_t f = front.back();
        front.pop_back();
        alike.faces.push_back(outside.faces[f]);
        for (const std::int32_t n : next[f])
            if (!std::exchange(taken[std::size_t(n)], 1)) front.push_back(std::size_t(n));
    }
    std::ranges::sort(alike.faces);
    return alike;
}

} // namespace amontons
