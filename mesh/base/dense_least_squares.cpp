#include "mesh/base/dense.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace amontons {

Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b)
{
    return A.colPivHouseholderQr().solve(b);
}

Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                       double threshold)
{
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> least;
    least.setThreshold(threshold);
    least.compute(A);
    return least.solve(b);
}

Eigen::Quaternion<double> rotation_between(const Vec3& from, const Vec3& to)
{
    return Eigen::Quaterniond::FromTwoVectors(from, to);
}

SingularValues3 singular_values(const Mat3& A)
{
    const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return {svd.singularValues(), svd.matrixU(), svd.matrixV()};
}

RightSingular right_singular(const Eigen::MatrixXd& A)
{
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinV);
    return {svd.singularValues(), svd.matrixV()};
}

} // namespace amontons
