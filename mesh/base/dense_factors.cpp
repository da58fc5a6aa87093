#include "mesh/base/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace amontons {

struct LuFactor::Factor {
    Eigen::PartialPivLU<Eigen::MatrixXd> lu;
};

LuFactor::LuFactor() : factor_(std::make_unique<Factor>()) {}
LuFactor::LuFactor(const Eigen::MatrixXd& A) : LuFactor()
{
    compute(A);
}
LuFactor::LuFactor(LuFactor&&) noexcept = default;
LuFactor& LuFactor::operator=(LuFactor&&) noexcept = default;
LuFactor::LuFactor(const LuFactor& other) : factor_(std::make_unique<Factor>(*other.factor_)) {}
LuFactor& LuFactor::operator=(const LuFactor& other)
{
    factor_ = std::make_unique<Factor>(*other.factor_);
    return *this;
}
LuFactor::~LuFactor() = default;

void LuFactor::compute(const Eigen::MatrixXd& A)
{
    factor_->lu.compute(A);
}
Eigen::VectorXd LuFactor::solve(const Eigen::VectorXd& b) const
{
    return factor_->lu.solve(b);
}
Eigen::MatrixXd LuFactor::solve_all(const Eigen::MatrixXd& B) const
{
    return factor_->lu.solve(B);
}
Eigen::MatrixXd LuFactor::inverse() const
{
    return factor_->lu.inverse();
}
double LuFactor::determinant() const
{
    return factor_->lu.determinant();
}

struct LdltFactor::Factor {
    Eigen::LDLT<Eigen::MatrixXd> ldlt;
};

LdltFactor::LdltFactor(const Eigen::MatrixXd& A)
    : factor_(std::make_unique<Factor>(Factor{Eigen::LDLT<Eigen::MatrixXd>(A)}))
{
}
LdltFactor::~LdltFactor() = default;

Eigen::VectorXd LdltFactor::solve(const Eigen::VectorXd& b) const
{
    return factor_->ldlt.solve(b);
}
Eigen::MatrixXd LdltFactor::solve_all(const Eigen::MatrixXd& B) const
{
    return factor_->ldlt.solve(B);
}

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

Vec3 solve_small(const Mat3& A, const Vec3& b)
{
    return A.partialPivLu().solve(b);
}
Eigen::Vector4d solve_small(const Eigen::Matrix4d& A, const Eigen::Vector4d& b)
{
    return A.partialPivLu().solve(b);
}
Vec3 solve_transposed(const Mat3& A, const Vec3& b)
{
    return A.transpose().partialPivLu().solve(b);
}
Vec3 solve_symmetric(const Mat3& A, const Vec3& b)
{
    return A.ldlt().solve(b);
}
Mat6 inverse_of(const Mat6& A)
{
    return A.partialPivLu().inverse();
}

Eigen::VectorXd solve_full_pivots(const Eigen::MatrixXd& A, const Eigen::VectorXd& b)
{
    return A.fullPivLu().solve(b);
}

} // namespace amontons
