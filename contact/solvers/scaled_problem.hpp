#pragma once

#include "contact/solvers/shifted_delassus.hpp"

#include <vector>

namespace amontons {

/// The problem in dimensionless numbers: r = s f r', u = f u' / s with one s per contact that
/// gives each own block the mean diagonal 1, and the force f that gives q' the norm 1.
///
/// Arguments r, u and directions are in physical units; F is dimensionless.
class ScaledProblem {
public:
    explicit ScaledProblem(const SolverWork& work); ///< refers to its problem, columns and scale

    /// Size of F: its norm and its largest part.
    struct Merit {
        double all = 0;   ///< norm of F over all contacts
        double worst = 0; ///< the largest of one contact (scaled)
    };
    /// The merit of (r, u) at this rounding.
    Merit merit(const Eigen::VectorXd& r, const Eigen::VectorXd& u, const Smoothing& s) const;
    /// Adds the contacts whose own |F| is above a limit, ascending.
    /// @returns false if there are none that are new, or more than `most` with those there
    /// @param limit  dimensionless, as |F|
    bool add_beyond(double limit, std::size_t most, const Eigen::VectorXd& r,
                    const Eigen::VectorXd& u, const Smoothing& s, std::vector<int>& few) const;
    /// Linearises the law of every contact at (r, u) and this rounding.
    /// @returns  |F| (scaled)
    double linearise(const Eigen::VectorXd& r, const Eigen::VectorXd& u, const Smoothing& s,
                     std::vector<LinearisedLaw>& law) const;
    /// Norm of r in the scale of the problem.
    double size(const Eigen::VectorXd& r) const { return r.cwiseQuotient(scale_).norm() / force_; }
    double force() const { return force_; } ///< f [N]

    /// The Newton step, and W times it.
    /// @returns false if the matrix is singular to working precision
    bool step(const std::vector<LinearisedLaw>& law, double shift, const Smoothing& s,
              ShiftedDelassus& matrix, Eigen::VectorXd& direction, Eigen::VectorXd& slope);
    /// Nonlinear elimination: the step by which a few contacts end on their law itself, while the
    /// others follow theirs as linearised for the last step(), whose direction and slope enter.
    /// W of bodies only.
    ///
    /// Where a few contacts hold all of the merit, their corners would cut every step short. With
    /// all others condensed they are a problem of few rows, whose own Newton steps have a
    /// negligible cost. Source: Lanzkron, Rose & Wilkes, SIAM J. Sci. Comput. 17 (1996).
    /// @param limit  what their |F| together is to be below
    /// @returns  whether it is
    bool solve_few(const std::vector<int>& few, double limit, const std::vector<LinearisedLaw>& law,
                   const Smoothing& s, const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                   ShiftedDelassus& matrix, Eigen::VectorXd& direction, Eigen::VectorXd& slope);

private:
    double own_merit(int contact, const double* r, const double* u, const Smoothing& s) const;
    LinearisedLaw own_law(int contact, const Vec3& r, const Vec3& u, const Smoothing& s) const;
    bool solve(ShiftedDelassus& matrix, Eigen::VectorXd& direction, Eigen::VectorXd& slope) const;

    const ContactProblem& problem_;
    const Columns& columns_;
    const Eigen::VectorXd& scale_;
    double force_ = 1;
    Eigen::VectorXd right_, given_; ///< of the last step: of closed rows, of open ones
};

} // namespace amontons
