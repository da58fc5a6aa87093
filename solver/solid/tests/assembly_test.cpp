#include "solver/solid/assembly.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/solid/tests/solid_samples.hpp"

#include <Eigen/SparseCholesky>
#include <doctest/doctest.h>

using namespace amontons;
using test::kAllKinds;

namespace {

VolumeMesh unit_box(ElementKind kind, std::int32_t cells)
{
    SolidBoxOptions box;
    box.cells = {cells, cells, cells};
    box.grading = {1, 2, 0.7};
    box.kind = kind;
    return make_solid_box(box);
}

SparseMatrix mesh_stiffness(const VolumeMesh& mesh, const SolidMaterial& material)
{
    return test::assembled_stiffness(mesh, make_pattern(mesh), material);
}

bool inside(const Vec3& x)
{
    return x.minCoeff() > 1e-9 && x.maxCoeff() < 1 - 1e-9;
}

/// Displacements at all nodes.
template <class Field> Eigen::VectorXd nodal_values(const VolumeMesh& mesh, Field field)
{
    Eigen::VectorXd u(3 * Eigen::Index(mesh.nodes.size()));
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        u.segment<3>(3 * Eigen::Index(i)) = field(mesh.nodes[i]);
    return u;
}

/// A bar along x bent to curvature 1 in the plane x z: sigma_xx = E z alone.
Vec3 pure_bending(const Vec3& x, double nu)
{
    return {x[0] * x[2], -nu * x[1] * x[2], -(x[0] * x[0] + nu * (x[2] * x[2] - x[1] * x[1])) / 2};
}

} // namespace

TEST_CASE("patch test: a constant strain on the surface is there inside for any material")
{
    test::Random random(1);
    for (const ElementKind kind : kAllKinds)
        for (const double nu : {0.0, 0.3, 0.49, 0.4999}) {
            CAPTURE(shape_of(kind).name);
            CAPTURE(nu);
            VolumeMesh mesh = unit_box(kind, 3);
            test::shake_inside(mesh, random, kind == ElementKind::T10 ? 0.02 : 0.05);
            const SolidMaterial material{1e6, nu, 0};
            const SparseMatrix K = mesh_stiffness(mesh, material);
            const Mat3 G = random.matrix();
            const Eigen::VectorXd exact =
                nodal_values(mesh, [&](const Vec3& x) { return Vec3(G * x); });

            std::vector<std::int32_t> fixed;
            for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
                if (!inside(mesh.nodes[i]))
                    for (int a = 0; a < 3; ++a)
                        fixed.push_back(std::int32_t(3 * i) + a);
            const FreeDofs dofs = make_free_dofs(make_pattern(mesh), fixed);
            REQUIRE(dofs.free.size() >= 24);
            const Elimination parts = make_elimination(K, dofs);
            Eigen::VectorXd prescribed(Eigen::Index(dofs.fixed.size()));
            for (std::size_t k = 0; k < dofs.fixed.size(); ++k)
                prescribed[Eigen::Index(k)] = exact[dofs.fixed[k]];
            const Eigen::SimplicialLDLT<SparseMatrix> factor(parts.ff);
            const Eigen::VectorXd u = factor.solve(-(parts.fc * prescribed));
            Eigen::VectorXd whole = exact;
            double worst = 0;
            for (std::size_t k = 0; k < dofs.free.size(); ++k) {
                worst = std::max(worst, std::abs(u[Eigen::Index(k)] - exact[dofs.free[k]]));
                whole[dofs.free[k]] = u[Eigen::Index(k)];
            }
            CHECK(worst < 1e-11);
            const Vec6 e = test::strain_of(G);
            const Mat6 C = elasticity_matrix(material);
            double error = 0;
            for_each_element(mesh, [&](std::int32_t, ElementKind, std::span<const std::int32_t> n) {
                ElementVector of(3 * Eigen::Index(n.size()));
                for (std::size_t i = 0; i < n.size(); ++i)
                    of.segment<3>(3 * Eigen::Index(i)) = whole.segment<3>(3 * n[i]);
                const ElementPlaces X = places_of(mesh, n);
                const Vec6 found = solid_strain(kind, X, of, solid_internal_modes(kind, X, C, of),
                                                Vec3::Constant(0.1));
                error = std::max(error, (C * (found - e)).norm());
            });
            CHECK(error < 1e-10 * C.norm());
        }
}

TEST_CASE("pure bending is exact for T10 in any straight mesh and for H8 in bricks while "
          "displacements alone lock")
{
    test::Random random(2);
    for (const ElementKind kind : {ElementKind::T10, ElementKind::H8})
        for (const double nu : {0.0, 0.3, 0.4999}) {
            CAPTURE(shape_of(kind).name);
            CAPTURE(nu);
            const VolumeMesh mesh = unit_box(kind, 3);
            const SolidMaterial material{1e6, nu, 0};
            const Eigen::VectorXd u =
                nodal_values(mesh, [&](const Vec3& x) { return pure_bending(x, nu); });
            const auto residual = [&](const SparseMatrix& K) {
                const Eigen::VectorXd f = K * u;
                double worst = 0;
                for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
                    if (inside(mesh.nodes[i]))
                        worst = std::max(worst, f.segment<3>(3 * Eigen::Index(i)).norm());
                return worst / K.coeffs().abs().maxCoeff();
            };
            CHECK(residual(mesh_stiffness(mesh, material)) < 1e-13);
            // Its energy: E/2 integral of z^2 over the unit cube.
            CHECK(u.dot(mesh_stiffness(mesh, material) * u) ==
                  doctest::Approx(1e6 / 3).epsilon(1e-10));
            if (kind == ElementKind::H8) {
                const SolidPattern pattern = make_pattern(mesh);
                SparseMatrix plain = zero_matrix(pattern);
                assemble(
                    mesh, pattern,
                    [&](std::int32_t, ElementKind, std::span<const std::int32_t> nodes,
                        ElementMatrix& K) {
                        K = test::plain_stiffness(kind, places_of(mesh, nodes),
                                                  elasticity_matrix(material));
                    },
                    plain);
                // Chords in place of x^2 are a shear x - (middle) in each element: without
                // Poisson's effect, twice its energy is G h^2 / 12.
                if (nu == 0)
                    CHECK(u.dot(plain * u) ==
                          doctest::Approx(1e6 / 3 + 0.5e6 / (9 * 12)).epsilon(1e-10));
                CHECK(u.dot(plain * u) > 1.01 * 1e6 / 3);
            }
        }
}

TEST_CASE("a sparse matrix is the sum of its elements with every entry of the pattern once")
{
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const VolumeMesh mesh = unit_box(kind, 2);
        const SparseMatrix K = mesh_stiffness(mesh, {1e6, 0.3, 0});
        Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(K.rows(), K.cols()), touched = sum;
        for_each_element(mesh, [&](std::int32_t, ElementKind, std::span<const std::int32_t> n) {
            ElementMatrix block;
            solid_stiffness(kind, places_of(mesh, n), elasticity_matrix({1e6, 0.3, 0}), block);
            for (std::size_t i = 0; i < n.size(); ++i)
                for (std::size_t j = 0; j < n.size(); ++j) {
                    sum.block<3, 3>(3 * n[i], 3 * n[j]) +=
                        block.block<3, 3>(3 * Eigen::Index(i), 3 * Eigen::Index(j));
                    touched.block<3, 3>(3 * n[i], 3 * n[j]).setOnes();
                }
        });
        CHECK((Eigen::MatrixXd(K) - sum).norm() <= 1e-15 * sum.norm());
        CHECK(double(K.nonZeros()) == touched.sum());
        const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(K.cols(), -1, 2).array().sin();
        CHECK((symmetric_times(make_pattern(mesh), K, x) - sum * x).norm() <=
              1e-14 * sum.norm() * x.norm());
        for (Eigen::Index c = 0; c < K.cols(); ++c) // rows ascend in each column
            for (std::int32_t k = K.outerIndexPtr()[c] + 1; k < K.outerIndexPtr()[c + 1]; ++k)
                REQUIRE(K.innerIndexPtr()[k - 1] < K.innerIndexPtr()[k]);
    }
}

TEST_CASE("blocks of several kinds stand side by side with each element of its own material")
{
    // Two boxes apart, of H8 and of T4: one mesh. Their matrix is both of theirs.
    const VolumeMesh hexahedra = unit_box(ElementKind::H8, 2),
                     tetrahedra = unit_box(ElementKind::T4, 2);
    VolumeMesh both = tetrahedra;
    both.blocks.push_back(hexahedra.blocks[0]);
    const auto shift = std::int32_t(tetrahedra.nodes.size());
    for (std::int32_t& node : both.blocks[1].nodes)
        node += shift;
    both.nodes.insert(both.nodes.end(), hexahedra.nodes.begin(), hexahedra.nodes.end());
    const SolidMaterial soft{1e5, 0.45, 900}, hard{1e9, 0.2, 2000};
    std::vector<SolidMaterial> materials(element_count(both), soft);
    std::fill(materials.end() - 8, materials.end(), hard);
    const SolidPattern pattern = make_pattern(both);
    SparseMatrix K = zero_matrix(pattern), M = K;
    assemble_stiffness(both, pattern, materials, K);
    assemble_mass(both, pattern, materials, M);
    const Eigen::MatrixXd dense = K;
    CHECK(dense.topLeftCorner(3 * shift, 3 * shift) ==
          Eigen::MatrixXd(mesh_stiffness(tetrahedra, soft)));
    CHECK(dense.bottomRightCorner(3 * shift, 3 * shift) ==
          Eigen::MatrixXd(mesh_stiffness(hexahedra, hard)));
    CHECK(dense.topRightCorner(3 * shift, 3 * shift).norm() == 0);
    CHECK(M.sum() == doctest::Approx(3 * (900.0 + 2000)).epsilon(1e-13));
    CHECK(assemble_lumped_mass(both, materials).sum() ==
          doctest::Approx(3 * (900.0 + 2000)).epsilon(1e-13));
}

TEST_CASE("the mass matrix gives a turning block its kinetic energy and weight its force")
{
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const VolumeMesh mesh = unit_box(kind, 2);
        const SolidMaterial material{1, 0, 1200};
        const SolidPattern pattern = make_pattern(mesh);
        SparseMatrix M = zero_matrix(pattern);
        assemble_mass(mesh, pattern, {&material, 1}, M);
        const Vec3 centre = Vec3::Constant(0.5), w{0.3, -1, 2};
        const Eigen::VectorXd v =
            nodal_values(mesh, [&](const Vec3& x) { return Vec3(w.cross(x - centre)); });
        // A cube's inertia is m / 6 about any axis.
        CHECK(v.dot(M * v) == doctest::Approx(1200.0 / 6 * w.squaredNorm()).epsilon(1e-13));
        Eigen::VectorXd f = Eigen::VectorXd::Zero(v.size());
        add_weight(mesh, {&material, 1}, {0, 0, -9.81}, f);
        CHECK(f.sum() == doctest::Approx(-1200 * 9.81).epsilon(1e-13));
        CHECK(std::abs(f.dot(v)) < 1e-9); // it does not turn the block
    }
}

TEST_CASE("values are filled again in place and prescribed rows leave the rest")
{
    const VolumeMesh mesh = unit_box(ElementKind::H8, 2);
    const SolidPattern pattern = make_pattern(mesh);
    SparseMatrix K = zero_matrix(pattern);
    const double* values = K.valuePtr();
    SolidMaterial material{1, 0.3, 0};
    assemble_stiffness(mesh, pattern, {&material, 1}, K);
    std::vector<std::int32_t> fixed{7, 0, 1, 80, 7};
    const FreeDofs dofs = make_free_dofs(pattern, fixed);
    CHECK(dofs.fixed == std::vector<std::int32_t>{0, 1, 7, 80});
    CHECK(dofs.free.size() == 77);
    CHECK(dofs.number[7] == -3);
    CHECK(dofs.number[8] == 5);
    Elimination parts = make_elimination(K, dofs);
    const double* free_values = parts.ff.valuePtr();
    material.youngs_modulus = 3;
    assemble_stiffness(mesh, pattern, {&material, 1}, K);
    eliminate(K, parts);
    CHECK(K.valuePtr() == values);
    CHECK(parts.ff.valuePtr() == free_values);
    const Eigen::MatrixXd dense = K;
    CHECK(Eigen::MatrixXd(parts.ff) == Eigen::MatrixXd(dense(dofs.free, dofs.free)));
    CHECK(Eigen::MatrixXd(parts.fc) == Eigen::MatrixXd(dense(dofs.free, dofs.fixed)));
}

TEST_CASE("nodes of no element are fixed and faults of the caller are refused")
{
    VolumeMesh mesh = unit_box(ElementKind::T4, 1);
    mesh.nodes.push_back({5, 5, 5});
    const SolidPattern pattern = make_pattern(mesh);
    CHECK(make_free_dofs(pattern, {}).fixed == std::vector<std::int32_t>{24, 25, 26});
    const std::int32_t outside = 27;
    CHECK_THROWS_AS(make_free_dofs(pattern, {&outside, 1}), std::logic_error);
    SparseMatrix K = zero_matrix(pattern), other(3, 3);
    const SolidMaterial material{1, 0.3, 0};
    for (const int threads : {1, 2}) {
        CHECK_THROWS_AS(assemble_stiffness(mesh, pattern, {&material, 1}, other, threads),
                        std::logic_error);
        CHECK_THROWS_AS(assemble_stiffness(mesh, pattern, {}, K, threads), std::logic_error);
    }
    mesh.blocks[0].nodes[3] = 99;
    CHECK_THROWS_AS(make_pattern(mesh), std::logic_error);
}

TEST_CASE("one and two and three threads give the same matrices and products to the last bit" *
          doctest::test_suite("slow"))
{
    SolidBoxOptions options;
    options.cells = {9, 9, 9};
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10, ElementKind::H8}) {
        options.kind = kind;
        const VolumeMesh mesh = make_solid_box(options);
        const SolidPattern pattern = make_pattern(mesh);
        const SolidMaterial material{1e6, 0.3, 1000};
        Eigen::VectorXd x(3 * Eigen::Index(mesh.nodes.size()));
        for (Eigen::Index i = 0; i < x.size(); ++i)
            x[i] = std::sin(double(i));
        SparseMatrix K[3], M[3];
        Eigen::VectorXd y[3];
        for (int threads = 1; threads <= 3; ++threads) {
            const int k = threads - 1;
            K[k] = zero_matrix(pattern);
            M[k] = zero_matrix(pattern);
            assemble_stiffness(mesh, pattern, std::span(&material, 1), K[k], threads);
            assemble_mass(mesh, pattern, std::span(&material, 1), M[k], threads);
            y[k] = symmetric_times(pattern, K[k], x, threads);
        }
        CHECK(y[0].norm() > 0);
        for (int k = 1; k < 3; ++k) {
            CHECK((K[k].coeffs() == K[0].coeffs()).all());
            CHECK((M[k].coeffs() == M[0].coeffs()).all());
            CHECK((y[k].array() == y[0].array()).all());
        }
    }
}
