#include "contact/solve.hpp"

#include "contact/cone.hpp"
#include "contact/solvers/automatic.hpp"
#include "contact/solvers/newton.hpp"
#include "contact/solvers/nsgs.hpp"
#include "contact/solvers/uzawa.hpp"
#include "mesh/base/phase_timer.hpp"

#include <algorithm>

namespace amontons {
namespace {

void check(const ContactProblem& problem, const SolverOptions& options,
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
    if (!found.empty()) throw InputError(std::move(found));
}

/// The warm start, brought into the cones, if its error is below that of r = 0.
Eigen::VectorXd start(const ContactProblem& problem, const Eigen::VectorXd& warm_start)
{
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.q.size());
    if (warm_start.size() == 0) return zero;

    // All rows count here: what the two starts leave open differs, and must not be the judge.
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

} // namespace

ContactSolution solve(const ContactProblem& problem, const SolverOptions& options,
                      const Eigen::VectorXd& warm_start)
{
    const Stopwatch clock;
    check(problem, options, warm_start);

    const ContactSolver solver = options.solver;
    SolverWork work(problem, options, start(problem, warm_start));
    switch (solver) {
    case ContactSolver::automatic:
        solve_automatically(work);
        break;
    case ContactSolver::nsgs:
        solve_nsgs(work);
        break;
    case ContactSolver::anderson: {
        AcceleratedNsgs(work).advance(std::numeric_limits<int>::max());
        break;
    }
    case ContactSolver::uzawa:
        solve_uzawa(work);
        break;
    case ContactSolver::newton:
    case ContactSolver::path: {
        ShiftedDelassus matrix(work);
        NewtonPath path;
        path.smooth = solver == ContactSolver::path;
        path.from_afar = warm_start.size() == 0;
        follow_path(work, matrix, path);
        break;
    }
    }
    SolverRun run = std::move(work.progress).result();

    ContactSolution solution;
    solution.certificate = certify(problem, run.reaction, options.tolerance, options.scope);
    Certificate& c = solution.certificate;
    // A solver may end early, never declare success.
    if (c.status != SolveStatus::converged && run.status != SolveStatus::converged)
        c.status = run.status;
    c.proof = std::move(run.proof);
    c.solver = solver;
    c.iterations = run.iterations;
    solution.reaction = std::move(run.reaction);
    solution.u = problem.W * solution.reaction + problem.q;
    solution.history = std::move(run.history);
    c.seconds = clock.seconds();
    return solution;
}

} // namespace amontons
