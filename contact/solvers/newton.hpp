#pragma once

#include "contact/solvers/shifted_delassus.hpp"

#include <limits>

namespace amontons {

/// A proximal term: u = W r + q + alpha (r - centre), each contact in its own scale. The path that
/// is followed is then that of this easier problem; its solution solves the original problem where
/// it equals the centre.
struct Proximal {
    double alpha = 0;       ///< over an own block's mean diagonal, > 0 [-]
    Eigen::VectorXd centre; ///< rows [N]
    double target = 0;      ///< rounding over all contacts at which the path has arrived [-]
};

/// Parameters of Newton's method along the central path.
struct NewtonPath {
    bool smooth = true;     ///< round the corners of the law, with a rounding that tends to zero;
                            ///< false: semismooth Newton on the law itself
    bool from_afar = false; ///< begin with corners as wide as the problem, not as the error
    /// From near, corners are at least this wide at the start: the error may be small while the
    /// contacts that decide are all at a corner [-].
    double widest = 1e-3;
    double reduction = 0.3; ///< of the rounding, when its equation is solved [-]
    double closeness = 1;   ///< ||F|| over the rounding of all contacts at which it is solved [-]
    /// Also required: the largest |F_i| of one contact over the rounding is no more than this [-].
    double worst = std::numeric_limits<double>::infinity();
    /// Smallest factor on the rounding at once, after a full step that ends far below it [-].
    double fastest = 1e-3;
    double rho = 3;    ///< weight of u beside r [-]
    double spread = 3; ///< rounding of friction's discs over that of the normal law [-]
    /// So many contacts at most that a full step leaves further than `worst` from the path are
    /// solved apart (ScaledProblem::solve_few); W of bodies only.
    std::size_t few = 0;
    bool free = false; ///< full steps without a line search, even where ||F|| increases
    int steps = 100;   ///< at most
    /// Line searches in a row that may fail; then the corners are rounded wider, or, without
    /// rounding, the path ends.
    int rejections = 3;
    int patience = 25; ///< steps without a lower rounding after which the path counts as folded
};

/// Paths for problems on which the quick one fails: the iterates stay much closer to the path. Each
/// smoothing has a path of its own, and where one folds back the next may not. Arguments as the
/// fields of NewtonPath [-].
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
    over,    ///< SolveProgress::ends(): solved, or a limit was reached
    arrived, ///< at the target of a proximal problem
    lost     ///< no further step is found
};

/// Newton on the law of Alart & Curnier, all contacts together, along the path of its smoothings.
///
/// r_n u_n = epsilon^2 and s ((mu r_n)^2 - |r_t|^2) ~ epsilon^2 with u_t = -s r_t: a central path
/// as of an interior-point method, but the iterates need not stay inside, so it starts anywhere.
/// Levenberg-Marquardt shift where the line search fails. Insensitive to contrasts of stiffness
/// and mass; singular W is no obstacle.
/// Cost of a step: one factor of ShiftedDelassus, 10 to 40 steps.
/// @returns true if SolveProgress::ends(), false if no further step is found
bool follow_path(SolverWork& work, ShiftedDelassus& matrix, const NewtonPath& path);
/// The same for the problem with a proximal term; errors are those of the problem without it.
PathEnd follow_path(SolverWork& work, ShiftedDelassus& matrix, const NewtonPath& path,
                    const Proximal& proximal);

/// The solver `newton`: semismooth Newton. It begins with sweeps, since it does not converge from a
/// remote start; more sweeps follow where it fails.
void solve_by_newton(SolverWork& work);
/// The solver `path`: Newton's method along the central path (docs/theory/contact.md).
/// @param warm  start at the reaction of `work` with corners as wide as its error, not as the
///              problem
void solve_by_path(SolverWork& work, bool warm);

} // namespace amontons
