#include "contact/solvers/smoothed_law.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// Stiffest entry of D: stiffer ones would cause round-off in all others. The direction of a
/// Newton step then errs by its inverse, the solution does not.
constexpr double kStiffest = 1e10;

struct Normal {
    double value = 0; ///< p(z), > 0 for epsilon > 0
    double slope = 0; ///< p', in [0, 1]
};

/// p (p - z) = epsilon^2 rho: z's positive part, rounded.
Normal positive_part(double z, const Smoothing& s)
{
    const double c = 4 * s.epsilon * s.epsilon * s.rho;
    const double root = std::sqrt(z * z + c);
    if (z > 0) return {(z + root) / 2, (1 + z / root) / 2};
    if (root == 0) return {0, 0.5};
    const double value = c / (root - z) / 2; // z + root without cancellation
    return {value, value / root};
}

/// How far z_t lies outside the disc: z_t / (1 + d) is the rounded projection.
struct Disc {
    double d = 0;     ///< >= 0
    double kappa = 0; ///< stiffness of the rim, times |z_t|^2 at most kStiffest
    bool exists = true;
};

/// @param a  |z_t|^2
Disc project(double a, double R, const Smoothing& s)
{
    Disc disc;
    const double R2 = R * R;
    const double e2 = s.spread * s.spread * s.epsilon * s.epsilon * s.rho;
    if (!(R2 > 0)) {
        disc.exists = false; // the disc is a point
        return disc;
    }
    const double b = a / R2, c = e2 / R2;
    const double outside = b > 1 ? std::sqrt(b) - 1 : 0;
    if (c == 0) {
        disc.d = outside;
        if (b > 1) disc.kappa = kStiffest / a;
        return disc;
    }
    // Root of d ((1 + d)^2 - b) = c (1 + d)^2: the start is to its right, where the left side
    // less the right one is convex and rises. Newton then comes down to it without overshooting.
    double d = outside + c + 1.5 * std::sqrt(c);
    for (int k = 0; k < 100; ++k) {
        const double t = 1 + d;
        const double gap = t * t - b;
        const double slope = gap + 2 * t * (d - c);
        const double next = d - (d * gap - c * t * t) / slope;
        if (!(next < d) || !(next > outside)) break;
        const bool small = d - next <= 1e-15 * d;
        d = next;
        if (small) break;
    }
    disc.d = d;
    disc.kappa = 2 * d * d / (e2 * (1 + d) * (1 + d));
    if (disc.kappa * a > kStiffest) disc.kappa = kStiffest / a;
    return disc;
}

} // namespace

Vec3 smoothed_frictional(double mu, const Vec3& r, const Vec3& u, const Smoothing& s)
{
    const Vec3 z = r - s.rho * u;
    const Normal normal = positive_part(z[0], s);
    const Disc disc = project(z[1] * z[1] + z[2] * z[2], mu * normal.value, s);
    const double share = disc.exists ? 1 / (1 + disc.d) : 0;
    return {r[0] - normal.value, r[1] - share * z[1], r[2] - share * z[2]};
}

LinearisedLaw linearise_frictional(double mu, const Vec3& r, const Vec3& u, const Smoothing& s)
{
    LinearisedLaw law;
    const Vec3 z = r - s.rho * u;
    const Normal normal = positive_part(z[0], s);
    const double R = mu * normal.value;
    const Disc disc = project(z[1] * z[1] + z[2] * z[2], R, s);
    const double share = disc.exists ? 1 / (1 + disc.d) : 0;
    law.residual = {r[0] - normal.value, r[1] - share * z[1], r[2] - share * z[2]};
    law.open = normal.slope < s.open || !disc.exists;
    if (law.open) return law;

    const double rim = disc.kappa / s.rho;
    const double along = -rim * (1 + disc.d) * R * mu;
    law.D(0, 0) = (1 / normal.slope - 1) / s.rho;
    law.D(1, 0) = along * z[1];
    law.D(2, 0) = along * z[2];
    law.D(1, 1) = disc.d / s.rho + rim * z[1] * z[1];
    law.D(2, 2) = disc.d / s.rho + rim * z[2] * z[2];
    law.D(1, 2) = law.D(2, 1) = rim * z[1] * z[2];
    return law;
}

double smoothed_frictionless(double r, double u, const Smoothing& s)
{
    return r - positive_part(r - s.rho * u, s).value;
}

LinearisedLaw linearise_frictionless(double r, double u, const Smoothing& s)
{
    LinearisedLaw law;
    const Normal normal = positive_part(r - s.rho * u, s);
    law.residual[0] = r - normal.value;
    law.open = normal.slope < s.open;
    if (!law.open) law.D(0, 0) = (1 / normal.slope - 1) / s.rho;
    return law;
}

} // namespace amontons
