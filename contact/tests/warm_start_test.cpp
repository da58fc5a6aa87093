#include "contact/warm_start.hpp"

#include "contact/solvers/solve.hpp"
#include "contact/tests/contact_problems.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// The contacts of a problem in another order.
ContactProblem shuffled(const ContactProblem& p, const std::vector<int>& order)
{
    std::vector<Eigen::Index> rows;
    for (const int i : order)
        for (int k = 0; k < 3; ++k)
            rows.push_back(3 * i + k);
    ContactProblem other = p;
    other.W = Eigen::MatrixXd(p.W.dense()(rows, rows));
    other.q = p.q(rows);
    return other;
}

} // namespace

TEST_CASE("a solution follows its contacts into another order")
{
    std::mt19937 rng{1};
    const ContactProblem p = test::random_problem(rng, 6, 18, 0.4);
    const ContactSolution s = solve(p);
    REQUIRE(s.certificate.status == SolveStatus::converged);
    const std::vector<int> order{3, 0, 5, 1, 4, 2};
    const ContactProblem other = shuffled(p, order);
    const std::vector<std::int32_t> identity{70, -2, 11, 5, 1000, 6};
    std::vector<std::int32_t> moved;
    for (const int i : order)
        moved.push_back(identity[static_cast<std::size_t>(i)]);
    const Eigen::VectorXd warm = matched_warm_start(p, identity, s.reaction, other, moved);
    CHECK(certify(other, warm, 1e-8).status == SolveStatus::converged);
    CHECK((matched_warm_start(other, moved, warm, p, identity) - s.reaction).norm() == 0);
}

TEST_CASE("what is new or lost or of another kind or there twice")
{
    ContactProblem old, now;
    old.mu = Eigen::VectorXd::Constant(4, 0.5);
    now.mu = Eigen::VectorXd::Constant(5, 0.5);
    old.kind = {ContactKind::bilateral, ContactKind::frictional, ContactKind::frictionless,
                ContactKind::frictionless};
    now.kind = {ContactKind::frictional, ContactKind::bilateral, ContactKind::frictionless,
                ContactKind::frictionless, ContactKind::frictionless};
    Eigen::VectorXd r(6), expected(7);
    r << 1, 2, 3, 4, 5, 6;
    SUBCASE("others than before")
    {
        expected << 2, 3, 4, 0, 0, 6, 0;
        CHECK(matched_warm_start(old, {7, 1, 9, 2}, r, now, {1, 8, 7, 2, 3}) == expected);
    }
    SUBCASE("an identity more than once")
    {
        expected << 0, 0, 0, 1, 5, 6, 0;
        CHECK(matched_warm_start(old, {4, 1, 9, 9}, r, now, {0, 4, 9, 9, 9}) == expected);
    }
    SUBCASE("no contact, before or now")
    {
        CHECK(matched_warm_start({}, {}, {}, now, {1, 2, 3, 4, 5}).norm() == 0);
        CHECK(matched_warm_start(old, {1, 2, 3, 4}, r, {}, {}).size() == 0);
    }
}

TEST_CASE("sizes that do not fit are refused all at once")
{
    const ContactProblem p = test::tower({1, 1}, 0.1, 0.5);
    try {
        matched_warm_start(p, {1}, Eigen::VectorXd::Zero(5), p, {1, 2, 3});
        FAIL("accepted");
    } catch (const InputError& e) {
        CHECK(e.issues().size() == 3);
    }
}

TEST_CASE("a start from known statuses of the contacts saves two thirds of the iterations")
{
    // Each problem is the one before, pushed by a hundredth.
    std::mt19937 rng{3};
    std::normal_distribution<double> normal;
    int cold = 0, warm = 0;
    for (int k = 0; k < 20; ++k) {
        ContactProblem p = test::random_problem(rng, 20, 40, 0.4, 2);
        const Eigen::VectorXd before = solve(p).reaction;
        p.q += 0.01 * p.W.dense() * before;
        const ContactSolution a = solve(p), b = solve(p, {}, before);
        REQUIRE(a.certificate.status == SolveStatus::converged);
        REQUIRE(b.certificate.status == SolveStatus::converged);
        cold += a.certificate.iterations;
        warm += b.certificate.iterations;
    }
    CAPTURE(cold);
    CAPTURE(warm);
    CHECK(3 * warm <= cold); // [regression] our own run
}
