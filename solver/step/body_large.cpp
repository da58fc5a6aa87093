#include "solver/step/body_stepper.hpp"

#include "mesh/base/phase_timer.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/large/contact_newton.hpp"

#include <fmt/format.h>

// The contact problem of large solids whose contacts are with what does not yield (obstacles,
// driven bodies): without W, by iterations on the solid's own matrix.

namespace amontons {

/// Whether every row is of one body alone, and that an iterative solid.
bool BodyStepper::uses_matrix_free() const
{
    bool any = false;
    int rows = 0;
    for (std::size_t b = 0; b < bodies(); ++b) {
        const SolidBody* solid = system_.refs[b].solid;
        const bool large = solid && solid->iterative();
        any |= large;
        if (!large && !all_.row[b].empty()) return false;
        rows += int(all_.row[b].size());
    }
    return any && rows == all_.count && system_.couplings.empty();
}

bool BodyStepper::solve_without_W()
{
    rows_ = all_;
    B_.assign(bodies(), {});
    const std::size_t n = rows_.chosen.size();
    problem_ = {};
    problem_.mu.resize(Eigen::Index(n));

    // ---- Laws and first reactions
    problem_.kind.resize(n);
    problem_.level = step_.dynamic ? ContactLevel::velocity : ContactLevel::position;
    for (std::size_t i = 0; i < n; ++i) {
        const BodyContact& c = list_.contact[std::size_t(rows_.chosen[i])];
        const double mu = friction_of(system_.finder.pairs(), c);
        problem_.mu[Eigen::Index(i)] = mu;
        problem_.kind[i] = mu > 0 ? ContactKind::frictional : ContactKind::frictionless;
    }
    r_ = warm_start();
    y_.assign(bodies(), {});
    std::vector<Eigen::VectorXd> motion(bodies());
    Eigen::VectorXd compliance = Eigen::VectorXd::Zero(rows_.count),
                    mean = Eigen::VectorXd::Zero(rows_.count);
    const Eigen::VectorXd start = values(rows_);
    const Stopwatch watch;

    // ---- Newton's method on each solid
    for (std::size_t b = 0; b < bodies(); ++b) {
        SolidBody* solid = system_.refs[b].solid;
        if (!solid || !solid->iterative()) {
            y_[b] = free_[b];
            continue;
        }
        LargeContactProblem p;
        const std::span<const std::int32_t> dofs = solid->unknown_dofs();
        p.load = solid->large_load();
        std::vector<Eigen::Triplet<double>> entries;
        for (Eigen::Index j = 0; j < rows_.columns[b].cols(); ++j)
            for (SparseColumns::InnerIterator at(rows_.columns[b], j); at; ++at)
                entries.emplace_back(dofs[std::size_t(at.row())], int(j), at.value());
        p.C.resize(p.load.size(), rows_.columns[b].cols());
        p.C.setFromTriplets(entries.begin(), entries.end());
        const Eigen::Index own = Eigen::Index(rows_.row[b].size());
        p.q.resize(own);
        Eigen::VectorXd r(own);
        for (Eigen::Index i = 0; i < own; ++i) {
            p.q[i] = start[rows_.row[b][std::size_t(i)]];
            r[i] = r_[rows_.row[b][std::size_t(i)]];
        }
        std::vector<double> mu;
        int first = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const BodyContact& c = list_.contact[std::size_t(rows_.chosen[i])];
            if (c.a != int(b) && c.b != int(b)) continue;
            p.kind.push_back(problem_.kind[i]);
            mu.push_back(problem_.mu[Eigen::Index(i)]);
            p.first.push_back(first);
            first += amontons::rows_of(problem_.kind[i]);
        }
        p.mu = Eigen::Map<const Eigen::VectorXd>(mu.data(), Eigen::Index(mu.size()));
        p.times = [solid](const Eigen::VectorXd& y) { return solid->step_times(y); };
        p.diagonal = solid->step_diagonal();
        LargeContactOptions options;
        options.tolerance = 0.5 * options_.tolerance;
        options.stop = options_.stop;
        system_.mean_compliance.resize(bodies(), 0);
        const LargeContactSolution s =
            solve_large_contact(solid->large(), p, r, system_.mean_compliance[b], options);
        report_.iterations += s.newton;
        if (options_.stop && *options_.stop) {
            report_.refusal = "interrupted";
            return false;
        }
        if (!s.converged && s.error > options_.tolerance) {
            report_.refusal =
                !s.fault.empty()
                    ? fmt::format("{}: {}", system_.refs[b].name, s.fault)
                    : fmt::format("{}: contact problem stagnated at an error of {:.1e} after "
                                  "{} iterations, {} of the linear solver",
                                  system_.refs[b].name, s.error, s.newton, s.linear);
            return false;
        }
        system_.mean_compliance[b] = s.mean_compliance;
        y_[b].resize(Eigen::Index(dofs.size()));
        for (std::size_t i = 0; i < dofs.size(); ++i)
            y_[b][Eigen::Index(i)] = s.y[dofs[i]];
        for (Eigen::Index i = 0; i < own; ++i) {
            const int row = rows_.row[b][std::size_t(i)];
            r_[row] = s.r[i];
            compliance[row] = s.compliance[i];
            mean[row] = s.mean_compliance;
        }
    }
    report_.contact_solve += watch.seconds();
    body_force_ = forces(rows_, r_);
    Eigen::VectorXd u = start;
    add_motion(rows_, y_, u);

    // ---- Certificate
    // The certificate needs W r, which is known, and the size of W.
    std::vector<Eigen::Triplet<double>> diagonal;
    for (int i = 0; i < rows_.count; ++i)
        diagonal.emplace_back(i, i, mean[i]);
    MatrixFreeDelassus W;
    W.rows = rows_.count;
    W.blocks.resize(rows_.count, rows_.count);
    W.blocks.setFromTriplets(diagonal.begin(), diagonal.end());
    W.apply = [r = r_, compliance, mean](const Eigen::VectorXd& other, Eigen::VectorXd& out) {
        out = compliance + mean.cwiseProduct(other - r);
    };
    if (rows_.count > 0) problem_.W = Delassus(std::move(W));
    problem_.q = u - compliance;
    take_answer(u);
    return finish_iteration();
}

} // namespace amontons
