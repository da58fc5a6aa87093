#include "mesh/base/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace amontons {
namespace {

template <class Matrix> auto values_of(const Matrix& S)
{
    return Eigen::SelfAdjointEigenSolver<Matrix>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

} // namespace

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& S) { return values_of(S); }
Vec3 symmetric_eigenvalues(const Mat3& S) { return values_of(S); }
Vec6 symmetric_eigenvalues(const Mat6& S) { return values_of(S); }

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& S)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
    return {eigen.eigenvalues(), eigen.eigenvectors()};
}

SymmetricEigen3 symmetric_eigen(const Mat3& S)
{
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(S);
    return {eigen.eigenvalues(), eigen.eigenvectors()};
}

SymmetricEigen6 symmetric_eigen(const Mat6& S)
{
    const Eigen::SelfAdjointEigenSolver<Mat6> eigen(S);
    return {eigen.eigenvalues(), eigen.eigenvectors()};
}

SymmetricEigen generalised_eigen(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B)
{
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A, B);
    return {eigen.eigenvalues(), eigen.eigenvectors()};
}

struct LuFactor::Factor {
    Eigen::PartialPivLU<Eigen::MatrixXd> lu;
};

LuFactor::LuFactor() : factor_(std::make_unique<Factor>()) {}
LuFactor::LuFactor(const Eigen::MatrixXd& A) : LuFactor() { compute(A); }
LuFactor::LuFactor(LuFactor&&) noexcept = default;
LuFactor& LuFactor::operator=(LuFactor&&) noexcept = default;
LuFactor::LuFactor(const LuFactor& other) : factor_(std::make_unique<Factor>(*other.factor_)) {}
LuFactor& LuFactor::operator=(const LuFactor& other)
{
    factor_ = std::make_unique<Factor>(*other.factor_);
    return *this;
}
LuFactor::~LuFactor() = default;

void LuFactor::compute(const Eigen::MatrixXd& A) { factor_->lu.compute(A); }
Eigen::VectorXd LuFactor::solve(const Eigen::VectorXd& b) const { return factor_->lu.solve(b); }
Eigen::MatrixXd LuFactor::solve_all(const Eigen::MatrixXd& B) const { return factor_->lu.solve(B); }
Eigen::MatrixXd LuFactor::inverse() const { return factor_->lu.inverse(); }
double LuFactor::determinant() const { return factor_->lu.determinant(); }

struct LdltFactor::Factor {
    Eigen::LDLT<Eigen::MatrixXd> ldlt;
};

LdltFactor::LdltFactor(const Eigen::MatrixXd& A)
    : factor_(std::make_unique<Factor>(Factor{Eigen::LDLT<Eigen::MatrixXd>(A)}))
{
}
LdltFactor::~LdltFactor() = default;

Eigen::VectorXd LdltFactor::solve(const Eigen::VectorXd& b) const { return factor_->ldlt.solve(b); }
Eigen::MatrixXd LdltFactor::solve_all(const Eigen::MatrixXd& B) const { return factor_->ldlt.solve(B); }

Eigen::MatrixXd LdltFactor::root() const
{
    const Eigen::LDLT<Eigen::MatrixXd>& ldl = factor_->ldlt;
    Eigen::MatrixXd G = ldl.matrixL();
    G = ldl.transpositionsP().transpose() *
        (G * ldl.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal());
    return G;
}

bool is_positive_definite(Eigen::MatrixXd&& A)
{
    return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(A).info() == Eigen::Success;
}

Eigen::MatrixXd cholesky_root(const Eigen::MatrixXd& A)
{
    const Eigen::LLT<Eigen::MatrixXd> root(A);
    if (root.info() != Eigen::Success) return {};
    return root.matrixU();
}

Eigen::Vector2d solve_small(const Eigen::Matrix2d& A, const Eigen::Vector2d& b)
{
    return A.partialPivLu().solve(b);
}
Vec3 solve_small(const Mat3& A, const Vec3& b) { return A.partialPivLu().solve(b); }
Eigen::Vector4d solve_small(const Eigen::Matrix4d& A, const Eigen::Vector4d& b)
{
    return A.partialPivLu().solve(b);
}
Vec3 solve_symmetric(const Mat3& A, const Vec3& b) { return A.ldlt().solve(b); }
Mat6 inverse_of(const Mat6& A) { return A.partialPivLu().inverse(); }

Eigen::VectorXd solve_full_pivots(const Eigen::MatrixXd& A, const Eigen::VectorXd& b)
{
    return A.fullPivLu().solve(b);
}

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
