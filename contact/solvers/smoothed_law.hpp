#pragma once

#include "mesh/base/types.hpp"

// Coulomb's law as one smooth equation F(r, u) = 0 per contact, in dimensionless numbers: what the
// Newton solvers linearise. Derivation: docs/theory/contact.md.

namespace amontons {

/// The law's corners are rounded over a distance epsilon; epsilon = 0 is the law itself.
struct Smoothing {
    double epsilon = 0; ///< >= 0, relative to the size of the problem [-]
    double rho = 3;     ///< weight of u beside r in the predictor r - rho u, > 0 [-]
    double spread = 3;  ///< rounding of friction's disc over that of the normal law, > 0 [-]
    double open = 1e-6; ///< a contact with dr_n / d(-rho u_n) below this is taken as open [-]
};

/// F linearised and solved for the slip: u's change is -D dr - (F / rho + D F).
struct LinearisedLaw {
    Vec3 residual = Vec3::Zero(); ///< F
    Mat3 D = Mat3::Zero();        ///< positive semidefinite symmetric part
    bool open = false;            ///< D would be infinite: dr = -F whatever u does
};

/// F of a frictional contact: normal law and disc of radius mu r_n, each rounded.
///
/// With z = r - rho u:  F_n = r_n - p(z_n),  p (p - z_n) = epsilon^2 rho;
/// F_t = r_t - z_t / t, (t - 1)((R t)^2 - |z_t|^2) = (spread epsilon t)^2 rho, R = mu p(z_n).
/// As epsilon tends to 0 this is the function of Alart & Curnier (1991).
Vec3 smoothed_frictional(double mu, const Vec3& r, const Vec3& u, const Smoothing& s);
/// The law of a contact with friction at (r, u), rounded and linearised.
LinearisedLaw linearise_frictional(double mu, const Vec3& r, const Vec3& u, const Smoothing& s);

/// The normal law alone: in residual[0] and D(0, 0).
double smoothed_frictionless(double r, double u, const Smoothing& s);
/// The same of a contact without friction.
LinearisedLaw linearise_frictionless(double r, double u, const Smoothing& s);

} // namespace amontons
