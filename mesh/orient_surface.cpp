#include "mesh/orient_surface.hpp"

#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <array>
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

void turn(SurfaceMesh& mesh, std::size_t triangle)
{
    std::swap(mesh.triangles[triangle][1], mesh.triangles[triangle][2]);
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
                const char wanted = (state[here] == turned) != n.disagrees ? turned : kept;
                if (state[there] == unseen) {
                    state[there] = wanted;
                    turned_count += wanted == turned;
                    component.push_back(there);
                } else if (state[there] != wanted) {
                    result.orientable = false;
                }
            }
        }
        const bool turn_the_kept = 2 * turned_count > component.size();
        for (const std::size_t t : component) {
            if ((state[t] == turned) == turn_the_kept) continue;
            turn(mesh, t);
            ++result.turned;
        }
    }
    return result;
}

void turn_around(SurfaceMesh& mesh)
{
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        turn(mesh, t);
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
