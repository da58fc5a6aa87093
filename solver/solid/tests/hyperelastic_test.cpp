#include "solver/solid/hyperelastic.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/solid/tests/solid_samples.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

std::vector<Hyperelastic> materials()
{
    return {{find_law("st_venant_kirchhoff"), {1e6, 0.3}},
            {find_law("neo_hooke"), {1e6, 0.3}},
            {find_law("neo_hooke"), {1e6, 0.4999}},
            {find_law("mooney_rivlin"), {2e5, 1e5, 0.49}},
            {find_law("guccione"), {1e5, 8, 2, 4, 1e7}}};
}

Mat3 some_axes()
{
    return Eigen::AngleAxisd(0.8, Vec3(1, 2, -1).normalized()).toRotationMatrix();
}

/// An element bent out of shape, then moved.
struct HyperelasticSample {
    HyperelasticElement element;
    Eigen::Matrix3Xd X, x;
};

HyperelasticSample hyperelastic_sample(ElementKind kind, double strain, unsigned seed)
{
    test::Random random(seed);
    HyperelasticSample s;
    s.X = test::distorted_element(kind, random, 0.08);
    s.element = make_hyperelastic(kind, s.X, some_axes());
    s.x = s.X;
    for (Eigen::Index i = 0; i < s.x.size(); ++i)
        s.x.data()[i] += (kind == ElementKind::T10 ? 0.4 : 1) * strain * random();
    s.x = (random.rotation() * s.x).colwise() + Vec3(3, -1, 2);
    return s;
}

double energy(const HyperelasticSample& s, const Hyperelastic& m, const Eigen::Matrix3Xd& x,
              ElementVector& f)
{
    HyperelasticState state;
    REQUIRE(hyperelastic_forces(s.element, m, x, state, f) == ElementFault::none);
    return state.energy;
}

} // namespace

TEST_CASE("forces are the gradient of the energy and the tangent is their derivative")
{
    for (const ElementKind kind : test::kAllKinds)
        for (const Hyperelastic& m : materials())
            for (unsigned seed = 1; seed < 4; ++seed) {
                CAPTURE(m.law->name);
                CAPTURE(int(kind));
                const HyperelasticSample s = hyperelastic_sample(kind, 0.06, seed);
                const Eigen::Index n = s.x.size();
                ElementVector f, plus[2], minus[2];
                HyperelasticState state;
                REQUIRE(hyperelastic_forces(s.element, m, s.x, state, f) == ElementFault::none);
                ElementMatrix K;
                hyperelastic_tangent(s.element, m, s.x, state, K);
                Eigen::MatrixXd difference(n, n);
                Eigen::VectorXd gradient(n);
                for (Eigen::Index j = 0; j < n; ++j) {
                    double slope[2];
                    for (int k = 0; k < 2; ++k) { // Richardson: error of order h^4
                        const double h = 2e-4 / (k + 1);
                        Eigen::Matrix3Xd x = s.x;
                        x.data()[j] += h;
                        const double up = energy(s, m, x, plus[k]);
                        x.data()[j] = s.x.data()[j] - h;
                        const double down = energy(s, m, x, minus[k]);
                        slope[k] = (up - down) / (2 * h);
                        plus[k] = ((plus[k] - minus[k]) / (2 * h)).eval();
                    }
                    gradient[j] = (4 * slope[1] - slope[0]) / 3;
                    difference.col(j) = (4 * plus[1] - plus[0]) / 3;
                }
                CHECK((gradient - f).norm() < 1e-7 * (f.norm() + K.norm()));
                CHECK((difference - K).norm() < 1e-6 * K.norm());
                CHECK((K - K.transpose()).norm() < 1e-12 * K.norm());
                CHECK((difference - 1.001 * K).norm() > 1e-5 * K.norm()); // it can fail
            }
}

namespace {

/// The volume of an element there.
double volume(ElementKind kind, const Eigen::Matrix3Xd& x)
{
    double v = 0;
    for (const QuadraturePoint& p : stiffness_points(kind))
        v += p.weight * (x * shape_gradients(kind, p.xi).transpose()).determinant();
    return v;
}

} // namespace

TEST_CASE(
    "the pressure of a mean volume as an unknown of its own: the matrix and its condensed form")
{
    const Hyperelastic rubber{find_law("neo_hooke"), {1e6, 0.4999}};
    const double mu = 1e6 / 2.9998, lambda = 2 * mu * 0.4999 / 0.0002;
    for (const ElementKind kind : {ElementKind::T10, ElementKind::H8}) {
        CAPTURE(int(kind));
        const HyperelasticSample s = hyperelastic_sample(kind, 0.06, 4),
                                 other = hyperelastic_sample(kind, 0.06, 5);
        const double V = volume(kind, s.X);
        const double share =
            lambda - mu * (kind == ElementKind::T10 ? kPointwiseLambda : kPointwiseLambdaOfH8);
        const auto answer = [&](const Eigen::Matrix3Xd& x) {
            const double J = volume(kind, x) / V;
            return share * std::log(J) / J;
        };
        const Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, s.x.cols());
        const double p = pressure_after(s.element, rubber, s.x, rest);
        CHECK(p == doctest::Approx(answer(s.x)).epsilon(1e-9));

        // Half a motion leads half as far, and a small one where the places' own answer is.
        const Eigen::Matrix3Xd move = 0.01 * (other.x - other.X.colwise().mean().replicate(3, 1));
        const double whole = pressure_after(s.element, rubber, s.x, move) - p,
                     half = pressure_after(s.element, rubber, s.x, 0.5 * move) - p;
        CHECK(half == doctest::Approx(0.5 * whole).epsilon(1e-9));
        const double h = 1e-4;
        CHECK((answer(s.x + h * move) - answer(s.x - h * move)) / (2 * h) ==
              doctest::Approx(whole).epsilon(1e-6));

        // With another pressure the matrix has as much more of the volume's second derivatives,
        // which differences give exactly: it is cubic.
        HyperelasticState state;
        ElementVector f;
        REQUIRE(hyperelastic_forces(s.element, rubber, s.x, state, f) == ElementFault::none);
        ElementMatrix own, same, more;
        hyperelastic_tangent(s.element, rubber, s.x, state, own);
        state.pressure = p;
        hyperelastic_tangent(s.element, rubber, s.x, state, same);
        CHECK((same - own).norm() < 1e-9 * own.norm());
        state.pressure = p + 1e6;
        hyperelastic_tangent(s.element, rubber, s.x, state, more);
        const Eigen::Index n = s.x.size();
        Eigen::MatrixXd second(n, n);
        const auto at = [&](Eigen::Index i, double a, Eigen::Index j, double b) {
            Eigen::Matrix3Xd x = s.x;
            x.data()[i] += a;
            x.data()[j] += b;
            return volume(kind, x);
        };
        for (Eigen::Index j = 0; j < n; ++j)
            for (Eigen::Index i = 0; i < n; ++i)
                second(i, j) =
                    (at(i, 1, j, 1) - at(i, 1, j, -1) - at(i, -1, j, 1) + at(i, -1, j, -1)) / 4;
        CHECK((more - own - 1e6 * second).norm() < 1e-9 * (own.norm() + 1e6 * second.norm()));
        CHECK(second.norm() * 1e6 > 1e-4 * own.norm()); // it can fail

        // Forces leave it alone: Newton's next matrix is made with it.
        REQUIRE(hyperelastic_forces(s.element, rubber, s.x, state, f) == ElementFault::none);
        CHECK(state.pressure == p + 1e6);
    }
    const HyperelasticSample t4 = hyperelastic_sample(ElementKind::T4, 0.06, 4);
    CHECK(std::isnan(pressure_after(t4.element, rubber, t4.x, t4.x)));
}

TEST_CASE("a rigid motion causes no force and a turned state has the same forces, turned")
{
    for (const ElementKind kind : test::kAllKinds)
        for (const Hyperelastic& m : materials()) {
            const HyperelasticSample rest = hyperelastic_sample(kind, 0, 7),
                                     s = hyperelastic_sample(kind, 0.05, 8);
            ElementVector f, turned;
            HyperelasticState state, other;
            REQUIRE(hyperelastic_forces(rest.element, m, rest.x, state, f) == ElementFault::none);
            ElementMatrix K;
            hyperelastic_tangent(rest.element, m, rest.x, state, K);
            CHECK(f.norm() < 1e-13 * K.norm());
            CHECK(std::abs(state.energy) < 1e-12 * K.norm());
            REQUIRE(hyperelastic_forces(s.element, m, s.x, state, f) == ElementFault::none);
            const Mat3 Q = Eigen::AngleAxisd(2.1, Vec3(1, 1, 3).normalized()).toRotationMatrix();
            REQUIRE(hyperelastic_forces(s.element, m, Q * s.x, other, turned) ==
                    ElementFault::none);
            for (Eigen::Index i = 0; i < f.size(); i += 3)
                CHECK((Q * f.segment<3>(i) - turned.segment<3>(i)).norm() < 1e-9 * f.norm());
            Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
            for (Eigen::Index i = 0; i < s.x.cols(); ++i) {
                force += f.segment<3>(3 * i);
                moment += s.x.col(i).cross(Vec3(f.segment<3>(3 * i)));
            }
            CHECK(force.norm() < 1e-10 * f.norm());
            CHECK(moment.norm() < 1e-9 * f.norm());
        }
}

TEST_CASE("a uniform deformation of a distorted element is that of the point: patch test")
{
    Mat3 F;
    F << 1.2, 0.3, -0.1, 0.05, 0.8, 0.2, 0.1, -0.2, 1.1;
    for (const ElementKind kind : test::kAllKinds)
        for (const Hyperelastic& m : materials()) {
            CAPTURE(m.law->name);
            CAPTURE(int(kind));
            const HyperelasticSample s = hyperelastic_sample(kind, 0, 11);
            HyperelasticState state;
            ElementVector f;
            const Eigen::Matrix3Xd x = F * s.X;
            REQUIRE(hyperelastic_forces(s.element, m, x, state, f) == ElementFault::none);
            const Mat3 axes = some_axes();
            const PointResponse p = point_response(m, F * axes);
            const double volume = solid_volume(kind, s.X);
            CHECK(state.energy == doctest::Approx(p.energy * volume).epsilon(1e-10));
            if (state.modes.size() > 0) CHECK(state.modes.norm() < 1e-10);
            // The virtual work of the forces on any uniform motion is P : H volume.
            Mat3 S;
            S << p.S[0], p.S[3], p.S[5], p.S[3], p.S[1], p.S[4], p.S[5], p.S[4], p.S[2];
            const Mat3 P = F * axes * S * axes.transpose();
            test::Random random(2);
            const Mat3 H = random.matrix();
            const double work = f.dot(test::linear_displacement(s.X, H));
            CHECK(work == doctest::Approx((P.cwiseProduct(H)).sum() * volume).epsilon(1e-9));
            const HyperelasticMean mean = hyperelastic_mean(s.element, m, x, state);
            const Mat3 sigma = P * F.transpose() / F.determinant();
            CHECK(mean.stress[0] == doctest::Approx(sigma(0, 0)).epsilon(1e-8));
            CHECK(mean.stress[3] == doctest::Approx(sigma(0, 1)).epsilon(1e-8));
        }
}

TEST_CASE("at rest the tangent is the linear element's stiffness")
{
    for (const ElementKind kind : test::kAllKinds)
        for (const char* law : {"st_venant_kirchhoff", "neo_hooke"}) {
            const double nu = kind == ElementKind::H8 ? 0.47 : 0.35; // all of lambda at points
            const HyperelasticSample s = hyperelastic_sample(kind, 0, 12);
            HyperelasticState state;
            ElementVector f;
            const Hyperelastic m{find_law(law), {1e6, nu}};
            REQUIRE(hyperelastic_forces(s.element, m, s.X, state, f) == ElementFault::none);
            ElementMatrix K, linear;
            hyperelastic_tangent(s.element, m, s.X, state, K);
            solid_stiffness(kind, s.X, elasticity_matrix({1e6, nu, 0}), linear);
            CHECK((K - linear).norm() < 1e-11 * linear.norm());
        }
}

TEST_CASE("nearly incompressible elements have one stiff motion each and not four or seven")
{
    for (const ElementKind kind : {ElementKind::T10, ElementKind::H8}) {
        const HyperelasticSample s = hyperelastic_sample(kind, 0.04, 13);
        HyperelasticState state;
        ElementVector f;
        const Hyperelastic m{find_law("neo_hooke"), {1e6, 0.4999999}};
        ElementMatrix K;
        Eigen::Matrix3Xd x = s.X; // sheared: no change of volume
        x.row(0) += 0.2 * s.X.row(1);
        REQUIRE(hyperelastic_forces(s.element, m, x, state, f) == ElementFault::none);
        hyperelastic_tangent(s.element, m, x, state, K);
        const Eigen::VectorXd eigen =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues();
        const Eigen::Index n = eigen.size();
        CHECK(eigen[n - 1] > 1e4 * eigen[n - 2]); // [regression] our own run
    }
}

TEST_CASE("a small stiff element far from the origin has its strain to rounding")
{
    // A wall's element: with places of 0.3 m for 1.5 mm it had strains of 1e-13.
    constexpr double kSize = 1.5e-3, kModulus = 1e9, kStrain = 1e-7;
    for (const ElementKind kind : test::kAllKinds) {
        CAPTURE(int(kind));
        SolidBoxOptions box;
        box.lowest = Vec3(0.3123, 0.2456, -0.2789);
        box.highest = box.lowest + Vec3::Constant(kSize);
        box.kind = kind;
        const VolumeMesh mesh = make_solid_box(box);
        const Hyperelastic m{find_law("neo_hooke"), {kModulus, 0.3}};
        Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size())), inner = u;
        const auto forces = [&] {
            inner.setZero();
            for_each_element(
                mesh, [&](std::int32_t, ElementKind k, std::span<const std::int32_t> nodes) {
                    const HyperelasticElement e =
                        make_hyperelastic(k, places_of(mesh, nodes), Mat3::Identity());
                    HyperelasticState state;
                    ElementVector f;
                    REQUIRE(hyperelastic_forces(e, m, displaced_places(mesh, nodes, u), state, f) ==
                            ElementFault::none);
                    for (std::size_t i = 0; i < nodes.size(); ++i)
                        inner.segment<3>(3 * nodes[i]) += f.segment<3>(3 * Eigen::Index(i));
                });
        };
        forces();
        CHECK(inner.norm() < 4e-15 * kModulus * kSize * kSize);
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i) // sheared: the faces' tractions
            u[3 * Eigen::Index(i)] = kStrain * (mesh.nodes[i].z() - box.lowest.z());
        forces();
        double above = 0;
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
            if (mesh.nodes[i].z() > box.highest.z() - 0.1 * kSize)
                above += inner[3 * Eigen::Index(i)];
        const double shear = kModulus / 2.6 * kStrain * kSize * kSize;
        CHECK(above == doctest::Approx(shear).epsilon(2e-8));
    }
}

TEST_CASE("a block that its boundary compresses uniformly does not buckle within")
{
    // Laws that are polyconvex are stable so: what an element loses is its own doing.
    for (const ElementKind kind : test::kAllKinds)
        for (const double nu : {0.3, 0.49})
            for (const double l : {0.8, 0.5, 0.3}) {
                CAPTURE(int(kind));
                CAPTURE(nu);
                CAPTURE(l);
                SolidBoxOptions box;
                box.cells = {3, 3, 3};
                box.kind = kind;
                const VolumeMesh mesh = make_solid_box(box);
                const Hyperelastic m{find_law("neo_hooke"), {1e6, nu}};
                // Lateral stretch of a bar that is free to widen.
                const double mu = 1e6 / (2 * (1 + nu)), lambda = 2 * mu * nu / (1 - 2 * nu);
                double t = 1;
                for (int k = 0; k < 200; ++k) { // mu (t^2 - 1) + lambda ln(l t^2) = 0
                    const double g = mu * (t * t - 1) + lambda * std::log(l * t * t);
                    t -= g / (2 * mu * t + 2 * lambda / t);
                }
                const Mat3 F = Vec3(t, t, l).asDiagonal();
                const SolidPattern pattern = make_pattern(mesh);
                SparseMatrix K = zero_matrix(pattern);
                assemble(
                    mesh, pattern,
                    [&](std::int32_t, ElementKind k, std::span<const std::int32_t> nodes,
                        ElementMatrix& block) {
                        const ElementPlaces X = places_of(mesh, nodes);
                        const HyperelasticElement e = make_hyperelastic(k, X, Mat3::Identity());
                        HyperelasticState state;
                        ElementVector f;
                        const Eigen::Matrix3Xd x = F * X;
                        CHECK(hyperelastic_forces(e, m, x, state, f) == ElementFault::none);
                        hyperelastic_tangent(e, m, x, state, block);
                    },
                    K);
                std::vector<std::int32_t> held;
                for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
                    if (mesh.nodes[i].minCoeff() < 1e-9 || mesh.nodes[i].maxCoeff() > 1 - 1e-9)
                        for (int axis = 0; axis < 3; ++axis)
                            held.push_back(std::int32_t(3 * i) + axis);
                const FreeDofs dofs = make_free_dofs(pattern, held);
                const Eigen::MatrixXd inside = make_elimination(K, dofs).ff;
                const Eigen::VectorXd eigen =
                    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(inside).eigenvalues();
                CHECK(eigen[0] > 0);
            }
}

TEST_CASE("an element that is inverted or not finite is refused")
{
    for (const ElementKind kind : test::kAllKinds)
        for (const Hyperelastic& m : materials()) {
            const HyperelasticSample s = hyperelastic_sample(kind, 0, 14);
            ElementVector f;
            HyperelasticState state;
            Eigen::Matrix3Xd x = s.X;
            x.row(2) *= -1;
            CHECK(hyperelastic_forces(s.element, m, x, state, f) == ElementFault::inverted);
            x = s.X;
            x.row(1).setZero();
            CHECK(hyperelastic_forces(s.element, m, x, state, f) != ElementFault::none);
            x = s.X * std::numeric_limits<double>::quiet_NaN();
            CHECK(hyperelastic_forces(s.element, m, x, state, f) != ElementFault::none);
        }
    const HyperelasticSample s = hyperelastic_sample(ElementKind::T4, 0, 14);
    ElementVector f;
    HyperelasticState state;
    const Hyperelastic tissue{find_law("guccione"), {1e5, 8, 2, 4, 1e7}};
    CHECK(hyperelastic_forces(s.element, tissue, 100 * s.X, state, f) == ElementFault::inverted);
}
