#include "solver/solid/compliance.hpp"

#include "mesh/extract_surface.hpp"
#include "mesh/generate/solid_box.hpp"
#include "solver/solid/tests/solid_samples.hpp"

#include <Eigen/Cholesky>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

constexpr std::size_t kBytesOfPair = 9 * sizeof(double);

struct Body {
    VolumeMesh mesh;
    SolidPattern pattern;
    SparseMatrix K;
    FreeDofs dofs;
    std::vector<std::int32_t> surface;

    std::size_t bytes_of_column() const { return kBytesOfPair * surface.size(); }
};

/// A box held at z_min, and sideways at x_min so that some surface nodes are half prescribed.
Body body(ElementKind kind, double E = 1e9)
{
    SolidBoxOptions box;
    box.cells = {3, 4, 3};
    box.kind = kind;
    Body b{make_solid_box(box), {}, {}, {}, {}};
    b.pattern = make_pattern(b.mesh);
    b.K = zero_matrix(b.pattern);
    const SolidMaterial material{E, 0.3, 0};
    assemble_stiffness(b.mesh, b.pattern, {&material, 1}, b.K);
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

SolidCompliance compliance_of(const Body& b, std::size_t memory = std::size_t(1) << 30)
{
    SupernodalFactor factor;
    REQUIRE(factor_free(b.K, b.dofs, {}, factor));
    return SolidCompliance(std::move(factor), b.dofs, b.surface, memory);
}

/// Contacts on the given nodes: turned frames, weights of both signs.
ContactRows rows_on(std::span<const std::int32_t> nodes, std::size_t contacts, unsigned seed,
                    int at_each = 4)
{
    test::Random random(seed);
    ContactRows rows;
    for (std::size_t i = 0; i < contacts; ++i) {
        rows.begin(random.rotation());
        for (int k = 0; k < at_each; ++k) {
            const auto n = std::size_t((random() + 1) / 2 * double(nodes.size()));
            rows.add(nodes[std::min(n, nodes.size() - 1)], random());
        }
    }
    return rows;
}

void prepare(SolidCompliance& compliance, const ContactRows& rows)
{
    std::vector<std::int32_t> nodes;
    for (const ContactRows::Entry& e : rows.entry)
        nodes.push_back(e.node);
    compliance.prepare(nodes);
}

/// H of all degrees of freedom, and A^-1 with zeros where prescribed, both dense.
Eigen::MatrixXd reference(const Body& b, const ContactRows& rows)
{
    const Eigen::Index n = b.K.rows(), free = Eigen::Index(b.dofs.free.size());
    const Eigen::MatrixXd dense = Eigen::MatrixXd(b.K);
    const Eigen::MatrixXd part = dense(b.dofs.free, b.dofs.free);
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
    const Eigen::MatrixXd of_part = part.llt().solve(Eigen::MatrixXd::Identity(free, free));
    inverse(b.dofs.free, b.dofs.free) = of_part;
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3 * Eigen::Index(rows.size()), n);
    for (std::size_t i = 0; i < rows.size(); ++i)
        for (const ContactRows::Entry& e : rows.of(i))
            H.block<3, 3>(3 * Eigen::Index(i), 3 * e.node) += e.weight * rows.frame[i].transpose();
    return H * inverse * H.transpose();
}

double distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b)
{
    return (a - b).norm() / b.norm();
}

} // namespace

TEST_CASE("W from kept columns, from the tree and from a dense inverse are one")
{
    for (const ElementKind kind : test::kAllKinds) {
        const Body b = body(kind);
        SolidCompliance compliance = compliance_of(b);
        compliance.prepare(b.surface);
        for (const std::size_t contacts : {1, 5, 30}) {
            const ContactRows rows = rows_on(b.surface, contacts, unsigned(contacts));
            const Eigen::MatrixXd expected = reference(b, rows);
            Eigen::MatrixXd W, once, of_matrix;
            compliance.delassus(rows, W);
            compliance.delassus(contact_matrix(rows, b.dofs), of_matrix);
            compliance.delassus_once(rows, once);
            CHECK(distance(of_matrix, expected) < 1e-12);
            CHECK(of_matrix == of_matrix.transpose());
            CHECK(distance(W, expected) < 1e-12);
            CHECK(distance(once, expected) < 1e-12);
            CHECK(W == W.transpose());
            CHECK(once == once.transpose());
        }
        CHECK(compliance.counts().from_factor == 0);
    }
}

TEST_CASE("columns are solved once, and no contact or none is fine")
{
    const Body b = body(ElementKind::T4);
    SolidCompliance compliance = compliance_of(b);
    const ContactRows rows = rows_on(b.surface, 12, 1);
    Eigen::MatrixXd first, second;
    prepare(compliance, rows);
    compliance.delassus(rows, first);
    const std::int64_t solved = compliance.counts().columns_solved;
    CHECK(solved > 0);
    CHECK(compliance.counts().bytes == std::size_t(solved) * b.bytes_of_column());
    compliance.delassus(rows, second);
    compliance.surface_displacement(rows, Eigen::VectorXd::Ones(36));
    CHECK(compliance.counts().columns_solved == solved);
    CHECK(first == second);

    compliance.prepare(b.surface);
    CHECK(compliance.counts().columns_solved == std::int64_t(b.surface.size()));
    compliance.delassus(rows_on(b.surface, 40, 2), second);
    CHECK(compliance.counts().columns_solved == std::int64_t(b.surface.size()));

    compliance.delassus(ContactRows(), second);
    CHECK(second.size() == 0);
    ContactRows inside;
    inside.begin(Mat3::Identity());
    for (std::int32_t i = 0; i < std::int32_t(b.mesh.nodes.size()); ++i)
        if (!std::binary_search(b.surface.begin(), b.surface.end(), i)) {
            inside.add(i, 1);
            break;
        }
    REQUIRE(inside.entry.size() == 1);
    CHECK_THROWS_AS(compliance.delassus(inside, second), std::logic_error);
}

TEST_CASE("the bound on memory holds, whatever comes, and W stays right")
{
    const Body b = body(ElementKind::H8);
    const std::size_t room = 20, bound = room * b.bytes_of_column() + 17;
    SolidCompliance small = compliance_of(b, bound), large = compliance_of(b);
    CHECK(small.most_columns() == room);
    for (unsigned step = 0; step < 60; ++step) {
        const ContactRows rows = rows_on(b.surface, 1 + step % 9, step);
        Eigen::MatrixXd W, expected;
        if (step % 2 == 0) prepare(small, rows);
        small.delassus(rows, W);
        large.delassus_once(rows, expected);
        CHECK(distance(W, expected) < 1e-13);
        CHECK(small.counts().bytes <= bound);
    }
    small.prepare(b.surface);
    CHECK(small.counts().bytes <= bound);
    CHECK(small.counts().columns_dropped > 0);
    CHECK(small.counts().from_factor > 0); // 9 contacts have up to 36 nodes
    CHECK(large.counts().columns_dropped == 0);

    SolidCompliance none = compliance_of(b, 0);
    const ContactRows rows = rows_on(b.surface, 5, 1);
    Eigen::MatrixXd W, expected;
    none.delassus(rows, W);
    large.delassus(rows, expected);
    CHECK(distance(W, expected) < 1e-13);
    CHECK(none.counts().bytes == 0);
    const Eigen::VectorXd r = Eigen::VectorXd::Ones(15);
    CHECK(distance(none.surface_displacement(rows, r), large.surface_displacement(rows, r)) <
          1e-13);
}

TEST_CASE("columns are solved once the tree has cost as much, and at once for a few new nodes")
{
    const Body b = body(ElementKind::T10);
    SolidCompliance compliance = compliance_of(b);
    const ContactRows rows = rows_on(b.surface, 20, 6);
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

    ContactRows more = rows;
    for (const std::int32_t node : b.surface)
        if (std::none_of(rows.entry.begin(), rows.entry.end(),
                         [&](const ContactRows::Entry& e) { return e.node == node; })) {
            more.begin(Mat3::Identity());
            more.add(node, 1);
            break;
        }
    REQUIRE(more.size() == rows.size() + 1);
    compliance.delassus(more, later);
    CHECK(compliance.counts().columns_solved == then.columns_solved + 1);
    CHECK(compliance.counts().from_factor == then.from_factor);
}

TEST_CASE("the columns used least recently go first")
{
    const Body b = body(ElementKind::T4);
    SolidCompliance compliance = compliance_of(b, 6 * b.bytes_of_column());
    const auto solved_for = [&](std::size_t first, std::size_t count) {
        const std::int64_t before = compliance.counts().columns_solved;
        compliance.prepare(std::span(b.surface).subspan(first, count));
        return compliance.counts().columns_solved - before;
    };
    CHECK(solved_for(0, 3) == 3);
    CHECK(solved_for(3, 3) == 3);
    CHECK(solved_for(0, 3) == 0);
    CHECK(solved_for(6, 3) == 3); // 3, 4, 5 go
    CHECK(solved_for(0, 3) == 0);
    CHECK(solved_for(4, 1) == 1);
    CHECK(compliance.counts().columns_dropped == 4);
}

TEST_CASE("displacements obey K x = f, and their work is that of W")
{
    const Body b = body(ElementKind::T10);
    SolidCompliance compliance = compliance_of(b);
    const ContactRows rows = rows_on(b.surface, 8, 3);
    test::Random random(9);
    const Eigen::VectorXd r = Eigen::VectorXd::NullaryExpr(24, [&] { return random(); });
    Eigen::VectorXd f = Eigen::VectorXd::Zero(b.K.rows());
    add_reactions(rows, r, f);
    const Eigen::VectorXd x = compliance.displacement(f);
    const Eigen::VectorXd rest = b.K * x - f, free_rest = rest(b.dofs.free);
    CHECK(free_rest.norm() < 1e-11 * f.norm());
    for (const std::int32_t dof : b.dofs.fixed)
        CHECK(x[dof] == 0);

    Eigen::MatrixXd W;
    compliance.delassus(rows, W);
    CHECK(distance(relative_motion(rows, x), W * r) < 1e-12);
    CHECK(f.dot(x) == doctest::Approx(r.dot(W * r)).epsilon(1e-12));
    const Eigen::VectorXd on_surface = compliance.surface_displacement(rows, r);
    double worst = 0;
    for (std::size_t s = 0; s < b.surface.size(); ++s)
        worst = std::max(
            worst,
            (on_surface.segment<3>(3 * Eigen::Index(s)) - x.segment<3>(3 * b.surface[s])).norm());
    CHECK(worst < 1e-12 * x.norm());
}

TEST_CASE("rows of a surface's contacts: u = F^T (slave - master)")
{
    SurfaceContacts contacts;
    contacts.stencil = {{0, 0.25}, {1, 0.75}, {2, 0.5}, {0, 0.5}};
    SurfaceContact c;
    c.normal = Vec3(1, 2, 2) / 3;
    set_tangents(c);
    c.slave_end = c.master_begin = 2;
    c.master_end = 4;
    contacts.contact = {c};
    test::Random random(2);
    const Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(9, [&] { return random(); });
    const Vec3 slave = 0.25 * x.head<3>() + 0.75 * x.segment<3>(3),
               master = 0.5 * x.tail<3>() + 0.5 * x.head<3>();
    Mat3 F;
    F << c.normal, c.t1, c.t2;
    const auto motion = [&](ContactSide side) {
        return relative_motion(rows_of(contacts, side), x);
    };
    CHECK((motion(ContactSide::slave) - F.transpose() * slave).norm() < 1e-15);
    CHECK((motion(ContactSide::master) + F.transpose() * master).norm() < 1e-15);
    CHECK((motion(ContactSide::both) - F.transpose() * (slave - master)).norm() < 1e-15);
}

TEST_CASE("a stiffer material of the same ratio is a matter of scale")
{
    const Body soft = body(ElementKind::H8, 1e6), stiff = body(ElementKind::H8, 3e11);
    SolidCompliance scaled = compliance_of(soft), fresh = compliance_of(stiff);
    scaled.set_scale(3e5);
    const ContactRows rows = rows_on(soft.surface, 10, 4);
    Eigen::MatrixXd W, once, expected;
    scaled.delassus(rows, W);
    scaled.delassus_once(rows, once);
    fresh.delassus(rows, expected);
    CHECK(distance(W, expected) < 1e-13);
    CHECK(distance(once, expected) < 1e-13);
    const Eigen::VectorXd r = Eigen::VectorXd::Ones(30);
    CHECK(distance(scaled.surface_displacement(rows, r), fresh.surface_displacement(rows, r)) <
          1e-13);
    const Eigen::VectorXd f = Eigen::VectorXd::Ones(soft.K.rows());
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
    ContactRows rows;
    Mat3 frame;
    frame << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    rows.begin(frame);
    for (const std::int32_t node : nodes_of(mesh, *find_set(mesh.face_sets, "z_max")))
        rows.add(node, f[3 * node + 2] / 0.02);
    Eigen::MatrixXd W;
    compliance.delassus(rows, W);
    CHECK(W(0, 0) == doctest::Approx(2 / (2e11 * 0.02)).epsilon(1e-12));
}
