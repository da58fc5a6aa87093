#include "haptics/loop/proxy_loop.hpp"

#include <algorithm>
#include <cmath>

// Sweeps change one contact at a time. Where a wire rolls along a wall, one contact passes its
// force to the next and all others have to follow, a little each time: thousands of sweeps do not
// converge. So between two sweeps the closed contacts are solved together, each slipping or
// sticking as the sweep left it. With n the normal and p the direction of its reaction,
//
//     slips:   r_i = s_i p_i,   n_i . u_i = 0          one unknown
//     sticks:                         u_i = 0          three
//
// What would pull opens, what would overlap closes, what leaves its cone slips, and what slips
// along its friction sticks; then the others are solved again. Directions of slip are left to the
// sweeps.

namespace amontons {
namespace {

constexpr int kMostUnknowns = 48; // their system takes 50 us
constexpr int kRounds = 8;        // of solving them again
constexpr double kSmallPivot = 1e-12;
constexpr double kInside = 1e-9; // of a cone: a contact that sticks

/// Elimination with row pivots; the solution is left in b.
/// @param A  by rows, `stride` apart
bool eliminate(double* A, double* b, int n, int stride)
{
    for (int k = 0; k < n; ++k) {
        int best = k;
        for (int i = k + 1; i < n; ++i)
            if (std::abs(A[i * stride + k]) > std::abs(A[best * stride + k])) best = i;
        if (!(std::abs(A[best * stride + k]) > kSmallPivot)) return false;
        if (best != k) {
            std::swap_ranges(A + best * stride + k, A + best * stride + n, A + k * stride + k);
            std::swap(b[best], b[k]);
        }
        for (int i = k + 1; i < n; ++i) {
            const double f = A[i * stride + k] / A[k * stride + k];
            for (int j = k + 1; j < n; ++j)
                A[i * stride + j] -= f * A[k * stride + j];
            b[i] -= f * b[k];
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        for (int j = k + 1; j < n; ++j)
            b[k] -= A[k * stride + j] * b[j];
        b[k] /= A[k * stride + k];
    }
    return true;
}

/// W_ij
template <class Real> Mat3 coupling_block(const ReducedOperator<Real>& op, int i, int j)
{
    Mat3 W;
    for (int k = 0; k < 3; ++k)
        for (int a = 0; a < 3; ++a)
            W(a, k) = static_cast<double>(op.column(3 * j + k)[3 * i + a]);
    return W;
}

} // namespace

template <class Real> void ProxyLoop<Real>::reserve_closed()
{
    closed_.resize(kMostUnknowns);
    row_.resize(kMostUnknowns);
    matrix_.resize(kMostUnknowns * kMostUnknowns);
    right_.resize(kMostUnknowns);
}

/// Solves the closed contacts together.
/// @returns false if nothing has changed
template <class Real> bool ProxyLoop<Real>::solve_closed()
{
    int unknowns = 0;
    closed_count_ = 0;
    for (int i = 0; i < op_->contacts; ++i) {
        if (r_[at(i)].isZero(0)) continue;
        const Vec3 r = cone_[at(i)].transpose() * r_[at(i)];
        const bool sticks = r.tail<2>().norm() < (1 - kInside) * contact(i).mu * r[0];
        unknowns += sticks ? 3 : 1;
        if (unknowns > kMostUnknowns || !(r[0] > 0)) return false;
        closed_[at(closed_count_++)] = {i, 0, sticks, false, r_[at(i)], r / r[0], r};
    }
    bool changed = false;
    for (int round = 0; closed_count_ > 0 && round < kRounds && solve_statuses(); ++round) {
        if (leave_cones()) continue;
        for (int k = 0; k < closed_count_; ++k) {
            const ClosedContact& c = closed_[at(k)];
            const Vec3 next = c.open ? Vec3(Vec3::Zero()) : Vec3(cone_[at(c.contact)] * c.r),
                       change = next - r_[at(c.contact)];
            r_[at(c.contact)] = next;
            add_reaction(c.contact, change);
        }
        changed = true;
        if (!close_penetrating()) break;
    }
    return changed;
}

/// Their reactions, as they are open, slip or stick.
template <class Real> bool ProxyLoop<Real>::solve_statuses()
{
    int n = 0;
    for (int k = 0; k < closed_count_; ++k) {
        ClosedContact& c = closed_[at(k)];
        c.first = n;
        if (c.open) continue;
        const Mat3& axes = cone_[at(c.contact)];
        if (n + (c.sticks ? 3 : 1) > kMostUnknowns) return false;
        for (int a = 0; a < (c.sticks ? 3 : 1); ++a)
            row_[at(n++)] = {c.contact, axes.col(a),
                             c.sticks ? Vec3(axes.col(a)) : Vec3(axes * c.direction)};
    }
    for (int i = 0; i < n; ++i) {
        const ClosedRow& at_i = row_[at(i)];
        right_[at(i)] = -at_i.equation.dot(q_[at(at_i.contact)]);
        for (int j = 0; j < n; ++j)
            matrix_[at(i * kMostUnknowns + j)] = at_i.equation.dot(
                coupling_block(*op_, at_i.contact, row_[at(j)].contact) * row_[at(j)].force);
    }
    if (!eliminate(matrix_.data(), right_.data(), n, kMostUnknowns)) return false;
    for (int k = 0; k < closed_count_; ++k) {
        ClosedContact& c = closed_[at(k)];
        if (c.open) continue;
        const double* s = &right_[at(c.first)];
        c.r = c.sticks ? Vec3(s[0], s[1], s[2]) : Vec3(s[0] * c.direction);
        if (!c.r.allFinite()) return false;
    }
    return true;
}

/// Opens contacts that pull; those that stick beyond their cone become sliding.
template <class Real> bool ProxyLoop<Real>::leave_cones()
{
    bool any = false;
    for (int k = 0; k < closed_count_; ++k) {
        ClosedContact& c = closed_[at(k)];
        if (c.open) continue;
        const double bound = contact(c.contact).mu * c.r[0], t = c.r.tail<2>().norm();
        if (c.r[0] <= 0) {
            any = c.open = true;
        } else if (c.sticks && t > bound) {
            c.sticks = false;
            c.direction << 1, contact(c.contact).mu / t * c.r.tail<2>();
            any = true;
        }
    }
    return any;
}

/// Closes contacts that overlap; those that slip along their friction become sticking, and friction
template <class Real> bool ProxyLoop<Real>::close_penetrating()
{
    const double content = 0.5 * options_.tolerance * size_;
    bool any = false;
    for (int k = 0; k < closed_count_; ++k) {
        ClosedContact& c = closed_[at(k)];
        const Vec3 u = cone_[at(c.contact)].transpose() * slip(c.contact);
        const double t = u.tail<2>().norm();
        if (c.open || c.sticks || t <= content) continue;
        if (u.tail<2>().dot(c.r.tail<2>()) > 0) {
            any = c.sticks = true;
        } else {
            const Eigen::Vector2d next = -contact(c.contact).mu / t * u.tail<2>();
            any |= c.r[0] * (next - c.direction.tail<2>()).norm() > content;
            c.direction.tail<2>() = next;
        }
    }
    for (int i = 0; i < op_->contacts; ++i) {
        if (!r_[at(i)].isZero(0)) continue;
        const Vec3 u = cone_[at(i)].transpose() * slip(i);
        if (u[0] >= -content) continue;
        int k = 0;
        while (k < closed_count_ && closed_[at(k)].contact != i)
            ++k;
        if (k == kMostUnknowns) return false;
        const double t = u.tail<2>().norm();
        ClosedContact c{i, 0, false, false, Vec3::Zero(), Vec3::UnitX(), Vec3::Zero()};
        if (t > 0) c.direction.tail<2>() = -contact(i).mu / t * u.tail<2>();
        if (k < closed_count_)
            c.before = closed_[at(k)].before;
        else
            ++closed_count_;
        closed_[at(k)] = c;
        any = true;
    }
    return any;
}

/// Takes back what solve_closed() did last.
template <class Real> void ProxyLoop<Real>::restore_closed()
{
    for (int k = 0; k < closed_count_; ++k) {
        const ClosedContact& c = closed_[at(k)];
        add_reaction(c.contact, c.before - r_[at(c.contact)]);
        r_[at(c.contact)] = c.before;
    }
}

template void ProxyLoop<float>::reserve_closed();
template bool ProxyLoop<float>::solve_closed();
template bool ProxyLoop<float>::solve_statuses();
template bool ProxyLoop<float>::leave_cones();
template bool ProxyLoop<float>::close_penetrating();
template void ProxyLoop<float>::restore_closed();
template void ProxyLoop<double>::reserve_closed();
template bool ProxyLoop<double>::solve_closed();
template bool ProxyLoop<double>::solve_statuses();
template bool ProxyLoop<double>::leave_cones();
template bool ProxyLoop<double>::close_penetrating();
template void ProxyLoop<double>::restore_closed();

} // namespace amontons
