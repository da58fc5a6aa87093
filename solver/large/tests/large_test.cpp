#include "contact/solvers/solve.hpp"
#include "mesh/generate/solid_box.hpp"
#include "mesh/tests/test_program.hpp"
#include "solver/large/contact_newton.hpp"
#include "solver/linear/supernodal.hpp"

#include <Eigen/Geometry>
#include <doctest/doctest.h>
#include <limits>
#include <malloc.h>
#include <numeric>

// A block, its top held and moved, its bottom on a plane. Where W can be had from a factor, the
// contact solvers for W must find the same forces.

using namespace amontons;

namespace {

struct Pressed {
    VolumeMesh mesh;
    SolidPattern pattern;
    SolidMaterial material{1e6, 0.3, 1000};
    SparseMatrix K;
    std::vector<std::int32_t> held, bottom;
    FreeDofs dofs;
    Eigen::VectorXd prescribed;

    explicit Pressed(ElementKind kind, std::int32_t cells = 4)
    {
        SolidBoxOptions box;
        box.lowest = Vec3(0, 0, 0);
        box.highest = Vec3(0.1, 0.1, 0.08);
        box.cells = {cells + 1, cells, cells};
        box.kind = kind;
        mesh = make_solid_box(box);
        pattern = make_pattern(mesh);
        K = zero_matrix(pattern);
        assemble_stiffness(mesh, pattern, {&material, 1}, K);
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
            if (mesh.nodes[i].z() > 0.08 - 1e-9)
                for (int axis = 0; axis < 3; ++axis)
                    held.push_back(std::int32_t(3 * i) + axis);
            if (mesh.nodes[i].z() < 1e-9) bottom.push_back(std::int32_t(i));
        }
        dofs = make_free_dofs(pattern, held);
    }
    Eigen::VectorXd without_held(Eigen::VectorXd f) const
    {
        for (const std::int32_t dof : held)
            f[dof] = 0;
        return f;
    }
    Eigen::VectorXd on_free(const Eigen::VectorXd& f) const
    {
        Eigen::VectorXd out(Eigen::Index(dofs.free.size()));
        for (std::size_t i = 0; i < dofs.free.size(); ++i)
            out[Eigen::Index(i)] = f[dofs.free[i]];
        return out;
    }
    LargeMatrix matrix(double of_mass = 0) const
    {
        return LargeMatrix(mesh, pattern, material, of_mass, 1, held, true);
    }
    /// The plane's normal is inclined by `tilt`; the bottom touches it everywhere.
    LargeContactProblem problem(double mu, double tilt)
    {
        LargeContactProblem p;
        prescribed = Eigen::VectorXd::Zero(K.rows());
        for (std::size_t k = 0; k < held.size(); k += 3) {
            prescribed[held[k]] = 3e-4;
            prescribed[held[k] + 2] = -1e-3;
        }
        p.load = without_held(-(K * prescribed));
        p.times = [this](const Eigen::VectorXd& y) { return without_held(K * y); };
        p.diagonal = K.diagonal();
        Mat3 frame;
        frame.col(0) = Vec3(std::sin(tilt), 0, std::cos(tilt));
        frame.col(1) = Vec3::UnitY();
        frame.col(2) = frame.col(0).cross(frame.col(1));
        const int rows = mu > 0 ? 3 : 1;
        std::vector<Eigen::Triplet<double>> entries;
        for (std::size_t k = 0; k < bottom.size(); ++k) {
            p.first.push_back(rows * int(k));
            p.kind.push_back(mu > 0 ? ContactKind::frictional : ContactKind::frictionless);
            for (int row = 0; row < rows; ++row)
                for (int axis = 0; axis < 3; ++axis)
                    entries.emplace_back(3 * bottom[k] + axis, rows * int(k) + row,
                                         frame(axis, row));
        }
        const Eigen::Index n = rows * Eigen::Index(bottom.size());
        p.C.resize(K.rows(), n);
        p.C.setFromTriplets(entries.begin(), entries.end());
        p.mu = Eigen::VectorXd::Constant(Eigen::Index(bottom.size()), mu);
        p.q = Eigen::VectorXd::Zero(n);
        return p;
    }
    /// Forces by the factor, W and the solvers of contact.
    ContactSolution by_factor(const LargeContactProblem& p, ContactProblem& seen) const
    {
        const Elimination parts = make_elimination(K, dofs);
        std::vector<std::int32_t> node;
        for (const std::int32_t dof : dofs.free)
            node.push_back(dof / 3);
        SupernodalFactor factor;
        factor.analyse(parts.ff, node);
        REQUIRE(factor.factor(parts.ff));
        Eigen::SparseMatrix<double> C(Eigen::Index(dofs.free.size()), p.C.cols());
        std::vector<Eigen::Triplet<double>> entries;
        for (Eigen::Index j = 0; j < p.C.cols(); ++j)
            for (Eigen::SparseMatrix<double>::InnerIterator at(p.C, j); at; ++at)
                entries.emplace_back(dofs.number[std::size_t(at.row())], int(j), at.value());
        C.setFromTriplets(entries.begin(), entries.end());
        Eigen::MatrixXd W;
        factor.compliance(C, W);
        seen.W = W;
        seen.q = p.q + C.transpose() * factor.solved(on_free(p.load));
        seen.mu = p.mu;
        seen.kind = p.kind;
        SolverOptions options;
        options.tolerance = 1e-11;
        return solve(seen, options);
    }
};

bool no_module()
{
#ifdef AMONTONS_HAS_PETSC
    return false;
#else
    skip_test("the module petsc is not built (petsc-dev)");
    return true;
#endif
}

} // namespace

TEST_CASE("solves with the assembled matrix leave no residual whatever part a rank has" *
          doctest::test_suite("slow"))
{
    if (no_module()) return;
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10, ElementKind::H8})
        for (const double of_mass : {0.0, 1e6}) {
            Pressed block(kind, kind == ElementKind::T10 ? 2 : 3);
            LargeMatrix A = block.matrix(of_mass);
            SparseMatrix S = block.K, M = zero_matrix(block.pattern);
            assemble_mass(block.mesh, block.pattern, {&block.material, 1}, M);
            S.coeffs() += of_mass * M.coeffs();
            Eigen::VectorXd f(S.rows());
            for (Eigen::Index i = 0; i < f.size(); ++i)
                f[i] = std::sin(3.0 * double(i));
            f = block.without_held(f);
            Eigen::VectorXd y = f;
            const LargeMatrix::Result done = A.solve(y, 1e-11);
            CHECK(done.reached <= 1e-11);
            CHECK((block.without_held(S * y) - f).norm() <= 1e-10 * f.norm());
            CHECK((block.without_held(y) - y).norm() == 0);
            // Blocks are created and destroyed without a trace.
            const std::int32_t node = block.bottom.front();
            Mat3 stiff = 1e6 * Mat3::Identity();
            A.set_blocks({{node, node, stiff}}, true, true);
            Eigen::VectorXd z = f;
            A.solve(z, 1e-11);
            Eigen::VectorXd left = block.without_held(S * z) - f;
            left.segment<3>(3 * node) += stiff * z.segment<3>(3 * node);
            CHECK(left.norm() <= 1e-10 * f.norm());
            A.set_blocks({}, true, true);
            z = f;
            A.solve(z, 1e-11);
            CHECK((z - y).norm() <= 1e-8 * y.norm());
        }
}

TEST_CASE("contact without W finds the forces that W gives" * doctest::test_suite("slow"))
{
    if (no_module()) return;
    for (const ElementKind kind : {ElementKind::T4, ElementKind::H8})
        for (const double mu : {0.0, 0.05, 0.3, 1.5})
            for (const double tilt : {0.0, 0.3}) {
                CAPTURE(mu);
                CAPTURE(tilt);
                Pressed block(kind);
                const LargeContactProblem p = block.problem(mu, tilt);
                LargeMatrix A = block.matrix();
                LargeContactOptions options;
                options.tolerance = 1e-8;
                const LargeContactSolution s = solve_large_contact(A, p, {}, 0, options);
                CHECK(s.converged);
                CHECK(s.newton <= 15); // [regression] our own run
                ContactProblem seen;
                const ContactSolution exact = block.by_factor(p, seen);
                REQUIRE(is_solved(exact.certificate.status));
                CHECK((s.r - exact.reaction).norm() <= 1e-6 * exact.reaction.norm());
                // The stated error is that of W's own certificate, but for the estimated trace.
                const double true_error =
                    certify(seen, s.r, options.tolerance, ErrorScope::acting_rows).error;
                CHECK(true_error <= 2e-8);
                CHECK(s.mean_compliance == doctest::Approx(seen.W.diagonal().mean()).epsilon(0.25));
            }
}

TEST_CASE("a guess and a second problem: fewer iterations and the same forces" *
          doctest::test_suite("slow"))
{
    if (no_module()) return;
    Pressed block(ElementKind::T4);
    const LargeContactProblem p = block.problem(0.3, 0);
    LargeMatrix A = block.matrix();
    LargeContactOptions options;
    const LargeContactSolution cold = solve_large_contact(A, p, {}, 0, options);
    const LargeContactSolution warm =
        solve_large_contact(A, p, cold.r, cold.mean_compliance, options);
    CHECK(warm.converged);
    CHECK(warm.linear < cold.linear);
    CHECK((warm.r - cold.r).norm() <= 1e-6 * cold.r.norm());
}

TEST_CASE("a block pulled off the plane keeps no force" * doctest::test_suite("slow"))
{
    if (no_module()) return;
    Pressed block(ElementKind::T4);
    LargeContactProblem p = block.problem(0.3, 0);
    p.load = -p.load;
    LargeMatrix A = block.matrix();
    const LargeContactSolution s = solve_large_contact(A, p, {}, 0, {});
    CHECK(s.converged);
    CHECK(s.r.norm() == 0);
}

TEST_CASE("a rank without nodes or elements takes part" * doctest::test_suite("slow"))
{
    if (no_module()) return;
    Pressed block(ElementKind::H8, 1); // 12 nodes, 8 of them free or held
    const LargeContactProblem p = block.problem(0.3, 0);
    LargeMatrix A = block.matrix();
    const LargeContactSolution s = solve_large_contact(A, p, {}, 0, {});
    CHECK(s.converged);
    ContactProblem seen;
    const ContactSolution exact = block.by_factor(p, seen);
    CHECK((s.r - exact.reaction).norm() <= 1e-6 * exact.reaction.norm());
}

TEST_CASE("a linear solve that does not converge reports it and what is not a number is an error" *
          doctest::test_suite("slow"))
{
    if (no_module()) return;
    Pressed block(ElementKind::T4);
    LargeMatrix A = block.matrix();
    const LargeContactProblem p = block.problem(0.3, 0);
    Eigen::VectorXd f = p.load;
    const LargeMatrix::Result few = A.solve(f, 1e-10, 2);
    CHECK(few.iterations == 2);
    CHECK(few.reached > 1e-10);
    CHECK(few.fault.find("after 2 iterations") != std::string::npos);
    f = p.load;
    CHECK(A.solve(f, 1e-10).fault.empty());
    for (const double none :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        Eigen::VectorXd bad = p.load;
        bad[3 * block.bottom.front()] = none;
        CHECK_THROWS_AS(A.solve(bad, 1e-10), std::runtime_error);
    }
    // And the matrix still serves.
    Eigen::VectorXd again = p.load;
    A.solve(again, 1e-10);
    CHECK((again - f).norm() <= 1e-8 * f.norm());
}

TEST_CASE("a balance that cannot be found is not taken for one with contacts or without" *
          doctest::test_suite("slow"))
{
    if (no_module()) return;
    Pressed block(ElementKind::T4);
    LargeContactProblem p = block.problem(0.3, 0);
    // Nothing holds it: K is singular, and a force along it has no answer.
    block.held.clear();
    LargeMatrix A = block.matrix();
    LargeContactProblem free = p;
    free.load = Eigen::VectorXd::Zero(p.load.size());
    for (Eigen::Index i = 0; i < free.load.size(); i += 3)
        free.load[i] = 1;
    free.times = p.times = [&](const Eigen::VectorXd& y) { return Eigen::VectorXd(block.K * y); };
    free.C.resize(p.load.size(), 0);
    free.q.resize(0);
    free.mu.resize(0);
    free.kind.clear();
    free.first.clear();
    const LargeContactSolution none = solve_large_contact(A, free, {}, 0, {});
    CHECK_FALSE(none.converged);
    CHECK(none.error > 1e-6);
    CHECK_FALSE(none.fault.empty());
    // Lifted off the plane, and again nothing holds it.
    p.load = free.load;
    p.q.setConstant(1);
    const LargeContactSolution lifted = solve_large_contact(A, p, {}, 0, {});
    CHECK_FALSE(lifted.converged);
    CHECK_FALSE(lifted.error < 1e-6);
}

TEST_CASE("a stop ends the solve where nothing touches, too" * doctest::test_suite("slow"))
{
    if (no_module()) return;
    Pressed block(ElementKind::T4);
    LargeContactProblem p = block.problem(0, 0);
    p.C.resize(p.load.size(), 0);
    p.q.resize(0);
    p.mu.resize(0);
    p.kind.clear();
    p.first.clear();
    LargeMatrix A = block.matrix();
    std::atomic<bool> stop = true;
    LargeContactOptions options;
    options.stop = &stop;
    const LargeContactSolution stopped = solve_large_contact(A, p, {}, 0, options);
    CHECK_FALSE(stopped.converged);
    CHECK(stopped.linear == 0);
    stop = false;
    const LargeContactSolution done = solve_large_contact(A, p, {}, 0, options);
    CHECK(done.converged);
    CHECK((p.times(done.y) - p.load).norm() <= options.tolerance * p.load.norm());
    CHECK(done.error <= options.tolerance);
}

TEST_CASE("matrices that no longer exist leave nothing behind" * doctest::test_suite("slow"))
{
    if (no_module()) return;
    const Pressed block(ElementKind::H8, 16);
    const auto used = [] {
        const struct mallinfo2 info = ::mallinfo2();
        return double(info.uordblks) + double(info.hblkhd);
    };
    double before = 0;
    for (int k = 0; k < 6; ++k) {
        {
            LargeMatrix A = block.matrix();
            Eigen::VectorXd f = block.without_held(Eigen::VectorXd::Ones(block.K.rows()));
            A.solve(f, 1e-3);
        }
        if (k == 1) before = used(); // what the first ones set up stays
    }
    // 4 more: less than a vector of each.
    CHECK(used() - before < 4 * 8.0 * double(block.K.rows()));
}
