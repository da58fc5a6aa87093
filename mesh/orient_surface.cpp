#include "mesh/orient_surface.hpp"

#include "mesh/box_tree.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace amontons {
namespace {

/// The triangle behind an edge, and whether both run along it the same way.
struct Neighbour {
    std::int32_t triangle = -1;
    bool disagrees = false;
};

std::vector<std::vector<Neighbour>> neighbours_of(const SurfaceMesh& mesh)
{
    std::vector<std::vector<Neighbour>> neighbours(mesh.triangles.size());
    for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> sides) {
        if (sides.size() != 2) return;
        const bool disagrees = sides[0].begin == sides[1].begin;
        neighbours[static_cast<std::size_t>(sides[0].triangle)].push_back(
            {sides[1].triangle, disagrees});
        neighbours[static_cast<std::size_t>(sides[1].triangle)].push_back(
            {sides[0].triangle, disagrees});
    });
    return neighbours;
}

void turn_over(SurfaceMesh& mesh, std::size_t triangle)
{
    std::swap(mesh.triangles[triangle][1], mesh.triangles[triangle][2]);
}

/// A closed part of a surface.
struct Part {
    std::vector<std::size_t> triangles;
    BoundingBox box;
    double volume = 0; ///< > 0: its normals point outwards [m^3]
};

std::vector<Part> closed_parts(const SurfaceMesh& mesh)
{
    std::vector<Part> parts;
    const std::vector<std::int32_t> part_of = parts_of(mesh);
    for (std::size_t t = 0; t < part_of.size(); ++t) {
        const auto i = static_cast<std::size_t>(part_of[t]);
        if (i >= parts.size()) parts.resize(i + 1);
        parts[i].triangles.push_back(t);
        for (const std::int32_t corner : mesh.triangles[t])
            parts[i].box.add(mesh.points[static_cast<std::size_t>(corner)]);
    }
    for (Part& part : parts) {
        const Vec3 middle = 0.5 * (part.box.low + part.box.high); // cones from afar would cancel
        for (const std::size_t t : part.triangles) {
            const auto x = [&](std::size_t k) -> Vec3 {
                return mesh.points[static_cast<std::size_t>(mesh.triangles[t][k])] - middle;
            };
            part.volume += x(0).dot(x(1).cross(x(2))) / 6;
        }
    }
    return parts;
}

/// How often a closed part runs around x: 0 outside of it, 1 or -1 inside.
/// Source: Van Oosterom & Strackee, IEEE Trans. Biomed. Eng. 30 (1983), solid angle of a triangle.
double winding(const SurfaceMesh& mesh, const Part& part, const Vec3& x)
{
    double half_angles = 0;
    for (const std::size_t t : part.triangles) {
        const auto to = [&](std::size_t k) -> Vec3 {
            return mesh.points[static_cast<std::size_t>(mesh.triangles[t][k])] - x;
        };
        const Vec3 a = to(0), b = to(1), c = to(2);
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        half_angles += std::atan2(a.dot(b.cross(c)),
                                  la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return half_angles / (2 * std::numbers::pi);
}

} // namespace

Orienting orient_consistently(SurfaceMesh& mesh)
{
    enum : char { unseen, kept, turned };
    const auto neighbours = neighbours_of(mesh);
    std::vector<char> state(mesh.triangles.size(), unseen);
    Orienting result;
    std::vector<std::size_t> component;
    for (std::size_t start = 0; start < state.size(); ++start) {
        if (state[start] != unseen) continue;
        state[start] = kept;
        component = {start};
        std::size_t turned_count = 0;
        for (std::size_t i = 0; i < component.size(); ++i) { // grows while it is walked
            const std::size_t here = component[i];
            for (const Neighbour& n : neighbours[here]) {
                const auto there = static_cast<std::size_t>(n.triangle);
                const char orientation = (state[here] == turned) != n.disagrees ? turned : kept;
                if (state[there] == unseen) {
                    state[there] = orientation;
                    turned_count += orientation == turned;
                    component.push_back(there);
                } else if (state[there] != orientation) {
                    result.orientable = false;
                }
            }
        }
        const bool turn_the_kept = 2 * turned_count > component.size();
        for (const std::size_t t : component) {
            if ((state[t] == turned) == turn_the_kept) continue;
            turn_over(mesh, t);
            ++result.turned;
        }
    }
    return result;
}

void turn_around(SurfaceMesh& mesh)
{
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        turn_over(mesh, t);
}

std::vector<std::int32_t> parts_of(const SurfaceMesh& mesh)
{
    const auto neighbours = neighbours_of(mesh);
    std::vector<std::int32_t> part(mesh.triangles.size(), -1);
    std::vector<std::size_t> waiting;
    std::int32_t count = 0;
    for (std::size_t start = 0; start < part.size(); ++start) {
        if (part[start] >= 0) continue;
        part[start] = count;
        waiting = {start};
        while (!waiting.empty()) {
            const std::size_t here = waiting.back();
            waiting.pop_back();
            for (const Neighbour& n : neighbours[here]) {
                const auto there = static_cast<std::size_t>(n.triangle);
                if (part[there] >= 0) continue;
                part[there] = count;
                waiting.push_back(there);
            }
        }
        ++count;
    }
    return part;
}

void orient_parts(SurfaceMesh& mesh)
{
    const std::vector<Part> parts = closed_parts(mesh);
    std::vector<BoundingBox> boxes;
    for (const Part& part : parts)
        boxes.push_back(part.box);
    const BoxTree tree(boxes);
    std::vector<std::size_t> wrong;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const auto& first = mesh.triangles[parts[i].triangles[0]];
        const Vec3& x = mesh.points[static_cast<std::size_t>(first[0])];
        BoundingBox here;
        here.add(x);
        int around = 0;
        tree.visit(here, [&](std::int32_t k) {
            const auto other = static_cast<std::size_t>(k);
            around += other != i && std::abs(winding(mesh, parts[other], x)) > 0.5;
        });
        if ((parts[i].volume < 0) == (around % 2 == 0)) wrong.push_back(i);
    }
    for (const std::size_t i : wrong)
        for (const std::size_t t : parts[i].triangles)
            turn_over(mesh, t);
}

Vec3 unit_normal(const SurfaceMesh& mesh, const std::array<std::int32_t, 3>& triangle)
{
    const auto x = [&](std::size_t k) -> const Vec3& {
        return mesh.points[static_cast<std::size_t>(triangle[k])];
    };
    return (x(1) - x(0)).cross(x(2) - x(0)).stableNormalized();
}

double enclosed_volume(const SurfaceMesh& mesh)
{
    if (mesh.points.empty()) return 0;
    Vec3 middle = Vec3::Zero(); // far from the origin, the cones from there would cancel
    for (const Vec3& x : mesh.points)
        middle += x / static_cast<double>(mesh.points.size());
    double volume = 0;
    for (const auto& triangle : mesh.triangles) {
        const auto x = [&](std::size_t i) -> Vec3 {
            return mesh.points[static_cast<std::size_t>(triangle[i])] - middle;
        };
        volume += x(0).dot(x(1).cross(x(2))) / 6;
    }
    return volume;
}

} // namespace amontons
