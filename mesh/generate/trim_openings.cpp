#include "mesh/generate/trim_openings.hpp"

#include "mesh/base/index.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace amontons {

namespace {

constexpr double kSnap = 0.35;  // of an edge: nearer vertices are moved onto the plane
constexpr double kAround = 1.5; // of the radius: farther from the axis is another vessel
constexpr double kBelow = 2;    // edges: so far below a plane nothing is cut
constexpr double kHalo = 8; // edges: vertices that a cut one depends on, and half a cube of cells
constexpr int kTrimSweeps = 2; // of relaxation after the cut

// A point of the opening's plane, put on its circle.
Vec3 on_circle(const Opening& o, const Vec3& x)
{
    Vec3 radial = x - o.centre;
    radial -= o.outward * o.outward.dot(radial);
    return o.centre + o.radius * radial.normalized();
}

void trim(SurfaceMesh& mesh, const Opening& o, double edge, double reach, std::vector<char>& rim)
{
    // Height above the plane; vertices of other vessels count as far below it.
    std::vector<double> height(mesh.points.size());
    for (std::size_t v = 0; v < height.size(); ++v) {
        const Vec3 e = mesh.points[v] - o.centre;
        height[v] = e.dot(o.outward);
        const double off = (e - height[v] * o.outward).norm();
        if (off > kAround * o.radius || height[v] > reach || height[v] < -kBelow * edge)
            height[v] = -kBelow * edge;
        else if (std::abs(height[v]) < kSnap * edge) {
            height[v] = 0;
            mesh.points[v] = on_circle(o, mesh.points[v]);
        }
    }
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> cuts;
    const auto cut = [&](std::int32_t a, std::int32_t b) {
        const auto [slot, fresh] =
            cuts.try_emplace(std::minmax(a, b), static_cast<std::int32_t>(mesh.points.size()));
        if (fresh) {
            const double t = height[at(a)] / (height[at(a)] - height[at(b)]);
            mesh.points.push_back(
                on_circle(o, mesh.points[at(a)] + t * (mesh.points[at(b)] - mesh.points[at(a)])));
        }
        return slot->second;
    };
    std::vector<std::array<std::int32_t, 3>> kept;
    kept.reserve(mesh.triangles.size());
    for (auto t : mesh.triangles) {
        int above = 0, below = 0;
        for (std::int32_t v : t) {
            above += height[at(v)] > 0;
            below += height[at(v)] < 0;
        }
        if (below == 0) continue;
        if (above == 0) {
            kept.push_back(t);
            continue;
        }
        const auto turn_until = [&](auto&& first) {
            while (!first(height[at(t[0])]))
                std::rotate(t.begin(), t.begin() + 1, t.end());
        };
        if (below == 2) { // one corner is cut off
            turn_until([](double h) { return h > 0; });
            const std::int32_t ab = cut(t[0], t[1]), ca = cut(t[2], t[0]);
            const auto length = [&](std::int32_t i, std::int32_t j) {
                return (mesh.points[at(i)] - mesh.points[at(j)]).squaredNorm();
            };
            if (length(ab, t[2]) <= length(ca, t[1])) {
                kept.push_back({ab, t[1], t[2]});
                kept.push_back({ab, t[2], ca});
            } else {
                kept.push_back({ab, t[1], ca});
                kept.push_back({ca, t[1], t[2]});
            }
        } else { // one corner stays
            turn_until([](double h) { return h < 0; });
            const std::int32_t b = height[at(t[1])] > 0 ? cut(t[0], t[1]) : t[1];
            const std::int32_t c = height[at(t[2])] > 0 ? cut(t[2], t[0]) : t[2];
            kept.push_back({t[0], b, c});
        }
    }
    mesh.triangles = std::move(kept);
    rim.resize(mesh.points.size(), 1); // the cuts
    for (std::size_t v = 0; v < height.size(); ++v)
        if (height[v] == 0) rim[v] = 1;
}

// @return  whether a vertex stays where it is from now on: it lies on an opening's circle
std::vector<char> trim(SurfaceMesh& mesh, const std::vector<Opening>& openings, double edge,
                       const std::vector<double>& reach)
{
    std::vector<char> rim(mesh.points.size(), 0);
    for (std::size_t i = 0; i < openings.size(); ++i)
        trim(mesh, openings[i], edge, reach[i], rim);
    return rim;
}

} // namespace

SurfaceMesh trim_openings(SurfaceMesh mesh, const ImplicitSurface& surface,
                          const std::vector<Opening>& openings, double edge,
                          const std::vector<double>& reach)
{
    SurfaceMesh result = std::move(mesh);
    const std::vector<char> rim = trim(result, openings, edge, reach);

    // Vertices beyond the planes are left over: renumber.
    std::vector<std::int32_t> number(result.points.size(), -1);
    SurfaceMesh used;
    std::vector<char> fixed;
    for (auto& t : result.triangles) {
        for (std::int32_t& v : t) {
            if (number[at(v)] < 0) {
                number[at(v)] = static_cast<std::int32_t>(used.points.size());
                used.points.push_back(result.points[at(v)]);
                fixed.push_back(rim[at(v)]);
            }
            v = number[at(v)];
        }
    }
    used.triangles = std::move(result.triangles);
    relax_on_surface(used, surface, fixed, kTrimSweeps);
    return used;
}

std::size_t count_trimmed(std::size_t all, const ImplicitSurface& surface, const Vec3& low,
                          const Vec3& high, const std::vector<Opening>& openings, double edge,
                          const std::vector<double>& reach)
{
    const auto is_near = [&](const Vec3& x) {
        for (std::size_t i = 0; i < openings.size(); ++i) {
            const Opening& o = openings[i];
            const Vec3 e = x - o.centre;
            const double height = e.dot(o.outward), off = (e - height * o.outward).norm();
            if (height > -(kBelow + kHalo) * edge && height < reach[i] + kHalo * edge &&
                off < kAround * o.radius + kHalo * edge)
                return true;
        }
        return false;
    };
    SurfaceMesh near = surface_nets(surface, low, high, edge, is_near);
    const std::size_t elsewhere = all - near.triangles.size();
    trim(near, openings, edge, reach);
    return elsewhere + near.triangles.size();
}

} // namespace amontons
