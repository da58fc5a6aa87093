#include "contact/solvers/sweeper.hpp"

#include "contact/cone.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// First shift of a block that has no solution alone, over its largest entry [-].
constexpr double kShift = 1e-2;

} // namespace

Sweeper::Sweeper(SolverWork& work)
    : work_(work)
    , own_(static_cast<std::size_t>(contact_count(work.problem)))
    , blocks_(own_.size())
    , own_weight_(contact_count(work.problem))
    , weight_(contact_count(work.problem))
{
    const NaturalMapError& map = work.progress.natural_map();
    for (int i = 0; i < contact_count(work.problem); ++i) {
        if (kind_of(work.problem, i) == ContactKind::frictional) {
            own(i) = work.problem.W.block(map.first_row(i), 3);
            block(i) = prepare(own(i));
        }
        const double rho = map.rho(i);
        own_weight_[i] = 1 / std::sqrt(rho);
        // ||F|| grows with rho, by no more than rho does.
        weight_[i] = std::max(1.0, map.rho() / rho);
    }
}

void Sweeper::sweep(double freeze, bool backward)
{
    const NaturalMapError& map = work_.progress.natural_map();
    const int n = contact_count(work_.problem);
    const double settled = freeze * work_.progress.residuals().norm() / std::sqrt(n);
    const double own_settled = freeze * worst_;
    worst_ = 0;
    for (int k = 0; k < n; ++k) {
        const int i = backward ? n - 1 - k : k;
        const double residual = map.residual(i, work_.r, work_.u, map.rho(i));
        worst_ = std::max(worst_, residual * own_weight_[i]);
        if (residual * weight_[i] < settled && residual * own_weight_[i] < own_settled) continue;
        if (kind_of(work_.problem, i) == ContactKind::frictional)
            visit(i);
        else
            visit_row(i);
    }
}

void Sweeper::visit(int i)
{
    const int row = work_.columns.first_row(i);
    if (work_.u[row] >= 0 && work_.r[row] == 0) return; // open, and right
    const Vec3 ri = work_.r.segment<3>(row), ui = work_.u.segment<3>(row);
    const double rt = ri.tail<2>().norm();
    const double guess = rt > 0 ? ui.tail<2>().norm() / rt : 0;
    const Vec3 b = ui - own(i) * ri;
    LocalReaction local = solve_local(block(i), work_.problem.mu[i], b, guess);
    if (local.state == LocalState::unsolved) local = solve_shifted(i, ri, b);
    if (local.state == LocalState::unsolved) return; // r stays: the certificate will tell

    const Vec3 change = local.r - ri;
    if (change.isZero(0)) return;
    work_.r.segment<3>(row) = local.r;
    work_.columns.add(i, change.data(), work_.u);
}

/// A proximal step: A + alpha in place of A, centred at the last reaction, so that a fixed point
/// is one of the problem itself. For a block that has no solution alone (A_nn = 0, a wedge that
/// locks), whose neighbours may yet help.
LocalReaction Sweeper::solve_shifted(int i, const Vec3& ri, const Vec3& b) const
{
    const Mat3& A = own(i);
    const double size = A.cwiseAbs().maxCoeff();
    double alpha = size > 0 ? kShift * size : 1 / work_.progress.natural_map().rho();
    LocalReaction local;
    for (int k = 0; k < 6 && local.state == LocalState::unsolved; ++k, alpha *= 10)
        local =
            solve_local(prepare(A + alpha * Mat3::Identity()), work_.problem.mu[i], b - alpha * ri);
    return local;
}

/// Frictionless and bilateral rows.
void Sweeper::visit_row(int i)
{
    const int row = work_.columns.first_row(i);
    // rho of one row is 1 / W_ii
    double wanted = work_.r[row] - work_.u[row] * work_.progress.natural_map().rho(i);
    if (kind_of(work_.problem, i) == ContactKind::frictionless) wanted = std::max(0.0, wanted);
    const double change = wanted - work_.r[row];
    if (change == 0) return;
    work_.r[row] = wanted;
    work_.columns.add(i, &change, work_.u);
}

} // namespace amontons
