#pragma once

#include "solver/material/law.hpp"
#include "solver/solid/element.hpp"

#include <limits>

// Elements of hyperelastic material, total Lagrangian: energy, forces and tangent at places x.
// T4 evaluates the law at its points. T10 and H8 evaluate the part of lambda/2 (ln J)^2 with a
// lambda beyond some shear moduli at the element's mean J. H8 has the twelve internal modes of
// solver/solid/element.hpp in F, transposed, in axes that turn with its centre.
// Equations, reasons and measured results: docs/theory/hyperelasticity.md.

namespace amontons {

/// lambda over the shear modulus up to which it acts at each point of a T10; the rest acts at its
/// mean J. So for nu < 0.4 a T10 is a pure displacement element.
constexpr double kPointwiseLambda = 4;
/// The same for H8, whose internal modes reduce locking (nu = 0.476).
constexpr double kPointwiseLambdaOfH8 = 20;

/// Above this Poisson's ratio T4 locks, and so does T10 with a law without a volumetric part.
constexpr double kMostPoissonOfT4 = 0.45;

/// What an element keeps of its reference shape.
struct HyperelasticElement {
    ElementKind kind = ElementKind::T4;
    std::vector<double> numbers; ///< gradients, weights and modes of its points; see the .cpp
};

/// @param X     3 x n [m]
/// @param axes  columns: the fibre, and two across it; of a law without direction any rotation
HyperelasticElement make_hyperelastic(ElementKind kind, const ElementPoints& X, const Mat3& axes);

/// An element at places x.
struct HyperelasticState {
    InternalModes modes;     ///< of H8: first guess on entry, then those in equilibrium
    double energy = 0;       ///< [J]
    double least_volume = 1; ///< least J at its points (ratio)
    /// Pressure of the mean J with which the tangent is formed; NaN: that at places x [Pa].
    double pressure = std::numeric_limits<double>::quiet_NaN();
};

/// Why an element is refused.
enum class ElementFault {
    none,
    inverted, ///< J <= 0, or too strained for numbers, at some point
    unstable, ///< its internal modes have no stable equilibrium: it would buckle within itself
};

/// Energy and forces.
/// @param x       3 x n [m]
/// @param forces  set to the gradient of the energy, 3n [N]; 0 where there is a fault
ElementFault hyperelastic_forces(const HyperelasticElement& e, const Hyperelastic& material,
                                 const ElementPoints& x, HyperelasticState& state,
                                 ElementVector& forces);

/// The whole derivative of the forces, at a state that hyperelastic_forces has found.
/// @param K  set to 3n x 3n: symmetric, may be indefinite
void hyperelastic_tangent(const HyperelasticElement& e, const Hyperelastic& material,
                          const ElementPoints& x, const HyperelasticState& state, ElementMatrix& K);

/// The pressure of the mean J after a motion, linearised in the motion. A nearly incompressible
/// element evaluated at the moved places would have a pressure of many shear moduli, which belongs
/// to no equilibrium.
/// @param move  of the nodes from x, 3 x n [m]
double pressure_after(const HyperelasticElement& e, const Hyperelastic& material,
                      const ElementPoints& x, const ElementPoints& move);

/// Means over an element.
struct HyperelasticMean {
    /// Cauchy stress [Pa].
    Vec6 stress = Vec6::Zero();
    /// Energy per volume of the reference shape [J/m^3].
    double energy = 0;
};
/// Means over an element at places x. @param state  as hyperelastic_forces() has left it
HyperelasticMean hyperelastic_mean(const HyperelasticElement& e, const Hyperelastic& material,
                                   const ElementPoints& x, const HyperelasticState& state);

} // namespace amontons
