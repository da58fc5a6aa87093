#include "solver/step/contact_status.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kTurnTolerance = 0.1; // slip directions are renewed within an iteration [rad]

/// Slip direction and stiffness across it from a predictor outside the cone's section.
void set_slip(const Candidate& c, Trial& t, double s1, double s2, double bound)
{
    const double m = std::hypot(s1, s2);
    t.status = 2;
    t.c1 = s1 / m;
    t.c2 = s2 / m;
    const double beta = std::min(bound / m, 1 - 1e-9);
    t.across = kRhoSlip * c.stiffness * beta / (1 - beta);
}

} // namespace

Change violation(const Candidate& c, const Trial& t, double force, double length)
{
    if (t.status == 0) {
        if (t.gap < -length) return {Change::close, -t.gap};
        return {};
    }
    if (t.normal < -force && !c.bilateral) return {Change::open, -t.normal};
    if (!(c.mu > 0)) return {};
    const double bound = c.mu * std::max(t.normal, 0.0);
    if (t.status == 1) {
        const double m = std::hypot(t.t1, t.t2);
        if (m > bound * (1 + 1e-9) + force) return {Change::slip, m - bound};
        return {};
    }
    const double m = std::hypot(t.t1, t.t2);
    const double k = m > bound && m > 0 ? bound / m : 1;
    const double rho = kRhoSlip * c.stiffness;
    const double s1 = k * t.t1 - rho * t.v1, s2 = k * t.t2 - rho * t.v2;
    const double s = std::hypot(s1, s2);
    if (s < bound * (1 - 1e-9) - force) return {Change::stick, bound - s};
    // Slip against its own friction: sticks first, or the two opposite slips alternate.
    if (t.v1 * t.c1 + t.v2 * t.c2 > force / rho) return {Change::stick, bound};
    const double turn = std::abs(s1 * t.c2 - s2 * t.c1);
    if (s > 0 && turn > kTurnTolerance * s && bound > force) return {Change::turn, turn};
    return {};
}

void change(const Candidate& c, Trial& t, Change::Kind kind)
{
    const double rho = kRhoSlip * c.stiffness;
    const double bound = c.mu * std::max(t.normal, 0.0);
    switch (kind) {
    case Change::open:
        t.status = 0;
        break;
    case Change::close:
        t.status = 1;
        // A point that closes while sliding continues to slide.
        if (c.mu > 0 && std::hypot(t.v1, t.v2) > 0) set_slip(c, t, -t.v1, -t.v2, 0);
        break;
    case Change::stick:
        t.status = 1;
        break;
    case Change::slip:
        set_slip(c, t, t.t1, t.t2, bound);
        break;
    case Change::turn: {
        const double m = std::hypot(t.t1, t.t2);
        const double k = m > bound && m > 0 ? bound / m : 1;
        set_slip(c, t, k * t.t1 - rho * t.v1, k * t.t2 - rho * t.v2, bound);
        break;
    }
    case Change::none:
        break;
    }
}

void initial_status(const Candidate& c, Trial& t)
{
    t = Trial{};
    t.hold = stick_weight(c);
    if (!(c.normal > 0) && c.gap >= 0 && !c.bilateral) return;
    t.status = 1;
    if (!(c.mu > 0)) return;
    const double rho = kRhoSlip * c.stiffness;
    const double s1 = c.tangential[0] - rho * c.slip[0], s2 = c.tangential[1] - rho * c.slip[1];
    const double bound = c.mu * c.normal, m = std::hypot(s1, s2);
    if (!c.sticks && m > 0 && m >= bound * (1 - 1e-9))
        set_slip(c, t, s1, s2, bound);
    else if (m > bound * (1 + 1e-6) && m > 0)
        set_slip(c, t, s1, s2, bound);
}

} // namespace amontons
