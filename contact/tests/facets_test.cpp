#include "contact/surface/facets.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <random>
#include <utility>

using namespace amontons;

namespace {

/// A unit square whose corners are moved by at most `moved`: convex for less than a quarter.
FaceInPlane square(std::mt19937& random, double moved, double size, bool mirrored)
{
    std::uniform_real_distribution<double> off(-1, 1);
    std::vector<Vec3> places{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    for (Vec3& x : places) {
        const double dx = off(random), dy = off(random);
        x = size * (x + Vec3(moved * dx, moved * dy, off(random)));
    }
    if (mirrored) std::swap(places[1], places[3]);
    const std::array<std::int32_t, 4> nodes{0, 1, 2, 3};
    return {nodes, places};
}

} // namespace

TEST_CASE("the place of a quadrilateral over a point is found from its place on the face")
{
    std::mt19937 random(5);
    std::uniform_real_distribution<double> inside(-1, 1);
    for (const double moved : {0.0, 1e-15, 1e-9, 1e-4, 0.1, 0.24})
        for (const double size : {1e-4, 1.0, 1e3})
            for (int trial = 0; trial < 200; ++trial) {
                const FaceInPlane face = square(random, moved, size, trial % 2 == 1);
                const double x = inside(random), y = inside(random);
                const FaceSpot at = spot(face, {x, y});
                const auto found = locate(face, at.place.head<2>(), Vec2::Zero());
                REQUIRE(found);
                // The least area per reference area of such squares is 0.02 of the square's.
                CHECK((found->values - at.values).norm() <= 1e-13);
                CHECK((found->place - at.place).norm() <= 1e-13 * size);
            }
}

TEST_CASE("a quadrilateral has no place over points beside it, on whichever side of its fold")
{
    std::mt19937 random(6);
    std::uniform_real_distribution<double> beyond(0.5, 40), along(-1, 1);
    int beside = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        const FaceInPlane face = square(random, 0.24, 1, trial % 2 == 1);
        // Farther beyond a side than the margin within which facets and faces may differ.
        const double t = along(random);
        const Vec3 border = spot(face, {1, t}).place, a = spot(face, {1, -1}).place,
                   b = spot(face, {1, 1}).place;
        Vec2 out((b - a).y(), (a - b).x());
        if (trial % 2 == 1) out = -out;
        const Vec2 z = border.head<2>() + beyond(random) * out;
        CHECK_FALSE(locate(face, z, Vec2::Zero()));
        ++beside;
    }
    CHECK(beside == 1000);
}
