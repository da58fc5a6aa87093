#include "contact/solvers/scaled_problem.hpp"

#include "mesh/base/dense.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace amontons {
namespace {

// Newton's method on a few contacts apart: to a tenth of the limit.
constexpr int kFewSteps = 40, kFewHalvings = 12;
constexpr double kFewEnough = 0.01, kFewSolved = 0.1;

/// A contact's numbers times a factor, padded to three.
Vec3 padded(const double* x, int rows, double factor)
{
    Vec3 own = Vec3::Zero();
    for (int a = 0; a < rows; ++a)
        own[a] = factor * x[a];
    return own;
}

} // namespace

ScaledProblem::ScaledProblem(const SolverWork& work)
    : problem_(work.problem)
    , columns_(work.columns)
    , scale_(work.scale)
    , right_(work.r.size())
    , given_(work.r.size())
{
    force_ = problem_.q.cwiseProduct(scale_).norm();
    if (!(force_ > 0)) force_ = 1;
}

/// |F|^2 of one contact.
double ScaledProblem::own_merit(int contact, const double* r, const double* u,
                                const Smoothing& s) const
{
    const double scale = scale_[columns_.first_row(contact)];
    const double a = 1 / (scale * force_), b = scale / force_;
    switch (kind_of(problem_, contact)) {
    case ContactKind::frictional:
        return smoothed_frictional(problem_.mu[contact], a * Eigen::Map<const Vec3>(r),
                                   b * Eigen::Map<const Vec3>(u), s)
            .squaredNorm();
    case ContactKind::frictionless: {
        const double f = smoothed_frictionless(a * *r, b * *u, s);
        return f * f;
    }
    case ContactKind::bilateral:
        break;
    }
    return s.rho * s.rho * b * b * *u * *u;
}

ScaledProblem::Merit ScaledProblem::merit(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                                          const Smoothing& s) const
{
    double sum = 0, worst = 0;
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int k = columns_.first_row(i);
        const double own = own_merit(i, r.data() + k, u.data() + k, s);
        sum += own;
        worst = std::max(worst, own);
    }
    return {std::sqrt(sum), std::sqrt(worst)};
}

bool ScaledProblem::add_beyond(double limit, std::size_t most, const Eigen::VectorXd& r,
                               const Eigen::VectorXd& u, const Smoothing& s,
                               std::vector<int>& few) const
{
    std::vector<int> found;
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int k = columns_.first_row(i);
        if (own_merit(i, r.data() + k, u.data() + k, s) > limit * limit) found.push_back(i);
    }
    std::vector<int> all;
    std::ranges::set_union(few, found, std::back_inserter(all));
    if (all.size() == few.size() || all.size() > most) return false;
    few = std::move(all);
    return true;
}

/// Of dimensionless numbers.
LinearisedLaw ScaledProblem::own_law(int contact, const Vec3& r, const Vec3& u,
                                     const Smoothing& s) const
{
    switch (kind_of(problem_, contact)) {
    case ContactKind::frictional:
        return linearise_frictional(problem_.mu[contact], r, u, s);
    case ContactKind::frictionless:
        return linearise_frictionless(r[0], u[0], s);
    case ContactKind::bilateral:
        break;
    }
    LinearisedLaw law;
    law.residual[0] = s.rho * u[0];
    return law;
}

double ScaledProblem::linearise(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                                const Smoothing& s, std::vector<LinearisedLaw>& law) const
{
    double sum = 0;
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int k = columns_.first_row(i), rows = columns_.rows(i);
        LinearisedLaw& own = law[static_cast<std::size_t>(i)];
        own = own_law(i, padded(r.data() + k, rows, 1 / (scale_[k] * force_)),
                      padded(u.data() + k, rows, scale_[k] / force_), s);
        sum += own.residual.squaredNorm();
    }
    return std::sqrt(sum);
}

bool ScaledProblem::step(const std::vector<LinearisedLaw>& law, double shift, const Smoothing& s,
                         ShiftedDelassus& matrix, Eigen::VectorXd& direction,
                         Eigen::VectorXd& slope)
{
    if (!matrix.factorise(law, shift)) return false;
    for (int i = 0; i < contact_count(problem_); ++i) {
        const LinearisedLaw& own = law[static_cast<std::size_t>(i)];
        const int k = columns_.first_row(i), rows = columns_.rows(i);
        const Vec3 b = -(own.residual / s.rho + own.D * own.residual);
        for (int a = 0; a < rows; ++a) {
            given_[k + a] = own.open ? -own.residual[a] : 0;
            right_[k + a] = b[a];
        }
    }
    return solve(matrix, direction, slope);
}

/// The step of right_ and given_, in its own units.
bool ScaledProblem::solve(ShiftedDelassus& matrix, Eigen::VectorXd& direction,
                          Eigen::VectorXd& slope) const
{
    direction = given_;
    if (!matrix.solve(right_, direction, slope)) return false;
    direction.array() *= force_ * scale_.array();
    slope.array() *= force_ / scale_.array();
    return direction.allFinite();
}

bool ScaledProblem::solve_few(const std::vector<int>& few, double limit,
                              const std::vector<LinearisedLaw>& law, const Smoothing& s,
                              const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                              ShiftedDelassus& matrix, Eigen::VectorXd& direction,
                              Eigen::VectorXd& slope)
{
    // ---- Linear response to forces on the few
    // Forces f on top of what the linearised laws answer: the changes of r and u are
    // dr = dr0 + A f and du = du0 + B f.
    const ShiftedDelassus::Response answer = matrix.response(few);
    const Eigen::MatrixXd &A = answer.reactions, &B = answer.motions;
    const Eigen::Index rows = A.rows();
    std::vector<int> row; // of the problem
    for (const int i : few)
        for (int a = 0; a < columns_.rows(i); ++a)
            row.push_back(columns_.first_row(i) + a);
    const Eigen::ArrayXd to_r = (scale_(row).array() * force_).inverse(),
                         to_u = scale_(row).array() / force_;
    const Eigen::VectorXd r0 = r(row).array() * to_r, u0 = u(row).array() * to_u,
                          dr0 = direction(row).array() * to_r, du0 = slope(row).array() * to_u;
    const auto each = [&](const auto& work) { // with its place among the rows and their number
        Eigen::Index k = 0;
        for (std::size_t i = 0; i < few.size(); ++i) {
            const int n = columns_.rows(few[i]);
            work(i, k, n);
            k += n;
        }
    };

    // ---- Newton's method on the few
    std::vector<LinearisedLaw> own(few.size());
    Eigen::VectorXd f = Eigen::VectorXd::Zero(rows), next_f, dr, du, right(rows);
    const auto merit = [&](const Eigen::VectorXd& by) {
        dr = dr0 + A * by;
        du = du0 + B * by;
        const Eigen::VectorXd next_r = r0 + dr, next_u = u0 + du;
        double sum = 0;
        each([&](std::size_t i, Eigen::Index k, int n) {
            own[i] = own_law(few[i], padded(next_r.data() + k, n, 1),
                             padded(next_u.data() + k, n, 1), s);
            sum += own[i].residual.squaredNorm();
        });
        return std::sqrt(sum);
    };
    Eigen::MatrixXd system(rows, rows);
    double now = merit(f);
    for (int step = 0; step < kFewSteps && now > kFewSolved * limit; ++step) {
        each([&](std::size_t i, Eigen::Index k, int n) {
            const LinearisedLaw& l = own[i];
            if (l.open) {
                system.middleRows(k, n) = A.middleRows(k, n);
                right.segment(k, n) = -l.residual.head(n);
            } else {
                system.middleRows(k, n) =
                    B.middleRows(k, n) + l.D.topLeftCorner(n, n) * A.middleRows(k, n);
                right.segment(k, n) = -(l.residual / s.rho + l.D * l.residual).head(n);
            }
        });
        const Eigen::VectorXd change = LuFactor(system).solve(right);
        double length = 1, next = 0;
        int halvings = 0;
        for (; halvings <= kFewHalvings; ++halvings, length /= 2) {
            next_f = f + length * change;
            next = merit(next_f);
            if (next < (1 - kFewEnough * length) * now) break;
        }
        if (halvings > kFewHalvings) break;
        f.swap(next_f);
        now = next;
    }
    now = merit(f); // dr and du of this f
    if (!std::isfinite(now)) return false;

    // ---- The same as a right-hand side
    // The same step as that of a linear system whose right-hand side leads there: as exact as any.
    each([&](std::size_t i, Eigen::Index k, int n) {
        const LinearisedLaw& linear = law[static_cast<std::size_t>(few[i])];
        const int first = columns_.first_row(few[i]);
        if (linear.open)
            given_.segment(first, n) = dr.segment(k, n);
        else
            right_.segment(first, n) = du.segment(k, n) +
                                       linear.D.topLeftCorner(n, n) * dr.segment(k, n) +
                                       matrix.shift() * dr.segment(k, n);
    });
    return solve(matrix, direction, slope) && now <= limit;
}

} // namespace amontons
