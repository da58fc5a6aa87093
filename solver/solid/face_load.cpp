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

FaceTangent pressure_tangent(const FacePoints& X, double pressure)
{
    const int n = static_cast<int>(X.cols());
    FaceTangent K = FaceTangent::Zero(3 * n, 3 * n);
    const auto cross = [](const Vec3& a) {
        Mat3 m;
        m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
        return m;
    };
    for (const QuadraturePoint& p : face_points(n)) {
        const auto N = face_shape_values(n, p.xi);
        const auto dN = face_shape_gradients(n, p.xi);
        const Eigen::Matrix<double, 3, 2> T = X * dN.transpose();
        const Mat3 first = cross(T.col(0)), second = cross(T.col(1));
        for (int j = 0; j < n; ++j) { // d(t1 x t2) = t1 x dt2 - t2 x dt1
            const Mat3 of_area = dN(1, j) * first - dN(0, j) * second;
            for (int i = 0; i < n; ++i)
                K.block<3, 3>(3 * i, 3 * j) -= (pressure * p.weight * N[i]) * of_area;
        }
    }
    return K;
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

FaceTangent support_stiffness(const FacePoints& X, double normal, double tangential)
{
    const int n = static_cast<int>(X.cols());
    FaceTangent K = FaceTangent::Zero(3 * n, 3 * n);
    for (const QuadraturePoint& p : face_points(n)) {
        const FacePoint at = face_point(X, p);
        const double area = at.area.norm();
        const Vec3 out = at.area / area;
        const Mat3 k =
            area * (tangential * Mat3::Identity() + (normal - tangential) * out * out.transpose());
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i)
                K.block<3, 3>(3 * i, 3 * j) += at.values[i] * at.values[j] * k;
    }
    return K;
}

} // namespace amontons
