#pragma once

#include "solver/solid/shape.hpp"

// Loads on the faces T3, T6 and Q4 of solid elements. X holds the places of a face's nodes as
// face_nodes gives them (counter-clockwise seen from outside), 3 x n [m].

namespace amontons {

using FacePoints = Eigen::Ref<const Eigen::Matrix3Xd>;
using FaceForces = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostSolidFaceNodes>;

/// An integration point of a face: what an integral over it needs.
struct FacePoint {
    FaceValues values; ///< shape functions, n [-]
    Vec3 place;        ///< [m]
    Vec3 area;         ///< outward normal times the area that the point stands for [m^2]
};

/// Place, tangents and normal of a face at an integration point.
FacePoint face_point(const FacePoints& X, const QuadraturePoint& p);

/// Forces of a pressure that pushes against the face: 3 x n [N]. Their sum and moment are exact.
/// @param pressure  [Pa], > 0 pushes inwards
FaceForces pressure_forces(const FacePoints& X, double pressure);

/// Most degrees of freedom of a face.
constexpr int kMostFaceDofs = 3 * kMostSolidFaceNodes;
using FaceTangent =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostFaceDofs, kMostFaceDofs>;

/// Derivative of pressure_forces by the places: 3n x 3n [N/m]. Not symmetric; summed over faces,
/// what is skew is left at the rim of their surface alone.
FaceTangent pressure_tangent(const FacePoints& X, double pressure);

/// Forces of a constant force per area: 3 x n [N].
/// @param traction  [Pa]
FaceForces traction_forces(const FacePoints& X, const Vec3& traction);

/// Stiffness of springs per area between the face and what stands still: 3n x 3n [N/m], symmetric.
/// @param normal, tangential  along the face's normal and across it [N/m^3]
FaceTangent support_stiffness(const FacePoints& X, double normal, double tangential);

} // namespace amontons
