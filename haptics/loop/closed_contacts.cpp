#include "haptics/loop/proxy_contacts.hpp"

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

std::size_t at(int i)
{
    return static_cast<std::size_t>(i);
}

/// Their reactions, as they are open, slip or stick.
template <class Real>
bool solve_statuses(const ProxyContacts<Real>& contacts, ClosedContacts& closed)
{
    const ReducedOperator<Real>& op = *contacts.op;
    int n = 0;
    for (int k = 0; k < closed.count; ++k) {
        ClosedContact& c = closed.contact[at(k)];
        c.first = n;
        if (c.open) continue;
        const Mat3& axes = contacts.cone[at(c.contact)];
        if (n + (c.sticks ? 3 : 1) > kMostUnknowns) return false;
        for (int a = 0; a < (c.sticks ? 3 : 1); ++a)
            closed.row[at(n++)] = {c.contact, axes.col(a),
                                   c.sticks ? Vec3(axes.col(a)) : Vec3(axes * c.direction)};
    }
    for (int i = 0; i < n; ++i) {
        const ClosedRow& at_i = closed.row[at(i)];
        closed.right[at(i)] = -at_i.equation.dot(contacts.q[at(at_i.contact)]);
        for (int j = 0; j < n; ++j)
            closed.matrix[at(i * kMostUnknowns + j)] =
                at_i.equation.dot(coupling_block(op, at_i.contact, closed.row[at(j)].contact) *
                                  closed.row[at(j)].force);
    }
    if (!eliminate(closed.matrix.data(), closed.right.data(), n, kMostUnknowns)) return false;
    for (int k = 0; k < closed.count; ++k) {
        ClosedContact& c = closed.contact[at(k)];
        if (c.open) continue;
        const double* s = &closed.right[at(c.first)];
        c.r = c.sticks ? Vec3(s[0], s[1], s[2]) : Vec3(s[0] * c.direction);
        if (!c.r.allFinite()) return false;
    }
    return true;
}

/// Opens contacts that pull; those that stick beyond their cone become sliding.
template <class Real> bool leave_cones(const ReducedOperator<Real>& op, ClosedContacts& closed)
{
    bool any = false;
    for (int k = 0; k < closed.count; ++k) {
        ClosedContact& c = closed.contact[at(k)];
        if (c.open) continue;
        const double bound = op.contact[at(c.contact)].mu * c.r[0], t = c.r.tail<2>().norm();
        if (c.r[0] <= 0) {
            any = c.open = true;
        } else if (c.sticks && t > bound) {
            c.sticks = false;
            c.direction << 1, op.contact[at(c.contact)].mu / t * c.r.tail<2>();
            any = true;
        }
    }
    return any;
}

/// Closes contacts that overlap; those that slip along their friction become sticking, and friction
template <class Real>
bool close_penetrating(const ProxyContacts<Real>& contacts, ClosedContacts& closed, double content)
{
    const ReducedOperator<Real>& op = *contacts.op;
    bool any = false;
    for (int k = 0; k < closed.count; ++k) {
        ClosedContact& c = closed.contact[at(k)];
        const Vec3 u = contacts.cone[at(c.contact)].transpose() * slip_of(contacts, c.contact);
        const double t = u.tail<2>().norm();
        if (c.open || c.sticks || t <= content) continue;
        if (u.tail<2>().dot(c.r.tail<2>()) > 0) {
            any = c.sticks = true;
        } else {
            const Eigen::Vector2d next = -op.contact[at(c.contact)].mu / t * u.tail<2>();
            any |= c.r[0] * (next - c.direction.tail<2>()).norm() > content;
            c.direction.tail<2>() = next;
        }
    }
    for (int i = 0; i < op.contacts; ++i) {
        if (!contacts.r[at(i)].isZero(0)) continue;
        const Vec3 u = contacts.cone[at(i)].transpose() * slip_of(contacts, i);
        if (u[0] >= -content) continue;
        int k = 0;
        while (k < closed.count && closed.contact[at(k)].contact != i)
            ++k;
        if (k == kMostUnknowns) return false;
        const double t = u.tail<2>().norm();
        ClosedContact c{i, 0, false, false, Vec3::Zero(), Vec3::UnitX(), Vec3::Zero()};
        if (t > 0) c.direction.tail<2>() = -op.contact[at(i)].mu / t * u.tail<2>();
        if (k < closed.count)
            c.before = closed.contact[at(k)].before;
        else
            ++closed.count;
        closed.contact[at(k)] = c;
        any = true;
    }
    return any;
}

} // namespace

ClosedContacts::ClosedContacts()
    : contact(kMostUnknowns)
    , row(kMostUnknowns)
    , matrix(kMostUnknowns * kMostUnknowns)
    , right(kMostUnknowns)
{
}

template <class Real>
bool solve_closed(ProxyContacts<Real>& contacts, ClosedContacts& closed, double content)
{
    const ReducedOperator<Real>& op = *contacts.op;
    int unknowns = 0;
    closed.count = 0;
    for (int i = 0; i < op.contacts; ++i) {
        if (contacts.r[at(i)].isZero(0)) continue;
        const Vec3 r = contacts.cone[at(i)].transpose() * contacts.r[at(i)];
        const bool sticks = r.tail<2>().norm() < (1 - kInside) * op.contact[at(i)].mu * r[0];
        unknowns += sticks ? 3 : 1;
        if (unknowns > kMostUnknowns || !(r[0] > 0)) return false;
        closed.contact[at(closed.count++)] = {i, 0, sticks, false, contacts.r[at(i)], r / r[0], r};
    }
    bool changed = false;
    for (int round = 0; closed.count > 0 && round < kRounds && solve_statuses(contacts, closed);
         ++round) {
        if (leave_cones(op, closed)) continue;
        for (int k = 0; k < closed.count; ++k) {
            const ClosedContact& c = closed.contact[at(k)];
            const Vec3 next =
                           c.open ? Vec3(Vec3::Zero()) : Vec3(contacts.cone[at(c.contact)] * c.r),
                       change = next - contacts.r[at(c.contact)];
            contacts.r[at(c.contact)] = next;
            add_reaction(contacts, c.contact, change);
        }
        changed = true;
        if (!close_penetrating(contacts, closed, content)) break;
    }
    return changed;
}

template <class Real>
void restore_closed(ProxyContacts<Real>& contacts, const ClosedContacts& closed)
{
    for (int k = 0; k < closed.count; ++k) {
        const ClosedContact& c = closed.contact[at(k)];
        add_reaction(contacts, c.contact, c.before - contacts.r[at(c.contact)]);
        contacts.r[at(c.contact)] = c.before;
    }
}

template bool solve_closed(ProxyContacts<float>&, ClosedContacts&, double);
template bool solve_closed(ProxyContacts<double>&, ClosedContacts&, double);
template void restore_closed(ProxyContacts<float>&, const ClosedContacts&);
template void restore_closed(ProxyContacts<double>&, const ClosedContacts&);

} // namespace amontons
