#include "contact/certificate.hpp"

#include "contact/solvers/solve.hpp"
#include "contact/tests/contact_problems.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

Eigen::VectorXd random_reaction(std::mt19937& rng, Eigen::Index rows)
{
    std::normal_distribution<double> normal;
    Eigen::VectorXd r(rows);
    for (double& x : r)
        x = normal(rng);
    return r;
}

} // namespace

TEST_CASE("the certified error is the formula as long double computes it")
{
    std::mt19937 rng{1};
    for (int k = 0; k < 300; ++k) {
        const double mu[] = {0, 0.3, 2, 10};
        const ContactProblem p = test::random_problem(rng, 1 + k % 7, 9, mu[k % 4], k % 7);
        const Eigen::VectorXd r = random_reaction(rng, p.q.size());
        const double expected = static_cast<double>(test::reference_error(p, r));
        CHECK(certify(p, r, 1e-8).error == doctest::Approx(expected).epsilon(1e-12));
        CHECK(certify(p, r, 1e-8).status == SolveStatus::stagnated);
    }
}

TEST_CASE("the error has no unit: force and length and scale of W leave it as it is")
{
    std::mt19937 rng{2};
    for (int k = 0; k < 100; ++k) {
        const ContactProblem p = test::random_problem(rng, 4, 9, 0.5, 3);
        const Eigen::VectorXd r = random_reaction(rng, p.q.size());
        const Certificate c = certify(p, r, 1e-8);
        for (double force : {1e-12, 1e3, 1e12})
            for (double length : {1e-12, 1e3, 1e12}) {
                ContactProblem other = p;
                other.W.dense() *= length / force;
                other.q *= length;
                const Certificate d = certify(other, force * r, 1e-8);
                CHECK(d.error == doctest::Approx(c.error).epsilon(1e-12));
                CHECK(d.scaled_error == doctest::Approx(c.scaled_error).epsilon(1e-12));
                CHECK(d.worst_contact == c.worst_contact);
                CHECK(d.worst_penetration ==
                      doctest::Approx(length * c.worst_penetration).epsilon(1e-12));
                CHECK(d.worst_cone_violation ==
                      doctest::Approx(force * c.worst_cone_violation).epsilon(1e-12));
                CHECK(d.worst_dissipation ==
                      doctest::Approx(force * length * c.worst_dissipation).epsilon(1e-12));
            }
    }
}

TEST_CASE("each contact in a unit of its own leaves the scaled error as it is")
{
    std::mt19937 rng{3};
    const ContactProblem p = test::random_problem(rng, 5, 15, 0.5);
    const Eigen::VectorXd r = random_reaction(rng, p.q.size());
    const Certificate c = certify(p, r, 1e-8);
    ContactProblem other = p;
    Eigen::VectorXd s(p.q.size());
    for (Eigen::Index i = 0; i < 5; ++i)
        s.segment<3>(3 * i).setConstant(std::pow(10, 2 * i - 4));
    other.W = Eigen::MatrixXd(s.asDiagonal() * p.W.dense() * s.asDiagonal());
    other.q = s.cwiseProduct(p.q);
    const Certificate d = certify(other, r.cwiseQuotient(s), 1e-8);
    CHECK(d.scaled_error == doctest::Approx(c.scaled_error).epsilon(1e-12));
    CHECK(d.error != doctest::Approx(c.error).epsilon(1e-3)); // one rho for all does not do that
}

TEST_CASE("physical figures are those of the incline")
{
    // A block held by hand: r_n short of the weight, friction beyond the cone, then slipping.
    ContactProblem p = test::tower({2.0}, 0.3, 0.5);
    const double weight = 2 * test::kGravity;
    Eigen::VectorXd r(3);
    r << 0.9 * weight * std::cos(0.3), -weight * std::sin(0.3), 0;
    const Certificate c = certify(p, r, 1e-8);
    CHECK(c.worst_penetration == doctest::Approx(0.1 * test::kGravity * std::cos(0.3)));
    CHECK(c.worst_cone_violation == doctest::Approx(0)); // tan 0.3 < 0.9 mu
    CHECK(c.worst_dissipation == doctest::Approx(0));
    CHECK(c.worst_contact == 0);
    r[1] = -0.6 * r[0];
    CHECK(certify(p, r, 1e-8).worst_cone_violation == doctest::Approx(0.1 * r[0]));
    r[1] = 0; // slips without friction: all of mu r_n |u_t| is missing
    CHECK(certify(p, r, 1e-8).worst_dissipation ==
          doctest::Approx(0.5 * r[0] * test::kGravity * std::sin(0.3)));
    r[0] = -1;
    CHECK(certify(p, r, 1e-8).worst_cone_violation == doctest::Approx(1));
}

TEST_CASE("a candidate far away loosens the test only where all rows count")
{
    ContactProblem p;
    p.W = Eigen::MatrixXd(Eigen::MatrixXd::Identity(6, 6));
    p.q = Eigen::VectorXd::Zero(6);
    p.q[0] = -1e-6;
    p.q[3] = 1; // open by a metre
    p.mu.setConstant(2, 0.5);
    Eigen::VectorXd r = Eigen::VectorXd::Zero(6);
    CHECK(certify(p, r, 1e-4).status == SolveStatus::converged);
    const Certificate c = certify(p, r, 1e-4, ErrorScope::acting_rows);
    CHECK(c.status == SolveStatus::stagnated);
    CHECK(c.error == doctest::Approx(1));
    r[0] = 1e-6;
    CHECK(certify(p, r, 1e-12, ErrorScope::acting_rows).status == SolveStatus::converged);
}

TEST_CASE("a reaction that diverges is not accepted because of its round-off")
{
    // Two walls that close on one body: r = (x, x) leaves a penetration whatever x.
    ContactProblem p;
    p.W.dense().resize(2, 2);
    p.W.dense() << 1, -1, -1, 1;
    p.q = Eigen::Vector2d{-1, 0.5};
    p.mu = Eigen::Vector2d::Zero();
    p.kind = {ContactKind::frictionless, ContactKind::frictionless};
    for (double x : {1.0, 1e4, 1e8, 1e12, 1e16, 1e20}) {
        const Certificate c = certify(p, Eigen::Vector2d{x, x}, 1e-8);
        CHECK(c.status == SolveStatus::stagnated);
        CHECK(c.error > 0.4);
    }
    CHECK(certify(p, Eigen::Vector2d::Constant(NAN), 1e-8).status == SolveStatus::stagnated);
}

TEST_CASE("nothing at all and a motion that is zero are certified as solved by r = 0")
{
    CHECK(certify({}, Eigen::VectorXd{}, 1e-8).status == SolveStatus::converged);
    ContactProblem p = test::tower({1, 1}, 0, 0.5);
    p.q.setZero();
    CHECK(certify(p, Eigen::VectorXd::Zero(6), 0).error == 0);
    CHECK(certify(p, Eigen::VectorXd::Ones(6), 1e-8).status == SolveStatus::stagnated);
}

TEST_CASE("sweeps that creep below a tolerance are below it in long double too" *
          doctest::test_suite("slow"))
{
    // Heavy on light: sweeps end within a fiftieth of the tolerance, u is known to a thousandth.
    std::mt19937 rng{7};
    std::uniform_real_distribution<double> uniform;
    int solved = 0;
    for (int k = 0; k < 200; ++k) {
        ContactProblem p = test::tower({1, uniform(rng), 1, 1, 100 + 100 * uniform(rng)},
                                       0.2 + 0.2 * uniform(rng), 0.5);
        SolverOptions options;
        options.tolerance = 1e-12;
        const ContactSolution near = solve(p, options);
        options.solver = ContactSolver::nsgs;
        options.max_iterations = options.patience = 200000;
        options.tolerance = 1.05 * NaturalMapError(p, ErrorScope::all_rows)
                                       .floor(near.reaction, p.W * near.reaction + p.q);
        const ContactSolution swept = solve(p, options);
        if (swept.certificate.status != SolveStatus::converged) continue; // round-off stopped it
        ++solved;
        REQUIRE(swept.certificate.threshold == options.tolerance);
        CHECK(test::reference_error(p, swept.reaction) <= options.tolerance);
    }
    CHECK(solved > 190);
}
