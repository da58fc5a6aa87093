#include "solver/linear/supernodal.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/linear/backward_error.hpp"
#include "solver/solid/assembly.hpp"

#include <Eigen/Cholesky>
#include <doctest/doctest.h>
#include <numeric>
#include <random>

using namespace amontons;

namespace {

std::vector<std::int32_t> one_node_each(Eigen::Index n)
{
    std::vector<std::int32_t> nodes(static_cast<std::size_t>(n));
    std::iota(nodes.begin(), nodes.end(), 0);
    return nodes;
}

/// G G^T + a I with a sparse G: positive definite, of any pattern.
SparseMatrix random_matrix(int n, unsigned seed)
{
    std::mt19937 engine(seed);
    std::uniform_real_distribution<> value(-1, 1);
    std::uniform_int_distribution<> place(0, n - 1);
    SparseMatrix G(n, n);
    std::vector<Eigen::Triplet<double>> entries;
    for (int k = 0; k < 2 * n; ++k)
        entries.emplace_back(place(engine), place(engine), value(engine));
    for (int i = 0; i < n; ++i)
        entries.emplace_back(i, i, 1 + value(engine) / 2);
    G.setFromTriplets(entries.begin(), entries.end());
    SparseMatrix A = G * SparseMatrix(G.transpose());
    A.makeCompressed();
    return A;
}

struct Solid {
    SparseMatrix K;
    std::vector<std::int32_t> node_of_dof;
};

/// A box held on one face.
Solid solid(ElementKind kind, std::int32_t cells)
{
    SolidBoxOptions box;
    box.cells = {cells, cells + 1, cells + 2};
    box.kind = kind;
    const VolumeMesh mesh = make_solid_box(box);
    const SolidPattern pattern = make_pattern(mesh);
    SparseMatrix K = zero_matrix(pattern);
    const SolidMaterial material{1e9, 0.3, 0};
    assemble_stiffness(mesh, pattern, {&material, 1}, K);
    std::vector<std::int32_t> fixed;
    for (const std::int32_t node : nodes_of(mesh, *find_set(mesh.face_sets, "z_min")))
        for (int a = 0; a < 3; ++a)
            fixed.push_back(3 * node + a);
    const FreeDofs dofs = make_free_dofs(pattern, fixed);
    Solid out{make_elimination(K, dofs).ff, {}};
    for (const std::int32_t dof : dofs.free)
        out.node_of_dof.push_back(dof / 3);
    return out;
}

/// Contact rows: a few entries in each column.
SparseMatrix random_rows(Eigen::Index n, Eigen::Index columns, unsigned seed)
{
    std::mt19937 engine(seed);
    std::uniform_real_distribution<> value(-1, 1);
    std::uniform_int_distribution<Eigen::Index> place(0, n - 1);
    SparseMatrix C(n, columns);
    for (Eigen::Index j = 0; j < columns; ++j)
        for (int k = 0; k < 6; ++k)
            C.coeffRef(place(engine), j) += value(engine);
    C.makeCompressed();
    return C;
}

Eigen::MatrixXd random_dense(Eigen::Index rows, Eigen::Index columns, unsigned seed)
{
    std::mt19937 engine(seed);
    std::uniform_real_distribution<> value(-1, 1);
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return value(engine); });
}

double distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b)
{
    return (a - b).norm() / b.norm();
}

void compare_with_dense(const SparseMatrix& A, std::span<const std::int32_t> nodes,
                        const SupernodalOptions& options, double tolerance)
{
    SupernodalFactor factor;
    factor.analyse(A, nodes, options);
    REQUIRE(factor.factor(A));
    const Eigen::LDLT<Eigen::MatrixXd> dense{Eigen::MatrixXd(A)};
    for (const Eigen::Index columns : {1, 7, 60}) {
        const Eigen::MatrixXd B = random_dense(A.rows(), columns, 5);
        Eigen::MatrixXd X = B;
        factor.solve(X);
        CHECK(distance(X, dense.solve(B)) < tolerance);
        CHECK(backward_error(A, X.col(0), B.col(0)) < 1e-15);
        const SparseMatrix C = random_rows(A.rows(), columns, 7);
        const Eigen::MatrixXd reference = C.transpose() * dense.solve(Eigen::MatrixXd(C));
        Eigen::MatrixXd W;
        factor.compliance(C, W);
        CHECK(distance(W, reference) < tolerance);
        CHECK(W == W.transpose());
    }
    const Eigen::MatrixXd inverse = dense.solve(Eigen::MatrixXd::Identity(A.rows(), A.rows()));
    std::vector<std::int32_t> rows, columns;
    for (std::int32_t i = 0; i < A.rows(); i += 5)
        rows.push_back(i);
    for (std::int32_t i = std::int32_t(A.rows()) - 1; i >= 0; i -= 3)
        columns.push_back(i);
    Eigen::MatrixXd part(Eigen::Index(rows.size()), Eigen::Index(columns.size()));
    factor.inverse_part(rows, columns, part);
    CHECK(distance(part, inverse(rows, columns)) < tolerance);
}

} // namespace

TEST_CASE("solve and compliance and parts of the inverse agree with a dense factor" *
          doctest::test_suite("slow"))
{
    for (const int n : {1, 2, 17, 150, 400}) {
        CAPTURE(n);
        const SparseMatrix A = random_matrix(n, unsigned(n));
        for (const Ordering ordering : {Ordering::natural, Ordering::minimum_degree,
                                        Ordering::nested_dissection, Ordering::automatic}) {
            CAPTURE(int(ordering));
            SupernodalOptions options;
            options.ordering = ordering;
            // Error of both factors: condition (up to 1e4 here) times 1e-16.
            compare_with_dense(A, one_node_each(n), options, 1e-10);
        }
    }
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10, ElementKind::H8})
        for (const Ordering ordering : {Ordering::minimum_degree, Ordering::nested_dissection}) {
            CAPTURE(int(kind));
            const Solid box = solid(kind, kind == ElementKind::T10 ? 2 : 4);
            SupernodalOptions options;
            options.ordering = ordering;
            compare_with_dense(box.K, box.node_of_dof, options, 1e-11);
        }
}

TEST_CASE("wide supernodes are cut: fewer zeros are stored and the answers stay")
{
    // A full matrix is one supernode, 90 x 90; of widths 30: 30 x 90, 30 x 60, 30 x 30.
    constexpr int kRows = 90;
    const Eigen::MatrixXd G = random_dense(kRows, kRows, 3);
    Eigen::MatrixXd full = G * G.transpose();
    full.diagonal().array() += 1;
    const SparseMatrix A = full.sparseView();
    SupernodalOptions options;
    for (const std::int32_t widest : {1000, 40}) {
        CAPTURE(widest);
        options.widest = widest;
        compare_with_dense(A, one_node_each(kRows), options, 1e-10);
        SupernodalFactor factor;
        factor.analyse(A, one_node_each(kRows), options);
        CHECK(factor.stored_entries() == (widest < kRows ? 30 * 180 : kRows * kRows));
    }
    for (const int n : {150, 400}) {
        options.widest = 7;
        compare_with_dense(random_matrix(n, unsigned(n)), one_node_each(n), options, 1e-10);
    }
    const Solid box = solid(ElementKind::T4, 5);
    options.widest = 20;
    compare_with_dense(box.K, box.node_of_dof, options, 1e-11);
}

TEST_CASE("the lower triangle is enough and the upper one is not read")
{
    const Solid box = solid(ElementKind::T4, 3);
    const SparseMatrix lower = box.K.triangularView<Eigen::Lower>();
    SparseMatrix spoilt = box.K;
    for (Eigen::Index j = 0; j < spoilt.cols(); ++j)
        for (SparseMatrix::InnerIterator it(spoilt, j); it; ++it)
            if (it.row() < j) it.valueRef() = 1e30;
    const Eigen::VectorXd b = random_dense(box.K.rows(), 1, 3);
    Eigen::VectorXd x[3];
    const SparseMatrix* const given[] = {&box.K, &lower, &spoilt};
    for (int k = 0; k < 3; ++k) {
        SupernodalFactor factor;
        factor.analyse(*given[k], box.node_of_dof);
        REQUIRE(factor.factor(*given[k]));
        x[k] = factor.solved(b);
    }
    CHECK(x[0] == x[1]);
    CHECK(x[0] == x[2]);
}

TEST_CASE("the answer does not depend on how the unknowns are numbered")
{
    const Solid box = solid(ElementKind::H8, 4);
    const Eigen::Index n = box.K.rows();
    std::vector<std::int32_t> shuffled = one_node_each(n);
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(4));
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, std::int32_t> P(n);
    std::copy(shuffled.begin(), shuffled.end(), P.indices().data());
    SparseMatrix turned = P * box.K * P.transpose();
    turned.makeCompressed();
    std::vector<std::int32_t> nodes(box.node_of_dof.size());
    for (std::size_t i = 0; i < nodes.size(); ++i)
        nodes[std::size_t(shuffled[i])] = box.node_of_dof[i];

    const SparseMatrix C = random_rows(n, 40, 2);
    SupernodalFactor one, two;
    one.analyse(box.K, box.node_of_dof);
    two.analyse(turned, nodes);
    REQUIRE(one.factor(box.K));
    REQUIRE(two.factor(turned));
    Eigen::MatrixXd W, V;
    one.compliance(C, W);
    two.compliance(P * C, V);
    CHECK(distance(V, W) < 1e-12);

    // Degrees of freedom of a node are eliminated one after the other.
    const auto order = one.permutation();
    std::vector<char> closed(order.size(), 0);
    for (std::size_t k = 1; k < order.size(); ++k) {
        const auto before = std::size_t(box.node_of_dof[std::size_t(order[k - 1])]),
                   now = std::size_t(box.node_of_dof[std::size_t(order[k])]);
        if (before != now) closed[before] = 1;
        CHECK(!closed[now]);
    }
}

TEST_CASE("a factor made again has the bits of a fresh one")
{
    const Solid box = solid(ElementKind::T10, 3);
    const Eigen::VectorXd b = random_dense(box.K.rows(), 1, 8);
    const SparseMatrix C = random_rows(box.K.rows(), 30, 9);
    SupernodalFactor fresh, again;
    fresh.analyse(box.K, box.node_of_dof);
    REQUIRE(fresh.factor(box.K));

    again.analyse(box.K, box.node_of_dof);
    const SparseMatrix other = 3.7 * box.K;
    REQUIRE(again.factor(other));
    REQUIRE(again.refactor({box.K.valuePtr(), std::size_t(box.K.nonZeros())}));
    CHECK(again.solved(b) == fresh.solved(b));
    // The same values among others.
    std::vector<double> all(2 * std::size_t(box.K.nonZeros()), 1e30);
    std::vector<std::int32_t> where;
    for (Eigen::Index k = 0; k < box.K.nonZeros(); ++k) {
        where.push_back(std::int32_t(all.size()) - 1 - 2 * std::int32_t(k));
        all[std::size_t(where.back())] = box.K.valuePtr()[k];
    }
    REQUIRE(again.factor(other));
    again.take(all, where);
    REQUIRE(again.factor_taken());
    CHECK(again.solved(b) == fresh.solved(b));
    Eigen::MatrixXd W, V;
    fresh.compliance(C, W);
    again.compliance(C, V);
    CHECK(W == V);

    // Also after a failure.
    SparseMatrix bad = box.K;
    bad.coeffRef(5, 5) = -1;
    CHECK(!again.factor(bad));
    CHECK(!again.is_factored());
    REQUIRE(again.factor(box.K));
    CHECK(again.solved(b) == fresh.solved(b));

    // And with the order kept from elsewhere, for a part of the unknowns.
    SupernodalOptions options;
    options.node_order = elimination_order(node_graph(box.K, box.node_of_dof));
    SupernodalFactor third;
    third.analyse(box.K, box.node_of_dof, options);
    REQUIRE(third.factor(box.K));
    CHECK(third.solved(b) == fresh.solved(b));
}

TEST_CASE("a pivot that is not positive names its degree of freedom")
{
    for (const int wrong : {0, 3, 9}) {
        SparseMatrix A(10, 10);
        A.setIdentity();
        A.coeffRef(wrong, wrong) = -2;
        A.makeCompressed();
        SupernodalFactor factor;
        factor.analyse(A, one_node_each(10));
        const FactorResult result = factor.factor(A);
        CHECK(!result);
        CHECK(result.failed_dof == wrong);
        CHECK(!factor.is_factored());
        CHECK(factor.pivot_ratio() == 0);
        A.coeffRef(wrong, wrong) = std::numeric_limits<double>::quiet_NaN();
        CHECK(factor.factor(A).failed_dof == wrong);
        A.coeffRef(wrong, wrong) = 2;
        CHECK(factor.factor(A));
    }
    // A free body: its rigid motions cost nothing. With round-off the factor may succeed, but not
    // without a trace.
    SolidBoxOptions box;
    box.cells = {3, 3, 3};
    const VolumeMesh mesh = make_solid_box(box);
    const SolidPattern pattern = make_pattern(mesh);
    SparseMatrix K = zero_matrix(pattern);
    const SolidMaterial material{1e9, 0.3, 0};
    assemble_stiffness(mesh, pattern, {&material, 1}, K);
    std::vector<std::int32_t> nodes;
    for (std::int32_t i = 0; i < K.rows(); ++i)
        nodes.push_back(i / 3);
    SupernodalFactor factor;
    factor.analyse(K, nodes);
    if (factor.factor(K)) CHECK(factor.pivot_ratio() < 1e-14);
    const Solid held = solid(ElementKind::H8, 3);
    factor.analyse(held.K, held.node_of_dof);
    REQUIRE(factor.factor(held.K));
    CHECK(factor.pivot_ratio() > 1e-3);
}

TEST_CASE("backward error: zero for the answer and one for a wrong sign")
{
    const SparseMatrix A = random_matrix(50, 1);
    const Eigen::VectorXd x = random_dense(50, 1, 2), b = A * x;
    CHECK(backward_error(A, x, b) < 1e-15);
    CHECK(backward_error(A, Eigen::VectorXd::Zero(50), b) == doctest::Approx(1));
    CHECK(backward_error(A, -x, b) > 0.01);
}

TEST_CASE("no unknowns and no rows and rows that are empty")
{
    SupernodalFactor factor;
    SparseMatrix none(0, 0);
    none.makeCompressed();
    factor.analyse(none, {});
    CHECK(factor.factor(none));
    Eigen::MatrixXd X(0, 3), W;
    factor.solve(X);
    factor.compliance(SparseMatrix(0, 4), W);
    CHECK(W == Eigen::MatrixXd::Zero(4, 4));

    const SparseMatrix A = random_matrix(20, 3);
    factor.analyse(A, one_node_each(20));
    REQUIRE(factor.factor(A));
    factor.compliance(SparseMatrix(20, 0), W);
    CHECK(W.size() == 0);
    SparseMatrix C(20, 3);
    C.insert(4, 1) = 1;
    C.makeCompressed();
    factor.compliance(C, W);
    CHECK(W(1, 1) > 0);
    W(1, 1) = 0;
    CHECK(W == Eigen::MatrixXd::Zero(3, 3));
}
