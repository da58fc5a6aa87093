// The least of the reactions that W does not distinguish.

#include "contact/least_norm.hpp"
#include "contact/solvers/solve.hpp"

#include <Eigen/Geometry>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// A table of 10 kg, legs at the corners of 1 m x 1 m, under 100 N at a place on it.
ContactProblem table(const Eigen::Vector2d& at, double mu, double push)
{
    Eigen::MatrixXd G(12, 6);
    const Vec3 axes[] = {Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY()};
    for (int i = 0; i < 4; ++i) { // ++, +-, -+, --
        const Vec3 x(i < 2 ? 0.5 : -0.5, i % 2 == 0 ? 0.5 : -0.5, 0);
        for (int k = 0; k < 3; ++k)
            G.row(3 * i + k) << axes[k].transpose(), x.cross(axes[k]).transpose();
    }
    Eigen::VectorXd inverse(6), force(6);
    inverse << 0.1, 0.1, 0.1, 1.2, 1.2, 0.6;
    const Vec3 f(push, 0, -100);
    force << f, Vec3(at.x(), at.y(), 0).cross(f);
    ContactProblem p;
    p.W = Eigen::MatrixXd(G * inverse.asDiagonal() * G.transpose());
    p.q = G * inverse.cwiseProduct(force);
    p.mu = Eigen::VectorXd::Constant(4, mu);
    return p;
}

} // namespace

TEST_CASE("the least reactions of a table are those of statics at rest and sliding")
{
    // Benchmark B16: W/4 + W (x_i X + y_i Y) / sum x^2.
    SolverOptions options;
    options.least_norm = true;
    options.tolerance = 1e-10;
    const Eigen::Vector4d legs(40, 20, 30, 10);
    const ContactSolution rest = solve(table({0.1, 0.2}, 0.3, 0), options);
    REQUIRE(rest.certificate.status == SolveStatus::converged);
    for (int i = 0; i < 4; ++i) {
        CHECK(rest.reaction[3 * i] == doctest::Approx(legs[i]).epsilon(1e-7));
        CHECK(rest.reaction.segment<2>(3 * i + 1).norm() < 1e-6);
    }
    // Sliding, friction keeps to the motion and its share of the load.
    const ContactSolution sliding_at_start = solve(table({0.1, 0.2}, 0.3, 60), options);
    REQUIRE(sliding_at_start.certificate.status == SolveStatus::converged);
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
        sum += sliding_at_start.reaction[3 * i];
        const Eigen::Vector2d u = sliding_at_start.u.segment<2>(3 * i + 1);
        CHECK((sliding_at_start.reaction.segment<2>(3 * i + 1) +
               0.3 * sliding_at_start.reaction[3 * i] * u.normalized())
                  .norm() < 1e-6);
    }
    CHECK(sum == doctest::Approx(100));
}

TEST_CASE("the least reaction of the same motion: no larger than any other and the law holds")
{
    const ContactProblem p = table({0.1, 0.2}, 0.3, 0);
    // Another answer of the same motion: forces of opposite signs on the two diagonals.
    Eigen::VectorXd r = solve(p).reaction;
    for (int i = 0; i < 4; ++i)
        r[3 * i] += i == 0 || i == 3 ? 5 : -5;
    const auto least = least_norm_of_same_motion(p, r);
    REQUIRE(least);
    CHECK(least->norm() < r.norm());
    CHECK((p.W * *least - p.W * r).norm() < 1e-10);
    // Where the least would pull, there is none.
    const ContactProblem tilted = table({0.45, 0.45}, 0, 0);
    const Eigen::VectorXd one = solve(tilted).reaction;
    CHECK(one.minCoeff() > -1e-9);
    CHECK_FALSE(least_norm_of_same_motion(tilted, one));
}
