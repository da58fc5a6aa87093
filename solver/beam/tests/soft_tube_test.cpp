#include "solver/beam/soft_tube.hpp"

#include "mesh/base/error.hpp"
#include "solver/beam/tests/held_tube.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>
#include <random>

using namespace amontons;

namespace {

constexpr double kThickness = 0.0015, kE = 0.6e6, kNu = 0.45;

SolidTubeOptions quarter_bend(ElementKind kind, int around, int along)
{
    Centreline line(Vec3(0.1, 0, 0), Vec3::UnitX(), Vec3::UnitY(), kTubeRadius);
    line.append_line(0.03, kTubeRadius);
    line.append_arc(0.04, std::numbers::pi / 2, 0.3, kTubeRadius);
    return {line, kThickness, around, 1, along, kind};
}

SolidTubeOptions straight(int around, int along, double length)
{
    Centreline line(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), kTubeRadius);
    line.append_line(length, kTubeRadius);
    return {line, kThickness, around, 2, along, ElementKind::H8};
}

SoftTube linear_tube(const SolidTubeOptions& o, double pressure = 0)
{
    return held_tube(o, {kE, kNu, 0}, pressure);
}

} // namespace

TEST_CASE(
    "weights of a place sum to one and their derivatives to nothing and those are derivatives")
{
    const SoftTube tube = linear_tube(quarter_bend(ElementKind::H8, 12, 16));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 20; ++i) {
        const double s = 0.09 * uniform(random), phi = 7 * (uniform(random) - 0.5), h = 1e-6;
        const TubePlace p = tube.place(s, phi), q = tube.place(s, phi + 2 * std::numbers::pi);
        double sum = 0, along = 0, around = 0;
        for (std::size_t a = 0; a < 16; ++a) {
            sum += p.weight[a];
            along += p.by_along[a];
            around += p.by_around[a];
            CHECK(q.weight[a] == doctest::Approx(p.weight[a]).epsilon(1e-9));
        }
        CHECK(sum == doctest::Approx(1).epsilon(1e-14));
        CHECK(std::abs(along) < 1e-10);
        CHECK(std::abs(around) < 1e-12);
        const TubePlace l = tube.place(s - h * 1e-2, phi), r = tube.place(s + h * 1e-2, phi);
        if (l.node == r.node)
            for (std::size_t a = 0; a < 16; ++a)
                CHECK((r.weight[a] - l.weight[a]) / (2e-2 * h) ==
                      doctest::Approx(p.by_along[a]).epsilon(1e-4));
    }
}

TEST_CASE("the compliance of places is symmetric and positive and what a whole solve gives")
{
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        SoftTube tube = linear_tube(quarter_bend(kind, 10, 12));
        const std::vector<TubePlace> places{tube.place(0.031, 0.4), tube.place(0.036, 0.6),
                                            tube.place(0.06, 3.0)};
        const Eigen::MatrixXd C = tube.compliance(places);
        CHECK((C - C.transpose()).norm() == 0);
        CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(C).eigenvalues().minCoeff() > 0);
        Eigen::VectorXd f(9);
        f << 0.1, -0.2, 0.05, 0, 0.3, 0.1, -0.1, 0.1, 0.2;
        std::vector<TubeForce> forces;
        Vec3 total = Vec3::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            forces.push_back({places[k], f.segment<3>(3 * Eigen::Index(k))});
            total += forces.back().force;
        }
        tube.set_forces(forces);
        const Eigen::VectorXd moved = C * f, whole = tube.whole_displacement(),
                              nodal = tube.nodal_forces();
        Vec3 sum = Vec3::Zero();
        for (Eigen::Index n = 0; n < nodal.size() / 3; ++n)
            sum += nodal.segment<3>(3 * n);
        CHECK((sum - total).norm() < 1e-14);
        for (std::size_t k = 0; k < 3; ++k) {
            Vec3 u = Vec3::Zero();
            for (std::size_t a = 0; a < 16; ++a)
                u += places[k].weight[a] *
                     whole.segment<3>(3 * tube.inner_nodes()[std::size_t(places[k].node[a])]);
            CHECK((u - moved.segment<3>(3 * Eigen::Index(k))).norm() < 1e-11 * moved.norm());
            CHECK((u - tube.displacement(places[k])).norm() < 1e-11 * moved.norm());
        }
        // Clapeyron: the work of the forces is twice the elastic energy.
        CHECK(f.dot(moved) == doctest::Approx(nodal.dot(whole)).epsilon(1e-11));
    }
}

TEST_CASE("a point is pulled back to where it was: x = y + u(y) and the gradient is its derivative")
{
    SoftTube tube = linear_tube(quarter_bend(ElementKind::H8, 16, 24), 2000);
    tube.set_forces(
        {{tube.place(0.05, 1), Vec3(0, 0.05, 0.1)}, {tube.place(0.055, 1.2), Vec3(0.05, 0, 0.1)}});
    const CurvePoint c = tube_sections(quarter_bend(ElementKind::H8, 16, 24)).size() > 0
                             ? quarter_bend(ElementKind::H8, 16, 24).centreline.at(0.052)
                             : CurvePoint{};
    const Vec3 x = c.position + 0.9 * kTubeRadius * c.tangent.unitOrthogonal();
    WallHint hint;
    const PulledBack b = tube.pull_back(x, hint);
    CHECK((b.y + b.u - x).norm() < 1e-14);
    CHECK((b.u - tube.displacement(b.place)).norm() < 1e-15);
    CHECK(b.u.norm() > 1e-5); // it has moved
    const double h = 1e-6;
    Mat3 inverse;
    for (int k = 0; k < 3; ++k)
        inverse.col(k) = (tube.pull_back(x + h * Vec3::Unit(k), hint).y -
                          tube.pull_back(x - h * Vec3::Unit(k), hint).y) /
                         (2 * h);
    CHECK((inverse * b.gradient - Mat3::Identity()).norm() < 1e-7);
}

TEST_CASE("pressure widens a long tube as Lame's solution states" * doctest::test_suite("slow"))
{
    // Plane strain between its held ends: u(a) of a cylinder under internal pressure p.
    const double p = 1000, a = kTubeRadius, b = kTubeRadius + kThickness;
    SoftTube tube = linear_tube(straight(48, 60, 0.15), p);
    const double expected =
        p * a * (1 + kNu) / kE * ((1 - 2 * kNu) * a * a + b * b) / (b * b - a * a);
    for (const double phi : {0.0, 1.0, 2.5}) {
        const Vec3 u = tube.displacement(tube.place(0.075, phi));
        CHECK(u.norm() == doctest::Approx(expected).epsilon(0.01));
        CHECK(std::abs(u[0]) < 1e-3 * expected);
    }
    CHECK(tube.loaded_displacement() == doctest::Approx(expected).epsilon(0.02));
}

TEST_CASE("a wall that nothing holds is refused")
{
    const SolidTubeOptions o = straight(8, 4, 0.02);
    CHECK_THROWS_AS(SoftTube(o, make_solid_tube(o), {kE, kNu, 0}, {}), InputError);
}
