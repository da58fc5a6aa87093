#include "contact/surface/polygon_sides.hpp"

#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

ConvexPolygon triangle(std::mt19937& random, double size)
{
    std::uniform_real_distribution<double> place(0, 1), part(-size, size);
    const Vec2 at(place(random), place(random));
    ConvexPolygon p;
    const auto near = [&] {
        const double x = part(random);
        return Vec2(at + Vec2(x, part(random)));
    };
    const Vec2 a = near(), b = near(), c = near();
    p.add(a);
    p.add(twice_area(a, b, c) > 0 ? b : c);
    p.add(twice_area(a, b, c) > 0 ? c : b);
    return p;
}

double sum(const std::vector<ConvexPolygon>& pieces)
{
    double total = 0;
    for (const ConvexPolygon& p : pieces)
        total += area(p);
    return total;
}

} // namespace

TEST_CASE("what two polygons share and what they do not is the whole")
{
    std::mt19937 random(3);
    for (int trial = 0; trial < 1000; ++trial) {
        const ConvexPolygon p = triangle(random, 0.5), q = triangle(random, 0.5);
        ConvexPolygon shared;
        std::vector<ConvexPolygon> rest;
        intersect(p, q, shared);
        subtract(p, q, 0, rest);
        CHECK(std::abs(area(shared) + sum(rest) - area(p)) < 1e-14);
        for (const ConvexPolygon& piece : rest) {
            intersect(piece, q, shared);
            CHECK(area(shared) < 1e-14);
        }
    }
}

TEST_CASE(
    "a polygon stays whole beside others and pieces under many layers grow with their corners")
{
    std::mt19937 random(5);
    ConvexPolygon p;
    for (const Vec2& corner : {Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 1)})
        p.add(corner);
    std::vector<ConvexPolygon> pieces{p}, rest;
    double before = 1;
    for (int layer = 0; layer < 200; ++layer) {
        ConvexPolygon q = triangle(random, 0.05), shared;
        rest.clear();
        double covered = 0;
        for (const ConvexPolygon& piece : pieces) {
            intersect(piece, q, shared);
            covered += area(shared);
            subtract(piece, q, 1e-14, rest);
        }
        std::swap(pieces, rest);
        CHECK(std::abs(sum(pieces) + covered - before) < 1e-12);
        before = sum(pieces);
    }
    CHECK(pieces.size() < 5000); // [regression] our own run
}

TEST_CASE("a polygon is cut by all sides of another at once as it is by one after the other")
{
    std::mt19937 random(7);
    int parts = 0, wholes = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        ConvexPolygon q = triangle(random, 0.5);
        if (trial % 2 == 0) { // four corners: one is cut off
            ConvexPolygon cut;
            keep_left(q, (q[0] + q[1]) / 2, (q[0] + 2 * q[2]) / 3, cut);
            if (cut.count != 4) keep_left(q, (q[0] + 2 * q[2]) / 3, (q[0] + q[1]) / 2, cut);
            REQUIRE(cut.count == 4);
            q = cut;
        }
        const ConvexPolygon p = triangle(random, trial % 3 == 0 ? 0.05 : 0.5);
        const PolygonSides sides(q);
        CHECK(shared_with(sides, p) == shared_with(q, p));
        ConvexPolygon one = p, other = p;
        const bool some = cut_to(q, one);
        CHECK(cut_to(sides, other) == some);
        if (!some) continue;
        parts += one.count != 3;
        wholes += shared_with(q, p) == Shared::all;
        REQUIRE(one.count == other.count);
        for (int i = 0; i < one.count; ++i)
            CHECK((one[i] - other[i]).norm() < 1e-13);
    }
    CHECK(parts > 300);
    CHECK(wholes > 20);
}
