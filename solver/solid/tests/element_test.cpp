#include "solver/solid/element.hpp"

#include "solver/solid/tests/solid_samples.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <doctest/doctest.h>

using namespace amontons;
using test::kAllKinds;

namespace {

constexpr double kRatios[] = {-0.5, 0.0, 0.3, 0.49, 0.4999};

Mat6 elasticity(double nu)
{
    return elasticity_matrix({1e6, nu, 0});
}

Eigen::VectorXd eigenvalues(const ElementMatrix& K)
{
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K, Eigen::EigenvaluesOnly).eigenvalues();
}

ElementMatrix element_stiffness(ElementKind kind, const ElementPlaces& X, const Mat6& C)
{
    ElementMatrix K;
    solid_stiffness(kind, X, C, K);
    return K;
}

/// Energy of the strains at the stiffness points.
double strain_energy(ElementKind kind, const ElementPlaces& X, const Mat6& C,
                     const ElementVector& u, const InternalModes& modes)
{
    double sum = 0;
    for (const QuadraturePoint& p : stiffness_points(kind)) {
        const Vec6 e = solid_strain(kind, X, u, modes, p.xi);
        sum += 0.5 * p.weight * (X * shape_gradients(kind, p.xi).transpose()).determinant() *
               e.dot(C * e);
    }
    return sum;
}

/// An order of the nodes that is a rotation of the reference element: its new node i is the old
/// order[i].
std::vector<Eigen::Index> turned(ElementKind kind, test::Random& random)
{
    const ShapeGradients at = reference_nodes(kind);
    Mat3 A;
    Vec3 shift = Vec3::Zero();
    do {
        std::array<int, 4> corner{0, 1, 2, 3};
        for (std::size_t i = 3; i > 0; --i)
            std::swap(corner[i], corner[std::size_t((random() + 1) / 2 * double(i + 1) * 0.999)]);
        if (kind == ElementKind::H8) {
            A.setZero();
            int row = 0;
            for (const int c : corner)
                if (c < 3) A(row++, c) = random() > 0 ? 1 : -1;
        } else {
            shift = at.col(corner[0]);
            for (int k = 0; k < 3; ++k)
                A.col(k) = at.col(corner[std::size_t(k) + 1]) - shift;
        }
    } while (A.determinant() < 0);
    std::vector<Eigen::Index> order;
    for (Eigen::Index i = 0; i < at.cols(); ++i) {
        Eigen::Index j = 0;
        (at.colwise() - (A * at.col(i) + shift)).colwise().squaredNorm().minCoeff(&j);
        order.push_back(j);
    }
    return order;
}

} // namespace

TEST_CASE("an element resists all but the six rigid motions and is symmetric to the last bit")
{
    test::Random random(1);
    for (const ElementKind kind : kAllKinds)
        for (const double nu : kRatios)
            for (int trial = 0; trial < 5; ++trial) {
                CAPTURE(shape_of(kind).name);
                CAPTURE(nu);
                const ElementPlaces X = test::distorted_element(kind, random);
                const ElementMatrix K = element_stiffness(kind, X, elasticity(nu));
                CHECK(K == K.transpose());
                const Eigen::VectorXd values = eigenvalues(K);
                CHECK(values.head<6>().cwiseAbs().maxCoeff() < 1e-14 * values.tail<1>()[0]);
                CHECK(values[6] > 1e-3 * 1e6); // E times a length of about 1
                const Mat3 spin = random.matrix();
                const ElementVector u = test::linear_displacement(X, spin - spin.transpose());
                CHECK((K * u).norm() < 1e-13 * K.norm() * u.norm());
            }
}

TEST_CASE("a constant strain is what it is anywhere in any element and stores its energy")
{
    test::Random random(2);
    for (const ElementKind kind : kAllKinds)
        for (const double nu : kRatios) {
            CAPTURE(shape_of(kind).name);
            CAPTURE(nu);
            const ElementPlaces X = test::distorted_element(kind, random);
            const Mat3 G = random.matrix();
            const Vec6 e = test::strain_of(G);
            const ElementVector u = test::linear_displacement(X, G);
            const Mat6 C = elasticity(nu);
            const InternalModes modes = solid_internal_modes(kind, X, C, u);
            if (kind == ElementKind::H8) CHECK(modes.norm() < 1e-11);
            CHECK((solid_strain(kind, X, u, modes, Vec3::Constant(0.2)) - e).norm() < 1e-11);
            CHECK(u.dot(element_stiffness(kind, X, C) * u) ==
                  doctest::Approx(e.dot(C * e) * solid_volume(kind, X)).epsilon(1e-11));
        }
}

TEST_CASE("the stiffness of T4 and T10 is that of displacements alone")
{
    test::Random random(3);
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10}) {
        const ElementPlaces X = test::distorted_element(kind, random);
        const ElementMatrix K = element_stiffness(kind, X, elasticity(0.3));
        CHECK((K - test::plain_stiffness(kind, X, elasticity(0.3))).norm() < 1e-13 * K.norm());
    }
}

TEST_CASE("internal modes take the amplitudes of least energy which is that of the stiffness")
{
    test::Random random(4);
    const ElementKind kind = ElementKind::H8;
    const ElementPlaces X = test::distorted_element(kind, random);
    for (const double nu : kRatios) {
        CAPTURE(nu);
        const Mat6 C = elasticity(nu);
        ElementVector u(24);
        for (double& x : u)
            x = random();
        InternalModes modes = solid_internal_modes(kind, X, C, u);
        const double least = strain_energy(kind, X, C, u, modes);
        CHECK(0.5 * u.dot(element_stiffness(kind, X, C) * u) ==
              doctest::Approx(least).epsilon(1e-11));
        CHECK(0.5 * u.dot(test::plain_stiffness(kind, X, C) * u) > 1.01 * least);
        for (Eigen::Index k = 0; k < modes.size(); ++k)
            for (const double d : {-1e-3, 1e-3}) {
                InternalModes other = modes;
                other[k] += d;
                CHECK(strain_energy(kind, X, C, u, other) > least);
            }
    }
}

TEST_CASE("an element does not depend on rotation or place or order of nodes or unit")
{
    test::Random random(5);
    for (const ElementKind kind : kAllKinds)
        for (int trial = 0; trial < 10; ++trial) {
            CAPTURE(shape_of(kind).name);
            const ElementPlaces X = test::distorted_element(kind, random);
            const Mat6 C = elasticity(0.3);
            const ElementMatrix K = element_stiffness(kind, X, C);
            const Eigen::Index n = X.cols();

            const Mat3 R = random.rotation();
            const ElementPlaces turned_X = (R * X).colwise() + random.vector();
            const ElementMatrix turned_K = element_stiffness(kind, turned_X, C);
            ElementMatrix back(3 * n, 3 * n);
            for (Eigen::Index i = 0; i < n; ++i)
                for (Eigen::Index j = 0; j < n; ++j)
                    back.block<3, 3>(3 * i, 3 * j) =
                        R.transpose() * turned_K.block<3, 3>(3 * i, 3 * j) * R;
            CHECK((back - K).norm() < 1e-13 * K.norm());

            const std::vector<Eigen::Index> order = turned(kind, random);
            const ElementMatrix other_K = element_stiffness(kind, X(Eigen::all, order), C);
            for (Eigen::Index i = 0; i < n; ++i)
                for (Eigen::Index j = 0; j < n; ++j)
                    CHECK((other_K.block<3, 3>(3 * i, 3 * j) -
                           K.block<3, 3>(3 * order[std::size_t(i)], 3 * order[std::size_t(j)]))
                              .norm() < 1e-13 * K.norm());

            // Millimetres and N/mm^2 give N/mm.
            const ElementMatrix in_mm = element_stiffness(kind, 1e3 * X, 1e-6 * C);
            CHECK((1e3 * in_mm - K).norm() < 1e-13 * K.norm());
        }
}

TEST_CASE("an H8 of incompressible material keeps one volume and not seven")
{
    // Eigenvalues that grow without bound as nu tends to 1/2 are what locks.
    test::Random random(6);
    const ElementKind kind = ElementKind::H8;
    for (const double shake : {0.0, 0.12}) {
        const ElementPlaces X = test::distorted_element(kind, random, shake);
        const Mat6 C = elasticity(0.5 - 1e-7);
        const auto stiff = [](const Eigen::VectorXd& values) {
            return (values.array() > 1e3 * 1e6).count(); // E times a length, 1000 times
        };
        CHECK(stiff(eigenvalues(element_stiffness(kind, X, C))) == 1);
        CHECK(stiff(eigenvalues(test::plain_stiffness(kind, X, C))) == 7);
    }
}

namespace {

/// A T10's masses from so many bytes deeper in the stack.
[[gnu::noinline]] ShapeValues masses_below(std::size_t bytes, const ElementPlaces& X)
{
    volatile char* const room = static_cast<char*>(__builtin_alloca(bytes));
    room[0] = 0;
    return solid_lumped_mass(ElementKind::T10, X, 1100);
}

} // namespace

TEST_CASE("lumped masses are the same bits wherever the stack is")
{
    test::Random random(11);
    for (int k = 0; k < 20; ++k) {
        const ElementPlaces X = test::distorted_element(ElementKind::T10, random);
        const ShapeValues first = masses_below(16, X);
        for (const std::size_t bytes : {32, 48, 64})
            CHECK(masses_below(bytes, X) == first);
    }
}

TEST_CASE("masses sum to density times volume and are positive and move a body as they should")
{
    test::Random random(7);
    const double density = 1100;
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const ElementPlaces X = test::distorted_element(kind, random);
        const double volume = solid_volume(kind, X);
        ElementMatrix M;
        solid_mass(kind, X, density, M);
        CHECK(M.sum() == doctest::Approx(density * volume).epsilon(1e-14));
        CHECK(M == M.transpose());
        CHECK(eigenvalues(M)[0] >
              1e-4 * eigenvalues(M).tail<1>()[0]); // [regression] of these shapes
        const ShapeValues lumped = solid_lumped_mass(kind, X, density);
        CHECK(lumped.sum() == doctest::Approx(density * volume).epsilon(1e-14));
        CHECK(lumped.minCoeff() > 0.01 * lumped.maxCoeff()); // [regression] of these shapes
        if (kind != ElementKind::T10)                        // the centre of mass stays
            CHECK((X * (lumped - M.rowwise().sum())).norm() < 1e-12 * density * volume);
        else // and rows would sum to less than nothing at a corner
            CHECK(M.rowwise().sum().minCoeff() < 0);

        const Vec3 force = random.vector();
        const ElementVector f = solid_body_force(kind, X, force);
        Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
        for (Eigen::Index i = 0; i < X.cols(); ++i) {
            sum += f.segment<3>(3 * i);
            torque += Vec3{X.col(i)}.cross(f.segment<3>(3 * i));
        }
        const Vec3 centre = X * M.rowwise().sum() / M.sum();
        CHECK((sum - volume * force).norm() < 1e-13 * volume);
        CHECK((torque - volume * centre.cross(force)).norm() < 1e-12 * volume);
    }
    // The simplest closed form: density V / 20 (1 + delta_ij).
    const ElementPlaces X = reference_nodes(ElementKind::T4);
    ElementMatrix M, expected = ElementMatrix::Ones(4, 4);
    solid_mass(ElementKind::T4, X, 120, M);
    expected.diagonal().array() += 1;
    CHECK((M - expected).norm() < 1e-14);
}

TEST_CASE("the volume of a curved element is exact")
{
    // The reference tetrahedron under x -> x + a y^2: its volume stays.
    ElementPlaces X = reference_nodes(ElementKind::T10);
    X.row(0).array() += 0.4 * X.row(1).array().square();
    CHECK(solid_volume(ElementKind::T10, X) == doctest::Approx(1.0 / 6).epsilon(1e-14));
}

TEST_CASE("an element that is inside out is refused")
{
    for (const ElementKind kind : kAllKinds) {
        ElementPlaces X = reference_nodes(kind);
        X.row(2) *= -1;
        ElementMatrix K;
        CHECK_THROWS_AS(solid_stiffness(kind, X, elasticity(0.3), K), std::logic_error);
    }
}
