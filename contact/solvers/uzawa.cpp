#include "contact/solvers/uzawa.hpp"

#include "contact/cone.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

// The change of rho * û over that of r, in the norms that make both forces: below one the step
// contracts. Between the two bounds rho is unchanged.
constexpr double kTooFast = 0.9;
constexpr double kTooSlow = 0.3;
constexpr double kShrink = 2.0 / 3, kGrow = 1.5;
constexpr int kMaxShrinks = 60;

/// The projected step of one contact, written into next.
void step(const ContactProblem& problem, const NaturalMapError& map, int i, double rho,
          const Eigen::VectorXd& r, const Eigen::VectorXd& u, Eigen::VectorXd& next)
{
    const int k = map.first_row(i);
    switch (kind_of(problem, i)) {
    case ContactKind::frictional: {
        const double mu = problem.mu[i];
        const Vec3 predicted = r.segment<3>(k) - rho * shifted_slip(u.segment<3>(k), mu);
        next.segment<3>(k) = project_cone(predicted, mu);
        break;
    }
    case ContactKind::frictionless:
        next[k] = std::max(0.0, r[k] - rho * u[k]);
        break;
    case ContactKind::bilateral:
        next[k] = r[k] - rho * u[k];
        break;
    }
}

/// 1 / |W_ii|: the largest rho for which the step of one contact alone cannot expand.
Eigen::VectorXd own_block_rho(const ContactProblem& problem, const NaturalMapError& map)
{
    Eigen::VectorXd rho(contact_count(problem));
    for (int i = 0; i < contact_count(problem); ++i) {
        const int k = map.first_row(i), rows = rows_of(kind_of(problem, i));
        const double size = problem.W.block(k, rows).norm();
        rho[i] = size > 0 ? 1 / size : map.rho();
    }
    return rho;
}

/// Contact after contact, each with its own constant rho.
void iterate_own_block(SolverWork& work, double factor)
{
    const ContactProblem& problem = work.problem;
    Eigen::VectorXd &r = work.r, &u = work.u;
    const NaturalMapError& map = work.progress.natural_map();
    const Eigen::VectorXd rho = factor * own_block_rho(problem, map);
    Eigen::VectorXd next = r;
    while (!work.progress.ends(r, u))
        for (int i = 0; i < contact_count(problem); ++i) {
            step(problem, map, i, rho[i], r, u, next);
            const int k = map.first_row(i), rows = rows_of(kind_of(problem, i));
            const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> change =
                next.segment(k, rows) - r.segment(k, rows);
            if (change.isZero(0)) continue;
            r.segment(k, rows) = next.segment(k, rows);
            work.columns.add(i, change.data(), u);
        }
}

/// All contacts at once. A common factor on rho shrinks until the step contracts, and grows again.
void iterate_adaptive(SolverWork& work, double factor)
{
    const ContactProblem& problem = work.problem;
    Eigen::VectorXd &r = work.r, &u = work.u;
    const NaturalMapError& map = work.progress.natural_map();
    const Eigen::VectorXd rho = own_block_rho(problem, map);
    Eigen::VectorXd next_r = r, next_u = u;
    while (!work.progress.ends(r, u)) {
        double rate = 0;
        for (int shrinks = 0; shrinks < kMaxShrinks; ++shrinks) {
            for (int i = 0; i < contact_count(problem); ++i)
                step(problem, map, i, factor * rho[i], r, u, next_r);
            next_u = problem.q;
            next_u += problem.W * next_r;

            double change_of_r = 0, change_of_u = 0;
            for (int i = 0; i < contact_count(problem); ++i) {
                const int k = map.first_row(i), rows = rows_of(kind_of(problem, i));
                const double dr = (next_r - r).segment(k, rows).squaredNorm();
                double du = (next_u - u).segment(k, rows).squaredNorm();
                if (rows == 3)
                    du = (shifted_slip(next_u.segment<3>(k), problem.mu[i]) -
                          shifted_slip(u.segment<3>(k), problem.mu[i]))
                             .squaredNorm();
                change_of_r += dr / rho[i];
                change_of_u += du * rho[i];
            }
            rate = change_of_r > 0 ? factor * std::sqrt(change_of_u / change_of_r) : 1;
            if (rate <= kTooFast || change_of_r == 0) break;
            factor *= kShrink;
        }
        r.swap(next_r);
        u.swap(next_u);
        if (rate < kTooSlow) factor *= kGrow;
    }
}

} // namespace

void solve_uzawa(SolverWork& work)
{
    const SolverOptions::Uzawa& options = work.options.uzawa;
    // Without columns, all contacts at once is the only way.
    if (options.rho == SolverOptions::Uzawa::Rho::adaptive || work.problem.W.is_matrix_free())
        iterate_adaptive(work, options.factor);
    else
        iterate_own_block(work, options.factor);
}

} // namespace amontons
