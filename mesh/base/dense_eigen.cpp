#include "mesh/base/dense.hpp"

#include <Eigen/Eigenvalues>

namespace amontons {
namespace {

template <class Matrix> auto values_of(const Matrix& S)
{
    return Eigen::SelfAdjointEigenSolver<Matrix>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

} // namespace

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& S)
{
    return values_of(S);
}
Vec3 symmetric_eigenvalues(const Mat3& S)
{
    return values_of(S);
}
Vec6 symmetric_eigenvalues(const Mat6& S)
{
    return values_of(S);
}

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& S)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
    return {eigen.eigenvalues(), eigen.eigenvectors(), eigen.info() == Eigen::Success};
}

SymmetricEigen6 symmetric_eigen(const Mat6& S)
{
    const Eigen::SelfAdjointEigenSolver<Mat6> eigen(S);
    return {eigen.eigenvalues(), eigen.eigenvectors()};
}

SymmetricEigen generalised_eigen(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B)
{
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A, B);
    return {eigen.eigenvalues(), eigen.eigenvectors(), eigen.info() == Eigen::Success};
}

} // namespace amontons
