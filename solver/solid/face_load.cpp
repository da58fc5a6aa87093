#include "solver/solid/face_load.hpp"

#include <Eigen/Geometry>

namespace amontons {

FacePoint face_point(const FacePoints& X, const QuadraturePoint& p)
{
    const int n = static_cast<int>(X.cols());
    const Eigen::Matrix<double, 3, 2> T = X * face_shape_gradients(n, p.xi).transpose();
    FacePoint point{face_shape_values(n, p.xi), {}, p.weight * T.col(0).cross(T.col(1))};
    point.place = X * point.values;
    return point;
}

FaceForces pressure_forces(const FacePoints& X, double pressure)
{
    FaceForces f = FaceForces::Zero(3, X.cols());
    for (const QuadraturePoint& p : face_points(static_cast<int>(X.cols()))) {
        const FacePoint at = face_point(X, p);
        f.noalias() -= pressure * at.area * at.values.transpose();
    }
    return f;
}

FaceForces traction_forces(const FacePoints& X, const Vec3& traction)
{
    FaceForces f = FaceForces::Zero(3, X.cols());
    for (const QuadraturePoint& p : face_points(static_cast<int>(X.cols()))) {
        const FacePoint at = face_point(X, p);
        f.noalias() += at.area.norm() * traction * at.values.transpose();
    }
    return f;
}

} // namespace amontons
