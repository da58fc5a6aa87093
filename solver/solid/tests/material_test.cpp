#include "solver/solid/material.hpp"

#include <Eigen/LU>
#include <doctest/doctest.h>
#include <limits>

using namespace amontons;

TEST_CASE("the compliance of an isotropic material is 1/E and -nu/E and 1/G")
{
    for (const double nu : {-0.5, 0.0, 0.3, 0.4999}) {
        CAPTURE(nu);
        const SolidMaterial m{2.1e11, nu, 7800};
        const Mat6 C = elasticity_matrix(m);
        CHECK(C == C.transpose());
        const Mat6 S = C.inverse() * m.youngs_modulus;
        Mat6 expected = Mat6::Zero();
        expected.topLeftCorner<3, 3>().setConstant(-nu);
        expected.diagonal() << 1, 1, 1, 2 * (1 + nu), 2 * (1 + nu), 2 * (1 + nu);
        CHECK((S - expected).norm() < 1e-11);
        // All-round pressure: K; and lambda = K - 2/3 G.
        const Vec6 round = (Vec6{} << 1, 1, 1, 0, 0, 0).finished();
        CHECK((C * round - 3 * bulk_modulus(m) * round).norm() < 1e-14 * C.norm());
        CHECK(lame_lambda(m) == doctest::Approx(bulk_modulus(m) - 2 * shear_modulus(m) / 3));
    }
}

TEST_CASE("every fault of a material is named and none of a good one")
{
    CHECK(issues_of({1e6, 0.4999, 0}, "a.json", "/m").empty());
    CHECK(issues_of({1e6, -0.99, 1000}, "a.json", "/m").empty());
    const std::vector<Issue> issues = issues_of({-1, 0.5, -2}, "a.json", "/m");
    REQUIRE(issues.size() == 3);
    CHECK(issues[0].place == "/m/youngs_modulus");
    CHECK(issues[1].place == "/m/poissons_ratio");
    CHECK(issues[1].found == "0.5");
    CHECK(issues[2].place == "/m/density");
    CHECK(issues_of(SolidMaterial{0, -1, 0}, "", "").size() == 2);
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinite = std::numeric_limits<double>::infinity();
    CHECK(issues_of({infinite, nan, infinite}, "", "").size() == 3);
}
