#pragma once

#include "solver/step/wire_step.hpp"

namespace amontons::validation {

/// A uniform straight wire that stands out of a sheath along x: a cantilever, if it moves across.
struct VibratingWire {
    double length = 1;                ///< that is out [m]
    double held = 0.5;                ///< in the sheath [m]
    double radius = 0.01;             ///< [m]
    double EI = 1, EA = 4e4;          ///< [N m^2], [N]
    double torsion_of_bending = 0.77; ///< GJ / EI
    double density = 1e4;             ///< [kg/m^3]
    double damping = 0;               ///< [1/s]
    int elements = 20;                ///< of the length that is out
    double tolerance = 1e-12;         ///< of forces, relative
    double mass_per_length() const { return density * 3.14159265358979323846 * radius * radius; }
};
WireBody make_body(const VibratingWire& w);

/// What a sampled decaying oscillation is made of: x_n = a rho^n cos(n phi + b).
struct Oscillation {
    double angle = 0; ///< phi, per sample [rad]
    double decay = 0; ///< -ln rho, per sample
};
/// Best fit of x_{n+1} = 2 rho cos(phi) x_n - rho^2 x_{n-1}.
Oscillation fit_oscillation(const std::vector<double>& samples);

} // namespace amontons::validation
