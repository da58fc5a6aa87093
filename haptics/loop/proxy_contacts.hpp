#pragma once

#include "contact/solvers/local.hpp"
#include "haptics/loop/columns.hpp"
#include "haptics/reduced_operator.hpp"

#include <vector>

// The contacts of an operator at a pose, in its frame and without dimensions, as the haptic loop
// solves them: by sweeps (proxy_loop.cpp), and those with a force together (closed_contacts.cpp).

namespace amontons {

/// What a tick keeps of each contact of its operator.
template <class Real> struct ProxyContacts {
    /// Numbers that lie on one line of the cache.
    using Line = typename ReducedOperator<Real>::Line;

    const ReducedOperator<Real>* op = nullptr; ///< nullptr: none yet
    AddColumns<Real> add = nullptr;            ///< of columns of W to u
    std::vector<Vec3> r, q;                    ///< q is q(d) with anchor and fading
    std::vector<Vec3> before;                  ///< r of the tick before, 0 if there was none
    std::vector<Mat3> cone;        ///< axes of the turned frame; one where it does not turn
    std::vector<LocalBlock> block; ///< W_ii in the turned frame, prepared
    std::vector<Vec3> anchor;      ///< added to q, in the turned frame: minus the slip so far
    std::vector<Vec3> fade;        ///< the same: what differs from the operator before
    std::vector<double> slip_time; ///< when it last slipped or was open [s]
    std::vector<Line> u;           ///< W r + q, rows in one row
    long products = 0;             ///< columns of contacts times forces, in this tick

    /// Takes the memory for so many contacts.
    void reserve(int most_contacts);
};

/// Gap and slip of a contact.
template <class Real> Vec3 slip_of(const ProxyContacts<Real>& c, int i)
{
    const Real* u = c.u.data()->number + 3 * i;
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
}

/// Adds to u what a change of a reaction does. (The reaction itself is the caller's to change.)
template <class Real> void add_reaction(ProxyContacts<Real>& c, int i, const Vec3& change)
{
    ++c.products;
    const ReducedOperator<Real>& op = *c.op;
    c.add(c.u.data()->number, op.column(3 * i), op.column(3 * i + 1), op.column(3 * i + 2),
          static_cast<Real>(change[0]), static_cast<Real>(change[1]), static_cast<Real>(change[2]),
          op.stride);
}

/// A contact with a force, where those are solved together.
struct ClosedContact {
    int contact = 0, first = 0; ///< first: of its unknowns
    bool sticks = false, open = false;
    Vec3 before;    ///< its reaction when that began, in the operator's frame
    Vec3 direction; ///< of its reaction, per normal force, in the turned frame ...
    Vec3 r;         ///< ... and itself
};
/// An equation of the closed contacts, and its unknown.
struct ClosedRow {
    /// Number of the contact.
    int contact = 0;
    Vec3 equation, force; ///< in the operator's frame
};
/// The contacts with a force and their equations, of fixed capacity.
struct ClosedContacts {
    ClosedContacts(); ///< takes all memory
    std::vector<ClosedContact> contact;
    std::vector<ClosedRow> row;
    std::vector<double> matrix, right; ///< of the equations
    int count = 0;                     ///< of the contacts
};

/// Solves the contacts with a force together, each slipping or sticking as it is.
/// @param content  residual of a contact that need not be solved better [-]
/// @returns false if nothing has changed
template <class Real>
bool solve_closed(ProxyContacts<Real>& contacts, ClosedContacts& closed, double content);
/// Takes back what solve_closed() did last.
template <class Real>
void restore_closed(ProxyContacts<Real>& contacts, const ClosedContacts& closed);

} // namespace amontons
