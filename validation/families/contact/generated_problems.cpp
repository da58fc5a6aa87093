// Contact problems of every family, judged by the law as it is written; see
// cases/generated-problems.

#include "contact/solvers/solve.hpp"
#include "validation/contact/problem_set.hpp"
#include "validation/families/contact/contact.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons::validation {
namespace {

/// What rounding leaves of u = W r + q, as docs/theory/contact.md counts it.
double floor_of(const Eigen::MatrixXd& W, const Eigen::VectorXd& q, const Eigen::VectorXd& r)
{
    const Eigen::VectorXd terms = W.cwiseAbs() * r.cwiseAbs() + q.cwiseAbs();
    return 50 * std::numeric_limits<double>::epsilon() * terms.norm() / q.norm();
}

/// ||r - P_K(r - rho û)|| / (rho ||q||), rho = rows / trace(W), with nothing of contact/ in it.
double natural_map_error(const Eigen::MatrixXd& W, const Eigen::VectorXd& q,
                         const Eigen::VectorXd& mu, const Eigen::VectorXd& r)
{
    const double rho = double(q.size()) / W.trace();
    const Eigen::VectorXd u = W * r + q;
    double sum = 0;
    for (Eigen::Index i = 0; i < mu.size(); ++i) {
        const Eigen::Vector2d u_t = u.segment<2>(3 * i + 1), r_t = r.segment<2>(3 * i + 1);
        const double n = r[3 * i] - rho * (u[3 * i] + mu[i] * u_t.norm());
        const Eigen::Vector2d t = r_t - rho * u_t;
        double p_n = n;
        Eigen::Vector2d p_t = t;
        if (mu[i] * t.norm() <= -n) { // the polar cone
            p_n = 0;
            p_t.setZero();
        } else if (t.norm() > mu[i] * n) { // the edge
            p_n = (n + mu[i] * t.norm()) / (1 + mu[i] * mu[i]);
            p_t = mu[i] * p_n * t.normalized();
        }
        sum += std::pow(r[3 * i] - p_n, 2) + (r_t - p_t).squaredNorm();
    }
    return std::sqrt(sum) / (rho * q.norm());
}

} // namespace

std::vector<Measured> generated_problems()
{
    std::vector<Measured> rows;
    for (const unsigned seed : {1u, 2u, 3u})
        for (const NamedProblem& p : problem_set(seed)) {
            CondenseOptions dense;
            dense.form = CondenseOptions::Form::matrix;
            dense.dense_above = 0;
            const CondensedProblem condensed(p.problem, dense);
            const ContactProblem& problem = condensed.contact();
            SolverOptions options;
            options.tolerance = 1e-8;
            const ContactSolution s = solve(problem, options);
            const Eigen::MatrixXd& W = problem.W.dense();
            Measured row = at_most(fmt::format("{}, seed {}: error", p.name, seed),
                                   natural_map_error(W, problem.q, problem.mu, s.reaction),
                                   std::max(1e-8, floor_of(W, problem.q, s.reaction)));
            row.note = fmt::format("{} contacts, {}, {:.1e} by the certificate", problem.mu.size(),
                                   name(s.certificate.status), s.certificate.error);
            rows.push_back(std::move(row));
        }
    return rows;
}

} // namespace amontons::validation
