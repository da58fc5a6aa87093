#pragma once

#include "mesh/face_shape.hpp"
#include "mesh/volume_mesh.hpp"

#include <span>

// Shape functions and integration points of the elements T4, T10, H8 in the node order of
// mesh/volume_mesh.hpp; those of their faces are in mesh/face_shape.hpp. Reference elements: the
// tetrahedron between the origin and the unit vectors, and the cube [-1, 1]^3.

namespace amontons {

constexpr int kMostSolidNodes = 10; ///< of an element with shape functions; sizes fixed storage

using ShapeValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSolidNodes, 1>;
using ShapeGradients = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostSolidNodes>;

/// Values at xi; they sum to 1.
/// @return  n [-]
ShapeValues shape_values(ElementKind kind, const Vec3& xi);

/// Derivatives with respect to xi; each row sums to 0.
/// @return  3 x n [-]
ShapeGradients shape_gradients(ElementKind kind, const Vec3& xi);

/// Where the nodes are in the reference element.
/// @return  3 x n [-]
ShapeGradients reference_nodes(ElementKind kind);

/// Exact for the stiffness of affine elements, and for the work of a constant stress in any (what
/// the patch test requires of a curved T10): 1, 8, 2 x 2 x 2 points (polynomials of total degree 1 and
/// 3; H8: of degree 3 along each axis).
std::span<const QuadraturePoint> stiffness_points(ElementKind kind);

/// Exact for the mass of affine elements, and for volume and body force of any: 4, 14, 3 x 3 x 3
/// points (total degree 2 and 5; H8: 5 along each axis).
std::span<const QuadraturePoint> mass_points(ElementKind kind);

} // namespace amontons
