#pragma once

#include <utility>

namespace amontons {

/// Time integration rule of a dynamic step: the mean of a rate g over the step, where g is the
/// velocity for places and the force for momentum:
///   mean = end g' + start g + memory d,
/// where d, the filtered rate, is stored from step to step:
///   d' = filter_end g' + filter_start g + filter_memory d.
struct TimeRule {
    /// Weights of end, start and filtered rate in the step's mean.
    double end = 1, start = 0, memory = 0;
    /// Weights by which the filtered rate is renewed.
    double filter_end = 1, filter_start = 0, filter_memory = 0;
    bool filtered = false; ///< generalised-alpha; else one force, at the place between

    /// The part of the mean that is known before the step. @param d  the filtered rate
    template <class Rate> Rate past(const Rate& g, const Rate& d) const
    {
        return start * g + memory * d;
    }
    /// The filtered rate at the end of the step.
    template <class Rate> Rate next(const Rate& g_end, const Rate& g, const Rate& d) const
    {
        return filter_end * g_end + filter_start * g + filter_memory * d;
    }
};

/// Factors of mass and stiffness in the matrix of a step.
/// @param mass_damping, stiffness_damping  Rayleigh's [1/s], [s]
inline std::pair<double, double> matrix_shares(const TimeRule& rule, double h, double mass_damping,
                                               double stiffness_damping)
{
    const double own = h * rule.end;
    return {1 + own * mass_damping, own * (stiffness_damping + own)};
}

/// The theta rule, 1: implicit Euler, 1/2: midpoint. It has no filtered rate.
inline TimeRule theta_rule(double theta)
{
    TimeRule rule;
    rule.end = theta;
    rule.start = 1 - theta;
    return rule;
}

/// Generalised-alpha of the system of first order, x. = v and M v. = f: of second order, and high
/// frequencies fall by the factor `spectral_radius` (0 to 1) in each step.
/// Source: Jansen, Whiting & Hulbert 2000, with d eliminated from their (alpha_m, alpha_f, gamma).
inline TimeRule generalised_alpha(double spectral_radius)
{
    const double rho = spectral_radius;
    TimeRule rule;
    rule.end = 2 / ((1 + rho) * (3 - rho));
    rule.start = rho * rule.end;
    rule.memory = (1 - rho) / (3 - rho);
    rule.filter_end = 2 / (3 - rho);
    rule.filter_start = 2 * rho / (3 - rho);
    rule.filter_memory = (1 - 3 * rho) / (3 - rho);
    rule.filtered = true;
    return rule;
}

} // namespace amontons
