#include "contact/solvers/sweeper.hpp"

#include "contact/cone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

/// First shift of a block that has no solution alone, over its largest entry [-].
constexpr double kSweepShift = 1e-2;
/// Rows from which a dense W leaves the cache that a core has to itself.
constexpr Eigen::Index kManyRows = 550;
/// Contacts from which on threads share out a sweep: a colour of them takes longer than its start.
constexpr int kManyContacts = 3000;

} // namespace

Sweeper::Sweeper(SolverWork& work)
    : work_(work)
    , own_(static_cast<std::size_t>(contact_count(work.problem)))
    , blocks_(own_.size())
    , own_weight_(contact_count(work.problem))
    , weight_(contact_count(work.problem))
    , multiplier_(Eigen::VectorXd::Zero(contact_count(work.problem)))
    , seen_(Eigen::VectorXd::Constant(work.r.size(), std::numeric_limits<double>::quiet_NaN()))
{
    const NaturalMapError& map = work.progress.natural_map();
    for (int i = 0; i < contact_count(work.problem); ++i) {
        if (kind_of(work.problem, i) == ContactKind::frictional) {
            own(i) = work.problem.W.block(map.first_row(i), 3);
            block(i) = prepare(own(i));
        }
        const double rho = map.rho(i);
        own_weight_[i] = rho;
        // ||F|| grows with rho, by no more than rho does.
        weight_[i] = std::pow(std::max(rho, map.rho()), 2);
    }
    if (work.columns.is_of_bodies())
        colours_ = colours_of(work.columns, contact_count(work.problem));
    if (!work.columns.is_dense() || work.r.size() < kManyRows) return;
    const Eigen::MatrixXd& W = work.problem.W.dense();
    unit_ = std::ldexp(1, std::ilogb(map.rho()));
    rounded_.resize(static_cast<std::size_t>(W.size()));
    std::transform(W.data(), W.data() + W.size(), rounded_.begin(),
                   [unit = unit_](double x) { return static_cast<float>(unit * x); });
}

void Sweeper::add(int i, const double* change)
{
    if (work_.columns.is_of_bodies()) {
        work_.columns.add_to_bodies(i, change, v_);
        return;
    }
    if (rounded_.empty()) {
        work_.columns.add_to_slots(i, change, u_);
        return;
    }
    const Eigen::Index n = u_.size();
    double* const __restrict u = u_.data();
    const float* const w0 = rounded_.data() + work_.columns.first_row(i) * n;
    if (work_.columns.rows(i) == 1) {
        for (Eigen::Index k = 0; k < n; ++k)
            u[k] += static_cast<double>(w0[k]) * (change[0] / unit_);
        return;
    }
    const float *const w1 = w0 + n, *const w2 = w1 + n;
    const double c0 = change[0] / unit_, c1 = change[1] / unit_, c2 = change[2] / unit_;
    for (Eigen::Index k = 0; k < n; ++k)
        u[k] += static_cast<double>(w0[k]) * c0 + static_cast<double>(w1[k]) * c1 +
                static_cast<double>(w2[k]) * c2;
}

void Sweeper::sweep(double freeze, bool backward)
{
    const int n = contact_count(work_.problem);
    settled_ = freeze * freeze * work_.progress.residuals().squaredNorm() / n;
    own_settled_ = freeze * freeze * worst_;
    watches_ = freeze > 0;
    if (work_.columns.is_of_bodies()) return sweep_bodies(backward);
    worst_ = 0;
    work_.columns.spread(work_.u, u_);
    for (int k = 0; k < n; ++k) {
        const int i = backward ? n - 1 - k : k;
        worst_ = std::max(worst_, visit_if_changed(i));
    }
    work_.columns.collect(u_, work_.u);
}

/// Groups of one colour side by side: they share no body, so the order among them changes nothing.
void Sweeper::sweep_bodies(bool backward)
{
    const Columns& columns = work_.columns;
    const auto read = [&](int i) {
        columns.read(i, work_.r, v_, u_.data() + columns.first_row(i));
    };
    u_.resize(work_.u.size());
    columns.start(work_.r, v_);
    const auto colours = static_cast<int>(colours_.colour.size()) - 1;
    [[maybe_unused]] const int threads =
        contact_count(work_.problem) < kManyContacts ? 1 : work_.options.threads;
    double worst = 0;
#pragma omp parallel num_threads(threads) reduction(max : worst) if (threads > 1)
    {
        for (int c = 0; c < colours; ++c) {
            const auto colour = static_cast<std::size_t>(backward ? colours - 1 - c : c);
            const int begin = colours_.colour[colour], end = colours_.colour[colour + 1];
#pragma omp for schedule(static)
            for (int g = begin; g < end; ++g) {
                const int first = colours_.group[static_cast<std::size_t>(g)];
                const int last = colours_.group[static_cast<std::size_t>(g) + 1] - 1;
                for (int k = first; k <= last; ++k) {
                    const int i =
                        colours_.contact[static_cast<std::size_t>(backward ? first + last - k : k)];
                    read(i);
                    worst = std::max(worst, visit_if_changed(i));
                }
            }
        }
#pragma omp for schedule(static)
        for (int i = 0; i < contact_count(work_.problem); ++i)
            read(i);
    }
    worst_ = worst;
    work_.u = u_;
}

/// Visits a contact that is not settled. @returns  its change squared at its own scale, if requested
double Sweeper::visit_if_changed(int i)
{
    const bool frictional = kind_of(work_.problem, i) == ContactKind::frictional;
    const double* const u = u_.data() + work_.columns.slot(i);
    const int row = work_.columns.first_row(i);
    if (frictional && u[0] >= 0 && work_.r[row] == 0) return 0; // open, as the law requires
    double own = 0;
    double* const seen = seen_.data() + row;
    if (watches_) {
        // How far others have moved it since its last visit. Its residual then was none, and is now
        // rho times this at most, up to mu: far cheaper than the natural map.
        double change = (u[0] - seen[0]) * (u[0] - seen[0]);
        if (frictional)
            change += (u[1] - seen[1]) * (u[1] - seen[1]) + (u[2] - seen[2]) * (u[2] - seen[2]);
        own = change * own_weight_[i];
        if (change * weight_[i] < settled_ && own < own_settled_) return own;
    }
    if (frictional) {
        visit(i);
        seen[1] = u[1];
        seen[2] = u[2];
    } else {
        visit_row(i);
    }
    seen[0] = u[0];
    return own;
}

void Sweeper::visit(int i)
{
    const int row = work_.columns.first_row(i);
    const Eigen::Map<const Vec3> ui(u_.data() + work_.columns.slot(i));
    Eigen::Map<Vec3> ri(work_.r.data() + row);
    const Mat3& A = own(i);
    Vec3 b;
    for (int a = 0; a < 3; ++a)
        b[a] = ui[a] - A(a, 0) * ri[0] - A(a, 1) * ri[1] - A(a, 2) * ri[2];
    double& guess = multiplier_[i];
    LocalReaction local = solve_local(block(i), work_.problem.mu[i], b, guess, true);
    if (local.state == LocalState::unsolved) local = solve_shifted(i, ri, b);
    if (local.state == LocalState::unsolved) return; // r is unchanged: the error shows it
    if (local.state == LocalState::slip) guess = local.multiplier;

    // By components: see solve_local.
    double change[3];
    bool changes = false;
    for (int a = 0; a < 3; ++a) {
        change[a] = local.r[a] - ri[a];
        changes = changes || change[a] != 0;
        ri[a] = local.r[a];
    }
    if (changes) add(i, change);
}

/// A proximal step: A + alpha in place of A, centred at the last reaction, so that a fixed point
/// is one of the problem itself. For a block that has no solution alone (A_nn = 0, a wedge that
/// locks), which may have one after its neighbours change.
LocalReaction Sweeper::solve_shifted(int i, const Vec3& ri, const Vec3& b) const
{
    const Mat3& A = own(i);
    const double size = A.cwiseAbs().maxCoeff();
    double alpha = size > 0 ? kSweepShift * size : 1 / work_.progress.natural_map().rho();
    LocalReaction local;
    for (int k = 0; k < 6 && local.state == LocalState::unsolved; ++k, alpha *= 10)
        local =
            solve_local(prepare(A + alpha * Mat3::Identity()), work_.problem.mu[i], b - alpha * ri);
    return local;
}

/// Frictionless and bilateral rows.
void Sweeper::visit_row(int i)
{
    double& r = work_.r[work_.columns.first_row(i)];
    // rho of one row is 1 / W_ii
    double next = r - u_[work_.columns.slot(i)] * work_.progress.natural_map().rho(i);
    if (kind_of(work_.problem, i) == ContactKind::frictionless) next = std::max(0.0, next);
    const double change = next - r;
    if (change == 0) return;
    r = next;
    add(i, &change);
}

} // namespace amontons
