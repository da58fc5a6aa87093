#include "mesh/size_field.hpp"

#include "mesh/generate/ball.hpp"
#include "mesh/tests/sample_surfaces.hpp"

#include <doctest/doctest.h>
#include <random>

using namespace amontons;

TEST_CASE(
    "the size is that of the nearest way from a source, and its slope never exceeds the gradation")
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

TEST_CASE("1 / size^3 integrates to volume / size^3, and to the closed form of one source")
{
    const SurfaceMesh cube = unit_cube();
    CHECK(count_by_size(cube, SizeField(0.1, {}, 0.3)) == doctest::Approx(1000).epsilon(1e-6));
    const SurfaceMesh two =
        together(cube, moved(cube, 0.5, {0.25, 0.25, 0.25})); // a cavity: an even number of walls
    CHECK(count_by_size(two, SizeField(0.1, {}, 0.3)) == doctest::Approx(875).epsilon(0.02));
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
