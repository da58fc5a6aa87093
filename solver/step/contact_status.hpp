#pragma once

#include "solver/step/wire_newton.hpp"

#include <algorithm>

// Pivoting of one contact: the rows of its status, whether the result of a trial is consistent with
// it, and the next status if not.

namespace amontons {

/// Multiplier weights relative to the wire's own stiffness (WireMaterial::stiffness). They change
/// the linear systems' conditioning and the number of iterations, never the solution: the
/// reaction is r - rho (g + H dx), exact when the gap is zero.
constexpr double kRhoNormal = 1e4;
/// Weight of a sticking row, times EI/l^3 (factor).
constexpr double kRhoStick = 1e4;
constexpr double kRhoSlip = 0.3; ///< of the slip direction's predictor r_t - rho u_t

/// Weight of a normal row: springs of a foundation lie behind the contact [N/m].
inline double normal_weight(const Candidate& c)
{
    return 1 / (c.compliance + 1 / (kRhoNormal * std::max(c.stiffness, c.held[0])));
}
/// Weight of a sticking row [N/m].
inline double stick_weight(const Candidate& c)
{
    return kRhoStick * std::max(c.stiffness, c.held[1]);
}

/// State of a contact in a trial.
using Trial = NewtonWorkspace::Trial;

/// How the status of a contact must change.
struct Change {
    /// Changes of a state.
    enum Kind { none, open, close, stick, slip, turn } kind = none;
    /// How much the state is violated (relative).
    double size = 0;
};

/// The change of status that the result of a trial requires; none if they are consistent.
/// @param force, length  violations below these do not count [N], [m]
Change violation(const Candidate& c, const Trial& t, double force, double length);

/// Applies a change to the state of a contact.
void change(const Candidate& c, Trial& t, Change::Kind kind);

/// Status to start with, from the reactions that the iterate has.
void initial_status(const Candidate& c, Trial& t);

} // namespace amontons
