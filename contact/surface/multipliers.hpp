#pragma once

#include "contact/surface/facets.hpp"

// The functions psi of the contact pressure on the slave's faces. They are dual to the shape
// functions, int psi_i N_j = 0 for i != j, and sum to 1 everywhere:
//
//   T3, Q4  one at each corner: psi = D M^-1 N, D = diag int N, M = int N N^T, on the true face
//   T6      one at each middle node: the rows of the middle nodes of D M^-1 of the reference
//           triangle. Corner nodes carry none, as int N_corner = 0; their rows of D are 0. The
//           true M would give functions that do not sum to 1 on a curved face, and fail the
//           patch test; so on a curved face the functions are dual only up to its curvature.
//
// Dual functions are negative in places. Where the master covers only a part of a face their
// integral vanishes, and instead psi_i = 1 on the part of the face nearest to node i.

namespace amontons {

/// The dual multipliers of one face.
struct FaceMultipliers {
    /// Number of nodes with a multiplier.
    int count = 0;
    std::array<int, 4> node{}; ///< each one's node, among those of the face
    /// psi_i = sum_j functions(i, j) N_j; 0 beyond the last of either
    Eigen::Matrix<double, 4, kMostSolidFaceNodes> functions;
    std::array<double, 4> full{}; ///< integral of psi_i over the face [m^2]
};

/// The dual multipliers of a face. Functions are the same in any coordinates, `full` is in the
/// square of their unit.
FaceMultipliers face_multipliers(const FaceInPlane& face);

/// Where psi_i = 1 on a partly covered face: a convex polygon of the reference face. Those of all
/// multipliers tile it.
ConvexPolygon nearest_part(int nodes, int multiplier);

/// Integration points in the reference triangle for products of the functions of quadrilaterals
/// that are no parallelograms; right to 1e-10.
/// @param bend  half the range of the area per reference area over the triangle, over its mean [-]
std::span<const QuadraturePoint> points_for_bend(double bend);

} // namespace amontons
