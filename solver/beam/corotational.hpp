#pragma once

#include "solver/beam/element.hpp"

// The corotational beam element with 12 degrees of freedom: the linear cubic beam (with shear) in a
// frame whose first axis is the chord and whose second follows the mean of the ends' second axes.
// Its natural shape is that of the same law in the geometrically exact element.
// Source: Battini & Pacoste 2002 (co-rotational beam elements with warping effects), sections 2 and
// 3; Nour-Omid & Rankin 1991. The symmetric part of the tangent and the check of every term against
// differences: docs/theory/beams.md, solver/beam/tests.

namespace amontons {

/// Deformation of the element: change of length of the chord, and rotations of the ends in the
/// element's frame.
struct CorotationalStrain {
    double stretch = 0;                          ///< [m]
    Vec3 turn[2] = {Vec3::Zero(), Vec3::Zero()}; ///< rotation vectors [rad]
};
/// Strains of the corotational element between two nodes.
/// @param length  of the chord when free of stress [m]
CorotationalStrain corotational_strain(const BeamNode& a, const BeamNode& b, double length);

/// The deformation at which the element is free of stress.
CorotationalStrain corotational_natural(const ElementLaw& law);

/// Elastic energy [J].
double corotational_energy(const BeamNode& a, const BeamNode& b, const ElementLaw& law,
                           const CorotationalStrain& natural);

/// Gradient and Hessian by the displacements of both nodes (places, turns in the body frames),
/// in the sense of add_elements().
void corotational_element(const BeamNode& a, const BeamNode& b, const ElementLaw& law,
                          const CorotationalStrain& natural, Vec12& gradient, Mat12& hessian);

} // namespace amontons
