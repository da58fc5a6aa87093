#include "solver/beam/table_law.hpp"

#include "mesh/tests/relative.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("a table's law is straight between its points and continues beyond them")
{
    const TableLaw law = make_table_law({{-3, -4}, {-1, -3}, {0, 0}, {2, 4}, {4, 5}});
    CHECK(law.at_rest == 2);
    const double exact[][2] = {{-5, -5}, {-2, -3.5}, {-0.5, -1.5}, {1, 2},
                               {3, 4.5}, {4, 5},     {6, 6}};
    for (const auto& [x, force] : exact) {
        CAPTURE(x);
        CHECK(law.at(x).force == test::relative(force).epsilon(1e-14));
    }
    CHECK(law.at(0).force == 0);
    CHECK(law.at(0).energy == 0);
    CHECK(law.beyond(0.7).force == 0);
    CHECK(law.beyond(3).force == test::relative(4.5 - 6).epsilon(1e-14));
    // Corners are rounded: between the stiffnesses 2 and 1/2 the middle has their mean.
    CHECK(law.at(2).stiffness == test::relative(1.25).epsilon(1e-14));
    CHECK(law.at(2).force == test::relative(4 - 1.5 * 0.1 / 4).epsilon(1e-14));
}

TEST_CASE("a table's force is the slope of its energy and its stiffness that of its force")
{
    const TableLaw law = make_table_law({{-3, -4}, {-1, -3}, {0, 0}, {2, 4}, {4, 5}});
    const double h = 1e-5;
    for (double x = -4.03; x < 6; x += 0.07) {
        CAPTURE(x);
        const TableLaw::Value v = law.at(x), up = law.at(x + h), down = law.at(x - h);
        CHECK((up.energy - down.energy) / (2 * h) == test::relative(v.force).epsilon(1e-8));
        CHECK((up.force - down.force) / (2 * h) == test::relative(v.stiffness).epsilon(1e-4));
    }
}
