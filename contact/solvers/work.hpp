#pragma once

#include "contact/solvers/columns.hpp"
#include "contact/solvers/progress.hpp"

#include <cmath>

namespace amontons {

/// Shared state of the solvers of one problem: each continues from the r and u of the one before.
struct SolverWork {
    SolverWork(const ContactProblem& p, const SolverOptions& o, Eigen::VectorXd start)
        : problem(p)
        , options(o)
        , columns(p)
        , progress(p, o)
        , r(std::move(start))
        , u(p.W * r + p.q)
        , scale(p.q.size())
    {
        for (int i = 0; i < contact_count(p); ++i)
            scale.segment(columns.first_row(i), columns.rows(i))
                .setConstant(std::sqrt(progress.natural_map().rho(i)));
    }

    /// Sets r to a reaction, and u = W r + q.
    void take(const Eigen::VectorXd& reaction)
    {
        r = reaction;
        problem.W.apply(r, u);
        u += problem.q;
    }
    /// Returns to the iterate of the least error.
    void take_best() { take(progress.best()); }

    const ContactProblem& problem;
    const SolverOptions& options;
    const Columns columns;
    SolveProgress progress;
    Eigen::VectorXd r; ///< reaction of the current iterate, rows
    Eigen::VectorXd u; ///< W r + q, rows
    /// S, rows [sqrt(N/m)]: r / s and s u are of one size for all contacts, S W S has own blocks of
    /// mean diagonal 1.
    Eigen::VectorXd scale;
};

} // namespace amontons
