#pragma once

#include "mesh/base/types.hpp"

#include <span>

// Shape functions and integration points of the faces of solids: T3, T6 and Q4, known by their
// number of nodes, in the node order of mesh/volume_mesh.hpp. Reference faces: the triangle
// between the origin and the unit vectors, and the square [-1, 1]^2. The third coordinate of a
// place on them is unused.

namespace amontons {

/// Most nodes of a face; the kinds have 3 and 6 (triangles) and 4.
constexpr int kMostSolidFaceNodes = 6;
using FaceValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSolidFaceNodes, 1>;
using FaceGradients = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostSolidFaceNodes>;

/// Values of the shape functions of a face, n [-].
/// @param nodes  n: 3, 6 or 4
FaceValues face_shape_values(int nodes, const Vec3& xi);
/// Derivatives of the shape functions of a face by xi, 2 x n [-].
FaceGradients face_shape_gradients(int nodes, const Vec3& xi);

/// The same for loops that need both: N and its derivatives dx, dy, in arrays of `nodes` numbers.
inline void evaluate_face(int nodes, double x, double y, double* N, double* dx, double* dy)
{
    if (nodes == 4) {
        const double a = 0.25 * (1 - x), b = 0.25 * (1 + x), c = 1 - y, d = 1 + y;
        N[0] = a * c, N[1] = b * c, N[2] = b * d, N[3] = a * d;
        dx[0] = -0.25 * c, dx[1] = 0.25 * c, dx[2] = 0.25 * d, dx[3] = -0.25 * d;
        dy[0] = -a, dy[1] = -b, dy[2] = b, dy[3] = a;
        return;
    }
    const double l = 1 - x - y;
    if (nodes == 3) {
        N[0] = l, N[1] = x, N[2] = y;
        dx[0] = -1, dx[1] = 1, dx[2] = 0;
        dy[0] = -1, dy[1] = 0, dy[2] = 1;
        return;
    }
    N[0] = l * (2 * l - 1), N[1] = x * (2 * x - 1), N[2] = y * (2 * y - 1);
    N[3] = 4 * l * x, N[4] = 4 * x * y, N[5] = 4 * y * l;
    dx[0] = 1 - 4 * l, dx[1] = 4 * x - 1, dx[2] = 0;
    dx[3] = 4 * (l - x), dx[4] = 4 * y, dx[5] = -4 * y;
    dy[0] = 1 - 4 * l, dy[1] = 0, dy[2] = 4 * y - 1;
    dy[3] = -4 * x, dy[4] = 4 * x, dy[5] = 4 * (l - y);
}

/// A point of an integration rule.
struct QuadraturePoint {
    /// Its coordinates in the reference element.
    Vec3 xi;
    double weight = 0; ///< all are > 0; they sum to the size of the reference element (weight)
};

/// Exact for constant pressure on any face, and for linear traction on flat ones: 3, 7, 2 x 2
/// points (total degree 2 and 5; Q4: 3 along each axis).
std::span<const QuadraturePoint> face_points(int nodes);

/// In the reference triangle, exact up to a total degree of 2, 4 or 5: 3, 6, 7 points.
std::span<const QuadraturePoint> triangle_points(int degree);

/// In the reference triangle, by Gauss's points on a square collapsed at one side into a corner
/// (Duffy's map): along x along points, along from 2 to 12, exact up to a total degree of
/// 2 along - 2.
std::span<const QuadraturePoint> triangle_points_along(int along);

/// In the reference square, 2 x 2 or 3 x 3: exact to degree 3 or 5 along each axis.
std::span<const QuadraturePoint> square_points(int along);

} // namespace amontons
