#pragma once

#include "solver/material/law.hpp"
#include "solver/solid/element.hpp"

#include <limits>

// Elements of hyperelastic material, total Lagrangian: energy, forces and tangent at places x.
// T4 takes the law as it is. T10 and H8 take that part of lambda/2 (ln J)^2 which is more than some
// shear moduli at the element's mean J. H8 has the twelve internal
// modes of solver/solid/element.hpp in F, transposed, in the axes that turn with its centre.
// Equations, why so, and what was measured: docs/theory/hyperelasticity.md.

namespace amontons {

/// Up to this many shear moduli of lambda act at each point of a T10, the rest at its mean J:
/// below nu = 0.4 a T10 is that of displacements alone.
constexpr double kPointwiseLambda = 4;
/// And of a H8, whose modes relieve them (nu = 0.476).
constexpr double kPointwiseLambdaOfH8 = 20;

/// T4 with a larger Poisson's ratio locks; and T10 does where the law has no part of J alone.
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
    InternalModes modes;     ///< of H8: given as a start, then those of balance
    double energy = 0;       ///< [J]
    double least_volume = 1; ///< least J at its points (ratio)
    /// What the tangent takes for the pressure of the mean J; no number: that of its places [Pa].
    double pressure = std::numeric_limits<double>::quiet_NaN();
};

/// Why an element is refused.
enum class ElementFault {
    none,
    inverted, ///< J <= 0, or too strained for numbers, at some point
    unstable, ///< its internal modes have no stable balance: it would buckle within itself
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

/// The pressure of the mean J that a motion leads to, as far as it is linear: what is nearly
/// incompressible answers to all of it with one of many shear moduli, which belongs to no
/// equilibrium.
/// @param move  of the nodes from x, 3 x n [m]
double pressure_after(const HyperelasticElement& e, const Hyperelastic& material,
                      const ElementPoints& x, const ElementPoints& move);

/// Mean over the element, there: Cauchy's stress [Pa], and energy per volume at rest [J/m^3].
struct HyperelasticMean {
    /// Cauchy stress [Pa].
    Vec6 stress = Vec6::Zero();
    /// Energy density [J/m^3].
    double energy = 0;
};
/// Means over an element.
HyperelasticMean hyperelastic_mean(const HyperelasticElement& e, const Hyperelastic& material,
                                   const ElementPoints& x, const HyperelasticState& state);

} // namespace amontons
