#pragma once

#include "solver/solid/material.hpp"
#include "solver/solid/shape.hpp"

// Solid elements: straight or curved T4 and T10 from displacements alone, and H8 with twelve
// internal modes (incompatible displacements and volume changes, condensed in the element), which
// bends without shear locking and keeps its volume without volumetric locking.
// Equations and measured orders: docs/theory/solids.md.
//
// Displacements of an element are 3n numbers, node by node; X holds its nodes' places, 3 x n [m].
// det J > 0 at the stiffness points is the caller's promise (mesh/volume_check.hpp refuses others).
//
// All that is here is linear: the strain is the symmetric part of the displacement gradient
//     H = sum_i u_i (x) grad N_i + sum_k a_k G_k,
// with the internal modes a. Hyperelastic elements, with F = 1 + H, are in
// solver/solid/hyperelastic.hpp.

namespace amontons {

using ElementPoints = Eigen::Ref<const Eigen::Matrix3Xd>;

/// Most degrees of freedom of an element.
constexpr int kMostSolidDofs = 3 * kMostSolidNodes;
using ElementMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostSolidDofs, kMostSolidDofs>;
using ElementVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSolidDofs, 1>;

/// Most internal modes of an element.
constexpr int kMostInternalModes = 12;
using InternalModes = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostInternalModes, 1>;

/// @param X  3 x n [m]
/// @param C  elasticity matrix, symmetric positive definite [Pa]
/// @param K  set to 3n x 3n [N/m]: symmetric to the last bit, zero on rigid motions alone
void solid_stiffness(ElementKind kind, const ElementPoints& X, const Mat6& C, ElementMatrix& K);

/// Consistent mass, the integral of density N_i N_j: n x n [kg], the same for x, y and z. H8's
/// internal modes carry no mass.
void solid_mass(ElementKind kind, const ElementPoints& X, double density, ElementMatrix& M);

/// One mass per node, all > 0: n [kg]. Row sums of the consistent mass for T4 and H8, which keep
/// the centre of mass; a T10's corners would get less than nothing, so its are the diagonal scaled
/// to the element's mass.
ShapeValues solid_lumped_mass(ElementKind kind, const ElementPoints& X, double density);

/// Integral of J over the element [m^3].
double solid_volume(ElementKind kind, const ElementPoints& X);

/// Forces of a constant force per volume: 3n [N].
/// @param force  [N/m^3]
ElementVector solid_body_force(ElementKind kind, const ElementPoints& X, const Vec3& force);

/// Amplitudes that H8's internal modes take under u; empty for T4 and T10.
/// @param u  3n [m]
InternalModes solid_internal_modes(ElementKind kind, const ElementPoints& X, const Mat6& C,
                                   const ElementVector& u);

/// Strain at a place of the element [-]; stress is C times it. H8: stresses are best at the centre,
/// xi = 0, where all internal modes vanish.
/// @param modes  from solid_internal_modes
/// @param xi     in the reference element
Vec6 solid_strain(ElementKind kind, const ElementPoints& X, const ElementVector& u,
                  const InternalModes& modes, const Vec3& xi);

} // namespace amontons
