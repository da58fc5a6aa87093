#pragma once

#include "mesh/base/types.hpp"
#include "mesh/volume_mesh.hpp"

#include <span>

// Shape functions and integration points of the elements T4, T10, H8 and of their faces T3, T6, Q4,
// in the node order of mesh/volume_mesh.hpp. Reference elements: the tetrahedron (triangle) between
// the origin and the unit vectors, and the cube [-1, 1]^3 (square [-1, 1]^2).

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

struct QuadraturePoint {
    Vec3 xi;
    double weight = 0; ///< all are > 0; they sum to the reference element's volume
};

/// Exact for the stiffness of affine elements, and for the work of a constant stress in any (what
/// the patch test asks of a curved T10): 1, 8, 2 x 2 x 2 points (polynomials of total degree 1 and
/// 3; H8: of degree 3 along each axis).
std::span<const QuadraturePoint> stiffness_points(ElementKind kind);

/// Exact for the mass of affine elements, and for volume and body force of any: 4, 14, 3 x 3 x 3
/// points (total degree 2 and 5; H8: 5 along each axis).
std::span<const QuadraturePoint> mass_points(ElementKind kind);

/// Kinds of faces, by their number of nodes: 3, 6 (triangles) and 4.
constexpr int kMostSolidFaceNodes = 6;
using FaceValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSolidFaceNodes, 1>;
using FaceGradients = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostSolidFaceNodes>;

/// @param nodes   3, 6 or 4
/// @param xi      third coordinate unused
/// @return        values, n [-], and derivatives, 2 x n [-]
FaceValues face_shape_values(int nodes, const Vec3& xi);
FaceGradients face_shape_gradients(int nodes, const Vec3& xi);

/// Exact for constant pressure on any face, and for linear traction on flat ones: 3, 7, 2 x 2
/// points (total degree 2 and 5; Q4: 3 along each axis).
std::span<const QuadraturePoint> face_points(int nodes);

} // namespace amontons
