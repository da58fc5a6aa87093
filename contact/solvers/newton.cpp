#include "contact/solvers/newton.hpp"

#include "contact/solvers/nsgs.hpp"
#include "contact/solvers/scaled_problem.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

// The line search: a step is taken if it lowers the largest of the last merits.
constexpr int kMemory = 4;
constexpr int kHalvings = 6;
constexpr double kEnough = 0.01;
/// Times that the few contacts that a step would leave off the path are solved apart: others may
/// join them.
constexpr int kNewtonRounds = 3;
// The Levenberg-Marquardt shift, relative to the scaled W's diagonal.
constexpr double kFirstShift = 1e-6, kLargestShift = 1, kSmallestShift = 1e-12;
constexpr double kRaise = 10, kLower = 0.1;
constexpr double kHeldShift = 1e-4; ///< least one after a few contacts have not been solved apart
constexpr double kFloor = 1e-12;    ///< always there: stick contacts of a singular W need it
/// The same of bodies, whose network has many such: a lower one leaves reactions that W does not
/// distinguish diverging against each other.
constexpr double kFloorOfBodies = 1e-6;
constexpr double kShort = 0.1, kLong = 0.5;
constexpr double kWiden = 10;
/// Full steps may diverge along the null space of W: they end when r is so many times what it was,
/// and what the diagonal of W would require. Larger ones would give less than 1e-9 of the motion,
/// and rounding would pass for a solution.
constexpr double kRunAway = 1e4;

Eigen::Index rows_of_closed(const Columns& columns, const std::vector<LinearisedLaw>& law)
{
    Eigen::Index count = 0;
    for (std::size_t i = 0; i < law.size(); ++i)
        if (!law[i].open) count += columns.rows(static_cast<int>(i));
    return count;
}

} // namespace

bool follow_path(SolverWork& work, ShiftedDelassus& matrix, const NewtonPath& path)
{
    return follow_path(work, matrix, path, {}) == PathEnd::over;
}

PathEnd follow_path(SolverWork& work, ShiftedDelassus& matrix, const NewtonPath& path,
                    const Proximal& proximal)
{
    const ContactProblem& problem = work.problem;
    SolveProgress& progress = work.progress;
    Eigen::VectorXd &r = work.r, &u = work.u;
    const Columns& columns = work.columns;
    ScaledProblem scaled(work);

    // ---- Scales, law and shift
    // The law is between r and v = u + alpha S^-2 (r - centre).
    const bool near_centre = proximal.alpha > 0;
    Eigen::VectorXd stiffness, v;
    if (near_centre) stiffness = proximal.alpha * work.scale.array().square().inverse();
    const auto seen = [&](const Eigen::VectorXd& at,
                          const Eigen::VectorXd& motion) -> const Eigen::VectorXd& {
        if (!near_centre) return motion;
        v = motion + stiffness.cwiseProduct(at - proximal.centre);
        return v;
    };

    const double floor = problem.W.is_of_bodies() ? kFloorOfBodies : kFloor;
    const int n = contact_count(problem);
    const double root_n = std::sqrt(static_cast<double>(std::max(n, 1)));
    Eigen::VectorXd direction(r.size()), slope(r.size()), next_r(r.size()), next_u(r.size());
    std::vector<LinearisedLaw> law(static_cast<std::size_t>(n));

    Smoothing smoothing;
    smoothing.rho = path.rho;
    smoothing.spread = path.spread;
    // A dense factor gets cheaper with each contact left out; a sparse one hardly, and a packing
    // with many redundant contacts needs the weak ones.
    smoothing.open = problem.W.is_dense() ? 1e-2 : 1e-6;
    const double widest = 1 / root_n;

    // ---- First epsilon
    if (path.smooth)
        smoothing.epsilon =
            path.from_afar ? widest
                           : std::min(widest, std::max(path.widest,
                                                       scaled.merit(r, seen(r, u), smoothing).all) /
                                                  root_n);
    if (path.smooth && path.from_afar) {
        r.setZero();
        for (int i = 0; i < n; ++i)
            if (const int k = columns.first_row(i); kind_of(problem, i) != ContactKind::bilateral)
                r[k] = widest * work.scale[k] * scaled.force();
        u = problem.W * r + problem.q;
    }

    const double largest = kRunAway * std::max(1.0, scaled.size(r));
    double shift = 0;
    double recent[kMemory] = {};
    int known = 0, rejected = 0;
    double lowest = std::numeric_limits<double>::infinity(); // epsilon, reached at this step
    int lowest_at = 0;
    std::vector<int> few;
    bool held = false; // by a few contacts that have not been solved apart

    // ---- Steps along the path
    for (int steps = 0; !progress.ends(r, u, true); ++steps) {
        if (smoothing.epsilon < lowest) {
            lowest = smoothing.epsilon;
            lowest_at = steps;
        }
        if (steps == path.steps || steps - lowest_at > path.patience) return PathEnd::lost;
        const double merit = scaled.linearise(r, seen(r, u), smoothing, law);
        if (!progress.has_time_for(1e-9 * matrix.cost(rows_of_closed(columns, law))))
            return PathEnd::over;
        if (rejected == 0) recent[known++ % kMemory] = merit;
        const double reference = *std::max_element(recent, recent + std::min(known, kMemory));

        double length = 0;
        ScaledProblem::Merit reached;
        if (scaled.step(law, proximal.alpha + std::max(shift, floor), smoothing, matrix, direction,
                        slope)) {
            few.clear();
            held = false;
            for (int round = 0; path.few > 0 && round < kNewtonRounds && !held; ++round) {
                next_r = r + direction;
                next_u = u + slope;
                const double limit = path.worst * smoothing.epsilon;
                if (!scaled.add_beyond(limit, path.few, next_r, seen(next_r, next_u), smoothing,
                                       few))
                    break;
                held = !scaled.solve_few(few, limit, law, smoothing, r, seen(r, u), matrix,
                                         direction, slope);
            }
            double trial = 1;
            for (int k = 0; k <= (held ? 0 : kHalvings); ++k, trial /= 2) {
                next_r = r + trial * direction;
                next_u = u + trial * slope;
                reached = scaled.merit(next_r, seen(next_r, next_u), smoothing);
                if (path.free || reached.all < (1 - kEnough * trial) * reference) {
                    length = trial;
                    break;
                }
            }
        }
        if (length == 0) {
            shift =
                std::min(std::max(kRaise * shift, held ? kHeldShift : kFirstShift), kLargestShift);
            if (++rejected > path.rejections) {
                if (!path.smooth) return PathEnd::lost;
                smoothing.epsilon =
                    std::min(kWiden * smoothing.epsilon, std::max(0.1 * widest, smoothing.epsilon));
                known = rejected = 0;
            }
            continue;
        }
        if (path.free && scaled.size(next_r) > largest) return PathEnd::lost;
        rejected = 0;
        r.swap(next_r);
        u.swap(next_u);
        if (held) {
            shift = std::max(shift, kHeldShift);
        } else if (length >= kLong) {
            shift *= kLower;
            if (shift < kSmallestShift) shift = 0;
        } else if (length < kShort) {
            shift = std::min(std::max(kRaise * shift, kFirstShift), kLargestShift);
        }
        const double solved = path.closeness * root_n * smoothing.epsilon;
        if (path.smooth && reached.all < solved &&
            reached.worst <= path.worst * smoothing.epsilon) {
            if (near_centre && root_n * smoothing.epsilon <= proximal.target)
                return PathEnd::arrived;
            const double further =
                length == 1 ? std::max(path.fastest, std::sqrt(reached.all / solved)) : 1;
            smoothing.epsilon *= std::min(path.reduction, further);
            known = 0;
        }
    }
    return PathEnd::over;
}

void solve_by_newton(SolverWork& work)
{
    ShiftedDelassus matrix(work);
    if (work.problem.W.is_matrix_free()) {
        follow_path(work, matrix, {.smooth = false});
        return;
    }
    AcceleratedNsgs sweeps(work);
    for (int budget = 10; !sweeps.advance(budget); budget *= 2) {
        if (follow_path(work, matrix, {.smooth = false})) return;
        work.take_best();
        sweeps.restart();
    }
}

void solve_by_path(SolverWork& work, bool warm)
{
    ShiftedDelassus matrix(work);
    if (warm && follow_path(work, matrix, {})) return;
    if (follow_path(work, matrix, {.from_afar = true})) return;
    for (NewtonPath path : kClosePaths) {
        path.from_afar = true;
        if (follow_path(work, matrix, path)) return;
    }
}

} // namespace amontons
