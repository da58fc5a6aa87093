#pragma once

#include "mesh/base/types.hpp"

#include <span>

// Shape functions and integration points of the faces of solids: T3, T6 and Q4, known by their
// number of nodes, in the node order of mesh/volume_mesh.hpp. Reference faces: the triangle
// between the origin and the unit vectors, and the square [-1, 1]^2. The third coordinate of a
// place on them is unused.

namespace amontons {

/// Kinds of faces, by their number of nodes: 3, 6 (triangles) and 4.
constexpr int kMostSolidFaceNodes = 6;
using FaceValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSolidFaceNodes, 1>;
using FaceGradients = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostSolidFaceNodes>;

/// @param nodes   3, 6 or 4
/// @return        values, n [-], and derivatives, 2 x n [-]
FaceValues face_shape_values(int nodes, const Vec3& xi);
FaceGradients face_shape_gradients(int nodes, const Vec3& xi);

struct QuadraturePoint {
    Vec3 xi;
    double weight = 0; ///< all are > 0; they sum to the size of the reference element
};

/// Exact for constant pressure on any face, and for linear traction on flat ones: 3, 7, 2 x 2
/// points (total degree 2 and 5; Q4: 3 along each axis).
std::span<const QuadraturePoint> face_points(int nodes);

/// In the reference triangle, exact up to a total degree of 2, 4 or 5: 3, 6, 7 points.
std::span<const QuadraturePoint> triangle_points(int degree);

/// In the reference square, 2 x 2 or 3 x 3: exact to degree 3 or 5 along each axis.
std::span<const QuadraturePoint> square_points(int along);

} // namespace amontons
