#include "mesh/generate/surface_nets.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <set>

using namespace amontons;

namespace {

/// Free within two balls of radius 1.
ImplicitSurface two_balls(const Vec3& a, const Vec3& b)
{
    return {[=](const Vec3& x) { return 1 - std::min((x - a).norm(), (x - b).norm()); },
            [=](const Vec3& x) {
                const Vec3& c = (x - a).norm() < (x - b).norm() ? a : b;
                return Vec3{c + (x - c).normalized()};
            }};
}

/// Free within a radius of the line from a to b.
ImplicitSurface capsule(const Vec3& a, const Vec3& b, double radius)
{
    const auto foot = [=](const Vec3& x) {
        const double t = (x - a).dot(b - a) / (b - a).squaredNorm();
        return Vec3{a + std::clamp(t, 0.0, 1.0) * (b - a)};
    };
    return {[=](const Vec3& x) { return radius - (x - foot(x)).norm(); },
            [=](const Vec3& x) { return Vec3{foot(x) + radius * (x - foot(x)).normalized()}; }};
}

std::int64_t euler_number(const SurfaceMesh& mesh) // of a closed one
{
    return static_cast<std::int64_t>(mesh.points.size()) -
           static_cast<std::int64_t>(mesh.triangles.size() / 2);
}

bool is_manifold(const SurfaceMesh& mesh)
{
    std::set<std::pair<std::int32_t, std::int32_t>> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            if (!edges.emplace(t[k], t[(k + 1) % 3]).second) return false;
    return true;
}

} // namespace

TEST_CASE("the number of triangles of nets and edges of four faces are predicted")
{
    int manifold = 0, others = 0;
    for (const double edge : {0.13, 0.1, 0.077})
        for (int k = 0; k < 36; ++k) {
            const Vec3 a{0.1, 0.2, 0.3}, towards = Vec3{1, 0.06 * k, 0.9 - 0.07 * k}.normalized();
            const ImplicitSurface balls = two_balls(a, a + (1.96 + 0.006 * k) * towards);
            const Vec3 low = Vec3::Constant(-3.2), high = Vec3::Constant(3.5);
            const SurfaceMesh mesh = surface_nets(balls, low, high, edge);
            const NetsPrediction predicted = predict_nets(balls, low, high, edge);
            CHECK(predicted.manifold == is_manifold(mesh));
            if (predicted.manifold) {
                CHECK(predicted.triangles == mesh.triangles.size());
                CHECK(predicted.euler == euler_number(mesh));
            }
            ++(predicted.manifold ? manifold : others);
        }
    CHECK(manifold > 5);
    CHECK(others > 5);
}

TEST_CASE("nets of a tube that just touches planes of the grid are one closed part")
{
    // Seen along a plane that cuts little off it, a tube across the grid is a narrow strip whose
    // nodes alternate. The grid's planes are 0.1 apart, the strip is higher in each round.
    const Vec3 low = Vec3::Constant(-1.2), high{3, 1.2, 3};
    for (int k = 0; k < 40; ++k) {
        const ImplicitSurface tube = capsule(Vec3::Zero(), {1.7, 0, 1.5}, 0.4 + 0.0025 * k);
        const SurfaceMesh mesh = surface_nets(tube, low, high, 0.1);
        const NetsPrediction predicted = predict_nets(tube, low, high, 0.1);
        CHECK(is_manifold(mesh));
        CHECK(predicted.manifold);
        CHECK(predicted.euler == 2);
        CHECK(euler_number(mesh) == 2);
    }
}

TEST_CASE("handles between walls that the grid does not part are counted")
{
    // Two parallel tubes joined at one end; the wall between them is half a cell thick.
    const ImplicitSurface a = capsule({0, 0, 0}, {2, 0.1, 0.7}, 0.4),
                          b = capsule({0, 0.85, 0}, {2, 0.95, 0.7}, 0.4),
                          across = capsule({0, 0, 0}, {0, 0.85, 0}, 0.4);
    const ImplicitSurface joined{[&](const Vec3& x) {
                                     return std::max({a.value(x), b.value(x), across.value(x)});
                                 },
                                 [](const Vec3& x) { return x; }};
    const Vec3 low{-1, -1, -1}, high{3, 2, 2};
    CHECK(predict_nets(joined, low, high, 0.1).euler != 2);
    CHECK(predict_nets(joined, low, high, 0.03).euler == 2);
}

TEST_CASE("nets are the same bits whether values far from the surface are examined or not")
{
    const ImplicitSurface steep = two_balls({0, 0, 0}, {1.2, 0.1, 0});
    ImplicitSurface flat = steep; // so small that it may be zero anywhere
    flat.value = [&](const Vec3& x) { return steep.value(x) / 64; };
    const Vec3 low{-1.2, -1.2, -1.2}, high{2.5, 1.3, 1.2};
    for (const double edge : {0.3, 0.1}) {
        const SurfaceMesh mesh = surface_nets(steep, low, high, edge),
                          all = surface_nets(flat, low, high, edge);
        CHECK(mesh.points == all.points);
        CHECK(mesh.triangles == all.triangles);
        CHECK(predict_nets(steep, low, high, edge).triangles == all.triangles.size());
        CHECK(predict_nets(flat, low, high, edge).triangles == all.triangles.size());
    }
}

TEST_CASE("a part of nets is the whole there")
{
    const ImplicitSurface balls = two_balls({0, 0, 0}, {1.2, 0.1, 0});
    const Vec3 low{-1.2, -1.2, -1.2}, high{2.5, 1.3, 1.2};
    const double edge = 0.1;
    const SurfaceMesh whole = surface_nets(balls, low, high, edge);
    const SurfaceMesh part =
        surface_nets(balls, low, high, edge, [](const Vec3& x) { return x[0] > 0.5; });
    CHECK(part.triangles.size() < whole.triangles.size());
    // Not beside what is left out: sweeps of relaxation examine neighbours.
    const auto within = [](const SurfaceMesh& mesh) {
        std::vector<std::array<double, 3>> points;
        for (const Vec3& p : mesh.points)
            if (p[0] > 1.2) points.push_back({p[0], p[1], p[2]});
        std::sort(points.begin(), points.end());
        return points;
    };
    CHECK(within(part).size() > 300);
    CHECK(within(part) == within(whole));
}
