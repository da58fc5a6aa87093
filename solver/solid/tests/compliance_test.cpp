#include "solver/solid/compliance.hpp"

#include "mesh/extract_surface.hpp"
#include "mesh/generate/solid_box.hpp"
#include "solver/solid/tests/solid_samples.hpp"

#include <Eigen/Cholesky>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

constexpr std::size_t kBytesOfPair = 9 * sizeof(double);

struct HeldBox {
    VolumeMesh mesh;
    SolidPattern pattern;
    SparseMatrix K;
    FreeDofs dofs;
    std::vector<std::int32_t> surface;

    std::size_t bytes_of_column() const { return kBytesOfPair * surface.size(); }
};

/// A box held at z_min, and sideways at x_min so that some surface nodes are half prescribed.
HeldBox held_box(ElementKind kind, double E = 1e9)
{
    SolidBoxOptions box;
    box.cells = {3, 4, 3};
    box.kind = kind;
    HeldBox b{make_solid_box(box), {}, {}, {}, {}};
    b.pattern = make_pattern(b.mesh);
    b.K = test::assembled_stiffness(b.mesh, b.pattern, {E, 0.3, 0});
    std::vector<std::int32_t> fixed;
    for (const std::int32_t node : nodes_of(b.mesh, *find_set(b.mesh.face_sets, "z_min")))
        for (int a = 0; a < 3; ++a)
            fixed.push_back(3 * node + a);
    for (const std::int32_t node : nodes_of(b.mesh, *find_set(b.mesh.face_sets, "x_min")))
        fixed.push_back(3 * node);
    b.dofs = make_free_dofs(b.pattern, fixed);
    b.surface = extract_surface(b.mesh).used_nodes;
    return b;
}

SolidCompliance compliance_of(const HeldBox& b, std::size_t memory = std::size_t(1) << 30)
{
    SupernodalFactor factor;
    REQUIRE(factor_free(b.K, b.dofs, {}, factor));
    return SolidCompliance(std::move(factor), b.dofs, b.surface, memory);
}

/// Contacts on nodes of the surface, turned, with weights of both signs: free x 3 contacts.
SparseMatrix rows_on(const HeldBox& b, std::size_t contacts, unsigned seed, int at_each = 4)
{
    test::Random random(seed);
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t i = 0; i < contacts; ++i) {
        const Mat3 frame = random.rotation();
        for (int k = 0; k < at_each; ++k) {
            const auto n = std::size_t((random() + 1) / 2 * double(b.surface.size()));
            const std::int32_t node = b.surface[std::min(n, b.surface.size() - 1)];
            const double weight = random();
            for (int row = 0; row < 3; ++row)
                for (int axis = 0; axis < 3; ++axis)
                    if (const auto free = b.dofs.number[std::size_t(3 * node + axis)]; free >= 0)
                        entries.emplace_back(free, 3 * int(i) + row, weight * frame(axis, row));
        }
    }
    SparseMatrix C(Eigen::Index(b.dofs.free.size()), 3 * Eigen::Index(contacts));
    C.setFromTriplets(entries.begin(), entries.end());
    return C;
}

std::vector<std::int32_t> nodes_in_rows(const HeldBox& b, const SparseMatrix& C)
{
    std::vector<std::int32_t> nodes;
    for (Eigen::Index k = 0; k < C.nonZeros(); ++k)
        nodes.push_back(b.dofs.free[std::size_t(C.innerIndexPtr()[k])] / 3);
    return nodes;
}

/// By a dense inverse.
Eigen::MatrixXd reference(const HeldBox& b, const SparseMatrix& C)
{
    const Eigen::MatrixXd dense = Eigen::MatrixXd(b.K);
    const Eigen::MatrixXd part = dense(b.dofs.free, b.dofs.free);
    return C.transpose() * part.llt().solve(Eigen::MatrixXd(C));
}

Eigen::MatrixXd by_tree(const SolidCompliance& compliance, const SparseMatrix& C)
{
    Eigen::MatrixXd W;
    compliance.factor().compliance(C, W);
    return W;
}

/// C r on all degrees of freedom, and on those of the surface alone.
Eigen::VectorXd forces(const HeldBox& b, const SparseMatrix& C, const Eigen::VectorXd& r)
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(b.K.rows());
    f(b.dofs.free) = Eigen::VectorXd(C * r);
    return f;
}
Eigen::VectorXd on_surface(const HeldBox& b, const Eigen::VectorXd& of_all)
{
    Eigen::VectorXd of_surface(3 * Eigen::Index(b.surface.size()));
    for (std::size_t s = 0; s < b.surface.size(); ++s)
        of_surface.segment<3>(3 * Eigen::Index(s)) = of_all.segment<3>(3 * b.surface[s]);
    return of_surface;
}

double distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b)
{
    return (a - b).norm() / b.norm();
}

} // namespace

TEST_CASE("W from kept columns and from the tree and from a dense inverse are one" *
          doctest::test_suite("slow"))
{
    for (const ElementKind kind : test::kAllKinds) {
        const HeldBox b = held_box(kind);
        SolidCompliance compliance = compliance_of(b);
        compliance.prepare(b.surface);
        for (const std::size_t contacts : {1, 5, 30}) {
            const SparseMatrix rows = rows_on(b, contacts, unsigned(contacts));
            const Eigen::MatrixXd expected = reference(b, rows);
            Eigen::MatrixXd W;
            compliance.delassus(rows, W);
            const Eigen::MatrixXd once = by_tree(compliance, rows);
            CHECK(distance(W, expected) < 1e-12);
            CHECK(distance(once, expected) < 1e-12);
            CHECK(W == W.transpose());
            CHECK(once == once.transpose());
        }
        CHECK(compliance.counts().from_factor == 0);
    }
}

TEST_CASE("columns are solved once and no contact or none is fine")
{
    const HeldBox b = held_box(ElementKind::T4);
    SolidCompliance compliance = compliance_of(b);
    const SparseMatrix rows = rows_on(b, 12, 1);
    Eigen::MatrixXd first, second;
    compliance.prepare(nodes_in_rows(b, rows));
    compliance.delassus(rows, first);
    const std::int64_t solved = compliance.counts().columns_solved;
    CHECK(solved > 0);
    CHECK(compliance.counts().bytes == std::size_t(solved) * b.bytes_of_column());
    compliance.delassus(rows, second);
    compliance.surface_displacement(on_surface(b, forces(b, rows, Eigen::VectorXd::Ones(36))));
    CHECK(compliance.counts().columns_solved == solved);
    CHECK(first == second);

    compliance.prepare(b.surface);
    CHECK(compliance.counts().columns_solved == std::int64_t(b.surface.size()));
    compliance.delassus(rows_on(b, 40, 2), second);
    CHECK(compliance.counts().columns_solved == std::int64_t(b.surface.size()));

    compliance.delassus(SparseMatrix(Eigen::Index(b.dofs.free.size()), 0), second);
    CHECK(second.size() == 0);
    SparseMatrix inside(Eigen::Index(b.dofs.free.size()), 1);
    for (std::size_t k = 0; k < b.dofs.free.size() && inside.nonZeros() == 0; ++k)
        if (!std::binary_search(b.surface.begin(), b.surface.end(), b.dofs.free[k] / 3))
            inside.coeffRef(Eigen::Index(k), 0) = 1;
    REQUIRE(inside.nonZeros() == 1);
    inside.makeCompressed();
    CHECK_THROWS_AS(compliance.delassus(inside, second), std::logic_error);
}

TEST_CASE("columns have the same bits for any number of threads")
{
    const HeldBox b = held_box(ElementKind::H8);
    SolidCompliance one = compliance_of(b), small = compliance_of(b, 20 * b.bytes_of_column());
    one.prepare(b.surface);
    REQUIRE(one.counts().columns_solved > 3 * 16); // several lots, the last not full
    const SparseMatrix C = rows_on(b, 18, 1, 1);
    Eigen::MatrixXd W, V;
    REQUIRE(one.delassus(C, W));
    for (const int threads : {2, 3, 5}) {
        SolidCompliance more = compliance_of(b);
        more.use_threads(threads);
        more.prepare(b.surface);
        CHECK(more.counts().columns_solved == one.counts().columns_solved);
        REQUIRE(more.delassus(C, V));
        CHECK((V - W).norm() == 0);
    }
    small.use_threads(4); // more at once than there is room for
    small.prepare(b.surface);
    small.expect(1000);
    const SparseMatrix few = rows_on(b, 6, 2, 1);
    REQUIRE(one.delassus(few, W));
    REQUIRE(small.delassus(few, V));
    CHECK(small.counts().bytes <= 20 * b.bytes_of_column());
    CHECK((V - W).norm() == 0);
}

TEST_CASE("the bound on memory holds whatever comes and W stays right")
{
    const HeldBox b = held_box(ElementKind::H8);
    const std::size_t room = 20, bound = room * b.bytes_of_column() + 17;
    SolidCompliance small = compliance_of(b, bound), large = compliance_of(b);
    CHECK(small.most_columns() == room);
    for (unsigned step = 0; step < 60; ++step) {
        const SparseMatrix rows = rows_on(b, 1 + step % 9, step);
        Eigen::MatrixXd W;
        if (step % 2 == 0) small.prepare(nodes_in_rows(b, rows));
        small.delassus(rows, W);
        CHECK(distance(W, by_tree(large, rows)) < 1e-13);
        CHECK(small.counts().bytes <= bound);
    }
    small.prepare(b.surface);
    CHECK(small.counts().bytes <= bound);
    CHECK(small.counts().columns_dropped > 0);
    CHECK(small.counts().from_factor > 0); // 9 contacts have up to 36 nodes
    CHECK(large.counts().columns_dropped == 0);

    SolidCompliance none = compliance_of(b, 0);
    const SparseMatrix rows = rows_on(b, 5, 1);
    Eigen::MatrixXd W, expected;
    none.delassus(rows, W);
    large.delassus(rows, expected);
    CHECK(distance(W, expected) < 1e-13);
    CHECK(none.counts().bytes == 0);
    const Eigen::VectorXd f = on_surface(b, forces(b, rows, Eigen::VectorXd::Ones(15)));
    CHECK(distance(none.surface_displacement(f), large.surface_displacement(f)) < 1e-13);
}

TEST_CASE("columns are solved once the tree has cost as much and at once for a few new nodes")
{
    const HeldBox b = held_box(ElementKind::T10);
    SolidCompliance compliance = compliance_of(b);
    const SparseMatrix rows = rows_on(b, 20, 6);
    Eigen::MatrixXd W, later;
    compliance.delassus(rows, W);
    CHECK(compliance.counts().columns_solved == 0); // one W by the tree costs less
    later = W;
    for (int k = 0; k < 100 && compliance.counts().columns_solved == 0; ++k)
        compliance.delassus(rows, later);
    const ComplianceCounts then = compliance.counts();
    CHECK(then.columns_solved > 0);
    CHECK(then.from_factor > 1);
    CHECK(distance(later, W) < 1e-13);
    compliance.delassus(rows, later);
    CHECK(compliance.counts().from_factor == then.from_factor);

    const std::vector<std::int32_t> known = nodes_in_rows(b, rows);
    SparseMatrix more = rows;
    more.conservativeResize(rows.rows(), rows.cols() + 1);
    for (std::size_t k = 0; k < b.dofs.free.size() && more.nonZeros() == rows.nonZeros(); ++k) {
        const std::int32_t node = b.dofs.free[k] / 3;
        if (std::binary_search(b.surface.begin(), b.surface.end(), node) &&
            std::find(known.begin(), known.end(), node) == known.end())
            more.coeffRef(Eigen::Index(k), rows.cols()) = 1;
    }
    REQUIRE(more.nonZeros() == rows.nonZeros() + 1);
    more.makeCompressed();
    compliance.delassus(more, later);
    CHECK(compliance.counts().columns_solved == then.columns_solved + 1);
    CHECK(compliance.counts().from_factor == then.from_factor);
}

TEST_CASE("the columns used least recently are first")
{
    const HeldBox b = held_box(ElementKind::T4);
    SolidCompliance compliance = compliance_of(b, 6 * b.bytes_of_column());
    const auto solved_for = [&](std::size_t first, std::size_t count) {
        const std::int64_t before = compliance.counts().columns_solved;
        compliance.prepare(std::span(b.surface).subspan(first, count));
        return compliance.counts().columns_solved - before;
    };
    CHECK(solved_for(0, 3) == 3);
    CHECK(solved_for(3, 3) == 3);
    CHECK(solved_for(0, 3) == 0);
    CHECK(solved_for(6, 3) == 3); // 3, 4, 5 are dropped
    CHECK(solved_for(0, 3) == 0);
    CHECK(solved_for(4, 1) == 1);
    CHECK(compliance.counts().columns_dropped == 4);
}

TEST_CASE("displacements obey K x = f and their work is that of W")
{
    const HeldBox b = held_box(ElementKind::T10);
    SolidCompliance compliance = compliance_of(b);
    const SparseMatrix rows = rows_on(b, 8, 3);
    test::Random random(9);
    const Eigen::VectorXd r = Eigen::VectorXd::NullaryExpr(24, [&] { return random(); });
    const Eigen::VectorXd f = forces(b, rows, r);
    const Eigen::VectorXd x = compliance.displacement(f);
    const Eigen::VectorXd rest = b.K * x - f, free_rest = rest(b.dofs.free);
    CHECK(free_rest.norm() < 1e-11 * f.norm());
    for (const std::int32_t dof : b.dofs.fixed)
        CHECK(x[dof] == 0);

    Eigen::MatrixXd W;
    compliance.delassus(rows, W);
    CHECK(distance(rows.transpose() * Eigen::VectorXd(x(b.dofs.free)), W * r) < 1e-12);
    CHECK(f.dot(x) == doctest::Approx(r.dot(W * r)).epsilon(1e-12));
    CHECK(distance(compliance.surface_displacement(on_surface(b, f)), on_surface(b, x)) < 1e-12);

    // Many at once, from kept columns alone.
    const Eigen::VectorXd one = on_surface(b, f);
    Eigen::MatrixXd many(one.size(), 2), Y;
    many << one, -3 * one;
    const SparseMatrix F = many.sparseView();
    SolidCompliance fresh = compliance_of(b);
    CHECK_FALSE(fresh.surface_displacements(F, Y));
    fresh.prepare(b.surface);
    fresh.set_scale(2);
    REQUIRE(fresh.surface_displacements(F, Y));
    CHECK(distance(Y.col(0), on_surface(b, x) / 2) < 1e-12);
    CHECK(distance(Y.col(1), -1.5 * on_surface(b, x)) < 1e-12);

    // No room for the columns of all nodes: by the factor, however many there are.
    SolidCompliance tight = compliance_of(b, 2 * b.bytes_of_column());
    tight.set_scale(2);
    Eigen::MatrixXd more(one.size(), 40);
    for (Eigen::Index j = 0; j < more.cols(); ++j)
        more.col(j) = double(j) * one;
    REQUIRE(tight.surface_displacements(more.sparseView(), Y));
    for (Eigen::Index j = 1; j < more.cols(); ++j)
        CHECK(distance(Y.col(j), double(j) * on_surface(b, x) / 2) < 1e-12);
    CHECK(tight.counts().columns_solved == 0);
}

TEST_CASE(
    "columns with all rows move the whole body and are solved early where many solves are expected")
{
    const HeldBox b = held_box(ElementKind::T4);
    SupernodalFactor factor;
    REQUIRE(factor_free(b.K, b.dofs, {}, factor));
    SolidCompliance compliance(std::move(factor), b.dofs, b.surface, SolidCompliance::kColumnMemory,
                               ColumnRows::all);
    const SparseMatrix C = rows_on(b, 10, 5, 2);
    const Eigen::VectorXd r = Eigen::VectorXd::LinSpaced(30, -1, 2), f = C * r;
    const Eigen::VectorXd expected = compliance.factor().solved(f);
    CHECK(distance(compliance.solved(f), expected) == 0); // one solve costs less
    CHECK(compliance.counts().columns_solved == 0);
    compliance.expect(1e3);
    CHECK(distance(compliance.solved(f), expected) < 1e-13);
    CHECK(compliance.counts().from_factor == 1);
    CHECK(compliance.counts().columns_solved == 16); // up to 16 nodes, and what costs nothing more
    Eigen::MatrixXd W;
    compliance.delassus(C, W);
    CHECK(distance(W, by_tree(compliance, C)) < 1e-13);
    CHECK(distance(on_surface(b,
                              [&] {
                                  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.K.rows());
                                  x(b.dofs.free) = expected;
                                  return x;
                              }()),
                   compliance.surface_displacement(on_surface(b, forces(b, C, r)))) < 1e-13);

    // A copy with the same columns continues with the same bits.
    SupernodalFactor again;
    REQUIRE(factor_free(b.K, b.dofs, {}, again));
    SolidCompliance copy(std::move(again), b.dofs, b.surface, SolidCompliance::kColumnMemory,
                         ColumnRows::all);
    copy.keep(compliance.kept());
    CHECK(copy.kept() == compliance.kept());
    CHECK(copy.solved(f) == compliance.solved(f));
}

TEST_CASE("a stiffer material of the same ratio is a matter of scale")
{
    const HeldBox soft = held_box(ElementKind::H8, 1e6), stiff = held_box(ElementKind::H8, 3e11);
    SolidCompliance scaled = compliance_of(soft), fresh = compliance_of(stiff);
    scaled.set_scale(3e5);
    const SparseMatrix rows = rows_on(soft, 10, 4);
    Eigen::MatrixXd of_tree, of_columns, expected;
    scaled.delassus(rows, of_tree);
    CHECK(scaled.counts().from_factor == 1);
    scaled.prepare(soft.surface);
    scaled.delassus(rows, of_columns);
    CHECK(scaled.counts().from_factor == 1);
    fresh.delassus(rows, expected);
    CHECK(distance(of_tree, expected) < 1e-13);
    CHECK(distance(of_columns, expected) < 1e-13);
    const Eigen::VectorXd f = forces(soft, rows, Eigen::VectorXd::Ones(30));
    CHECK(distance(scaled.surface_displacement(on_surface(soft, f)),
                   fresh.surface_displacement(on_surface(soft, f))) < 1e-13);
    CHECK(distance(scaled.displacement(f), fresh.displacement(f)) < 1e-13);
}

TEST_CASE("a bar stretched through a contact on its end face: F L / (E A)")
{
    SolidBoxOptions box;
    box.highest = {0.1, 0.2, 2};
    box.cells = {2, 2, 8};
    const VolumeMesh mesh = make_solid_box(box);
    const SolidPattern pattern = make_pattern(mesh);
    SparseMatrix K = zero_matrix(pattern);
    const SolidMaterial material{2e11, 0, 0};
    assemble_stiffness(mesh, pattern, {&material, 1}, K);
    std::vector<std::int32_t> fixed;
    for (const std::int32_t node : nodes_of(mesh, *find_set(mesh.face_sets, "z_min")))
        for (int a = 0; a < 3; ++a)
            fixed.push_back(3 * node + a);
    const FreeDofs dofs = make_free_dofs(pattern, fixed);
    SupernodalFactor factor;
    REQUIRE(factor_free(K, dofs, {}, factor));
    SolidCompliance compliance(std::move(factor), dofs, extract_surface(mesh).used_nodes);

    // The mean over the end, n outwards: weights of a constant pressure.
    Eigen::VectorXd f = Eigen::VectorXd::Zero(K.rows());
    add_traction(mesh, find_set(mesh.face_sets, "z_max")->members, Vec3::UnitZ(), f);
    SparseMatrix rows(Eigen::Index(dofs.free.size()), 1);
    for (std::size_t k = 0; k < dofs.free.size(); ++k)
        if (f[dofs.free[k]] != 0) rows.coeffRef(Eigen::Index(k), 0) = f[dofs.free[k]] / 0.02;
    rows.makeCompressed();
    Eigen::MatrixXd W;
    compliance.delassus(rows, W);
    CHECK(W(0, 0) == doctest::Approx(2 / (2e11 * 0.02)).epsilon(1e-12));
}
