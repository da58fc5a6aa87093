#include "mesh/size_field.hpp"

#include "mesh/orient_surface.hpp"
#include "mesh/tests/sample_surfaces.hpp"

#include <Eigen/Geometry>
#include <doctest/doctest.h>
#include <numbers>
#include <random>

using namespace amontons;

TEST_CASE(
    "the size is that of the nearest way from a source and its slope never exceeds the gradation")
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<SizeSource> sources;
    for (int i = 0; i < 50; ++i)
        sources.push_back(
            {{uniform(random), uniform(random), uniform(random)}, 0.01 + 0.1 * uniform(random)});
    const SizeField field(0.2, sources, 0.3);
    for (int n = 0; n < 500; ++n) {
        const Vec3 x{uniform(random), uniform(random), uniform(random)},
            y{uniform(random), uniform(random), uniform(random)};
        double expected = 0.2;
        for (const SizeSource& s : sources)
            expected = std::min(expected, s.size + 0.3 * (x - s.at).norm());
        CHECK(field.at(x) == doctest::Approx(expected).epsilon(1e-14));
        CHECK(std::abs(field.at(x) - field.at(y)) <= 0.3 * (x - y).norm() + 1e-15);
    }
}

TEST_CASE("1 / size^3 integrates to volume / size^3 and to the closed form of one source")
{
    const SurfaceMesh cube = unit_cube();
    CHECK(count_by_size(cube, SizeField(0.1, {}, 0.3)) == doctest::Approx(1000).epsilon(1e-6));
    SurfaceMesh two = cube; // a cavity: an even number of walls
    turn_around(two);
    two = together(cube, moved(two, 0.5, {0.25, 0.25, 0.25}));
    CHECK(count_by_size(two, SizeField(0.1, {}, 0.3)) == doctest::Approx(875).epsilon(1e-6));
    // Its middle is hollow, so a fine size there counts only where it reaches the walls.
    const SizeField middle(0.1, {{{0.5, 0.5, 0.5}, 0.05}}, 0.2);
    CHECK(count_by_size(two, middle) == doctest::Approx(875).epsilon(1e-6));
    CHECK(count_by_size(cube, middle) > 1030); // [regression] our own run
    // Around the cube's centre: size s0 + g r up to r = 0.4, then 1 / S^3 outside of that ball.
    const double s0 = 0.02, g = 0.2, reach = 0.4, far = s0 + g * reach;
    double ball = 0;
    const int n = 100000;
    for (int i = 0; i < n; ++i) {
        const double r = reach * (i + 0.5) / n;
        ball += 4 * 3.14159265358979323846 * r * r / std::pow(s0 + g * r, 3) * reach / n;
    }
    const double rest =
        (1 - 4. / 3 * 3.14159265358979323846 * std::pow(reach, 3)) / std::pow(far, 3);
    CHECK(count_by_size(cube, SizeField(far, {{{0.5, 0.5, 0.5}, s0}}, g)) ==
          doctest::Approx(ball + rest).epsilon(0.01));
}

TEST_CASE("slender bodies are counted in any orientation")
{
    const double width = 0.001, length = 0.15;
    SurfaceMesh rod = unit_cube();
    for (Vec3& x : rod.points)
        x = x.cwiseProduct(Vec3(width, width, length));
    const double volume = width * width * length;
    const Eigen::AngleAxisd about(0.6, Vec3(0.3, -0.5, 0.8).normalized());
    for (const Mat3& turned :
         {Mat3(Mat3::Identity()), Mat3(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX())),
          Mat3(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY())),
          Mat3(Eigen::AngleAxisd(1.0, Vec3(1, 1, 0).normalized())), Mat3(about)}) {
        SurfaceMesh lies = rod;
        for (Vec3& x : lies.points)
            x = turned * x;
        CHECK(count_by_size(lies, SizeField(5e-4, {}, 0.3)) ==
              doctest::Approx(volume / std::pow(5e-4, 3)).epsilon(1e-6));
        // Finer at one end; along the rod the size is that of the axis within a width.
        const SizeField graded(5e-4, {{turned * Vec3(width / 2, width / 2, 0), 2e-4}}, 0.01);
        double expected = 0;
        const int n = 20000;
        for (int i = 0; i < n; ++i)
            expected += width * width * length / n /
                        std::pow(std::min(5e-4, 2e-4 + 0.01 * length * (i + 0.5) / n), 3);
        CHECK(count_by_size(lies, graded) == doctest::Approx(expected).epsilon(0.03));
    }
}
