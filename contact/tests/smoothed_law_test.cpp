#include "contact/solvers/smoothed_law.hpp"

#include "contact/cone.hpp"

#include <Eigen/LU>
#include <cmath>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

/// Alart and Curnier's function, written from its definition.
Vec3 alart_curnier(double mu, const Vec3& r, const Vec3& u, double rho)
{
    const Vec3 z = r - rho * u;
    const double n = std::max(0.0, z[0]), t = z.tail<2>().norm(), R = mu * n;
    Vec3 projected{n, z[1], z[2]};
    if (t > R) projected.tail<2>() *= R / t;
    return r - projected;
}

} // namespace

TEST_CASE("without smoothing the law is that of Alart and Curnier with little of it near to it")
{
    std::mt19937 rng{1};
    std::normal_distribution<double> normal;
    for (int k = 0; k < 1000; ++k) {
        const double mu = 0.1 * (1 + k % 20);
        const Vec3 r = project_cone({normal(rng), normal(rng), normal(rng)}, mu);
        const Vec3 u{normal(rng), normal(rng), normal(rng)};
        const Vec3 exact = alart_curnier(mu, r, u, 3);
        CHECK((smoothed_frictional(mu, r, u, {}) - exact).norm() <= 1e-14 * (1 + exact.norm()));
        for (double epsilon : {1e-2, 1e-5, 1e-8}) {
            const Vec3 smooth = smoothed_frictional(mu, r, u, {.epsilon = epsilon});
            CHECK((smooth - exact).norm() <= 20 * epsilon);
        }
    }
}

TEST_CASE("the path: F = 0 means r_n u_n = epsilon^2 and friction inside its disc")
{
    // Solved for u at given r by Newton on the slip alone, then checked against the path's
    // equations.
    const Smoothing s{.epsilon = 0.05};
    const double mu = 0.6;
    for (double share : {0.0, 0.3, 0.9, 0.999}) {
        Vec3 r{0.8, share * mu * 0.8, 0}, u = Vec3::Zero();
        for (int k = 0; k < 50; ++k) {
            const LinearisedLaw law = linearise_frictional(mu, r, u, s);
            REQUIRE(!law.open);
            u -= law.residual / s.rho + law.D * law.residual;
        }
        CHECK(smoothed_frictional(mu, r, u, s).norm() <= 1e-12);
        CHECK(r[0] * u[0] == doctest::Approx(s.epsilon * s.epsilon));
        CHECK(u[1] <= 0); // against r_t
        const double slip = -u[1] / std::max(r[1], 1e-300);
        if (share > 0)
            CHECK(slip * (mu * mu * r[0] * r[0] - r[1] * r[1]) * s.rho ==
                  doctest::Approx(s.spread * s.spread * s.epsilon * s.epsilon * s.rho));
    }
}

TEST_CASE("the linearised law is the derivative")
{
    std::mt19937 rng{2};
    std::normal_distribution<double> normal;
    for (int k = 0; k < 200; ++k) {
        const Smoothing s{.epsilon = std::pow(10.0, -(k % 4)), .open = 0};
        const double mu = 0.2 * (1 + k % 8);
        const Vec3 r{std::abs(normal(rng)), 0.3 * normal(rng), 0.3 * normal(rng)};
        const Vec3 u{0.1 * normal(rng), 0.1 * normal(rng), 0.1 * normal(rng)};
        const LinearisedLaw law = linearise_frictional(mu, r, u, s);
        // dF = F_r dr + F_u du, D = F_u^-1 F_r: by central differences.
        Mat3 Fr, Fu;
        const double h = 1e-4 * s.epsilon;
        for (int a = 0; a < 3; ++a) {
            const Vec3 e = h * Vec3::Unit(a);
            Fr.col(a) =
                (smoothed_frictional(mu, r + e, u, s) - smoothed_frictional(mu, r - e, u, s)) /
                (2 * h);
            Fu.col(a) =
                (smoothed_frictional(mu, r, u + e, s) - smoothed_frictional(mu, r, u - e, s)) /
                (2 * h);
        }
        const double size = Fu.norm() * law.D.norm() + Fr.norm();
        CHECK((Fu * law.D - Fr).norm() <= 1e-5 * size + 1e-14 / h);
        // D's symmetric part without the coupling of the disc to r_n is semidefinite.
        CHECK(law.D(0, 0) >= 0);
        CHECK(law.D.bottomRightCorner<2, 2>().determinant() >= 0);
        CHECK(law.D(1, 1) >= 0);
    }
}

TEST_CASE("a frictionless contact is the normal part")
{
    const Smoothing s{.epsilon = 0.01};
    for (double r : {0.0, 0.3, 2.0})
        for (double u : {-0.4, 0.0, 0.7}) {
            const Vec3 both = smoothed_frictional(0.5, {r, 0, 0}, {u, 0, 0}, s);
            CHECK(smoothed_frictionless(r, u, s) == doctest::Approx(both[0]));
            const LinearisedLaw law = linearise_frictionless(r, u, s);
            CHECK(law.residual[0] == doctest::Approx(both[0]));
            CHECK(law.D(0, 0) ==
                  doctest::Approx(linearise_frictional(0.5, {r, 0, 0}, {u, 0, 0}, s).D(0, 0)));
        }
}
