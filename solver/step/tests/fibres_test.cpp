#include "solver/body/fibres.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/LU>
#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("fibres are one direction a line of unit length and what is none is named with its line")
{
    const std::vector<Vec3> f = parse_fibres("# x y z\n2 0 0\n0, 1e-200, 0\n\n1;1;0\n", "a", 3);
    REQUIRE(f.size() == 3);
    CHECK((f[0] - Vec3::UnitX()).norm() < 1e-15);
    CHECK((f[1] - Vec3::UnitY()).norm() < 1e-15);
    CHECK((f[2] - Vec3(1, 1, 0).normalized()).norm() < 1e-15);
    const auto issue = [](const char* text, std::size_t count) {
        try {
            parse_fibres(text, "a.csv", count);
        } catch (const InputError& e) {
            return e.issues().front();
        }
        FAIL("accepted");
        return Issue{};
    };
    CHECK(issue("1 0 0\n0 0 0\n", 2).place == "line 2");
    CHECK(issue("1 0\n", 1).place == "line 1");
    CHECK(issue("1 0 nan\n", 1).found == "\"1 0 nan\"");
    CHECK(issue("1 0 0\n", 2).allowed.find('2') != std::string::npos);
    CHECK(issue("", 1).file == "a.csv");
    const Mat3 axes = fibre_axes({1, 2, 3});
    CHECK((axes.transpose() * axes - Mat3::Identity()).norm() < 1e-14);
    CHECK(axes.determinant() > 0);
}
