#include "contact/solvers/solve.hpp"

#include "contact/analysis.hpp"
#include "contact/cone.hpp"
#include "contact/least_norm.hpp"
#include "contact/presolve.hpp"
#include "contact/solvers/automatic.hpp"
#include "contact/solvers/newton.hpp"
#include "contact/solvers/nsgs.hpp"
#include "contact/solvers/uzawa.hpp"
#include "contact/units.hpp"
#include "mesh/base/phase_timer.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// Times that parts are solved closer before the whole is left as it is.
constexpr int kPartRounds = 4;
constexpr int kWaysOfAutomatic = 5;
/// Friction from which on normal forces have units of their own, one try after the other.
constexpr double kSteepFriction[] = {128, 2048};
constexpr int kSteepRounds = 3, kSteepPatience = 400;

void check_arguments(const ContactProblem& problem, const SolverOptions& options,
                     const Eigen::VectorXd& warm_start)
{
    std::vector<Issue> found = issues(problem);
    for (Issue& issue : issues(options))
        found.push_back(std::move(issue));
    if (warm_start.size() != 0 && warm_start.size() != problem.q.size())
        found.push_back({"warm start", "", std::to_string(warm_start.size()) + " rows",
                         "none, or " + std::to_string(problem.q.size())});
    else if (!warm_start.allFinite())
        found.push_back({"warm start", "", "a number that is not finite", "finite"});
    if (problem.W.is_matrix_free() &&
        (options.solver == ContactSolver::nsgs || options.solver == ContactSolver::anderson))
        found.push_back({"solver options", "solver", name(options.solver),
                         "auto, uzawa, newton or path: a matrix-free W has no columns to sweep"});
    if (!found.empty()) throw InputError(std::move(found));
}

/// The warm start, brought into the cones, if its error is below that of r = 0.
Eigen::VectorXd start(const ContactProblem& problem, const Eigen::VectorXd& warm_start)
{
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.q.size());
    if (warm_start.size() == 0) return zero;

    // All rows count here: the open contacts of the two starts differ.
    const NaturalMapError error(problem, ErrorScope::all_rows);
    Eigen::VectorXd r = warm_start;
    for (int i = 0; i < contact_count(problem); ++i) {
        const int k = error.first_row(i);
        switch (kind_of(problem, i)) {
        case ContactKind::frictional:
            r.segment<3>(k) = project_cone(r.segment<3>(k), problem.mu[i]);
            break;
        case ContactKind::frictionless:
            r[k] = std::max(0.0, r[k]);
            break;
        case ContactKind::bilateral:
            break;
        }
    }
    const Eigen::VectorXd u = problem.W * r + problem.q;
    return error(r, u) < error(zero, problem.q) ? r : zero;
}

/// Runs one solver on the problem as it is.
SolverRun run_plain(const ContactProblem& problem, SolverOptions options, Eigen::VectorXd start,
                    bool warm)
{
    // It has several methods: stagnation of one of them is no reason to stop.
    if (options.solver == ContactSolver::automatic)
        options.patience =
            kWaysOfAutomatic *
            std::min(options.patience, std::numeric_limits<int>::max() / kWaysOfAutomatic);
    SolverWork work(problem, options, std::move(start));
    switch (options.solver) {
    case ContactSolver::automatic:
        solve_automatically(work, warm);
        break;
    case ContactSolver::nsgs:
        solve_nsgs(work);
        break;
    case ContactSolver::anderson:
        AcceleratedNsgs(work).advance(std::numeric_limits<int>::max());
        break;
    case ContactSolver::uzawa:
        solve_uzawa(work);
        break;
    case ContactSolver::newton:
        solve_by_newton(work);
        break;
    case ContactSolver::path:
        solve_by_path(work, warm);
        break;
    }
    return std::move(work.progress).result();
}

/// The same; `auto` first in normal_units, where friction is so large that there are any.
SolverRun run(const ContactProblem& problem, const SolverOptions& options, Eigen::VectorXd start,
              bool warm)
{
    if (options.solver != ContactSolver::automatic ||
        normal_units(problem, kSteepFriction[0]).size() == 0)
        return run_plain(problem, options, std::move(start), warm);
    const Stopwatch clock;
    const NaturalMapError error(problem, options.scope);
    SolverRun best;                  // of what has been tried, by the problem's own error
    std::vector<ErrorPoint> history; // those errors
    double least = std::numeric_limits<double>::infinity();
    int iterations = 0;
    const auto left = [&](SolverOptions o) { // limits are those of all tries together
        o.max_seconds = std::max(0.0, options.max_seconds - clock.seconds());
        o.max_iterations = std::max(0, options.max_iterations - iterations);
        return o;
    };
    const auto done = [&](SolverRun run) {
        run.iterations = iterations;
        run.history = std::move(history);
        return run;
    };
    for (const double most : kSteepFriction) {
        const Eigen::VectorXd D = normal_units(problem, most);
        if (D.size() == 0) break;
        const ContactProblem inner = in_normal_units(problem, D);
        SolverOptions closer = options;
        closer.patience = std::min(options.patience, kSteepPatience);
        Eigen::VectorXd from = start.cwiseQuotient(D);
        for (int round = 0; round < kSteepRounds; ++round, closer.tolerance *= 1e-2) {
            SolverRun found = run_plain(inner, left(closer), from, warm || round > 0);
            from = found.reaction;
            found.reaction = D.cwiseProduct(from);
            iterations += found.iterations;
            const double reached = error(found.reaction, problem.W * found.reaction + problem.q);
            history.push_back({iterations, clock.seconds(), reached});
            const SolveStatus status = found.status;
            if (reached < least) {
                least = reached;
                best = std::move(found);
            }
            if (reached <= options.tolerance) return done(std::move(best));
            if (status == SolveStatus::out_of_time) {
                best.status = status;
                return done(std::move(best));
            }
            if (status != SolveStatus::converged) break;
        }
    }
    const double begun = clock.seconds();
    SolverRun last = run_plain(problem, left(options), std::move(start), warm);
    for (const ErrorPoint& p : last.history)
        history.push_back({p.iteration + iterations, p.seconds + begun, p.error});
    iterations += last.iterations;
    const bool better = last.status == SolveStatus::converged ||
                        last.status == SolveStatus::infeasible ||
                        error(last.reaction, problem.W * last.reaction + problem.q) <= least;
    if (!better) last.reaction = std::move(best.reaction);
    return done(std::move(last));
}

/// The tolerance in a part's own measure that leaves it below the given one in that of the whole.
double tolerance_of(const NaturalMapError& whole, const ContactProblem& part, double tolerance)
{
    const double rho = whole.rho();
    const double own = NaturalMapError(part, ErrorScope::all_rows).rho();
    // ||F|| of the part grows with rho, by no more than rho does.
    const double share =
        std::min(1.0, own / rho) * rho * whole.problem().q.norm() / (own * part.q.norm());
    return std::clamp(share * tolerance, 0.1 * tolerance, std::max(tolerance, 1e-3));
}

InfeasibilityProof proof_of_whole(const ContactProblem& whole, const ProblemPart& part,
                                  InfeasibilityProof proof)
{
    const Eigen::VectorXd direction = proof.direction;
    proof.direction = Eigen::VectorXd::Zero(contact_count(whole));
    proof.direction(part.contacts) = direction;
    for (int& contact : proof.contacts)
        contact = part.contacts[static_cast<std::size_t>(contact)];
    return proof;
}

/// Solves the parts one by one; again, to a smaller error, where that of the whole is too large.
SolverRun run_parts(const NaturalMapError& error, const std::vector<ProblemPart>& parts,
                    const SolverOptions& options, const Eigen::VectorXd& start, double at_start)
{
    const Stopwatch clock;
    const ContactProblem& problem = error.problem();
    const auto error_of = [&](const Eigen::VectorXd& r) {
        Eigen::VectorXd u = problem.W * r + problem.q, residuals(contact_count(problem));
        return error.decided(r, u, residuals, options.tolerance);
    };
    SolverRun whole;
    whole.reaction = Eigen::VectorXd::Zero(problem.q.size());
    for (const ProblemPart& part : parts)
        whole.reaction(part.rows) = start(part.rows);
    whole.history.push_back({0, clock.seconds(), at_start});

    const double share = 1 / std::sqrt(static_cast<double>(parts.size()));
    const int threads = std::clamp(static_cast<int>(parts.size()), 1, options.threads);
    double factor = 1;
    std::vector<SolverRun> runs(parts.size());
    for (int round = 0; round < kPartRounds; ++round) {
        // Each part is on its own: any number of threads computes the same.
#pragma omp parallel for schedule(dynamic) num_threads(threads) if (threads > 1)
        for (std::size_t k = 0; k < parts.size(); ++k) {
            const ProblemPart& part = parts[k];
            SolverOptions own = options;
            own.tolerance = factor * share * tolerance_of(error, part.problem, options.tolerance);
            own.max_seconds = std::max(0.0, options.max_seconds - clock.seconds());
            Eigen::VectorXd own_start = whole.reaction(part.rows);
            const bool warm = !own_start.isZero(0);
            runs[k] = run(part.problem, own, std::move(own_start), warm);
        }
        whole.status = SolveStatus::converged;
        for (std::size_t k = 0; k < parts.size(); ++k) {
            whole.iterations += runs[k].iterations;
            whole.reaction(parts[k].rows) = runs[k].reaction;
            if (runs[k].status == SolveStatus::converged) continue;
            whole.status = runs[k].status;
            if (whole.status != SolveStatus::infeasible) continue;
            whole.proof = proof_of_whole(problem, parts[k], runs[k].proof);
            return whole;
        }
        const double reached = error_of(whole.reaction);
        whole.history.push_back({whole.iterations, clock.seconds(), reached});
        if (whole.status != SolveStatus::converged || reached <= options.tolerance) break;
        factor *= 0.5 * options.tolerance / reached;
    }
    return whole;
}

/// Solves again with W + alpha: among the reactions that W does not distinguish, alpha prefers the
/// least (Tikhonov). alpha |r| is a tenth of the tolerance, and the second solve close enough to
/// depend on it.
void reduce_norm(const ContactProblem& problem, const SolverOptions& options,
                 const Stopwatch& clock, SolverRun& outcome)
{
    const double size = outcome.reaction.norm();
    if (size == 0 || problem.W.is_matrix_free()) return;
    if (const std::optional<Eigen::VectorXd> least =
            least_norm_of_same_motion(problem, outcome.reaction)) {
        const NaturalMapError error(problem, options.scope);
        if (error(*least, problem.W * *least + problem.q) <= options.tolerance) {
            outcome.reaction = *least;
            return;
        }
    }
    const double alpha = 0.1 * options.tolerance * problem.q.norm() / size;
    ContactProblem softer = problem;
    if (problem.W.is_dense()) {
        softer.W.dense().diagonal().array() += alpha;
    } else {
        Delassus::Sparse shift(problem.W.rows(), problem.W.cols());
        shift.setIdentity();
        softer.W = Delassus::Sparse(problem.W.as_sparse() + alpha * shift);
    }
    SolverOptions closer = options;
    closer.solver = ContactSolver::path;
    closer.tolerance = 1e-5 * options.tolerance;
    closer.max_seconds = options.max_seconds - clock.seconds();
    SolverRun again = run(softer, closer, outcome.reaction, true);
    outcome.iterations += again.iterations;
    const NaturalMapError error(problem, options.scope);
    const double reached = error(again.reaction, problem.W * again.reaction + problem.q);
    if (reached <= options.tolerance) outcome.reaction = std::move(again.reaction);
}

/// The analysis that options.analyse enables.
void describe(const ContactProblem& problem, const SolverOptions& options, Certificate& c)
{
    if (!options.analyse) return;
    const DelassusAnalysis W = analyse(problem);
    c.analysed = W.known;
    c.rank_deficient = W.rank_deficient;
    c.indefinite = W.indefinite;
}

/// Solves a problem in the units that it has.
ContactSolution solve_in_range(const ContactProblem& problem, const SolverOptions& options,
                               const Eigen::VectorXd& warm_start)
{
    const Stopwatch clock;
    Eigen::VectorXd r = start(problem, warm_start);
    const NaturalMapError error(problem, options.scope);
    Eigen::VectorXd u = problem.W * r + problem.q;
    const double at_start = error(r, u);
    const bool may_shrink = options.least_norm && !r.isZero(0);
    if (at_start <= error.threshold(r, u, options.tolerance) && !may_shrink) {
        // No work: no contact closes, or the start is the solution.
        ContactSolution solution;
        solution.certificate = certify(error, r, options.tolerance, solution.u);
        solution.certificate.solver = options.solver;
        solution.reaction = std::move(r);
        solution.history = {{0, clock.seconds(), at_start}};
        solution.certificate.seconds = clock.seconds();
        describe(problem, options, solution.certificate);
        return solution;
    }
    std::optional<std::vector<ProblemPart>> parts;
    if (options.solver == ContactSolver::automatic) parts = take_apart(problem);
    SolverRun outcome = parts ? run_parts(error, *parts, options, r, at_start)
                              : run(problem, options, r, !r.isZero(0));

    if (options.least_norm && outcome.status == SolveStatus::converged)
        reduce_norm(problem, options, clock, outcome);

    ContactSolution solution;
    solution.certificate = certify(error, outcome.reaction, options.tolerance, solution.u);
    Certificate& c = solution.certificate;
    if (!is_solved(c.status) && !(c.error <= at_start)) {
        // A solver may end with a larger error than it began with.
        c = certify(error, r, options.tolerance, solution.u);
        outcome.reaction = std::move(r);
    }
    // Success is decided by the certificate, not by the solver.
    if (!is_solved(c.status) && outcome.status != SolveStatus::converged) c.status = outcome.status;
    c.proof = std::move(outcome.proof);
    c.solver = options.solver;
    c.iterations = outcome.iterations;
    solution.reaction = std::move(outcome.reaction);
    solution.history = std::move(outcome.history);
    c.seconds = clock.seconds();
    describe(problem, options, c);
    return solution;
}

/// Solves in other units, and certifies what is left of the reaction in the problem's own.
ContactSolution solve_in_units(const ContactProblem& problem, const Units& units,
                               const SolverOptions& options, const Eigen::VectorXd& warm_start)
{
    const int force = units.q - units.W; // as an exponent
    const ContactProblem inner = in_units(problem, units);
    ContactSolution solution = solve_in_range(inner, options, times_power(warm_start, -force));
    solution.reaction = times_power(solution.reaction, force);
    // The reaction of a large gap with a small W may be out of the range of doubles.
    if (!solution.reaction.allFinite()) solution.reaction.setZero();
    solution.u = times_power(inner.W * times_power(solution.reaction, -force) + inner.q, units.q);

    Certificate c = certify(problem, solution.reaction, options.tolerance, options.scope);
    const Certificate& found = solution.certificate;
    if (!is_solved(c.status) && !is_solved(found.status)) c.status = found.status;
    c.analysed = found.analysed;
    c.rank_deficient = found.rank_deficient;
    c.indefinite = found.indefinite;
    c.solver = found.solver;
    c.iterations = found.iterations;
    c.seconds = found.seconds;
    c.proof = found.proof;
    c.proof.closing = std::ldexp(c.proof.closing, units.q);
    c.proof.holds_up_to = std::ldexp(c.proof.holds_up_to, force);
    solution.certificate = std::move(c);
    return solution;
}

} // namespace

ContactSolution solve(const ContactProblem& problem, const SolverOptions& options,
                      const Eigen::VectorXd& warm_start)
{
    check_arguments(problem, options, warm_start);
    const Units units = units_of(problem);
    return units.are_one() ? solve_in_range(problem, options, warm_start)
                           : solve_in_units(problem, units, options, warm_start);
}

} // namespace amontons
