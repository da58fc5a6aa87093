#include "solver/solid/rigid_modes.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/linear/supernodal.hpp"
#include "solver/solid/tests/solid_samples.hpp"

#include <doctest/doctest.h>

using namespace amontons;
using test::kAllKinds;

namespace {

struct LooseBox {
    VolumeMesh mesh;
    SolidPattern pattern;
    SparseMatrix K;
};

/// A box of 1 x 0.6 x 0.4, turned, far from the origin.
LooseBox loose_box(ElementKind kind, double size = 1, std::int32_t cells = 3)
{
    SolidBoxOptions box;
    box.highest = size * Vec3(1, 0.6, 0.4);
    box.cells = {cells, cells, 2};
    box.kind = kind;
    LooseBox b{make_solid_box(box), {}, {}};
    b.pattern = make_pattern(b.mesh);
    b.K = test::assembled_stiffness(b.mesh, b.pattern, {1e9, 0.3, 0});
    return b;
}

/// All or one of the axes of the nodes of a face.
void prescribe(const LooseBox& b, const char* face, std::initializer_list<int> axes,
               std::vector<std::int32_t>& dofs)
{
    for (const std::int32_t node : nodes_of(b.mesh, *find_set(b.mesh.face_sets, face)))
        for (const int a : axes)
            dofs.push_back(3 * node + a);
}

RigidModes modes_of(const LooseBox& b, std::span<const std::int32_t> prescribed,
                    std::span<const char> contact = {})
{
    return find_rigid_modes(b.mesh.nodes, b.pattern, prescribed, contact);
}

/// What every answer must be.
void check_laws(const LooseBox& b, const std::vector<std::int32_t>& prescribed, const RigidModes& m)
{
    const Eigen::Index n = b.K.rows(), k = m.R.cols();
    REQUIRE(Eigen::Index(m.pins.size()) == k);
    const double scale = b.K.coeffs().abs().maxCoeff();
    if (k > 0) {
        CHECK((b.K * m.R).cwiseAbs().maxCoeff() < 1e-11 * scale * m.R.cwiseAbs().maxCoeff());
        CHECK((m.R.transpose() * m.R * (3.0 / double(n)) - Eigen::MatrixXd::Identity(k, k)).norm() <
              1e-12);
    }
    for (const std::int32_t dof : prescribed)
        CHECK(m.R.row(dof).norm() == 0);
    for (const std::int32_t pin : m.pins)
        CHECK(std::find(prescribed.begin(), prescribed.end(), pin) == prescribed.end());

    // Pinned it is definite, and pins carry nothing under forces in equilibrium.
    std::vector<std::int32_t> fixed = prescribed;
    fixed.insert(fixed.end(), m.pins.begin(), m.pins.end());
    const FreeDofs dofs = make_free_dofs(b.pattern, fixed);
    const SparseMatrix K = make_elimination(b.K, dofs).ff;
    std::vector<std::int32_t> nodes;
    for (const std::int32_t dof : dofs.free)
        nodes.push_back(dof / 3);
    SupernodalFactor factor;
    factor.analyse(K, nodes);
    REQUIRE(factor.factor(K));
    CHECK(factor.pivot_ratio() > 1e-7); // [regression] our own run
    test::Random random(3);
    Eigen::VectorXd f = Eigen::VectorXd::NullaryExpr(n, [&] { return random(); });
    f -= m.R * (m.R.transpose() * f) * (3.0 / double(n));
    Eigen::VectorXd u = Eigen::VectorXd::Zero(n);
    u(dofs.free) = factor.solved(f(dofs.free));
    const Eigen::VectorXd reaction = b.K * u - f;
    for (const std::int32_t pin : m.pins)
        CHECK(std::abs(reaction[pin]) < 1e-10);
}

} // namespace

TEST_CASE("rigid modes left by what is prescribed: free 6 and a plane 3 and two 1 and three 0 and "
          "clamped 0")
{
    const std::pair<std::vector<std::pair<const char*, int>>, Eigen::Index> cases[] = {
        {{}, 6},
        {{{"x_min", 0}}, 3},
        {{{"x_min", 0}, {"y_min", 1}}, 1},
        {{{"x_min", 0}, {"x_max", 0}}, 3}, // parallel planes prevent the same
        {{{"x_min", 0}, {"y_min", 1}, {"z_min", 2}}, 0},
        {{{"x_min", 0}, {"x_min", 1}, {"x_min", 2}}, 0},
    };
    for (const ElementKind kind : kAllKinds)
        for (const double size : {1e-6, 1.0, 1e4}) {
            const LooseBox b = loose_box(kind, size, 2);
            for (const auto& [faces, expected] : cases) {
                CAPTURE(expected);
                CAPTURE(size);
                std::vector<std::int32_t> prescribed;
                for (const auto& [face, axis] : faces)
                    prescribe(b, face, {axis}, prescribed);
                const RigidModes m = modes_of(b, prescribed);
                CHECK(m.R.cols() == expected);
                check_laws(b, prescribed, m);
            }
        }
}

TEST_CASE("three points in a line leave the turn about it")
{
    LooseBox b = loose_box(ElementKind::H8, 1, 2);
    std::vector<std::int32_t> on_line, prescribed;
    for (std::size_t i = 0; i < b.mesh.nodes.size(); ++i)
        if (b.mesh.nodes[i][1] == 0 && b.mesh.nodes[i][2] == 0) on_line.push_back(std::int32_t(i));
    REQUIRE(on_line.size() == 3);
    for (const std::int32_t node : on_line)
        for (int a = 0; a < 3; ++a)
            prescribed.push_back(3 * node + a);
    const RigidModes m = modes_of(b, prescribed);
    REQUIRE(m.R.cols() == 1);
    check_laws(b, prescribed, m);
    for (std::size_t i = 0; i < b.mesh.nodes.size(); ++i) // u = c e_x x X
        CHECK(m.R(3 * Eigen::Index(i), 0) == doctest::Approx(0).epsilon(1e-12));

    // One node off the line by a thousandth of the size is enough to hold it.
    b.mesh.nodes[std::size_t(on_line[1])][2] += 1e-3;
    CHECK(modes_of(b, prescribed).R.cols() == 0);
}

TEST_CASE("modes turn and move with the body")
{
    test::Random random(7);
    LooseBox b = loose_box(ElementKind::T4);
    const Mat3 Q = random.rotation();
    for (Vec3& x : b.mesh.nodes)
        x = Q * x + Vec3(50, -20, 30);
    const SolidMaterial material{1e9, 0.3, 0};
    assemble_stiffness(b.mesh, b.pattern, {&material, 1}, b.K);
    const RigidModes m = modes_of(b, {});
    CHECK(m.R.cols() == 6);
    check_laws(b, {}, m);
}

TEST_CASE("pins keep away from contact nodes where others can hold the body")
{
    const LooseBox b = loose_box(ElementKind::T10);
    std::vector<char> contact(b.mesh.nodes.size(), 0);
    for (const char* face : {"x_min", "x_max", "y_min", "z_max"})
        for (const std::int32_t node : nodes_of(b.mesh, *find_set(b.mesh.face_sets, face)))
            contact[std::size_t(node)] = 1;
    const RigidModes m = modes_of(b, {}, contact);
    REQUIRE(m.pins.size() == 6);
    CHECK(!m.pins_at_contacts);
    for (const std::int32_t pin : m.pins)
        CHECK(!contact[std::size_t(pin / 3)]);
    check_laws(b, {}, m);

    // Two nodes leave the turn about their line to contact nodes; none leaves all.
    std::vector<char> nearly(b.mesh.nodes.size(), 1);
    nearly.front() = nearly.back() = 0;
    const RigidModes two = modes_of(b, {}, nearly);
    CHECK(two.pins_at_contacts);
    CHECK(std::count_if(two.pins.begin(), two.pins.end(),
                        [&](std::int32_t pin) { return nearly[std::size_t(pin / 3)] != 0; }) == 1);
    check_laws(b, {}, two);
    const RigidModes none = modes_of(b, {}, std::vector<char>(b.mesh.nodes.size(), 1));
    CHECK(none.pins_at_contacts);
    check_laws(b, {}, none);
}

TEST_CASE("parts that no element connects move apart and nodes of no element hold nothing")
{
    LooseBox b = loose_box(ElementKind::T4, 1, 2);
    const auto n = static_cast<std::int32_t>(b.mesh.nodes.size());
    for (std::int32_t i = 0; i < n; ++i)
        b.mesh.nodes.push_back(b.mesh.nodes[std::size_t(i)] + Vec3(5, 0, 0));
    b.mesh.nodes.push_back({9, 9, 9}); // of no element
    std::vector<std::int32_t>& elements = b.mesh.blocks.front().nodes;
    const std::size_t size = elements.size();
    for (std::size_t k = 0; k < size; ++k)
        elements.push_back(elements[k] + n);
    b.pattern = make_pattern(b.mesh);
    CHECK(modes_of(b, {}).R.cols() == 12);
    CHECK(modes_of(b, std::vector<std::int32_t>{6 * n, 6 * n + 1, 6 * n + 2}).R.cols() == 12);
    std::vector<std::int32_t> prescribed;
    prescribe(b, "x_min", {0, 1, 2}, prescribed); // of the first part
    const RigidModes m = modes_of(b, prescribed);
    CHECK(m.R.cols() == 6);
    CHECK(m.R.topRows(3 * n).norm() == 0);
    for (const std::int32_t pin : m.pins)
        CHECK(pin >= 3 * n);
}
