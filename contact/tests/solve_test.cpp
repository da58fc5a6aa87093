#include "contact/solvers/solve.hpp"

#include "contact/tests/contact_problems.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <doctest/doctest.h>
#include <map>
#include <string>

using namespace amontons;

namespace {

SolverOptions options_of(ContactSolver solver, double tolerance = 1e-10)
{
    SolverOptions options;
    options.solver = solver;
    options.tolerance = tolerance;
    return options;
}

/// Every solver, uzawa in both kinds.
std::vector<SolverOptions> all_solvers(double tolerance = 1e-10)
{
    std::vector<SolverOptions> all;
    for (ContactSolver solver : kContactSolvers)
        all.push_back(options_of(solver, tolerance));
    all.push_back(options_of(ContactSolver::uzawa, tolerance));
    all.back().uzawa.rho = SolverOptions::Uzawa::Rho::adaptive;
    return all;
}

/// The same problem with W in another form.
ContactProblem as_sparse(ContactProblem p)
{
    p.W = Delassus::Sparse(p.W.dense().sparseView());
    return p;
}

ContactProblem as_function(ContactProblem p)
{
    const Eigen::MatrixXd W = p.W.dense();
    Eigen::MatrixXd own = Eigen::MatrixXd::Zero(W.rows(), W.cols());
    const std::vector<int> offset = row_offsets(p);
    for (int i = 0; i < contact_count(p); ++i) {
        const int row = offset[static_cast<std::size_t>(i)], rows = rows_of(kind_of(p, i));
        own.block(row, row, rows, rows) = W.block(row, row, rows, rows);
    }
    MatrixFreeDelassus function;
    function.rows = W.rows();
    function.apply = [W](const Eigen::VectorXd& r, Eigen::VectorXd& out) { out.noalias() = W * r; };
    function.blocks = own.sparseView();
    p.W = std::move(function);
    return p;
}

} // namespace

TEST_CASE("a tower on an incline stands below the friction angle and slides as one above")
{
    const double mu = 0.5;
    for (int n : {1, 2, 8}) {
        std::vector<double> mass;
        for (int i = 0; i < n; ++i)
            mass.push_back(1 + i % 3);
        for (double slope : {0.0, 0.9 * std::atan(mu), 1.1 * std::atan(mu)})
            for (const SolverOptions& options : all_solvers()) {
                CAPTURE(n);
                CAPTURE(slope);
                CAPTURE(name(options.solver));
                ContactProblem p = test::tower(mass, slope, mu);
                p.mu.tail(n - 1).setConstant(2 * mu); // only the lowest contact may slip
                const ContactSolution s = solve(p, options);
                REQUIRE(s.certificate.status == SolveStatus::converged);

                const bool stands = std::tan(slope) <= mu;
                const double shear = stands ? std::sin(slope) : mu * std::cos(slope);
                double above = 0;
                for (int i = n; i-- > 0;) {
                    above += mass[static_cast<std::size_t>(i)];
                    const Vec3 r = above * test::kGravity * Vec3{std::cos(slope), -shear, 0};
                    CHECK((s.reaction.segment<3>(3 * i) - r).norm() <= 1e-7 * r.norm());
                }
                const double slides = test::kGravity * (std::sin(slope) - shear); // [m/s^2]
                CHECK(std::abs(s.u[1] - slides) <= 1e-7 * test::kGravity);
            }
    }
}

TEST_CASE("random problems are solved and long double agrees with the certificate")
{
    std::mt19937 rng{1};
    int iterations = 0;
    for (int k = 0; k < 400; ++k) {
        const int n = 1 + k % 12;
        const int dofs = k % 2 ? 3 * n : 2 * n + 1; // every second one is singular
        ContactProblem p = test::random_problem(rng, n, dofs, k % 3 ? 0.4 : 0.1, k % 5);
        const double force = std::pow(10, k % 25 - 12), length = std::pow(10, 12 - k % 25);
        p.W.dense() *= length / force;
        p.q *= length;
        SolverOptions options;
        const ContactSolution s = solve(p, options);
        const double error = static_cast<double>(test::reference_error(p, s.reaction));
        CAPTURE(k);
        CHECK(std::abs(s.certificate.error - error) <= 1e-12 + 1e-3 * error);
        CHECK((s.certificate.status == SolveStatus::converged) ==
              (error <= s.certificate.threshold));
        CHECK(s.certificate.status == SolveStatus::converged);
        CHECK((s.u - p.W * s.reaction - p.q).norm() <= 1e-12 * s.u.norm() + 1e-13 * p.q.norm());
        iterations += s.certificate.iterations;
    }
    MESSAGE("mean sweeps " << iterations / 400.0);
}

TEST_CASE("hard problems end after few iterations with a certificate that is true")
{
    constexpr int kProblems = 2400;
    constexpr double kFriction[] = {0, 0.1, 0.5, 1, 2, 10};
    std::mt19937 rng{2};
    const auto up_to = [&](int most) { return std::uniform_int_distribution<int>(0, most)(rng); };
    std::map<SolveStatus, int> count;
    for (int k = 0; k < kProblems; ++k) {
        const int n = 1 + k % 6;
        ContactProblem p = test::random_problem(rng, n, 1 + up_to(3 * n - 1), 0, up_to(12));
        for (double& mu : p.mu)
            mu = kFriction[up_to(5)];
        if (k % 3 == 0) { // a duplicate contact
            p.W.dense().topRows<3>() = p.W.dense().bottomRows<3>();
            p.W.dense().leftCols<3>() = p.W.dense().rightCols<3>();
            p.W.dense().topLeftCorner<3, 3>() = p.W.dense().bottomRightCorner<3, 3>();
            p.q.head<3>() = p.q.tail<3>();
        }
        if (k % 5 == 0) { // a contact that nothing can move
            p.W.dense().topRows<3>().setZero();
            p.W.dense().leftCols<3>().setZero();
        }
        p.W.dense() *= std::pow(10.0, up_to(24) - 12); // any unit
        p.q *= std::pow(10.0, up_to(24) - 12);
        const ContactSolution s = solve(p, {});
        const Certificate& c = s.certificate;
        ++count[c.status];
        CAPTURE(k);
        REQUIRE(s.reaction.allFinite());
        CHECK(c.iterations < 400); // [regression] 163 at most
        if (p.W.dense().trace() <= 0 || p.q.norm() == 0) continue;
        const double error = static_cast<double>(test::reference_error(p, s.reaction));
        // Round-off of u = W r + q, of which mu |u_t| enters the normal, and of r beside rho u.
        const double rho = static_cast<double>(p.q.size()) / p.W.dense().trace();
        const Eigen::VectorXd terms = p.q.cwiseAbs() + p.W.absolute_times(s.reaction.cwiseAbs()) +
                                      s.reaction.cwiseAbs() / rho;
        const double round_off = 1e-14 * (1 + p.mu.maxCoeff()) * terms.norm() / p.q.norm();
        CHECK(std::abs(c.error - error) <= round_off + 1e-3 * error);
        CHECK(is_solved(c.status) == (c.error <= c.threshold));
        if (c.status != SolveStatus::infeasible) continue;
        // The proof, from its definition.
        Eigen::VectorXd d = Eigen::VectorXd::Zero(p.q.size());
        for (int i = 0; i < n; ++i)
            d[3 * i] = c.proof.direction[i];
        CHECK(d.minCoeff() >= 0);
        CHECK(d.dot(p.q) < 0);
        CHECK((p.W.dense().transpose() * d).norm() <= 1e-12 * p.W.dense().norm() * d.norm());
    }
    for (const auto& [status, problems] : count)
        MESSAGE(name(status) << " " << problems);
    CHECK(count[SolveStatus::converged] > kProblems / 2);
    CHECK(count[SolveStatus::infeasible] > 0);
    CHECK(count[SolveStatus::out_of_time] == 0);
}

TEST_CASE("units and the scale of W change nothing but the unit of the answer")
{
    std::mt19937 rng{3};
    const ContactProblem p = test::random_problem(rng, 6, 18, 0.3, 2);
    for (const SolverOptions& options : all_solvers()) {
        const ContactSolution s = solve(p, options);
        REQUIRE(s.certificate.status == SolveStatus::converged);
        for (double force : {1e-12, 1e12})
            for (double length : {1e-12, 1e3, 1e12}) {
                ContactProblem other = p;
                other.W.dense() *= length / force;
                other.q *= length;
                const ContactSolution t = solve(other, options);
                CHECK(std::abs(t.certificate.iterations - s.certificate.iterations) <= 1);
                CHECK((t.reaction / force - s.reaction).norm() <= 1e-7 * s.reaction.norm());
            }
        // By a power of two nothing is rounded: the same bits.
        ContactProblem other = p;
        other.W.dense() *= 0x1p-40;
        other.q *= 0x1p-20;
        CHECK((solve(other, options).reaction * 0x1p-20 - s.reaction).norm() <=
              1e-12 * s.reaction.norm());
    }
}

TEST_CASE("turning t1 and t2 at each contact turns the reactions")
{
    std::mt19937 rng{4};
    const ContactProblem p = test::random_problem(rng, 6, 18, 0.3);
    Eigen::MatrixXd Q = Eigen::MatrixXd::Identity(18, 18);
    for (int i = 0; i < 6; ++i) {
        const double a = 0.3 + i;
        Q.block<2, 2>(3 * i + 1, 3 * i + 1) << std::cos(a), -std::sin(a), std::sin(a), std::cos(a);
    }
    ContactProblem other = p;
    other.W = Eigen::MatrixXd(Q * p.W.dense() * Q.transpose());
    other.q = Q * p.q;
    const SolverOptions options = options_of(ContactSolver::nsgs, 1e-12);
    const ContactSolution s = solve(p, options), t = solve(other, options);
    CHECK((Q * s.reaction - t.reaction).norm() <= 1e-8 * s.reaction.norm());
    CHECK(std::abs(s.certificate.iterations - t.certificate.iterations) <= 2);
}

TEST_CASE("frictionless contacts are frictional ones with mu = 0 and bilateral rows stay closed")
{
    std::mt19937 rng{5};
    const ContactProblem p = test::random_problem(rng, 5, 15, 0);
    ContactProblem rows;
    const std::vector<Eigen::Index> normals{0, 3, 6, 9, 12};
    rows.W = Eigen::MatrixXd(p.W.dense()(normals, normals));
    rows.q = p.q(normals);
    rows.mu = Eigen::VectorXd::Zero(5);
    rows.kind.assign(5, ContactKind::frictionless);
    for (const SolverOptions& options : all_solvers()) {
        const ContactSolution full = solve(p, options), normal = solve(rows, options);
        REQUIRE(normal.certificate.status == SolveStatus::converged);
        CHECK((full.reaction(normals) - normal.reaction).norm() <= 1e-6 * normal.reaction.norm());
    }

    // Bilateral alone is a linear system; among others it holds too.
    rows.kind.assign(5, ContactKind::bilateral);
    const Eigen::VectorXd exact = -rows.W.dense().ldlt().solve(rows.q);
    for (const SolverOptions& options : all_solvers())
        CHECK((solve(rows, options).reaction - exact).norm() <= 1e-5 * exact.norm());

    ContactProblem mixed;
    mixed.W = Eigen::MatrixXd(p.W.dense().topLeftCorner<8, 8>());
    mixed.q = p.q.head<8>();
    mixed.mu = Eigen::VectorXd::Constant(4, 0.3);
    mixed.kind = {ContactKind::bilateral, ContactKind::frictional, ContactKind::frictionless,
                  ContactKind::frictional};
    for (const SolverOptions& options : all_solvers()) {
        const ContactSolution s = solve(mixed, options);
        CHECK(s.certificate.status == SolveStatus::converged);
        CHECK(std::abs(s.u[0]) <= 1e-8 * mixed.q.norm());
        CHECK(s.reaction[4] >= 0);
        CHECK(s.u[4] >= -1e-8 * mixed.q.norm());
    }
}

TEST_CASE("walls that close on a body from both sides are infeasible with the proof")
{
    for (double friction : {0.0, 0.5}) {
        // One body, one degree of freedom along n, held apart by less than it must be.
        ContactProblem p;
        p.W.dense().setZero(6, 6);
        for (int i : {0, 1})
            for (int j : {0, 1})
                p.W.dense().block<3, 3>(3 * i, 3 * j) =
                    Vec3{i == j ? 1.0 : -1.0, 1, 1}.asDiagonal();
        p.q.resize(6);
        p.q << -1, 0.1, 0, 1 - 1e-6, 0.1, 0;
        p.mu.setConstant(2, friction);
        const ContactSolution s = solve(p);
        CHECK(s.certificate.status == SolveStatus::infeasible);
        CHECK(s.certificate.proof.contacts == std::vector<int>{0, 1});
        CHECK(s.certificate.proof.closing == doctest::Approx(1e-6));
        CHECK(s.certificate.iterations < 200); // [regression] our own run
        // As much room as the body needs: feasible, and never called otherwise.
        p.q[3] = 1 + 1e-6;
        CHECK(solve(p).certificate.status == SolveStatus::converged);
    }
}

TEST_CASE("dense and sparse and matrix-free W give the same answer")
{
    std::mt19937 rng{9};
    for (int dofs : {40, 20}) { // regular and singular
        const ContactProblem p = test::random_problem(rng, 12, dofs, 0.4, 2);
        for (const SolverOptions& options : all_solvers(1e-9)) {
            CAPTURE(name(options.solver));
            const ContactSolution dense = solve(p, options), sparse = solve(as_sparse(p), options);
            REQUIRE(dense.certificate.status == SolveStatus::converged);
            REQUIRE(sparse.certificate.status == SolveStatus::converged);
            CHECK((dense.u - sparse.u).norm() <= 1e-6 * p.q.norm());
        }
        for (ContactSolver solver :
             {ContactSolver::automatic, ContactSolver::path, ContactSolver::uzawa}) {
            CAPTURE(name(solver));
            const ContactSolution dense = solve(p, options_of(solver, 1e-9));
            const ContactSolution function = solve(as_function(p), options_of(solver, 1e-9));
            REQUIRE(function.certificate.status == SolveStatus::converged);
            CHECK((dense.u - function.u).norm() <= 1e-6 * p.q.norm());
        }
    }
}

TEST_CASE("heavy on light: the path does not depend on the ratio of masses")
{
    // Where sweeps take iterations in proportion to the ratio (docs/theory/contact.md).
    int steps = 0;
    for (double ratio : {1e2, 1e4, 1e6, 1e8}) {
        std::vector<double> mass(8, 1.0);
        mass.back() = ratio;
        ContactProblem p = test::tower(mass, 0.3, 0.5);
        const ContactSolution s = solve(p, options_of(ContactSolver::path, 1e-10));
        CAPTURE(ratio);
        REQUIRE(is_solved(s.certificate.status));
        steps = std::max(steps, s.certificate.iterations);
        const double weight = (ratio + 7) * test::kGravity * std::cos(0.3);
        // The error is over ||q||; the light blocks' W carries it to the weight, ratio times.
        CHECK(s.reaction[0] == doctest::Approx(weight).epsilon(10 * 1e-10 * ratio));
    }
    CHECK(steps < 60); // [regression] our own run
}

TEST_CASE("groups that W does not couple are solved apart")
{
    std::mt19937 rng{10};
    const ContactProblem a = test::random_problem(rng, 5, 20, 0.4),
                         b = test::random_problem(rng, 7, 25, 0);
    ContactProblem both; // interleaved by pairs, with a contact that never closes in between
    std::vector<Eigen::Index> row_a, row_b;
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(39, 39);
    both.q = Eigen::VectorXd::Constant(39, 1.0);
    both.mu = Eigen::VectorXd::Constant(13, 0.3);
    W.block<3, 3>(15, 15).setIdentity();
    for (int i = 0; i < 13; ++i) {
        if (i == 5) continue;
        const bool first = i < 10 && i % 2 == 0;
        std::vector<Eigen::Index>& rows = first ? row_a : row_b;
        both.mu[i] = first ? 0.4 : 0.0;
        for (int k = 0; k < 3; ++k)
            rows.push_back(3 * i + k);
    }
    W(row_a, row_a) = a.W.dense();
    W(row_b, row_b) = b.W.dense();
    both.q(row_a) = a.q;
    both.q(row_b) = b.q;
    both.W = W;
    for (const ContactProblem& p : {both, as_sparse(both)}) {
        const ContactSolution whole = solve(p, options_of(ContactSolver::automatic));
        REQUIRE(whole.certificate.status == SolveStatus::converged);
        SolverOptions threads = options_of(ContactSolver::automatic);
        threads.threads = 4;
        CHECK((solve(p, threads).reaction - whole.reaction).norm() == 0);
        CHECK(whole.reaction.segment<3>(15).norm() == 0);
        const Eigen::VectorXd u_a = whole.u(row_a), u_b = whole.u(row_b);
        CHECK((u_a - solve(a).u).norm() <= 1e-7 * a.q.norm());
        CHECK((u_b - solve(b).u).norm() <= 1e-7 * b.q.norm());
    }
}

TEST_CASE("redundant supports: reported to be not unique and shared evenly on request")
{
    // A table on n legs of one rigid body: three motions (up, two tilts) under n normal forces.
    for (int n : {4, 8}) {
        ContactProblem p;
        Eigen::MatrixXd G = Eigen::MatrixXd::Zero(3 * n, 6);
        for (int i = 0; i < n; ++i) {
            const double angle = 2 * 3.14159265358979 * i / n;
            const Vec3 x{std::cos(angle), std::sin(angle), -1};
            const Vec3 axes[3] = {Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY()};
            for (int k = 0; k < 3; ++k) {
                G.block<1, 3>(3 * i + k, 0) = axes[k].transpose();
                G.block<1, 3>(3 * i + k, 3) = x.cross(axes[k]).transpose();
            }
        }
        p.W = Eigen::MatrixXd(G * G.transpose());
        Eigen::VectorXd fall = Eigen::VectorXd::Zero(6);
        fall[2] = -1;
        p.q = G * fall;
        p.mu.setConstant(n, 0.5);
        for (const ContactProblem& form : {p, as_sparse(p)}) {
            SolverOptions options;
            options.analyse = options.least_norm = true;
            const ContactSolution s = solve(form, options);
            REQUIRE(s.certificate.status == SolveStatus::converged);
            CHECK(s.certificate.analysed);
            CHECK(s.certificate.rank_deficient);
            CHECK(!s.certificate.indefinite);
            for (int i = 0; i < n; ++i) {
                CHECK(s.reaction[3 * i] == doctest::Approx(1.0 / n).epsilon(1e-3));
                CHECK(s.reaction.segment<2>(3 * i + 1).norm() <= 1e-3 / n);
            }
        }
    }
    std::mt19937 rng{11};
    ContactProblem p = test::random_problem(rng, 6, 30, 0.4);
    SolverOptions options;
    options.analyse = true;
    CHECK(!solve(p, options).certificate.rank_deficient);
    p.W.dense()(0, 0) -= 2 * p.W.dense()(0, 0);
    const ContactSolution s = solve(p, options);
    CHECK(s.certificate.indefinite);
    CHECK(s.reaction.allFinite());
}

TEST_CASE("a warm start saves sweeps and a bad one costs nothing")
{
    std::mt19937 rng{6};
    ContactProblem p = test::random_problem(rng, 10, 30, 0.4, 1);
    const ContactSolution cold = solve(p);
    REQUIRE(cold.certificate.status == SolveStatus::converged);
    CHECK(solve(p, {}, cold.reaction).certificate.iterations == 0);
    p.q *= 1 + 1e-6;
    CHECK(solve(p, {}, cold.reaction).certificate.iterations <
          cold.certificate.iterations / 2); // [regression] our own run
    const Eigen::VectorXd bad = Eigen::VectorXd::Constant(30, 1e9);
    const ContactSolution from_bad = solve(p, {}, bad), from_zero = solve(p);
    CHECK((from_bad.reaction - from_zero.reaction).norm() == 0);
}

TEST_CASE("the same problem gives the same bits")
{
    std::mt19937 rng{7};
    const ContactProblem p = test::random_problem(rng, 12, 30, 0.4, 3);
    for (const SolverOptions& options : all_solvers(1e-8))
        CHECK((solve(p, options).reaction - solve(p, options).reaction).norm() == 0);
}

TEST_CASE("limits end a solve with the best reaction so far")
{
    std::mt19937 rng{8};
    const ContactProblem p = test::random_problem(rng, 12, 20, 0.4, 6);
    SolverOptions options = options_of(ContactSolver::nsgs, 1e-14);
    options.max_iterations = 3;
    const ContactSolution few = solve(p, options);
    CHECK(few.certificate.status == SolveStatus::stagnated);
    CHECK(few.certificate.iterations == 3);
    REQUIRE(few.history.size() == 4);
    double best = few.history[0].error;
    for (const ErrorPoint& point : few.history)
        best = std::min(best, point.error);
    CHECK(few.certificate.error == doctest::Approx(best));
    options.max_seconds = 0;
    CHECK(solve(p, options).certificate.status == SolveStatus::out_of_time);
}

TEST_CASE("a stop from outside ends every solver with the best reaction so far")
{
    std::mt19937 rng{8};
    const ContactProblem p = test::random_problem(rng, 12, 20, 0.4, 6);
    const std::atomic<bool> stop = true;
    for (const ContactSolver solver : kContactSolvers) {
        CAPTURE(name(solver));
        SolverOptions options = options_of(solver, 0);
        options.stop = &stop;
        const ContactSolution s = solve(p, options);
        CHECK(s.certificate.status == SolveStatus::out_of_time);
        CHECK(s.certificate.iterations == 0);
        CHECK(s.certificate.error <= certify(p, Eigen::VectorXd::Zero(p.q.size()), 0).error);
    }
}

TEST_CASE("a stop in the midst of a solve ends it soon")
{
    // By W itself, whose products are counted: time continues while it is used.
    std::mt19937 rng{8};
    const ContactProblem p = test::random_problem(rng, 12, 20, 0.4, 6);
    for (const ContactSolver solver :
         {ContactSolver::automatic, ContactSolver::path, ContactSolver::uzawa}) {
        CAPTURE(name(solver));
        SolverOptions options = options_of(solver, 0);
        options.max_iterations = 10'000'000;
        options.patience = 10'000'000;
        std::atomic<bool> stop = false;
        options.stop = &stop;
        ContactProblem counted = as_function(p);
        long products = 0;
        constexpr long kStopAt = 30;
        MatrixFreeDelassus function = counted.W.matrix_free();
        function.apply = [&, apply = function.apply](const Eigen::VectorXd& r,
                                                     Eigen::VectorXd& out) {
            if (++products == kStopAt) stop = true;
            apply(r, out);
        };
        counted.W = std::move(function);
        const ContactSolution s = solve(counted, options);
        REQUIRE(products >= kStopAt);
        CHECK(products < kStopAt + 20); // [regression] 9 at most, of the path's factor
        CHECK(s.certificate.status == SolveStatus::out_of_time);
    }
}

TEST_CASE("a solve never ends worse than it began")
{
    std::mt19937 rng{12};
    for (int k = 0; k < 10; ++k) {
        const ContactProblem p = test::random_problem(rng, 6, 18, 0.4, 6);
        const double zero = certify(p, Eigen::VectorXd::Zero(18), 0).error;
        for (SolverOptions options : all_solvers())
            for (int iterations : {0, 1}) {
                CAPTURE(name(options.solver));
                options.max_iterations = iterations;
                const ContactSolution s = solve(p, options);
                CHECK(s.certificate.error <= zero);
                CHECK(s.certificate.error == certify(p, s.reaction, 0).error);
            }
    }
}

TEST_CASE("any limit of stalled sweeps may be set")
{
    std::mt19937 rng{15};
    const ContactProblem p = test::random_problem(rng, 6, 18, 0.4);
    SolverOptions options;
    options.patience = 500'000'000; // five times this is no int
    CHECK(solve(p, options).certificate.status == SolveStatus::converged);
}

TEST_CASE("the least reaction is found from a warm start that solves the problem too")
{
    // Two equal contacts below one mass: only the sum of their reactions moves it.
    ContactProblem p;
    p.W.dense().setOnes(2, 2);
    p.q = Eigen::Vector2d(-1, -1);
    p.mu.setZero(2);
    p.kind.assign(2, ContactKind::frictionless);
    SolverOptions options;
    options.least_norm = true;
    const ContactSolution s = solve(p, options, Eigen::Vector2d(1, 0));
    REQUIRE(s.certificate.status == SolveStatus::converged);
    CHECK(s.reaction[0] == doctest::Approx(0.5).epsilon(1e-4));
    CHECK(s.reaction[1] == doctest::Approx(0.5).epsilon(1e-4));
}

TEST_CASE("a Newton step that takes longer than the time allowed is not begun")
{
    // 900 rows: a factor is reckoned at 13 ms, more than three times the limit.
    std::mt19937 rng{13};
    const ContactProblem p = test::random_problem(rng, 300, 900, 0.8, 2);
    SolverOptions options = options_of(ContactSolver::path);
    options.max_seconds = 4e-3;
    const ContactSolution s = solve(p, options);
    CHECK(s.certificate.status == SolveStatus::out_of_time);
    CHECK(s.certificate.iterations == 0);
}

TEST_CASE("a sparse W whose columns are not sorted is the same W")
{
    std::mt19937 rng{14};
    const ContactProblem p = test::random_problem(rng, 6, 18, 0.4);
    Delassus::Sparse W = p.W.dense().sparseView();
    W.makeCompressed();
    for (Eigen::Index j = 0; j < W.cols(); ++j) {
        const int begin = W.outerIndexPtr()[j], end = W.outerIndexPtr()[j + 1];
        std::reverse(W.innerIndexPtr() + begin, W.innerIndexPtr() + end);
        std::reverse(W.valuePtr() + begin, W.valuePtr() + end);
    }
    ContactProblem other = p;
    other.W = W;
    CHECK((solve(other).reaction - solve(as_sparse(p)).reaction).norm() == 0);
}

TEST_CASE("no contact is a problem with nothing to do")
{
    const ContactSolution s = solve(ContactProblem{});
    CHECK(s.certificate.status == SolveStatus::converged);
    CHECK(s.reaction.size() == 0);
}

TEST_CASE("bad input is refused with all that is wrong")
{
    ContactProblem p = test::tower({1, 1}, 0.1, 0.5);
    const auto count = [&](const ContactProblem& problem, const SolverOptions& options = {},
                           const Eigen::VectorXd& warm = {}) {
        try {
            solve(problem, options, warm);
        } catch (const InputError& e) {
            return e.issues().size();
        }
        return std::size_t{0};
    };
    CHECK(count(p) == 0);

    ContactProblem bad = p;
    bad.mu[0] = -0.1;
    bad.mu[1] = NAN;
    bad.q[2] = INFINITY;
    bad.W.dense()(3, 1) = NAN;
    CHECK(count(bad) == 4);
    bad = p;
    bad.q.conservativeResize(5);
    bad.W.dense().conservativeResize(6, 5);
    CHECK(count(bad) == 2);
    bad = p;
    bad.kind = {ContactKind::frictional};
    CHECK(count(bad) == 1);
    bad = p;
    bad.W.dense()(0, 4) += 0.1;
    CHECK(bad.W.asymmetry() > kMaxAsymmetry);
    CHECK(count(bad) == 1);
    CHECK(count(p, {}, Eigen::VectorXd::Zero(5)) == 1);
    CHECK(count(p, {}, Eigen::VectorXd::Constant(6, NAN)) == 1);

    SolverOptions options;
    options.tolerance = -1;
    options.max_seconds = NAN;
    options.nsgs.freeze = 1;
    options.uzawa.factor = 0;
    CHECK(count(p, options) == 4);
    for (ContactSolver sweeps : {ContactSolver::nsgs, ContactSolver::anderson})
        CHECK(count(as_function(p), options_of(sweeps)) == 1);
    CHECK(contact_solver("uzawa") == ContactSolver::uzawa);
    CHECK_THROWS_AS(contact_solver("uzava"), InputError);
}
