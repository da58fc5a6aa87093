#include "solver/material/law.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <doctest/doctest.h>
#include <functional>
#include <random>

using namespace amontons;

namespace {

/// a + b e1 + c e2 + d e1 e2 with e1^2 = e2^2 = 0: the first two derivatives of any function of it
/// are exact, without a difference.
struct HyperDual {
    double a = 0, b = 0, c = 0, d = 0;
    HyperDual() = default;
    HyperDual(double value) : a(value) {}
    HyperDual(double x, double y, double z, double w) : a(x), b(y), c(z), d(w) {}
    friend HyperDual operator+(HyperDual x, HyperDual y)
    {
        return {x.a + y.a, x.b + y.b, x.c + y.c, x.d + y.d};
    }
    friend HyperDual operator-(HyperDual x, HyperDual y)
    {
        return {x.a - y.a, x.b - y.b, x.c - y.c, x.d - y.d};
    }
    friend HyperDual operator*(HyperDual x, HyperDual y)
    {
        return {x.a * y.a, x.a * y.b + x.b * y.a, x.a * y.c + x.c * y.a,
                x.a * y.d + x.b * y.c + x.c * y.b + x.d * y.a};
    }
    HyperDual of(double f, double df, double ddf) const
    {
        return {f, df * b, df * c, df * d + ddf * b * c};
    }
};
HyperDual log(HyperDual x)
{
    return x.of(std::log(x.a), 1 / x.a, -1 / (x.a * x.a));
}
HyperDual exp(HyperDual x)
{
    return x.of(std::exp(x.a), std::exp(x.a), std::exp(x.a));
}

using Dual3 = std::array<std::array<HyperDual, 3>, 3>;

HyperDual dual_determinant(const Dual3& F)
{
    HyperDual sum;
    for (std::size_t i = 0; i < 3; ++i)
        sum = sum + F[0][i] * (F[1][(i + 1) % 3] * F[2][(i + 2) % 3] -
                               F[1][(i + 2) % 3] * F[2][(i + 1) % 3]);
    return sum;
}

/// The energies as the literature has them, of F, without the code's tensors.
HyperDual energy_of(const Hyperelastic& m, const Dual3& F)
{
    Dual3 C;
    HyperDual I1, CC;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            for (std::size_t k = 0; k < 3; ++k)
                C[i][j] = C[i][j] + F[k][i] * F[k][j];
    for (std::size_t i = 0; i < 3; ++i) {
        I1 = I1 + C[i][i];
        for (std::size_t j = 0; j < 3; ++j)
            CC = CC + C[i][j] * C[i][j];
    }
    const HyperDual ln_J = log(dual_determinant(F)), half(0.5), three(3), one(1);
    const HyperDual I2 = half * (I1 * I1 - CC);
    const MaterialConstants& c = m.constants;
    const auto E = [&](std::size_t i, std::size_t j) {
        return half * (C[i][j] - HyperDual(i == j ? 1 : 0));
    };
    if (m.law->name == "guccione") {
        const HyperDual Q =
            HyperDual(c[1]) * E(0, 0) * E(0, 0) +
            HyperDual(c[2]) *
                (E(1, 1) * E(1, 1) + E(2, 2) * E(2, 2) + E(1, 2) * E(1, 2) + E(2, 1) * E(2, 1)) +
            HyperDual(c[3]) *
                (E(0, 1) * E(0, 1) + E(1, 0) * E(1, 0) + E(0, 2) * E(0, 2) + E(2, 0) * E(2, 0));
        return HyperDual(0.5 * c[0]) * (exp(Q) - one) + HyperDual(0.5 * c[4]) * ln_J * ln_J;
    }
    if (m.law->name == "mooney_rivlin") {
        const double mu = 2 * (c[0] + c[1]), lambda = 2 * mu * c[2] / (1 - 2 * c[2]) - 4 * c[1];
        return HyperDual(c[0]) * (I1 - three) + HyperDual(c[1]) * (I2 - three) -
               HyperDual(2 * c[0] + 4 * c[1]) * ln_J + HyperDual(0.5 * lambda) * ln_J * ln_J;
    }
    const double mu = c[0] / (2 * (1 + c[1])), lambda = 2 * mu * c[1] / (1 - 2 * c[1]);
    if (m.law->name == "neo_hooke")
        return HyperDual(0.5 * mu) * (I1 - three) - HyperDual(mu) * ln_J +
               HyperDual(0.5 * lambda) * ln_J * ln_J;
    HyperDual trace, square;
    for (std::size_t i = 0; i < 3; ++i) {
        trace = trace + E(i, i);
        for (std::size_t j = 0; j < 3; ++j)
            square = square + E(i, j) * E(i, j);
    }
    return HyperDual(0.5 * lambda) * trace * trace + HyperDual(mu) * square;
}

std::vector<Hyperelastic> samples()
{
    return {{find_law("st_venant_kirchhoff"), {2.0, 0.3}},
            {find_law("neo_hooke"), {2.0, 0.4}},
            {find_law("neo_hooke"), {2.0, 0.4999}},
            {find_law("mooney_rivlin"), {0.4, 0.1, 0.45}},
            {find_law("guccione"), {2.0, 8.0, 2.0, 4.0, 50.0}}};
}

Mat3 full(const Vec6& s)
{
    Mat3 m;
    m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    return m;
}

Mat3 random_gradient(std::mt19937& rng, double size)
{
    std::uniform_real_distribution<double> number(-1, 1);
    for (;;) {
        const Mat3 F = Mat3::Identity() + size * Mat3::NullaryExpr([&] { return number(rng); });
        if (F.determinant() > 0.2) return F;
    }
}

} // namespace

TEST_CASE("four points at once have the results of each alone")
{
    std::mt19937 rng{5};
    for (const Hyperelastic& m : samples()) {
        CAPTURE(m.law->name);
        Gradient<double> one[4];
        Gradient<Four> all;
        for (int k = 0; k < 4; ++k) {
            const Mat3 F = random_gradient(rng, 0.4);
            for (std::size_t i = 0; i < 9; ++i)
                all[i][k] = one[k][i] = F.data()[i];
        }
        const Strain<Four> at = strain_of(all);
        Response<Four> four;
        m.law->respond_four(m.constants, at, four);
        four.add_volume(at, true);
        for (int k = 0; k < 4; ++k) {
            const Strain<double> alone = strain_of(one[k]);
            Response<double> r;
            m.law->respond(m.constants, alone, r);
            r.add_volume(alone, true);
            CHECK(at.ln_J[k] == doctest::Approx(alone.ln_J).epsilon(1e-13));
            CHECK(four.energy[k] == doctest::Approx(r.energy).epsilon(1e-12));
            for (std::size_t i = 0; i < 6; ++i)
                CHECK(four.S[i][k] == doctest::Approx(r.S[i]).epsilon(1e-11));
            for (std::size_t i = 0; i < 21; ++i)
                CHECK(four.D[i][k] == doctest::Approx(r.D[i]).epsilon(1e-11));
        }
    }
}

TEST_CASE("stress and tangent are the derivatives of the energy to the last digits")
{
    std::mt19937 rng{3};
    for (const Hyperelastic& m : samples())
        for (int k = 0; k < 20; ++k) {
            CAPTURE(m.law->name);
            const Mat3 F = random_gradient(rng, 0.4);
            const PointResponse at = point_response(m, F);
            const Mat3 S = full(at.S), P = F * S;
            // dP = dF S + F dS, dS = D dE.
            Eigen::Matrix<double, 9, 9> A, exact;
            Mat3 exact_P;
            double energy = 0;
            for (int p = 0; p < 9; ++p) {
                const Mat3 dF =
                    Eigen::Map<const Mat3>(Eigen::Matrix<double, 9, 1>::Unit(p).eval().data());
                const Mat3 dE = 0.5 * (dF.transpose() * F + F.transpose() * dF);
                const Vec6 e{dE(0, 0),     dE(1, 1),     dE(2, 2),
                             2 * dE(0, 1), 2 * dE(1, 2), 2 * dE(0, 2)};
                const Mat3 dP = dF * S + F * full(at.D * e);
                A.col(p) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dP.data());
                for (int q = 0; q < 9; ++q) {
                    Dual3 x;
                    for (int i = 0; i < 3; ++i)
                        for (int j = 0; j < 3; ++j)
                            x[std::size_t(i)][std::size_t(j)] =
                                HyperDual(F(i, j), p == i + 3 * j, q == i + 3 * j, 0);
                    const HyperDual W = energy_of(m, x);
                    exact(q, p) = W.d;
                    exact_P.data()[p] = W.b;
                    energy = W.a;
                }
            }
            CHECK(std::abs(at.energy - energy) <= 1e-12 * (1 + std::abs(energy)) * at.D.norm());
            CHECK((P - exact_P).norm() <= 1e-12 * (exact_P.norm() + at.D.norm()));
            CHECK((A - exact).norm() <= 1e-11 * exact.norm());
            CHECK((at.D - at.D.transpose()).norm() <= 1e-15 * at.D.norm());
            // The test can fail: another tangent is not this one.
            CHECK((A - 1.0001 * exact).norm() > 1e-6 * exact.norm());
        }
}

TEST_CASE("a turn of space changes neither energy nor S and at rest there is no stress")
{
    std::mt19937 rng{4};
    std::normal_distribution<double> number;
    for (const Hyperelastic& m : samples()) {
        CAPTURE(m.law->name);
        const PointResponse rest = point_response(m, Mat3::Identity());
        CHECK(std::abs(rest.energy) < 1e-14);
        CHECK(rest.S.norm() < 1e-13 * rest.D.norm());
        for (int k = 0; k < 10; ++k) {
            const Mat3 F = random_gradient(rng, 0.3);
            const Mat3 Q = Eigen::Quaterniond(number(rng), number(rng), number(rng), number(rng))
                               .normalized()
                               .toRotationMatrix();
            const PointResponse a = point_response(m, F), b = point_response(m, Q * F);
            CHECK(std::abs(a.energy - b.energy) < 1e-12 * (1 + a.energy) * a.D.norm());
            CHECK((a.S - b.S).norm() < 1e-12 * a.D.norm());
            if (m.law->directed) { // turns about the fibre
                const Mat3 R = Eigen::AngleAxisd(0.7, Vec3::UnitX()).toRotationMatrix();
                CHECK(point_response(m, F * R).energy == doctest::Approx(a.energy).epsilon(1e-12));
                const Mat3 other = Eigen::AngleAxisd(0.7, Vec3::UnitZ()).toRotationMatrix();
                CHECK(std::abs(point_response(m, F * other).energy / a.energy - 1) > 1e-3);
            } else { // isotropic
                CHECK(point_response(m, F * Q).energy == doctest::Approx(a.energy).epsilon(1e-11));
            }
        }
    }
}

TEST_CASE("the energy grows without bound as a point is crushed or torn but for St. Venant's")
{
    for (const Hyperelastic& m : samples()) {
        CAPTURE(m.law->name);
        const auto energy = [&](double stretch) {
            return point_response(m, stretch * Mat3::Identity()).energy;
        };
        double before = 0;
        for (double l = 1.1; l < 3; l += 0.1) {
            CHECK(energy(l) > before);
            before = energy(l);
        }
        CHECK(energy(0.9) > 0);
        if (m.law->name == "st_venant_kirchhoff") {
            CHECK(energy(1e-9) < 10); // finite: an element could be turned inside out
        } else {
            CHECK(energy(1e-9) > 100 * energy(0.5));
            CHECK(energy(1e-30) > 5 * energy(1e-9));
            CHECK(point_response(m, 1e-9 * Mat3::Identity()).S[0] < -1e6);
        }
    }
}

TEST_CASE("at rest the constants are Young's modulus and Poisson's ratio")
{
    for (const Hyperelastic& m : samples()) {
        if (m.law->directed) continue;
        CAPTURE(m.law->name);
        const Mat6 compliance = point_response(m, Mat3::Identity()).D.inverse();
        CHECK(1 / compliance(0, 0) == doctest::Approx(youngs_modulus(m)).epsilon(1e-9));
        CHECK(-compliance(1, 0) / compliance(0, 0) ==
              doctest::Approx(poissons_ratio(m)).epsilon(1e-9));
    }
    const Hyperelastic m{find_law("mooney_rivlin"), {0.4e6, 0.1e6, 0.49}};
    CHECK(youngs_modulus(m) == doctest::Approx(2 * 1e6 * 1.49).epsilon(1e-12));
    CHECK(poissons_ratio(m) == doctest::Approx(0.49).epsilon(1e-12));
}

TEST_CASE("constants that are negative or no numbers or do not fit each other are named")
{
    for (const Hyperelastic& m : samples())
        CHECK(issues_of(m, "a.json", "/m").empty());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto first = [](const Hyperelastic& m) {
        const std::vector<Issue> issues = issues_of(m, "a.json", "/m");
        REQUIRE(!issues.empty());
        return issues.front();
    };
    CHECK(first({find_law("neo_hooke"), {-1, 0.3}}).place == "/m/youngs_modulus");
    CHECK(first({find_law("neo_hooke"), {1, 0.5}}).place == "/m/poisson_ratio");
    CHECK(first({find_law("neo_hooke"), {1, -0.1}}).allowed == ">= 0 and <= 0.4999999");
    CHECK(first({find_law("st_venant_kirchhoff"), {1, nan}}).place == "/m/poisson_ratio");
    CHECK(issues_of({find_law("guccione"), {0, -1, 0, nan, -5}}, "", "").size() == 5);
    // c2 alone resists a change of volume more than by this ratio.
    CHECK(first({find_law("mooney_rivlin"), {0.1, 0.4, 0.2}}).found == "0.2");
    CHECK(find_law("rubber") == nullptr);
}
