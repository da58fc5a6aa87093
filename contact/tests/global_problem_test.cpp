#include "contact/global_problem.hpp"

#include "contact/solvers/solve.hpp"

#include <Eigen/Dense>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;
using Form = CondenseOptions::Form;

Eigen::SparseMatrix<double> sparse(Eigen::Index rows, Eigen::Index columns, const Triplets& t)
{
    Eigen::SparseMatrix<double> A(rows, columns);
    A.setFromTriplets(t.begin(), t.end());
    return A;
}

/// `bodies` of `size` unknowns each, full within; every contact joins two of them.
GlobalProblem random_bodies(std::mt19937& rng, int bodies, int size, int contacts, double contrast)
{
    std::normal_distribution<double> normal;
    std::uniform_int_distribution<int> body(0, bodies - 1);
    Triplets M, H;
    for (int b = 0; b < bodies; ++b) {
        Eigen::MatrixXd A(size, size);
        for (double& x : A.reshaped())
            x = normal(rng);
        const Eigen::MatrixXd S = std::pow(10, contrast * b / bodies) *
                                  (A * A.transpose() + Eigen::MatrixXd::Identity(size, size));
        for (int i = 0; i < size; ++i)
            for (int j = 0; j < size; ++j)
                M.emplace_back(b * size + i, b * size + j, S(i, j));
    }
    for (int c = 0; c < contacts; ++c) {
        const int a = body(rng), b = body(rng);
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < size; i += 2) { // every second unknown is touched
                H.emplace_back(a * size + i, 3 * c + k, normal(rng));
                if (b != a) H.emplace_back(b * size + i, 3 * c + k, normal(rng));
            }
    }
    GlobalProblem p;
    const int n = bodies * size;
    p.M = sparse(n, n, M);
    p.H = sparse(n, 3 * contacts, H);
    p.f.resize(n);
    for (double& x : p.f)
        x = normal(rng);
    p.w = Eigen::VectorXd::Constant(3 * contacts, 0.1);
    p.mu = Eigen::VectorXd::Constant(contacts, 0.4);
    return p;
}

Eigen::MatrixXd reference(const GlobalProblem& p)
{
    const Eigen::MatrixXd H = p.H;
    return H.transpose() * Eigen::MatrixXd(p.M).ldlt().solve(H);
}

CondenseOptions in_form(Form form)
{
    CondenseOptions options;
    options.form = form;
    return options;
}

} // namespace

TEST_CASE("condensing is H^T M^-1 H and H^T M^-1 f + w in every form")
{
    std::mt19937 rng{1};
    for (const int bodies : {1, 2, 40})
        for (const double contrast : {0.0, 6.0}) {
            CAPTURE(bodies);
            const GlobalProblem p = random_bodies(rng, bodies, 6, 8, contrast);
            const Eigen::MatrixXd W = reference(p);
            const Eigen::VectorXd q =
                Eigen::MatrixXd(p.H).transpose() * Eigen::MatrixXd(p.M).ldlt().solve(p.f) + p.w;
            const CondensedProblem matrix(p, in_form(Form::matrix));
            const Delassus& made = matrix.contact().W;
            CHECK(made.is_dense() == (bodies < 3));
            CHECK(made.is_sparse() == (bodies > 3));
            const Eigen::MatrixXd full = made.is_dense() ? made.dense() : made.sparse();
            CHECK((full - W).norm() <= 1e-12 * W.norm());
            CHECK((full - full.transpose()).norm() <= 1e-15 * W.norm());
            CHECK((matrix.contact().q - q).norm() <= 1e-12 * q.norm());

            const CondensedProblem function(p, in_form(Form::matrix_free));
            REQUIRE(function.contact().W.is_matrix_free());
            for (int k = 0; k < 5; ++k) {
                const Eigen::VectorXd r = Eigen::VectorXd::Random(W.cols());
                CHECK((function.contact().W * r - W * r).norm() <= 1e-12 * W.norm() * r.norm());
            }
            for (int c = 0; c < 8; ++c)
                CHECK((function.contact().W.block(3 * c, 3) - W.block<3, 3>(3 * c, 3 * c)).norm() <=
                      1e-12 * W.norm());
            CHECK((function.contact().q - q).norm() <= 1e-12 * q.norm());
        }
}

TEST_CASE("W of rigid bodies has entries only where contacts share a body")
{
    std::mt19937 rng{2};
    const GlobalProblem p = random_bodies(rng, 60, 6, 80, 0);
    const CondensedProblem condensed(p);
    const Delassus& W = condensed.contact().W;
    REQUIRE(W.is_sparse());
    const Eigen::MatrixXd exact = reference(p);
    for (int j = 0; j < W.cols(); ++j)
        for (Delassus::Sparse::InnerIterator it(W.sparse(), j); it; ++it)
            CHECK(std::abs(exact(it.row(), j)) > 1e-14); // nothing is stored that is zero
    CHECK((Eigen::MatrixXd(W.sparse()) - exact).norm() <= 1e-12 * exact.norm());
}

TEST_CASE("the solution of the condensed problem solves the global one")
{
    std::mt19937 rng{3};
    for (const Form form : {Form::matrix, Form::matrix_free}) {
        GlobalProblem p = random_bodies(rng, 6, 6, 6, 2);
        p.kind.assign(6, ContactKind::frictional);
        // A bilateral row at the end: two bodies glued at one unknown.
        Eigen::SparseMatrix<double> glue(p.M.rows(), 1);
        glue.insert(0, 0) = 1;
        glue.insert(7, 0) = -1;
        Eigen::SparseMatrix<double> H(p.M.rows(), 19);
        H.leftCols(18) = p.H;
        H.rightCols(1) = glue;
        p.H = H;
        p.w.conservativeResize(19);
        p.w[18] = 0.05;
        p.mu.conservativeResize(7);
        p.mu[6] = 0;
        p.kind.push_back(ContactKind::bilateral);

        SolverOptions options;
        options.tolerance = 1e-10;
        const ContactSolution s = solve(CondensedProblem(p).contact(), options);
        const CondensedProblem condensed(p, in_form(form));
        CHECK(certify(condensed.contact(), s.reaction, 1e-9).status == SolveStatus::converged);
        REQUIRE(s.certificate.status == SolveStatus::converged);
        const Eigen::VectorXd v = condensed.motion(s.reaction);
        CHECK((p.M * v - p.H * s.reaction - p.f).norm() <= 1e-12 * p.f.norm());
        CHECK((p.H.transpose() * v + p.w - s.u).norm() <= 1e-10);
        CHECK(std::abs(v[0] - v[7] + 0.05) <= 1e-9);
        // The test can fail: one reaction too many changes the error.
        const Eigen::VectorXd other = s.reaction + Eigen::VectorXd::Unit(19, 0);
        CHECK((p.M * v - p.H * other - p.f).norm() > 0.1);
    }
}

TEST_CASE("a stiff clamped chain is condensed as its closed form states")
{
    // n springs of stiffness k in a row, clamped at one end: compliance of node i against node j
    // is min(i, j) / k. Contacts act on the last two nodes only.
    const int n = 400;
    const double k = 1e9;
    Triplets M;
    for (int i = 0; i < n; ++i) {
        M.emplace_back(i, i, i + 1 < n ? 2 * k : k);
        if (i + 1 < n) {
            M.emplace_back(i, i + 1, -k);
            M.emplace_back(i + 1, i, -k);
        }
    }
    GlobalProblem p;
    p.M = sparse(n, n, M);
    p.H = sparse(n, 2, {{n - 1, 0, 1.0}, {n - 2, 1, 1.0}});
    p.f = Eigen::VectorXd::Zero(n);
    p.w = Eigen::VectorXd::Constant(2, -1e-3);
    p.mu = Eigen::VectorXd::Zero(2);
    p.kind.assign(2, ContactKind::frictionless);
    for (const Form form : {Form::matrix, Form::matrix_free}) {
        const CondensedProblem c(p, in_form(form));
        const Eigen::VectorXd column = c.contact().W * Eigen::VectorXd::Unit(2, 0);
        CHECK(column[0] == doctest::Approx(n / k).epsilon(1e-11));
        CHECK(column[1] == doctest::Approx((n - 1) / k).epsilon(1e-11));
    }
}

TEST_CASE("the form follows the memory that it would need")
{
    std::mt19937 rng{4};
    const GlobalProblem p = random_bodies(rng, 2, 6, 8, 0);
    CondenseOptions options;
    CHECK(CondensedProblem(p, options).contact().W.is_dense());
    options.memory = 1000;
    CHECK(CondensedProblem(p, options).contact().W.is_matrix_free());
    options.memory = 1e9;
    options.dense_above = 1;
    CHECK(CondensedProblem(p, options).contact().W.is_sparse());
}

TEST_CASE("a body that can float and one with negative stiffness are refused")
{
    GlobalProblem p;
    p.M = sparse(2, 2, {{0, 0, 1.0}, {0, 1, -1.0}, {1, 0, -1.0}, {1, 1, 1.0}}); // a free spring
    p.H = sparse(2, 3, {{0, 0, 1.0}});
    p.f = Eigen::VectorXd::Zero(2);
    p.w = Eigen::VectorXd::Zero(3);
    p.mu = Eigen::VectorXd::Zero(1);
    const auto message = [&] {
        try {
            const CondensedProblem c(p);
        } catch (const InputError& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    CHECK(message().find("singular") != std::string::npos);
    p.M.coeffRef(1, 1) = 1 + 1e-15; // as good as free
    CHECK(message().find("singular") != std::string::npos);
    p.M.coeffRef(1, 1) = -1;
    CHECK(message().find("indefinite") != std::string::npos);
    p.M.coeffRef(1, 1) = 2;
    CHECK(message() == "accepted");
    p.M.coeffRef(0, 1) = 0;
    CHECK(message().find("both triangles") != std::string::npos);
}

TEST_CASE("wrong sizes and numbers are reported together and a problem may have no contact")
{
    std::mt19937 rng{5};
    GlobalProblem p = random_bodies(rng, 2, 3, 2, 0);
    p.f.conservativeResize(5);
    p.w[0] = NAN;
    p.mu[1] = -1;
    CHECK(issues(p).size() == 3);
    CHECK_THROWS_AS(CondensedProblem{p}, InputError);

    GlobalProblem none;
    none.M = sparse(3, 3, {{0, 0, 2.0}, {1, 1, 2.0}, {2, 2, 2.0}});
    none.H.resize(3, 0);
    none.f = Eigen::VectorXd::Ones(3);
    const CondensedProblem c(none);
    CHECK(solve(c.contact()).certificate.status == SolveStatus::converged);
    CHECK((c.motion({}) - Eigen::VectorXd::Constant(3, 0.5)).norm() == 0);
}
