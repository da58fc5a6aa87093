#include "contact/solvers/solve.hpp"
#include "contact/tests/contact_problems.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <random>

// Problems solved to the last digits that doubles have.

using namespace amontons;

namespace {

/// Stiff contacts, all slipping, and a soft one whose compliance sets rho; each is coupled with the
/// others a little.
ContactProblem stiff_beside_soft(int stiff, double contrast, double mu)
{
    ContactProblem p;
    Eigen::MatrixXd W = Eigen::MatrixXd::Identity(3 * (stiff + 1), 3 * (stiff + 1));
    W.topLeftCorner(3 * stiff, 3 * stiff) /= contrast;
    W.array() += 1e-2 / contrast;
    p.W = Delassus(W);
    p.mu = Eigen::VectorXd::Constant(stiff + 1, mu);
    p.q.resize(3 * (stiff + 1));
    for (int i = 0; i <= stiff; ++i)
        p.q.segment<3>(3 * i) << -1 - 0.1 * i, 0.7 + 0.05 * i, 0.9 - 0.03 * i;
    return p;
}

} // namespace

TEST_CASE("sweeps over a W in single precision end at twelve digits in any unit")
{
    std::mt19937 rng{13};
    ContactProblem p = test::random_problem(rng, 190, 2000, 0.4); // 570 rows: beyond the cache
    for (const double unit : {1.0, 1e-45, 1e40}) {
        ContactProblem other = p;
        other.W.dense() *= unit;
        for (const ContactSolver solver : {ContactSolver::nsgs, ContactSolver::anderson}) {
            CAPTURE(unit);
            CAPTURE(name(solver));
            SolverOptions options;
            options.solver = solver;
            options.tolerance = 1e-12;
            const ContactSolution s = solve(other, options);
            CHECK(s.certificate.status == SolveStatus::converged);
            CHECK(s.certificate.error <= 1e-12);
            CHECK(s.certificate.iterations < 400); // [regression] our own run
        }
    }
}

TEST_CASE("stiff contacts beside soft ones: 1e-12 where the last digit of r is more than that")
{
    const ContactProblem p = stiff_beside_soft(10, 1e6, 0.3);
    SolverOptions options;
    options.tolerance = 1e-12;
    const ContactSolution s = solve(p, options);
    const NaturalMapError error(p, ErrorScope::all_rows);
    CHECK(error.rounding(s.reaction, s.u) > 5 * options.tolerance);
    CHECK(s.certificate.status == SolveStatus::converged);
    CHECK(s.certificate.threshold == options.tolerance);
    CHECK(static_cast<double>(test::reference_error(p, s.reaction)) <= options.tolerance);
}

TEST_CASE(
    "the error reported is that of the written reaction in long double however badly it is scaled")
{
    // Blocks of unlike stiffness, hyperstatic (W of low rank), heavy on light: what doubles find
    // differs from what is there by up to eps |r| / (rho |q|).
    std::mt19937 rng{7};
    int doubtful = 0, at_round_off = 0, compared = 0;
    std::uniform_real_distribution<double> uniform;
    for (int k = 0; k < 60; ++k) {
        const double contrast = std::pow(10.0, k % 10), mu = 0.2 + 0.1 * (k % 5);
        ContactProblem p;
        if (k % 3 == 0) {
            std::vector<double> mass(3 + std::size_t(k) % 7, 1.0);
            mass.back() = contrast;
            p = test::tower(mass, 0.3 * uniform(rng), mu);
        } else if (k % 3 == 1) { // stiff contacts that slip beside a soft one
            p = stiff_beside_soft(2 + k % 14, contrast, mu);
            for (double& q : p.q)
                q *= 1 + 0.1 * uniform(rng);
        } else {
            const int n = 2 + k % 14;
            p = test::random_problem(rng, n, k % 2 ? 2 * n : 3 * n, mu, k % 10);
        }
        if (k % 4 == 1) p.W = Delassus(Delassus::Sparse(p.W.dense().sparseView()));
        for (const double tolerance : {1e-8, 1e-12, 1e-14}) {
            CAPTURE(k);
            CAPTURE(tolerance);
            SolverOptions options;
            options.tolerance = tolerance;
            options.max_iterations = 2000;
            const ContactSolution s = solve(p, options);
            const Certificate& c = s.certificate;
            ContactProblem dense = p;
            if (p.W.is_sparse()) dense.W = Delassus(Eigen::MatrixXd(p.W.sparse()));
            const auto found = static_cast<double>(test::reference_error(dense, s.reaction));
            const double in_doubles =
                NaturalMapError(p, ErrorScope::all_rows)(s.reaction, p.W * s.reaction + p.q);
            if (std::max(found, c.error) > 1e-14) {
                ++compared;
                CHECK(c.error <= 2 * found);
                CHECK(found <= 2 * c.error);
                doubtful += in_doubles > 2 * found || found > 2 * in_doubles;
            }
            CHECK(is_solved(c.status) == (found <= c.threshold * 1.001));
            CHECK((c.status == SolveStatus::converged) == (found <= tolerance * 1.001));
            at_round_off += c.status == SolveStatus::at_round_off;
        }
    }
    MESSAGE(compared << " compared, doubles report another error in " << doubtful << ", "
                     << at_round_off << " at round-off");
    CHECK(doubtful > 0); // or this shows nothing
    CHECK(at_round_off > 0);
}
