#include "mesh/generate/solid_box.hpp"
#include "mesh/generate/solid_tube.hpp"
#include "solver/solid/tests/solid_samples.hpp"

#include <Eigen/SparseCholesky>
#include <doctest/doctest.h>
#include <functional>

using namespace amontons;

namespace {

using Stiffness =
    std::function<void(ElementKind, const ElementPlaces&, const Mat6&, ElementMatrix&)>;

void with_internal_modes(ElementKind kind, const ElementPlaces& X, const Mat6& C, ElementMatrix& K)
{
    solid_stiffness(kind, X, C, K);
}

void without(ElementKind kind, const ElementPlaces& X, const Mat6& C, ElementMatrix& K)
{
    K = test::plain_stiffness(kind, X, C);
}

/// Displacements under f, with the degrees of freedom `fixed` at 0.
Eigen::VectorXd solve(const VolumeMesh& mesh, const SolidMaterial& material, const Stiffness& of,
                      const std::vector<std::int32_t>& fixed, const Eigen::VectorXd& f)
{
    const SolidPattern pattern = make_pattern(mesh);
    SparseMatrix K = zero_matrix(pattern);
    const Mat6 C = elasticity_matrix(material);
    assemble(
        mesh, pattern,
        [&](std::int32_t, ElementKind kind, std::span<const std::int32_t> nodes,
            ElementMatrix& block) { of(kind, places_of(mesh, nodes), C, block); },
        K);
    const FreeDofs dofs = make_free_dofs(pattern, fixed);
    const Eigen::SimplicialLLT<SparseMatrix> factor(make_elimination(K, dofs).ff);
    REQUIRE(factor.info() == Eigen::Success);
    const Eigen::VectorXd u = factor.solve(f(dofs.free));
    Eigen::VectorXd whole = Eigen::VectorXd::Zero(f.size());
    whole(dofs.free) = u;
    return whole;
}

// ---- a cantilever: Timoshenko's deflection P L^3 / (3 E I) + P L / (5/6 G A)

struct Cantilever {
    double height = 1, length = 10;
    std::int32_t along = 10;
    ElementKind kind = ElementKind::H8;
};

/// Tip deflection, 1 for Timoshenko's. The end is held along the beam and in its middle across it,
/// so that the section is free to contract.
double tip_deflection(const Cantilever& c, double nu, const Stiffness& of)
{
    SolidBoxOptions box;
    box.highest = {c.length, 1, c.height};
    box.cells = {c.along, 1, 1};
    box.kind = c.kind;
    const VolumeMesh mesh = make_solid_box(box);
    Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
    const double P = 2.5;
    std::vector<std::int32_t> fixed, tip;
    add_traction(mesh, find_set(mesh.face_sets, "x_max")->members, {0, 0, P / c.height}, f);
    // The same force pulls back on the held end, spread like it: reactions are a pure couple.
    add_traction(mesh, find_set(mesh.face_sets, "x_min")->members, {0, 0, -P / c.height}, f);
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const Vec3& x = mesh.nodes[i];
        const auto dof = std::int32_t(3 * i);
        if (x[0] < 1e-9) {
            fixed.push_back(dof);
            if (x[2] < 1e-9 && (x[1] < 1e-9 || x[1] > 1 - 1e-9)) fixed.push_back(dof + 2);
            if (x[1] < 1e-9 && x[2] < 1e-9) fixed.push_back(dof + 1);
        }
        if (x[0] > c.length - 1e-9) tip.push_back(dof + 2);
    }
    const double E = 1e7;
    const Eigen::VectorXd u = solve(mesh, {E, nu, 0}, of, fixed, f);
    const double L = c.length, h = c.height,
                 beam = P * L * L * L / (3 * E * h * h * h / 12) +
                        P * L / (5.0 / 6 * E / (2 * (1 + nu)) * h);
    // Work of the load over the load: the mean over the ends.
    return u.dot(f) / P / beam;
}

// ---- a thick tube under pressure in plane strain (Lame): a = 0.1, b = 0.2 m, E = 1e9, p = 1e7 Pa

double lame_displacement(double r, double nu)
{
    const double a = 0.1, b = 0.2, E = 1e9, p = 1e7;
    return (1 + nu) / E * p * a * a / (b * b - a * a) * ((1 - 2 * nu) * r + b * b / r);
}

/// Root mean square of the error at the nodes, relative to the displacement.
double lame_error(ElementKind kind, std::int32_t through, double nu, const Stiffness& of)
{
    const double thickness = 0.1 / through; // of the slice: as thick as its elements
    Centreline line({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0.1);
    line.append_line(thickness, 0.1);
    const VolumeMesh mesh = make_solid_tube({line, 0.1, 8 * through, through, 1, kind});
    Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
    add_pressure(mesh, find_set(mesh.face_sets, "inner")->members, 1e7, f);
    std::vector<std::int32_t> fixed;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const Vec3& x = mesh.nodes[i];
        for (int a = 0; a < 2; ++a)
            if (std::abs(x[a]) < 1e-9) fixed.push_back(std::int32_t(3 * i) + a);
        if (x[2] < 1e-9 || x[2] > thickness - 1e-9) fixed.push_back(std::int32_t(3 * i) + 2);
    }
    const Eigen::VectorXd u = solve(mesh, {1e9, nu, 0}, of, fixed, f);
    double error = 0, size = 0;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const Vec3& x = mesh.nodes[i];
        const double r = x.head<2>().norm(), exact = lame_displacement(r, nu);
        const Vec3 direction{x[0] / r, x[1] / r, 0};
        error += (u.segment<3>(3 * Eigen::Index(i)) - exact * direction).squaredNorm();
        size += exact * exact;
    }
    return std::sqrt(error / size);
}

} // namespace

TEST_CASE("one layer of H8 bends as Timoshenko's beam but without internal modes it locks")
{
    for (const double nu : {0.0, 0.3, 0.4999})
        for (const double height : {1.0, 0.1}) { // elements with sides 1:1 and 1:10
            CAPTURE(nu);
            CAPTURE(height);
            const auto error = [&](std::int32_t along) {
                return std::abs(
                    tip_deflection({height, 10, along, ElementKind::H8}, nu, with_internal_modes) -
                    1);
            };
            CHECK(error(10) < 0.02);            // [regression] our own run
            CHECK(error(20) < 0.6 * error(10)); // [regression] our own run
            const double plain = tip_deflection({height, 10, 10, ElementKind::H8}, nu, without);
            CHECK(plain < (height == 1 ? 0.7 : 0.03)); // [regression] our own run, locked
        }
}

TEST_CASE("one layer of T10 bends as Timoshenko's beam")
{
    for (const double nu : {0.0, 0.3, 0.4999}) {
        CAPTURE(nu);
        CHECK(std::abs(tip_deflection({1, 10, 10, ElementKind::T10}, nu, with_internal_modes) - 1) <
              0.01);
    }
    // Flat ones, nearly incompressible, are too stiff by some per cent until there are more.
    CHECK(std::abs(tip_deflection({0.1, 10, 40, ElementKind::T10}, 0.4999, with_internal_modes) -
                   1) < 0.01);
}

TEST_CASE("a thick tube under pressure converges to Lame's: order 2 for T4 and H8 and 3 for T10" *
          doctest::test_suite("slow"))
{
    const auto order = [](ElementKind kind, double nu) {
        return std::log2(lame_error(kind, 4, nu, with_internal_modes) /
                         lame_error(kind, 8, nu, with_internal_modes));
    };
    CHECK(order(ElementKind::T4, 0.3) > 1.85);
    for (const double nu : {0.3, 0.49, 0.4999}) {
        CAPTURE(nu);
        CHECK(order(ElementKind::T10, nu) > 2.95);
        CHECK(order(ElementKind::H8, nu) > 1.9);
    }
}

TEST_CASE("a thick tube of incompressible material does not lock with H8 and T10" *
          doctest::test_suite("slow"))
{
    const double compressible = lame_error(ElementKind::H8, 8, 0.3, with_internal_modes);
    for (const double nu : {0.49, 0.4999})
        CHECK(lame_error(ElementKind::H8, 8, nu, with_internal_modes) <
              2 * compressible); // [regression] our own run
    CHECK(lame_error(ElementKind::T10, 8, 0.4999, with_internal_modes) <
          0.005); // [regression] our own run
    // Locking:
    CHECK(lame_error(ElementKind::H8, 8, 0.4999, without) > 0.5); // [regression] our own run
    CHECK(lame_error(ElementKind::T4, 8, 0.4999, with_internal_modes) >
          0.5); // [regression] our own run
}
