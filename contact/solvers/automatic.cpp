#include "contact/solvers/automatic.hpp"

#include "contact/solvers/newton.hpp"
#include "contact/solvers/nsgs.hpp"
#include "contact/solvers/proximal.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

namespace amontons {
namespace {

constexpr int kSweepBatch = 10;   ///< sweeps between two evaluations of their rate
constexpr double kPathSteps = 10; ///< steps that a path is expected to take
/// The same in a network of bodies. Its sweeps slow down: a digit takes twice as many as the last.
constexpr int kNetworkBatch = 5;
constexpr double kNetworkSteps = 7, kSlowing = 2;
/// Newton on the law itself: three steps where the sweeps have found the states of the contacts,
/// ended as soon as the error is not reduced.
constexpr NewtonPath kQuickNewton{.smooth = false, .steps = 8, .rejections = 1};
/// The same by full steps, as a primal-dual active set: it converges most often where few contacts
/// change their state, and else costs little beside the remaining methods.
constexpr NewtonPath kFreeNewton{.smooth = false, .free = true, .steps = 12};
/// In a network of rigid bodies whose reactions W does not distinguish: widely rounded, since the
/// reactions that W does not determine must leave the corners where sweeps have left them, and with
/// every single contact near the path before it continues: the mean of ten thousand does not show
/// the few that shorten the next step. Those are eliminated.
constexpr NewtonPath kNetworkPath{.widest = 1e-2, .worst = 3, .fastest = 0.1, .few = 80};
constexpr double kQuickSteps = 3;  ///< that it takes where it converges
constexpr double kWarmSweeps = 30; ///< that sweeps take from a warm start
constexpr double kSweepRoundOff = 1e-15;
constexpr double kHardlyHelped = 0.2;            ///< error, beside 1 for no reaction at all
constexpr int kFewSweeps = 100, kDoublings = 10; ///< between two paths, more in each round
/// Compliance at which an infeasible problem's reactions grow to 1e10 times their size.
constexpr double kSoft = 1e-10;

/// alpha of the proximal problems that follow on every third of the close paths.
constexpr int kPathsBetween = 3;
constexpr double kProximal[] = {0.3, 0.01};

/// Below this error the states of contacts are known, except at corners of the law: sweeps, and
/// Newton from their result, find the last digits that a path loses where W is singular.
constexpr double kNearly = 1e-9;
constexpr int kFirstPolish = 100, kPolishes = 5; ///< sweeps, twice as many in each round

constexpr double kCache = 2.5e5;     ///< numbers of W that a core has near itself
constexpr double kDearerSweep = 2.5; ///< times that a sweep over more of bodies takes

/// What a sweep costs [ns on one core of 2024].
double sweep_cost(const SolverWork& work, Eigen::Index closed_rows)
{
    const auto rows = static_cast<double>(work.r.size());
    const double products =
        work.columns.is_dense()
            ? (rows * rows > kCache ? 0.35 : 0.12) * rows * static_cast<double>(closed_rows)
            : 2.5 * static_cast<double>(work.columns.blocks()) * static_cast<double>(closed_rows) /
                  std::max(rows, 1.0);
    const double sweep = products + 30 * rows;
    const bool far = work.columns.is_of_bodies() && 4.0 * double(work.columns.blocks()) > kCache;
    return far ? kDearerSweep * sweep : sweep;
}

/// What a step of Newton's method costs beside its factor.
double linearising_cost(const SolverWork& work)
{
    return 100 * static_cast<double>(work.r.size());
}

/// Do so many steps of Newton's method cost at least this?
bool steps_cost_at_least(double limit, double steps, const SolverWork& work,
                         ShiftedDelassus& matrix, Eigen::Index closed_rows)
{
    return matrix.costs_at_least(limit / steps - linearising_cost(work), closed_rows);
}

Eigen::Index rows_with_force(const SolverWork& work)
{
    Eigen::Index count = 0;
    for (int i = 0; i < contact_count(work.problem); ++i) {
        const int k = work.columns.first_row(i), rows = work.columns.rows(i);
        if (!work.r.segment(k, rows).isZero(0)) count += rows;
    }
    return count;
}

/// Is there a direction in the null space of W that closes gaps? Tested where a path has not
/// converged.
std::optional<InfeasibilityProof> search_proof(const SolverWork& work)
{
    if (work.problem.W.is_matrix_free()) return {}; // its normal rows cost a product each
    std::vector<Eigen::Index> rows;
    std::vector<Eigen::VectorXd> answers;
    for (double compliance : {kSoft, 4 * kSoft}) {
        const ContactProblem normals = softened_normals(work.problem, compliance, rows);
        SolverOptions options;
        options.tolerance = 1e-10;
        options.max_seconds =
            work.progress.seconds_left(); // after too few iterations there is no proof
        options.stop = work.options.stop;
        SolverWork inner(normals, options, Eigen::VectorXd::Zero(normals.q.size()));
        ShiftedDelassus matrix(inner);
        follow_path(inner, matrix, {.from_afar = true, .steps = 60});
        answers.push_back(inner.progress.best());
    }
    Eigen::VectorXd growth = Eigen::VectorXd::Zero(work.r.size());
    growth(rows) = answers[0] - answers[1];
    return prove_infeasible(work.problem, growth);
}

/// Sweeps while they are the cheapest way.
/// @returns true if the progress ended
bool sweep_while_cheap(SolverWork& work, AcceleratedNsgs& sweeps, ShiftedDelassus& matrix)
{
    const bool network = work.problem.W.is_of_bodies();
    const int batch = network ? kNetworkBatch : kSweepBatch;
    double before = std::numeric_limits<double>::infinity();
    while (true) {
        if (sweeps.advance(batch)) return true;
        const double now = work.progress.best_error();
        const double gained = std::log(before / now);
        before = now;
        if (!std::isfinite(gained)) continue; // the first batch has no rate
        if (!(gained > 0)) return false;
        const double digits = std::log(now / std::max(work.options.tolerance, kSweepRoundOff));
        const Eigen::Index closed = rows_with_force(work);
        const double left =
            (network ? kSlowing : 1) * batch * digits / gained * sweep_cost(work, closed);
        if (!steps_cost_at_least(left, network ? kNetworkSteps : kPathSteps, work, matrix, closed))
            return false;
    }
}

} // namespace

void solve_automatically(SolverWork& work, bool warm)
{
    ShiftedDelassus matrix(work);

    // ---- From a warm start: free steps
    // The states of contacts, which sweeps would find, are those of the start; not in a network of
    // rigid bodies, whose reactions are not unique: full steps diverge.
    const bool network = work.problem.W.is_of_bodies();
    if (warm && !network && !work.problem.W.is_matrix_free() && contact_count(work.problem) > 1) {
        const Eigen::Index closed = rows_with_force(work);
        if (!steps_cost_at_least(kWarmSweeps * sweep_cost(work, closed), kQuickSteps, work, matrix,
                                 closed)) {
            if (follow_path(work, matrix, kFreeNewton)) return;
            matrix.trust();
            work.take_best();
        }
    }

    // ---- Accelerated sweeps
    std::optional<AcceleratedNsgs> sweeps;
    if (!work.problem.W.is_matrix_free()) {
        sweeps.emplace(work);
        if (sweep_while_cheap(work, *sweeps, matrix)) return;
        if (!work.progress.has_time_for(
                1e-9 * (matrix.cost(rows_with_force(work)) + linearising_cost(work)))) {
            sweeps->advance(std::numeric_limits<int>::max());
            return;
        }
    } else if (work.progress.ends(work.r, work.u)) {
        return;
    }
    work.take_best();
    const bool helped = work.progress.best_error() < kHardlyHelped;
    if (helped && !network) {
        if (follow_path(work, matrix, kQuickNewton)) return;
        matrix.trust(); // without rounding, factors of a singular W are no use for later
                        // ones
        work.take_best();
    }

    // ---- Newton's method and the path
    // Where sweeps have hardly reduced the error, their result is no better start than r = 0.
    NewtonPath first = network ? kNetworkPath : NewtonPath{};
    first.from_afar = !helped;
    if (follow_path(work, matrix, first)) return;
    work.take_best();
    if (network && work.progress.best_error() > work.options.acceptable) {
        // Near round-off short steps of all contacts may still converge.
        first.few = 0;
        first.from_afar = false;
        if (follow_path(work, matrix, first)) return;
        work.take_best();
    }
    if (follow_path(work, matrix, kFreeNewton)) return;
    matrix.trust();
    if (work.progress.best_error() <= work.options.acceptable) return;

    // ---- Proof, close paths, proximal problems
    if (std::optional<InfeasibilityProof> proof = search_proof(work)) {
        work.progress.prove(std::move(*proof));
        return;
    }
    double polished = kNearly; // the error that has been polished
    const auto polish = [&] {
        if (!sweeps || !(work.progress.best_error() < polished)) return false;
        for (int round = 0; round < kPolishes; ++round) {
            sweeps->restart();
            if (sweeps->advance(kFirstPolish << round)) return true;
            work.take_best();
            if (follow_path(work, matrix, kQuickNewton)) return true;
            matrix.trust();
            work.take_best();
        }
        polished = work.progress.best_error();
        return false;
    };
    if (polish()) return;
    // Each close path from a remote start: where one folds back the next may not, and each costs
    // less than the methods that follow.
    for (NewtonPath path : kClosePaths) {
        path.from_afar = true;
        if (follow_path(work, matrix, path)) return;
        work.take_best();
        if (work.progress.best_error() <= work.options.acceptable || polish()) return;
    }
    if (follow_path(work, matrix, kFreeNewton)) return;
    matrix.trust();
    if (follow_proximal_paths(work, matrix, kProximal[0])) return;
    work.take_best();
    // Then, from the best iterate, corners of several widths, proximal problems and sweeps in
    // turns.
    int tried = 0;
    for (int round = 0;; ++round)
        for (NewtonPath path : kClosePaths) {
            if (work.progress.best_error() <= work.options.acceptable || polish()) return;
            // In later rounds wide corners come first, by which r leaves its present place.
            for (double widest : {0.3, 1e-3, 0.0}) {
                if (widest == 0.3 && round == 0) continue;
                path.widest = widest;
                work.take_best();
                if (follow_path(work, matrix, path)) return;
            }
            if (++tried % kPathsBetween == 0) {
                const int which = tried / kPathsBetween - 1;
                const double alpha = kProximal[std::size_t(which) % std::size(kProximal)];
                if (follow_proximal_paths(work, matrix, alpha)) return;
            }
            work.take_best();
            if (!sweeps) continue;
            sweeps->restart();
            if (sweeps->advance(kFewSweeps << std::min(round, kDoublings))) return;
            work.take_best();
            if (follow_path(work, matrix, path)) return;
            work.take_best();
        }
}

} // namespace amontons
