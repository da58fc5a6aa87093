#include "mesh/base/curve.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <limits>

using namespace amontons;

TEST_CASE("a curve is linear between its points and constant outside")
{
    const CurvePoints c = {{1, 10}, {3, 20}, {4, 0}};
    CHECK(curve_value(c, -5) == 10);
    CHECK(curve_value(c, 1) == 10);
    CHECK(curve_value(c, 2) == 15);
    CHECK(curve_value(c, 3) == 20);
    CHECK(curve_value(c, 3.75) == 5);
    CHECK(curve_value(c, 4) == 0);
    CHECK(curve_value(c, 99) == 0);
    CHECK(curve_rate(c, 0) == 0);
    CHECK(curve_rate(c, 1) == 5);
    CHECK(curve_rate(c, 3) == -20);
    CHECK(curve_rate(c, 4) == 0);
}

TEST_CASE("a curve without points is 0 and with one point constant")
{
    CHECK(curve_value({}, 1) == 0);
    CHECK(curve_rate({}, 1) == 0);
    CHECK(curve_value({{2, 7}}, 1) == 7);
    CHECK(curve_value({{2, 7}}, 3) == 7);
}

TEST_CASE("at a jump the later value holds")
{
    const CurvePoints c = {{0, 0}, {1, 1}, {1, 5}, {2, 5}};
    CHECK(curve_value(c, std::nextafter(1.0, 0.0)) == doctest::Approx(1));
    CHECK(curve_value(c, 1) == 5);
    CHECK(knots(c) == std::vector<double>{0, 1, 2});
}

TEST_CASE("steps that stop at the knots see every corner of the curve")
{
    const CurvePoints c = {{0, 0}, {0.1, 3}, {0.7, -1}};
    std::vector<double> seen;
    for (double t = -1; (t = next_knot(c, t)) < std::numeric_limits<double>::infinity();)
        seen.push_back(t);
    CHECK(seen == knots(c));
    // Exact at the knots, bit by bit: a drive ends where its author specified.
    for (const auto& [time, value] : c)
        CHECK(curve_value(c, time) == value);
}
