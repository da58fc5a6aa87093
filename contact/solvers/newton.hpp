#pragma once

#include "contact/solvers/shifted_delassus.hpp"

#include <limits>

namespace amontons {

/// A term alpha (r - centre) beside W r + q, each contact in its own scale: what is followed is
/// then the path of that easier problem. Its solution is the problem's own where r is the centre.
struct Proximal {
    double alpha = 0;       ///< over an own block's mean diagonal, > 0 [-]
    Eigen::VectorXd centre; ///< rows [N]
    double target = 0;      ///< rounding over all contacts at which the path has arrived [-]
};

/// How a Newton solver walks.
struct NewtonPath {
    bool smooth = true;     ///< round the corners of the law and let the rounding tend to zero;
                            ///< false: semismooth Newton on the law itself
    bool from_afar = false; ///< begin with corners as wide as the problem, not as the error
    /// From near, corners are at least this wide at the start: the error may be small while the
    /// contacts that decide are all at a corner [-].
    double widest = 1e-3;
    double reduction = 0.3; ///< of the rounding, when its equation is solved [-]
    double closeness = 1;   ///< ||F|| over the rounding of all contacts at which it is solved [-]
    /// and no contact alone is further from its own, in a rounding [-]
    double worst = std::numeric_limits<double>::infinity();
    double fastest = 1e-3; ///< least reduction at once, when a full step lands far below that [-]
    double rho = 3;        ///< weight of u beside r [-]
    double spread = 3;     ///< rounding of friction's discs over that of the normal law [-]
    /// So many contacts at most that a full step leaves further than `worst` from the path are
    /// solved apart (ScaledProblem::solve_few); W of bodies only.
    std::size_t few = 0;
    bool free = false;  ///< full steps, whatever they do to ||F||
    int steps = 100;    ///< at most
    int rejections = 3; ///< then the corners are rounded wider; without corners, it is left
    int patience = 25;  ///< steps without a lower rounding after which it is taken to fold back
};

/// For where the quick path is lost: these keep much closer to theirs. Each smoothing has another
/// path, and where one folds back the next may not.
constexpr NewtonPath close_path(double reduction, double closeness, double rho, double spread)
{
    return {.reduction = reduction,
            .closeness = closeness,
            .fastest = 0.1,
            .rho = rho,
            .spread = spread,
            .steps = 300,
            .patience = 60};
}
/// The paths that are followed closely, in this order.
constexpr NewtonPath kClosePaths[] = {close_path(0.6, 0.05, 3, 3), close_path(0.4, 0.1, 10, 1),
                                      close_path(0.7, 0.1, 1, 3),  close_path(0.5, 0.1, 100, 1),
                                      close_path(0.5, 0.1, 3, 3),  close_path(0.5, 0.1, 10, 3),
                                      close_path(0.5, 0.1, 30, 3), close_path(0.5, 0.1, 10, 10)};

/// How a path ended.
enum class PathEnd {
    over,    ///< the progress ended
    arrived, ///< at the target of a proximal problem
    lost     ///< it leads no further
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
/// The same for the problem with a proximal term; the progress judges the problem as it is.
PathEnd follow_path(SolverWork& work, ShiftedDelassus& matrix, const NewtonPath& path,
                    const Proximal& proximal);

/// The solvers of that name. `newton` is semismooth: it begins with sweeps, for far from the
/// solution it leads nowhere; more sweeps where it fails.
void solve_by_newton(SolverWork& work);
/// Newton's method along a central path, from `work`; warm: from its reaction.
/// docs/theory/contact.md.
void solve_by_path(SolverWork& work, bool warm);

} // namespace amontons
