#include "contact/units.hpp"

#include "contact/solve.hpp"
#include "contact/tests/contact_problems.hpp"

#include <Eigen/Dense>
#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("numbers whose squares leave the range of doubles change nothing but the units")
{
    std::mt19937 rng{1};
    const ContactProblem p = test::random_problem(rng, 4, 12, 0.4);
    for (ContactSolver solver : kContactSolvers) {
        SolverOptions options;
        options.solver = solver;
        const ContactSolution s = solve(p, options);
        REQUIRE(s.certificate.status == SolveStatus::converged);
        for (int w : {-900, -500, 0, 500, 900})
            for (int q : {-900, -500, 0, 500, 900}) {
                if (std::abs(q - w) > 1000 || (w == 0 && q == 0)) continue;
                CAPTURE(name(solver));
                CAPTURE(w);
                CAPTURE(q);
                ContactProblem other = p;
                other.W.dense() *= std::ldexp(1.0, w);
                other.q *= std::ldexp(1.0, q);
                const ContactSolution t = solve(other, options);
                CHECK(t.certificate.status == SolveStatus::converged);
                CHECK((times_power(t.reaction, w - q) - s.reaction).norm() <=
                      1e-6 * s.reaction.norm());
                CHECK((times_power(t.u, -q) - s.u).norm() <= 1e-6 * p.q.norm());
                // The certificate of any reaction, too: r = 0 leaves the largest gap closed.
                const Eigen::VectorXd zero = Eigen::VectorXd::Zero(12);
                const Certificate c = certify(other, zero, 1e-8), own = certify(p, zero, 1e-8);
                CHECK(c.status == SolveStatus::stagnated);
                CHECK(c.error == doctest::Approx(own.error));
                CHECK(std::ldexp(c.worst_penetration, -q) ==
                      doctest::Approx(own.worst_penetration));
            }
    }
}

TEST_CASE("a reaction that no double can hold ends as stagnated, with a finite one")
{
    std::mt19937 rng{2};
    const ContactProblem p = test::random_problem(rng, 4, 12, 0.4);
    for (ContactSolver solver : kContactSolvers)
        for (int w : {-900, 900}) { // r is about 2^1800, then 2^-1800
            ContactProblem other = p;
            other.W.dense() *= std::ldexp(1.0, w);
            other.q *= std::ldexp(1.0, -w);
            SolverOptions options;
            options.solver = solver;
            const ContactSolution s = solve(other, options);
            CAPTURE(name(solver));
            CHECK(s.certificate.status == SolveStatus::stagnated);
            CHECK(s.certificate.error > 1e-3);
            CHECK(s.reaction.allFinite());
            CHECK(s.u.allFinite());
        }
}

TEST_CASE("in other units walls that close stay infeasible, and the proof is in the problem's")
{
    // One body, one degree of freedom, held apart by less than it must be.
    ContactProblem p;
    p.W.dense().resize(2, 2);
    p.W.dense() << 1, -1, -1, 1;
    p.W.dense() *= 0x1p-600;
    p.q = Eigen::Vector2d(-1, 0.75) * 0x1p400;
    p.mu.setZero(2);
    p.kind.assign(2, ContactKind::frictionless);
    const ContactSolution s = solve(p);
    CHECK(s.certificate.status == SolveStatus::infeasible);
    CHECK(s.certificate.proof.closing == doctest::Approx(0.25 * 0x1p400));
}
