#include "contact/fclib.hpp"

#include "contact/solvers/solve.hpp"
#include "contact/tests/contact_problems.hpp"

#include <algorithm>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

using Integers = std::vector<std::int32_t>;
using Numbers = std::vector<double>;

/// u = W r + q with W = [1 2 0; 2 3 0; 0 0 4] for one contact, stored in each of the three ways.
std::vector<NamedArray> small(int nz)
{
    std::vector<NamedArray> a{
        {"fclib_local/spacedim", Integers{3}},   {"fclib_local/W/nzmax", Integers{7}},
        {"fclib_local/W/m", Integers{3}},        {"fclib_local/W/n", Integers{3}},
        {"fclib_local/W/nz", Integers{nz}},      {"fclib_local/vectors/q", Numbers{-1, 0, 0}},
        {"fclib_local/vectors/mu", Numbers{0.5}}};
    if (nz >= 0) {
        a.push_back({"fclib_local/W/i", Integers{0, 1, 0, 1, 2, 2}});
        a.push_back({"fclib_local/W/p", Integers{0, 0, 1, 1, 2, 2}});
        a.push_back({"fclib_local/W/x", Numbers{1, 2, 2, 3, 1, 3}}); // 1 + 3: duplicates add up
    } else {
        a.push_back({"fclib_local/W/p", Integers{0, 2, 4, 5}});
        a.push_back({"fclib_local/W/i", Integers{0, 1, 0, 1, 2, 99, 99}}); // nzmax has room
        a.push_back({"fclib_local/W/x", Numbers{1, 2, 2, 3, 4, NAN, NAN}});
    }
    return a;
}

NamedArray& of(std::vector<NamedArray>& arrays, const std::string& name)
{
    return *std::find_if(arrays.begin(), arrays.end(),
                         [&](const NamedArray& a) { return a.name == name; });
}

Eigen::MatrixXd full_matrix(const Delassus& W)
{
    return W.is_dense() ? W.dense() : Eigen::MatrixXd(W.sparse());
}

/// Reading what was written.
FclibProblem again(const FclibProblem& p)
{
    return fclib_problem(unpack_arrays(pack_arrays(fclib_arrays(p))), "again.hdf5");
}

GlobalProblem one_mass_on_the_ground(bool glued)
{
    GlobalProblem p;
    const Eigen::Index rows = glued ? 4 : 3;
    p.M = Eigen::SparseMatrix<double>(4, 4);
    for (int i = 0; i < 4; ++i)
        p.M.insert(i, i) = 2 + i;
    p.H = Eigen::SparseMatrix<double>(4, rows);
    for (int i = 0; i < rows; ++i)
        p.H.insert(i, i) = 1;
    p.f = Eigen::VectorXd::LinSpaced(4, -4, -1);
    p.w = Eigen::VectorXd::LinSpaced(rows, 0.1, 0.4);
    p.mu = Eigen::VectorXd::Constant(1, 0.3);
    if (glued) {
        p.mu.conservativeResize(2);
        p.mu[1] = 0;
        p.kind = {ContactKind::frictional, ContactKind::bilateral};
    }
    return p;
}

} // namespace

TEST_CASE("columns and rows and triplets hold the same matrix")
{
    Eigen::Matrix3d W;
    W << 1, 2, 0, 2, 3, 0, 0, 0, 4;
    for (const int nz : {-1, -2, 6}) {
        const FclibProblem p = fclib_problem(small(nz), "a.hdf5");
        REQUIRE(p.local);
        CHECK((full_matrix(p.local->W) - W).norm() == 0);
        CHECK(p.local->W.is_dense()); // 5 of 9
        CHECK(p.local->level == ContactLevel::velocity);
        CHECK_FALSE(p.has_level);
    }
}

TEST_CASE("triplets of an oblong matrix are read in the orientation in which they fit")
{
    FclibProblem p;
    p.global = one_mass_on_the_ground(false);
    std::vector<NamedArray> arrays = fclib_arrays(p);
    of(arrays, "fclib_global/H/nz").value = Integers{2};
    of(arrays, "fclib_global/H/x").value = Numbers{5, 6};
    of(arrays, "fclib_global/H/i").value = Integers{3, 0}; // 4 rows, 3 columns
    of(arrays, "fclib_global/H/p").value = Integers{0, 2};
    CHECK(fclib_problem(arrays, "a.hdf5").global->H.coeff(3, 0) == 5);
    std::swap(of(arrays, "fclib_global/H/i").value, of(arrays, "fclib_global/H/p").value);
    CHECK(fclib_problem(arrays, "a.hdf5").global->H.coeff(3, 0) == 5);
    of(arrays, "fclib_global/H/i").value = Integers{3, 0}; // fits neither way
    of(arrays, "fclib_global/H/p").value = Integers{0, 3};
    CHECK_THROWS_AS(fclib_problem(arrays, "a.hdf5"), InputError);
}

TEST_CASE("what is written is what is read")
{
    std::mt19937 rng{1};
    for (const bool velocity : {false, true}) {
        FclibProblem p;
        p.local = velocity ? test::tower({1, 2, 3, 4, 5, 6, 7, 8}, 0.2, 0.7)
                           : test::random_problem(rng, 5, 12, 0.4);
        p.title = "a problem";
        p.identity = velocity ? Integers{8, 7, 6, 5, 4, 3, 2, 1} : Integers{};
        const Eigen::Index rows = p.local->q.size();
        p.solution = FclibSolution{
            Eigen::VectorXd::LinSpaced(rows, 0, 1), Eigen::VectorXd::LinSpaced(rows, 1, 2), {}};
        p.guesses = {*p.solution, *p.solution};
        const FclibProblem q = again(p);
        REQUIRE(q.local);
        CHECK(q.local->W.is_sparse() == velocity);
        CHECK((full_matrix(q.local->W) - full_matrix(p.local->W)).norm() == 0);
        CHECK(q.local->q == p.local->q);
        CHECK(q.local->mu == p.local->mu);
        CHECK(q.local->level == p.local->level);
        CHECK(q.title == p.title);
        CHECK(q.identity == p.identity);
        REQUIRE(q.solution);
        CHECK(q.solution->r == p.solution->r);
        CHECK(q.solution->u == p.solution->u);
        CHECK(q.guesses.size() == 2);
    }
    for (const bool glued : {false, true}) {
        FclibProblem p;
        p.global = one_mass_on_the_ground(glued);
        p.solution =
            FclibSolution{Eigen::VectorXd::LinSpaced(p.global->w.size(), 0, 1), {}, p.global->f};
        const FclibProblem q = again(p);
        REQUIRE(q.global);
        CHECK((Eigen::MatrixXd(q.global->M) - Eigen::MatrixXd(p.global->M)).norm() == 0);
        CHECK((Eigen::MatrixXd(q.global->H) - Eigen::MatrixXd(p.global->H)).norm() == 0);
        CHECK(q.global->f == p.global->f);
        CHECK(q.global->w == p.global->w);
        CHECK(q.global->kind == p.global->kind);
        CHECK(q.solution->r == p.solution->r);
        CHECK(q.solution->v == p.solution->v);
    }
}

TEST_CASE("bilateral equations of a local problem are bilateral contacts at its end")
{
    // V^T r + R l + s = 0 with V = (1 0 0)^T, R = 2, s = -1; u = W r + V l + q.
    std::vector<NamedArray> a = small(-1);
    for (const auto& [name, rows, columns] :
         {std::tuple{"fclib_local/V", 3, 1}, {"fclib_local/R", 1, 1}}) {
        const std::string at = name;
        a.push_back({at + "/m", Integers{rows}});
        a.push_back({at + "/n", Integers{columns}});
        a.push_back({at + "/nz", Integers{-1}});
        a.push_back({at + "/p", Integers{0, 1}});
        a.push_back({at + "/i", Integers{0}});
        a.push_back({at + "/x", Numbers{rows == 3 ? 1.0 : 2.0}});
    }
    a.push_back({"fclib_local/vectors/s", Numbers{-1}});
    const FclibProblem p = fclib_problem(a, "a.hdf5");
    REQUIRE(p.local->mu.size() == 2);
    CHECK(p.local->kind[1] == ContactKind::bilateral);
    const Eigen::Vector4d r{5, 6, 7, 8};
    const Eigen::VectorXd u = p.local->W * r + p.local->q;
    CHECK(u[0] == doctest::Approx(1 * 5 + 2 * 6 + 8 - 1));
    CHECK(u[3] == doctest::Approx(5 + 2 * 8 - 1));
    const FclibProblem q = again(p);
    CHECK((full_matrix(q.local->W) - full_matrix(p.local->W)).norm() == 0);
    CHECK(q.local->q == p.local->q);
}

TEST_CASE("no contact is a problem")
{
    FclibProblem p;
    p.local = ContactProblem{};
    const FclibProblem q = again(p);
    REQUIRE(q.local);
    CHECK(contact_count(*q.local) == 0);
    CHECK(issues(*q.local).empty());
}

TEST_CASE("each wrong dataset is refused with its place")
{
    struct Wrong {
        const char* dataset;
        decltype(NamedArray::value) value;
        const char* place;
        const char* found;
    };
    const std::vector<Wrong> all{
        {"fclib_local/spacedim", Integers{2}, "/fclib_local/spacedim", "plane"},
        {"fclib_local/spacedim", Integers{}, "/fclib_local/spacedim", "0 values"},
        {"fclib_local/spacedim", std::string("3"), "/fclib_local/spacedim", "text"},
        {"fclib_local/spacedim", Unreadable{"a link"}, "/fclib_local/spacedim", "a link"},
        {"fclib_local/W/m", Integers{4}, "/fclib_local/W/m", "4"},
        {"fclib_local/W/n", Integers{-3}, "/fclib_local/W/n", "-3"},
        {"fclib_local/W/n", Integers{2000000000}, "/fclib_local/W/n", "2000000000"},
        {"fclib_local/W/nz", Integers{-3}, "/fclib_local/W/nz", "-3"},
        {"fclib_local/W/nz", Integers{2000000000}, "/fclib_local/W/p", "4 values"},
        {"fclib_local/W/p", Integers{0, 2, 4}, "/fclib_local/W/p", "3 values"},
        {"fclib_local/W/p", Integers{1, 2, 4, 5}, "/fclib_local/W/p[0]", "1"},
        {"fclib_local/W/p", Integers{0, 4, 2, 5}, "/fclib_local/W/p[2]", "2 after 4"},
        {"fclib_local/W/p", Integers{0, 2, 4, 8}, "/fclib_local/W/p[3]", "8"},
        {"fclib_local/W/p", Integers{0, 2, 4, -5}, "/fclib_local/W/p[3]", "-5"},
        {"fclib_local/W/i", Integers{0, 1, 0, 3, 2}, "/fclib_local/W/i[3]", "3"},
        {"fclib_local/W/i", Integers{0, 1, -1, 1, 2}, "/fclib_local/W/i[2]", "-1"},
        {"fclib_local/W/i", Integers{0, 1}, "/fclib_local/W/p[3]", "5"},
        {"fclib_local/W/x", Numbers{1, 2, 2, NAN, 4}, "/fclib_local/W/x[3]", "nan"},
        {"fclib_local/W/x", Numbers{1, 2, 9, 3, 4}, "/fclib_local/W", "asymmetry"},
        {"fclib_local/vectors/q", Numbers{-1, 0}, "/fclib_local/vectors/q", "2 values"},
        {"fclib_local/vectors/q", Numbers{-1, 0, INFINITY}, "/fclib_local/vectors/q[2]", "inf"},
        {"fclib_local/vectors/mu", Numbers{-0.5}, "/fclib_local/vectors/mu[0]", "-0.5"},
        {"fclib_local/vectors/mu", Numbers{}, "/fclib_local/vectors/q", "3 values"},
    };
    for (const Wrong& w : all) {
        CAPTURE(w.place);
        CAPTURE(w.found);
        std::vector<NamedArray> arrays = small(-1);
        of(arrays, w.dataset).value = w.value;
        try {
            fclib_problem(arrays, "a.hdf5");
            FAIL_CHECK("accepted");
        } catch (const InputError& e) {
            const Issue& issue = e.issues().front();
            CHECK(issue.file == "a.hdf5");
            CHECK(issue.place == w.place);
            CHECK(issue.found.find(w.found) != std::string::npos);
            CHECK_FALSE(issue.allowed.empty());
        }
    }
    std::vector<NamedArray> arrays = small(-1);
    of(arrays, "fclib_local/spacedim").value = Integers{2}; // all at once
    of(arrays, "fclib_local/vectors/q").name = "fclib_local/vectors/Q";
    of(arrays, "fclib_local/vectors/mu").value = std::string("rough");
    try {
        fclib_problem(arrays, "a.hdf5");
        FAIL_CHECK("accepted");
    } catch (const InputError& e) {
        CHECK(e.issues().size() == 3);
    }
    CHECK_THROWS_AS(fclib_problem({}, "a.hdf5"), InputError);
}

TEST_CASE("a group solution without FCLib's datasets is no solution, such a guess is refused")
{
    std::vector<NamedArray> arrays = small(-1);
    arrays.push_back({"solution/remark", std::string("by hand")});
    CHECK_FALSE(fclib_problem(arrays, "a.hdf5").solution);
    arrays.push_back({"guesses/number_of_guesses", Integers{1}});
    arrays.push_back({"guesses/1/remark", std::string("by hand")});
    CHECK_THROWS_AS(fclib_problem(arrays, "a.hdf5"), InputError);
    arrays.push_back({"guesses/1/u", Numbers{1, 2, 3}});
    CHECK(fclib_problem(arrays, "a.hdf5").guesses.size() == 1);
}

TEST_CASE("a problem of bilateral rows alone keeps its reaction")
{
    FclibProblem p;
    p.local = ContactProblem{};
    p.local->W = Eigen::MatrixXd(Eigen::MatrixXd::Identity(2, 2));
    p.local->q = Eigen::Vector2d(1, -2);
    p.local->mu = Eigen::VectorXd::Zero(2);
    p.local->kind = {ContactKind::bilateral, ContactKind::bilateral};
    p.solution = FclibSolution{Eigen::Vector2d(-1, 2), Eigen::Vector2d::Zero(), {}};
    const FclibProblem q = again(p);
    REQUIRE(q.solution);
    CHECK(q.solution->r == p.solution->r);
}

TEST_CASE("what FCLib cannot hold is not written")
{
    FclibProblem p;
    p.local = ContactProblem{};
    p.local->W = Eigen::MatrixXd(Eigen::MatrixXd::Identity(4, 4));
    p.local->q = Eigen::VectorXd::Zero(4);
    p.local->mu = Eigen::VectorXd::Zero(2);
    p.local->kind = {ContactKind::frictionless, ContactKind::frictional};
    CHECK_THROWS_AS(fclib_arrays(p), InputError);
    p.local->kind = {ContactKind::bilateral, ContactKind::frictional};
    CHECK_THROWS_AS(fclib_arrays(p), InputError);
    p.local->kind = {ContactKind::frictional, ContactKind::bilateral};
    CHECK(again(p).local->kind == p.local->kind);
}

TEST_CASE("packed arrays that are cut or foreign are distinguished from whole ones")
{
    const std::string whole = pack_arrays(small(-1));
    CHECK(unpack_arrays(whole).size() == small(-1).size());
    for (std::size_t cut = 1; cut < 40; ++cut)
        CHECK_THROWS_AS(unpack_arrays(whole.substr(0, whole.size() - cut)), std::runtime_error);
    CHECK_THROWS_AS(unpack_arrays(std::string(100, '\xff')), std::runtime_error);
}

TEST_CASE(
    "contacts of one row become ones of three in which nothing acts, and keep their reactions")
{
    // Two masses on frictionless ground, coupled, one glued along its normal.
    ContactProblem p;
    Eigen::MatrixXd W(4, 4);
    W << 2, 0.5, 0, 0.1, //
        0.5, 3, 0.2, 0,  //
        0, 0.2, 1, 0.3,  //
        0.1, 0, 0.3, 4;
    p.q.resize(4);
    p.q << -1, -0.5, 0.2, 0.3;
    p.mu = Eigen::VectorXd::Zero(4);
    p.kind = {ContactKind::frictionless, ContactKind::frictionless, ContactKind::frictionless,
              ContactKind::bilateral};
    p.level = ContactLevel::position;
    p.W = W;
    const ContactSolution own = solve(p);
    REQUIRE(is_solved(own.certificate.status));
    for (const bool dense : {true, false}) {
        CAPTURE(dense);
        p.W = dense ? Delassus(W) : Delassus(Delassus::Sparse(W.sparseView()));
        CHECK_THROWS_AS(fclib_arrays({p}), InputError);
        const FclibForm form = fclib_form(p);
        REQUIRE(form.problem.q.size() == 10);
        CHECK(form.rows == std::vector<Eigen::Index>{0, 3, 6, 9});
        CHECK(form.problem.level == ContactLevel::position);
        FclibProblem file;
        file.local = form.problem;
        const ContactSolution same = solve(*again(file).local);
        REQUIRE(is_solved(same.certificate.status));
        CHECK((same.reaction(form.rows) - own.reaction).norm() <= 1e-7 * own.reaction.norm());
        CHECK(same.reaction.squaredNorm() ==
              doctest::Approx(Eigen::VectorXd(same.reaction(form.rows)).squaredNorm()));
        // Regular: the rows that were added are not without W.
        CHECK(form.problem.W.diagonal().minCoeff() >= 1);
    }
    p.W = MatrixFreeDelassus{};
    CHECK_THROWS_AS(fclib_form(p), InputError);
}
