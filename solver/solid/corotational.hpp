#pragma once

#include "solver/solid/element.hpp"

// Elements that turn with the material: linear elasticity between the element's own rotation and
// its shape. With F the mean deformation gradient at the element's centre, R its polar rotation and
// u_i = R^T (x_i - x_c) - (X_i - X_c), the energy is u^T K u / 2. Forces are its exact gradient,
// the turn of R included, so that forces and moments of an element are in balance to round-off and
// a rigid motion leaves no stress. Source: Felippa & Haugen 2005 (the projector); Müller & Gross
// 2004 (polar rotation). Derivation: docs/theory/solids.md.

namespace amontons {

/// What an element keeps of its reference shape.
struct CorotationalElement {
    ShapeGradients gradient; ///< of the shape functions at the centre, 3 x n [1/m]
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostSolidNodes>
        X;           ///< about their mean, 3 x n [m]
    ElementMatrix K; ///< linear stiffness at rest, 3n x 3n [N/m]
};

/// @param X  3 x n [m]
CorotationalElement make_corotational(ElementKind kind, const ElementPoints& X, const Mat6& C);

/// Rotation of a gradient F with det F > 0, by Newton's iteration; of an inverted one the nearest
/// proper rotation.
Mat3 polar_rotation(const Mat3& F);

/// State of a corotational element between iterations.
struct CorotationalState {
    /// Polar rotation of the element.
    Mat3 rotation = Mat3::Identity();
    ElementVector u;   ///< elastic displacement in the element's own frame, 3n [m]
    double energy = 0; ///< [J]
};

/// Energy and forces at places x.
/// @param x       3 x n [m]
/// @param forces  set to the gradient of the energy, 3n [N]
CorotationalState corotational_forces(const CorotationalElement& e, const ElementPoints& x,
                                      ElementVector& forces);

/// P^T K P v, see corotational_stiffness(): the forces of stiffness-proportional damping over its
/// coefficient. They vanish in a rotation of the element as a whole, and are self-equilibrated.
/// @param v       velocities in space, 3n [m/s]
/// @param forces  set to these, 3n [N/s]
void corotational_rate_forces(const CorotationalElement& e, const CorotationalState& state,
                              const ElementVector& v, ElementVector& forces);

/// The part of the tangent that is positive semidefinite: P^T K P turned into space, with P the
/// derivative of u by the places. What is left out is of first order in the stress.
/// @param K  set to 3n x 3n
void corotational_stiffness(const CorotationalElement& e, const CorotationalState& state,
                            ElementMatrix& K);

/// The whole derivative of the forces by the places: symmetric, may be indefinite.
/// @param K  set to 3n x 3n
void corotational_tangent(const CorotationalElement& e, const CorotationalState& state,
                          ElementMatrix& K);

} // namespace amontons
