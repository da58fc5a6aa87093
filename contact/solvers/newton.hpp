#pragma once

#include "contact/solvers/shifted_delassus.hpp"

namespace amontons {

/// How a Newton solver walks.
struct NewtonPath {
    bool smooth = true;     ///< round the corners of the law and let the rounding go to zero;
                            ///< false: semismooth Newton on the law itself
    bool from_afar = false; ///< begin with corners as wide as the problem, not as the error
    /// From near, corners are at least this wide at the start: the error may be small while the
    /// contacts that decide are all at a corner [-].
    double widest = 1e-3;
    double reduction = 0.3; ///< of the rounding, when its equation is solved [-]
    double rho = 3;         ///< weight of u beside r [-]
    double spread = 3;      ///< rounding of friction's discs over that of the normal law [-]
    int steps = 100;        ///< at most
};

/// Newton on the law of Alart & Curnier, all contacts together, along the path of its smoothings.
///
/// r_n u_n = epsilon^2 and s ((mu r_n)^2 - |r_t|^2) ~ epsilon^2 with u_t = -s r_t: a central path
/// as of an interior-point method, but the iterates need not stay inside, so it starts anywhere.
/// Levenberg-Marquardt shift where the line search fails. Insensitive to contrasts of stiffness
/// and mass; singular W is no obstacle.
/// Cost of a step: one factor of ShiftedDelassus, 10 to 40 steps.
/// @returns true if the progress ended, false if the path leads no further
bool follow_path(SolverWork& work, ShiftedDelassus& matrix, const NewtonPath& path);

/// The solvers of that name. `newton` is semismooth: it begins with sweeps, for far from the
/// solution it leads nowhere; more sweeps where it fails.
void solve_by_newton(SolverWork& work);
void solve_by_path(SolverWork& work, bool warm);

} // namespace amontons
