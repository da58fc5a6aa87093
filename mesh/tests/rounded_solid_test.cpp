#include "mesh/rounded_solid.hpp"

#include "mesh/orient_surface.hpp"
#include "mesh/tests/sample_surfaces.hpp"

#include <Eigen/Geometry>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

/// A box of the given edges around the origin, turned out of the axes.
SurfaceMesh turned_box(const Vec3& edges)
{
    const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    SurfaceMesh box = unit_cube();
    for (Vec3& x : box.points)
        x = turn * (x - 0.5 * Vec3::Ones()).cwiseProduct(edges);
    return box;
}

/// A ball of radius 1: an octahedron whose triangles are divided and pushed out.
SurfaceMesh ball(int rounds)
{
    SurfaceMesh mesh{
        {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(),
         -Vec3::UnitZ()},
        {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
    for (int round = 0; round < rounds; ++round) {
        SurfaceMesh finer{mesh.points, {}};
        const auto middle = [&](std::int32_t a, std::int32_t b) {
            finer.points.push_back((mesh.points[static_cast<std::size_t>(a)] +
                                    mesh.points[static_cast<std::size_t>(b)])
                                       .normalized());
            return static_cast<std::int32_t>(finer.points.size() - 1);
        };
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            for (const auto& t : {std::array{a, ab, ca}, std::array{ab, b, bc},
                                  std::array{ca, bc, c}, std::array{ab, bc, ca}})
                finer.triangles.push_back(t);
        }
        mesh = std::move(finer);
    }
    return mesh;
}

} // namespace

TEST_CASE("a closed surface winds once around its inside and twice where parts overlap")
{
    const SurfaceMesh one = unit_cube(), other = moved(unit_cube(), 1, Vec3(0.5, 0.4, 0.3));
    const WindingNumber number(together(one, other));
    const auto in = [](const Vec3& x) { return x.minCoeff() > 0 && x.maxCoeff() < 1; };
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-1, 2.5);
    for (int i = 0; i < 2000; ++i) {
        const Vec3 x(place(random), place(random), place(random));
        const int exact = in(x) + in(x - Vec3(0.5, 0.4, 0.3));
        CHECK(std::abs(number.at(x) - exact) < 0.01); // far cubes count as one triangle
    }
    SurfaceMesh inside_out = one;
    turn_around(inside_out);
    CHECK(WindingNumber(inside_out).at(Vec3(0.2, 0.3, 0.6)) == doctest::Approx(-1));
}

TEST_CASE("far groups of triangles change the winding number by less than a tenth")
{
    const WindingNumber number(ball(6)); // 32 768 triangles
    std::mt19937 random(7);
    std::uniform_real_distribution<double> place(-1.5, 1.5);
    for (int i = 0; i < 5000; ++i) {
        const Vec3 x(place(random), place(random), place(random));
        if (std::abs(x.norm() - 1) < 1e-3) continue;
        CHECK(std::abs(number.at(x) - (x.norm() < 1)) < 0.1);
    }
}

TEST_CASE("a rounded solid is the solid itself beside planes")
{
    const RoundedSolid solid(turned_box(Vec3(1, 1, 1)), 0.08);
    const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    for (double depth = -0.15; depth < 0.16; depth += 0.03) {
        const RoundedSolid::Sample s = solid.at(turn * Vec3(0.1, 0.5 + depth, -0.05));
        CHECK(s.value == doctest::Approx(depth).epsilon(1e-9));
        CHECK((s.gradient - turn * Vec3::UnitY()).norm() < 1e-7);
    }
    CHECK(solid.at(Vec3::Zero()).value < 0);
    CHECK(solid.at(Vec3(30, 20, -10)).value > 1);
}

TEST_CASE("a ball shrinks by width^2 / (3 R)")
{
    // The mean of the distance over the splines' kernel, whose variance is width^2 / 3 an axis,
    // is larger by half of that times the Laplacian of the distance, 2 / R.
    const double width = 0.1;
    const RoundedSolid solid(ball(6), width);
    for (const Vec3& way : {Vec3(1, 0, 0), Vec3(1, 2, 3), Vec3(-3, 1, 1)}) {
        Vec3 x = way.normalized();
        REQUIRE(solid.project(x));
        CHECK(1 - x.norm() == doctest::Approx(width * width / 3).epsilon(0.06));
    }
}

TEST_CASE("a right angle loses half a width and a cube's corner one width")
{
    const RoundedSolid solid(turned_box(Vec3(1, 1, 1)), 0.1);
    const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    for (const auto& [start, lost] : {std::pair{Vec3(0.5, 0.5, 0.1), 0.05},
                                      {Vec3(-0.5, 0.2, 0.5), 0.05},
                                      {Vec3(0.5, 0.5, 0.5), 0.1}}) {
        double inside = 1, outside = 0; // along the line to the middle of the nearest side
        const Vec3 way = -(start.array().abs() > 0.4).select(start, 0).matrix().normalized();
        while (inside - outside > 1e-9) {
            const double middle = 0.5 * (inside + outside);
            (solid.at(turn * (start + middle * 0.3 * way)).value < 0 ? inside : outside) = middle;
        }
        CHECK(0.3 * inside == doctest::Approx(lost).epsilon(0.2));
    }
}

TEST_CASE("the gradient is that of the value")
{
    const RoundedSolid solid(turned_box(Vec3(1, 0.3, 0.6)), 0.1);
    std::mt19937 random(11);
    std::uniform_real_distribution<double> place(-0.5, 0.5);
    for (int i = 0; i < 100; ++i) {
        const Vec3 x(place(random), place(random), place(random));
        const RoundedSolid::Sample s = solid.at(x);
        const double h = 1e-6;
        for (int k = 0; k < 3; ++k)
            CHECK((solid.at(x + h * Vec3::Unit(k)).value - solid.at(x - h * Vec3::Unit(k)).value) /
                      (2 * h) ==
                  doctest::Approx(s.gradient[k]).epsilon(1e-6));
    }
}

TEST_CASE("plates thinner than 0.8 widths vanish and those thicker than 1.1 widths stay")
{
    const double width = 0.1;
    for (const double thickness : {0.05, 0.08, 0.11, 0.2}) {
        const RoundedSolid solid(turned_box(Vec3(2, 2, thickness)), width);
        const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
        for (double along = -0.5; along < 0.5; along += 0.017)
            CHECK((solid.at(turn * Vec3(along, 0.3 * along, 0)).value < 0) == (thickness > width));
    }
}

TEST_CASE("a projection ends on the surface or states that there is none near")
{
    const RoundedSolid solid(turned_box(Vec3(1, 1, 1)), 0.1);
    for (const Vec3& start : turned_box(Vec3(1, 1, 1)).points) { // corners, which are rounded
        Vec3 x = start;
        REQUIRE(solid.project(x));
        CHECK(std::abs(solid.at(x).value) < 1e-6);
        CHECK((x - start).norm() > 0.03);
        CHECK((x - start).norm() < 0.1);
    }
    const RoundedSolid plate(turned_box(Vec3(2, 2, 0.02)), 0.1);
    Vec3 x = Vec3::Zero();
    CHECK_FALSE(plate.project(x));
}
