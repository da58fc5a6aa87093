#include "mesh/generate/ball.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <map>

namespace amontons {

namespace {

SurfaceMesh ball_triangles(const BallOptions& options)
{
    SurfaceMesh mesh;
    const double g = (1 + std::sqrt(5.0)) / 2;
    mesh.points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (Vec3& p : mesh.points)
        p.normalize();
    int levels = 3;
    if (options.resolution > 0) // the icosahedron's edge is 1.05 radii; halved by each level
        levels = std::clamp(
            static_cast<int>(std::ceil(std::log2(1.05 * options.radius / options.resolution))), 0,
            8);
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middle;
        const auto between = [&](std::int32_t a, std::int32_t b) {
            const auto [slot, fresh] = middle.try_emplace(
                std::minmax(a, b), static_cast<std::int32_t>(mesh.points.size()));
            if (fresh) {
                const Vec3 sum = mesh.points[static_cast<std::size_t>(a)] +
                                 mesh.points[static_cast<std::size_t>(b)];
                mesh.points.push_back(sum.normalized());
            }
            return slot->second;
        };
        std::vector<std::array<std::int32_t, 3>> finer;
        finer.reserve(4 * mesh.triangles.size());
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::int32_t ab = between(a, b), bc = between(b, c), ca = between(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    for (Vec3& p : mesh.points)
        p = options.centre + options.radius * p;
    if (options.inside)
        for (auto& t : mesh.triangles)
            std::swap(t[1], t[2]);
    return mesh;
}

double ball_deviation(const SurfaceMesh& mesh, const Wall& wall)
{
    double deviation = 0;
    WallHint hint;
    for (const auto& t : mesh.triangles) {
        const Vec3 centroid = (mesh.points[static_cast<std::size_t>(t[0])] +
                               mesh.points[static_cast<std::size_t>(t[1])] +
                               mesh.points[static_cast<std::size_t>(t[2])]) /
                              3;
        deviation = std::max(deviation, std::abs(wall.distance(centroid, hint)));
    }
    return deviation;
}

} // namespace

WallModel make_ball(const BallOptions& options)
{
    const auto wall = [options] {
        return make_ball_wall(options.centre, options.radius, options.inside);
    };
    Wall own = wall();
    if (!(options.resolution >= 0))
        throw InputError(
            {Issue{"", "/resolution", std::to_string(options.resolution), ">= 0 [m]"}});
    const Late<SurfaceMesh> mesh{[options] { return ball_triangles(options); }};
    const Late<double> deviation{[mesh, wall] { return ball_deviation(*mesh, wall()); }};
    return {mesh, std::move(own), {}, {}, deviation};
}

} // namespace amontons
