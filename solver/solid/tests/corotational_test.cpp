#include "solver/solid/corotational.hpp"

#include "solver/solid/tests/solid_samples.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <doctest/doctest.h>
#include <numbers>
#include <random>

using namespace amontons;
using test::kAllKinds;

namespace {

struct CorotationalSample {
    CorotationalElement element;
    Eigen::Matrix3Xd X, x;
};

/// An element bent out of shape, strained by some percent and turned.
CorotationalSample corotational_sample(ElementKind kind, double strain, double angle, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> number(-1, 1);
    CorotationalSample s;
    s.X = reference_nodes(kind);
    for (Eigen::Index i = 0; i < s.X.size(); ++i)
        s.X.data()[i] += 0.03 * number(random);
    const SolidMaterial m{1e6, 0.3, 0};
    s.element = make_corotational(kind, s.X, elasticity_matrix(m));
    const Mat3 R =
        Eigen::AngleAxisd(angle, Vec3(number(random), number(random), number(random)).normalized())
            .toRotationMatrix();
    s.x = s.X;
    for (Eigen::Index i = 0; i < s.x.size(); ++i)
        s.x.data()[i] += strain * number(random);
    s.x = (R * s.x).colwise() + Vec3(3, -1, 2);
    return s;
}

} // namespace

TEST_CASE("a rigid motion by any angle leaves no energy or force or stress")
{
    // Benchmark E07.
    for (const ElementKind kind : kAllKinds)
        for (int k = 0; k <= 36; ++k) {
            const CorotationalSample s = corotational_sample(kind, 0, k * std::numbers::pi / 18, 5);
            ElementVector f;
            const CorotationalState state = corotational_forces(s.element, s.x, f);
            CHECK(state.u.norm() < 1e-13);
            CHECK(f.norm() < 1e-12 * 1e6);
        }
}

TEST_CASE("forces are the gradient of the energy and their derivative is the tangent")
{
    for (const ElementKind kind : kAllKinds)
        for (unsigned seed = 1; seed < 6; ++seed) {
            CorotationalSample s = corotational_sample(kind, 0.1, 2, seed);
            const Eigen::Index n = s.x.size();
            ElementVector f, plus, minus;
            const CorotationalState state = corotational_forces(s.element, s.x, f);
            ElementMatrix K;
            corotational_tangent(s.element, state, K);
            const double h = 1e-6;
            Eigen::MatrixXd difference(n, n);
            Eigen::VectorXd gradient(n);
            for (Eigen::Index j = 0; j < n; ++j) {
                const double x = s.x.data()[j];
                s.x.data()[j] = x + h;
                const double up = corotational_forces(s.element, s.x, plus).energy;
                s.x.data()[j] = x - h;
                const double down = corotational_forces(s.element, s.x, minus).energy;
                s.x.data()[j] = x;
                gradient[j] = (up - down) / (2 * h);
                difference.col(j) = (plus - minus) / (2 * h);
            }
            CHECK((gradient - f).norm() < 1e-7 * f.norm());
            CHECK((difference - K).norm() < 1e-7 * K.norm());
            CHECK((K - K.transpose()).norm() < 1e-12 * K.norm());
        }
}

TEST_CASE("forces and moments of an element are in balance")
{
    for (const ElementKind kind : kAllKinds) {
        const CorotationalSample s = corotational_sample(kind, 0.2, 1, 3);
        ElementVector f;
        corotational_forces(s.element, s.x, f);
        Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
        for (Eigen::Index i = 0; i < s.x.cols(); ++i) {
            force += f.segment<3>(3 * i);
            moment += s.x.col(i).cross(Vec3(f.segment<3>(3 * i)));
        }
        CHECK(force.norm() < 1e-11 * f.norm());
        CHECK(moment.norm() < 1e-11 * f.norm());
    }
}

TEST_CASE("the positive part of the tangent is positive and is the tangent at rest")
{
    for (const ElementKind kind : kAllKinds) {
        const CorotationalSample strained = corotational_sample(kind, 0.2, 1, 4),
                                 rest = corotational_sample(kind, 0, 1, 4);
        ElementVector f;
        ElementMatrix part, whole;
        corotational_stiffness(strained.element,
                               corotational_forces(strained.element, strained.x, f), part);
        const Eigen::VectorXd eigen =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(part).eigenvalues();
        CHECK(eigen.minCoeff() > -1e-9 * eigen.maxCoeff());
        const CorotationalState state = corotational_forces(rest.element, rest.x, f);
        corotational_stiffness(rest.element, state, part);
        corotational_tangent(rest.element, state, whole);
        CHECK((part - whole).norm() < 1e-9 * whole.norm());
    }
}
