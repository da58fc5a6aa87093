#include "contact/units.hpp"

#include "contact/solvers/solve.hpp"
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

TEST_CASE("a reaction that no double can hold ends as stagnated with a finite one")
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

TEST_CASE("in other units walls that close stay infeasible and the proof is in the problem's")
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

TEST_CASE("friction without bounds: what slides is found though its normal force is negligible")
{
    // A strip on something like an elastic half-space, pressed and sheared.
    constexpr int n = 30;
    const auto strip = [](double mu) {
        ContactProblem p;
        p.W.dense().setZero(3 * n, 3 * n);
        p.q.resize(3 * n);
        p.mu = Eigen::VectorXd::Constant(n, mu);
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                const double compliance = 1 / (0.6 + std::abs(i - j));
                p.W.dense().block<3, 3>(3 * i, 3 * j).diagonal().setConstant(compliance);
                const double turn = i == j ? 0 : 0.3 * compliance * (i > j ? 1 : -1);
                p.W.dense()(3 * i, 3 * j + 1) = turn;
                p.W.dense()(3 * i + 1, 3 * j) = -turn;
            }
            p.q.segment<3>(3 * i) << -0.2, 1, 0;
        }
        return p;
    };
    REQUIRE(Eigen::LLT<Eigen::MatrixXd>(strip(1).W.dense()).info() == Eigen::Success);
    for (double mu : {1e3, 1e4}) {
        CAPTURE(mu);
        const ContactProblem p = strip(mu);
        const ContactSolution s = solve(p);
        CHECK(s.certificate.status == SolveStatus::converged);
        CHECK(s.certificate.iterations < 4000); // [regression] 8000 in the problem's own units
        CHECK(static_cast<double>(test::reference_error(p, s.reaction)) <= 1e-8);
        int sliding = 0;
        for (int i = 0; i < n; ++i) {
            const double t = s.reaction.segment<2>(3 * i + 1).norm();
            if (!(s.u.segment<2>(3 * i + 1).norm() > 1e-6)) continue;
            ++sliding;
            CHECK(s.reaction[3 * i] == doctest::Approx(t / mu).epsilon(1e-6));
        }
        CHECK(sliding > 0);
    }
}

TEST_CASE(
    "friction without bounds: limits count all tries and what is returned is the best of them")
{
    std::mt19937 rng{4};
    ContactProblem p = test::random_problem(rng, 40, 60, 0.4); // W is singular
    p.mu.setConstant(1e7);
    const NaturalMapError error(p, ErrorScope::all_rows);
    SolverOptions options;
    options.tolerance = 0; // never reached
    double before = std::numeric_limits<double>::infinity();
    for (int most : {0, 5, 50, 500}) {
        options.max_iterations = most;
        const ContactSolution s = solve(p, options);
        CHECK(s.certificate.iterations <= most);
        for (std::size_t k = 1; k < s.history.size(); ++k) {
            CHECK(s.history[k].iteration >= s.history[k - 1].iteration);
            CHECK(s.history[k].seconds >= s.history[k - 1].seconds);
        }
        CHECK(s.certificate.error <= before);
        before = s.certificate.error;
    }
    CHECK(before < 0.1); // [regression] our own run
}

TEST_CASE("units of normal forces are powers of two and leave Coulomb's law as it is")
{
    std::mt19937 rng{3};
    ContactProblem p = test::random_problem(rng, 4, 12, 0.4);
    CHECK(normal_units(p, 128).size() == 0);
    p.mu << 0, 0.4, 3e3, 3e7;
    const Eigen::VectorXd D = normal_units(p, 128);
    REQUIRE(D.size() == 12);
    const ContactProblem inner = in_normal_units(p, D);
    for (int i = 0; i < 4; ++i) {
        CHECK(D[3 * i] == std::ldexp(1.0, std::ilogb(D[3 * i])));
        CHECK(D[3 * i + 1] == 1);
        CHECK(inner.mu[i] <= 128);
        CHECK(inner.mu[i] == D[3 * i] * p.mu[i]);
    }
    const Eigen::VectorXd r = Eigen::VectorXd::LinSpaced(12, -1, 2);
    const Eigen::VectorXd u = p.W * r + p.q, other = inner.W * r.cwiseQuotient(D) + inner.q;
    CHECK((other - D.cwiseProduct(u)).norm() <= 1e-14 * u.norm());
}
