#include "mesh/bounding_tree.hpp"
#include "mesh/region_triangles.hpp"

#include "mesh/generate/ball.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

TEST_CASE("the closest point of a triangle is nearer than all others also where it is thin")
{
    std::mt19937 rng{1};
    std::uniform_real_distribution<double> uniform{-1, 1};
    for (int k = 0; k < 300; ++k) {
        const auto random = [&] { return Vec3{uniform(rng), uniform(rng), uniform(rng)}; };
        const Vec3 a = random(), b = random(), x = 2 * random();
        Vec3 c = random();
        if (k % 10 == 0) c = 0.5 * (a + b); // a segment
        if (k % 50 == 0) c = a;
        const TrianglePoint p = closest_on_triangle(x, a, b, c);
        const Vec3 same = p.weights[0] * a + p.weights[1] * b + p.weights[2] * c;
        CHECK((same - p.point).norm() < 1e-14);
        CHECK(p.weights.minCoeff() >= 0);
        double best = 1e300;
        for (int i = 0; i <= 40; ++i)
            for (int j = 0; j <= 40 - i; ++j)
                best = std::min(best, (x - (a * (40 - i - j) + b * i + c * j) / 40).norm());
        CHECK((x - p.point).norm() <= best + 1e-12);
        CHECK((x - p.point).norm() >= best - 0.2);
    }
}

TEST_CASE("the tree finds what a search of all triangles finds with or without a hint")
{
    const SurfaceMesh mesh = *make_ball({Vec3{0.2, 0, 0}, 1, true, 0.4}).surface;
    const BoundingTree tree{mesh};
    std::mt19937 rng{2};
    std::uniform_real_distribution<double> uniform{-1.5, 1.5};
    RegionTriangles nearby;
    for (int k = 0; k < 300; ++k) {
        const Vec3 x{uniform(rng), uniform(rng), uniform(rng)};
        double best = 1e300;
        for (const auto& [a, b, c] : mesh.triangles) {
            const auto at = [&](std::int32_t i) {
                return mesh.points[static_cast<std::size_t>(i)];
            };
            best = std::min(best, (x - closest_on_triangle(x, at(a), at(b), at(c)).point).norm());
        }
        CHECK(std::sqrt(tree.nearest(x, -1).squared) == doctest::Approx(best).epsilon(1e-14));
        CHECK(std::sqrt(tree.nearest(x, k).squared) == doctest::Approx(best).epsilon(1e-14));
        CHECK(std::sqrt(tree.nearest(x, -1, 0.1).squared) <= best * 1.1 + 1e-15);
        nearby.gather(mesh, tree, x + Vec3{0.05, -0.05, 0.02}, 0.08);
        CHECK(std::sqrt(nearby.nearest(x).squared) == doctest::Approx(best).epsilon(1e-14));
        nearby.select(x + Vec3{0.01, 0.01, -0.02}, 0.03);
        CHECK(std::sqrt(nearby.nearest(x).squared) == doctest::Approx(best).epsilon(1e-14));
    }
}

TEST_CASE(
    "where a search for the nearest triangle starts changes no bit of it and no choice on a tie")
{
    const SurfaceMesh mesh = *make_ball({Vec3{0.2, 0, 0}, 1, true, 0.4}).surface;
    const BoundingTree tree{mesh};
    const auto count = static_cast<std::int32_t>(mesh.triangles.size());
    std::mt19937 rng{3};
    std::uniform_real_distribution<double> uniform{-1.5, 1.5};
    for (int k = 0; k < 300; ++k) {
        Vec3 x{uniform(rng), uniform(rng), uniform(rng)};
        const auto& corners = mesh.triangles[static_cast<std::size_t>(k % count)];
        const auto corner = [&](int i) {
            return mesh.points[static_cast<std::size_t>(corners[static_cast<std::size_t>(i)])];
        };
        if (k % 3 == 0) x = corner(0);                      // of many triangles
        if (k % 3 == 1) x = 0.55 * (corner(0) + corner(1)); // above an edge: of two
        const NearestTriangle whole = tree.nearest(x, -1);
        for (std::int32_t near : {-1, 0, k % count, whole.triangle, count - 1, count}) {
            const NearestTriangle found = tree.nearest_within(x, near);
            CHECK(found.triangle == whole.triangle);
            CHECK(found.squared == whole.squared);
            CHECK(found.at.point == whole.at.point);
        }
    }
}

TEST_CASE("the tree visits each triangle whose box touches another, once, and no other")
{
    const SurfaceMesh mesh = *make_ball({Vec3{0.2, 0, 0}, 1, true, 0.4}).surface;
    const BoundingTree tree{mesh};
    std::mt19937 rng{4};
    std::uniform_real_distribution<double> uniform{-1.5, 1.5};
    for (int k = 0; k < 100; ++k) {
        BoundingBox box;
        box.add(Vec3{uniform(rng), uniform(rng), uniform(rng)});
        if (k % 3 > 0) box.add(Vec3{uniform(rng), uniform(rng), uniform(rng)});
        std::vector<std::int32_t> expected, visited;
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            BoundingBox own;
            for (const int corner : mesh.triangles[i])
                own.add(mesh.points[static_cast<std::size_t>(corner)]);
            if (own.touches(box)) expected.push_back(static_cast<std::int32_t>(i));
        }
        tree.visit(box, [&](std::int32_t i) { visited.push_back(i); });
        std::sort(visited.begin(), visited.end());
        CHECK(visited == expected);
    }
}

TEST_CASE("what is nearest in a region is found in any unit, among needles and large triangles")
{
    std::mt19937 rng{5};
    std::uniform_real_distribution<double> uniform{-1, 1};
    for (const double unit : {1e-15, 1e-3, 1.0, 1e12}) {
        SurfaceMesh mesh;
        const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
            const auto first = static_cast<std::int32_t>(mesh.points.size());
            for (const Vec3& x : {a, b, c})
                mesh.points.push_back(unit * x);
            mesh.triangles.push_back({first, first + 1, first + 2});
        };
        const auto place = [&] { return Vec3{uniform(rng), uniform(rng), uniform(rng)}; };
        for (int k = 0; k < 60; ++k) {
            const Vec3 a = place(), along = place(), aside = place();
            add(a, a + along, a + along / 3 + 1e-9 * aside); // of almost no area
            add(a, a + 0.1 * along, a + 0.1 * aside);
            add(a, a, a + 0.1 * along); // of none
        }
        add({-1e4, -1e4, 0.3}, {1e4, -1e4, 0.2}, {0, 2e4, -0.4});
        const BoundingTree tree{mesh};
        RegionTriangles nearby;
        for (int k = 0; k < 200; ++k) {
            const Vec3 centre = unit * place();
            nearby.gather(mesh, tree, centre, 0.2 * unit);
            const Vec3 middle = centre + 0.05 * unit * place();
            if (k % 2 == 0) nearby.select(middle, 0.1 * unit);
            const Vec3 x = middle + 0.05 * unit * place();
            CHECK(std::sqrt(nearby.nearest(x).squared) ==
                  doctest::Approx(std::sqrt(tree.nearest(x, -1).squared)).epsilon(1e-12));
        }
    }
}
