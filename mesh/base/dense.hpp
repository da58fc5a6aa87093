#pragma once

#include "mesh/base/types.hpp"

#include <memory>

// Factors, eigenvalues and least squares of dense matrices: Eigen's, compiled once (dense_*.cpp).
// Each of Eigen's classes costs a file that uses it one to seven seconds of compiling, so no other
// file of the program uses them (docs/build.md). Digits are those of Eigen's class that is named
// with each function.

namespace amontons {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

// ---- symmetric eigenvalues; only the lower triangle is read (SelfAdjointEigenSolver)

/// Eigenvalues of a symmetric matrix, n, ascending.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& S);
Vec3 symmetric_eigenvalues(const Mat3& S);
Vec6 symmetric_eigenvalues(const Mat6& S);

/// S = V diag(values) V^T with values ascending and V orthogonal.
struct SymmetricEigen {
    Eigen::VectorXd values;  ///< n
    Eigen::MatrixXd vectors; ///< n x n, a column each
    bool converged = true;   ///< never false where S is finite
};
struct SymmetricEigen6 {
    /// Eigenvalues, ascending.
    Vec6 values;
    /// Unit eigenvectors, as columns.
    Mat6 vectors;
};
/// Eigenvalues, ascending, and unit eigenvectors of a symmetric matrix.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& S);
SymmetricEigen6 symmetric_eigen(const Mat6& S);

/// A v = value B v, A symmetric and B positive definite; values ascend, V^T B V = 1.
SymmetricEigen generalised_eigen(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

// ---- factors

/// P A = L U with exchange of rows (PartialPivLU).
class LuFactor {
public:
    LuFactor();
    explicit LuFactor(const Eigen::MatrixXd& A);
    LuFactor(LuFactor&&) noexcept;
    LuFactor& operator=(LuFactor&&) noexcept;
    LuFactor(const LuFactor&);
    LuFactor& operator=(const LuFactor&);
    ~LuFactor();

    /// Factors A, square and regular, as P A = L U.
    void compute(const Eigen::MatrixXd& A);
    /// A^-1 b, for one right-hand side.
    Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
    /// A^-1 B, a column for each of B.
    Eigen::MatrixXd solve_all(const Eigen::MatrixXd& B) const;
    /// A^-1.
    Eigen::MatrixXd inverse() const;
    /// Determinant of A.
    double determinant() const;

private:
    struct Factor;
    std::unique_ptr<Factor> factor_;
};

/// P A P^T = L D L^T of a symmetric matrix, with exchange of rows and columns by the diagonal
/// (LDLT).
class LdltFactor {
public:
    explicit LdltFactor(const Eigen::MatrixXd& A);
    LdltFactor(const LdltFactor&) = delete;
    LdltFactor& operator=(const LdltFactor&) = delete;
    ~LdltFactor();

    /// A^-1 b.
    Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
    /// A^-1 B.
    Eigen::MatrixXd solve_all(const Eigen::MatrixXd& B) const;
    /// G with G G^T = A, n x n; negative entries of D, which rounding leaves, are taken for 0.
    Eigen::MatrixXd root() const;

private:
    struct Factor;
    std::unique_ptr<Factor> factor_;
};

/// Is the symmetric matrix positive definite (LLT)? Its storage is overwritten.
bool is_positive_definite(Eigen::MatrixXd&& A);
/// U with U^T U = A, upper triangular (LLT); a 0 x 0 matrix where A is not positive definite.
Eigen::MatrixXd cholesky_root(const Eigen::MatrixXd& A);

// ---- single systems

/// A^-1 b, A of 3 or 4 unknowns (PartialPivLU).
Vec3 solve_small(const Mat3& A, const Vec3& b);
Eigen::Vector4d solve_small(const Eigen::Matrix4d& A, const Eigen::Vector4d& b);
/// A^-T b (PartialPivLU of a matrix stored by rows, whose digits are others).
Vec3 solve_transposed(const Mat3& A, const Vec3& b);
/// A^-1 b, A symmetric and positive (LDLT).
Vec3 solve_symmetric(const Mat3& A, const Vec3& b);
/// A^-1 (PartialPivLU).
Mat6 inverse_of(const Mat6& A);
/// A^-1 b with exchange of rows and columns (FullPivLU).
Eigen::VectorXd solve_full_pivots(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
/// The x that makes |A x - b| least (ColPivHouseholderQR).
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
/// Of these the shortest; pivots below `threshold` times the largest count as 0
/// (CompleteOrthogonalDecomposition).
Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                       double threshold);

/// The shortest rotation that turns one direction into another; neither need be of length one
/// (Quaternion::FromTwoVectors).
Eigen::Quaternion<double> rotation_between(const Vec3& from, const Vec3& to);

// ---- singular values (JacobiSVD)

/// A = U diag(values) V^T, values descending.
struct SingularValues3 {
    /// Singular values, descending.
    Vec3 values;
    /// Orthogonal matrices of A = U diag(values) V^T.
    Mat3 U, V;
};
/// The singular value decomposition of a 3 x 3 matrix.
SingularValues3 singular_values(const Mat3& A);
/// Values and V of a matrix with at least as many rows as columns.
struct RightSingular {
    Eigen::VectorXd values; ///< n, descending
    Eigen::MatrixXd V;      ///< n x n
};
/// Singular values and right singular vectors of A.
RightSingular right_singular(const Eigen::MatrixXd& A);

} // namespace amontons
