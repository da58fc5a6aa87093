#include "mesh/base/dense.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <random>
#include <utility>

using namespace amontons;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kDigits = 1e-12; // what is left of rounding in matrices of size one

class RandomDense {
public:
    explicit RandomDense(unsigned seed) : rng_(seed) {}

    MatrixXd matrix(Index rows, Index columns)
    {
        return MatrixXd::NullaryExpr(rows, columns, [&](Index, Index) { return uniform_(rng_); });
    }
    VectorXd vector(Index n) { return matrix(n, 1).col(0); }
    /// With values far enough from 0 that a system of it keeps its digits.
    MatrixXd regular(Index n) { return matrix(n, n) + 2 * std::sqrt(n) * MatrixXd::Identity(n, n); }
    MatrixXd symmetric(Index n)
    {
        const MatrixXd A = matrix(n, n);
        return A + A.transpose();
    }
    MatrixXd positive(Index n)
    {
        const MatrixXd A = matrix(n, n);
        return A * A.transpose() + MatrixXd::Identity(n, n);
    }
    /// Of this rank, as a product.
    MatrixXd of_rank(Index rows, Index columns, Index rank)
    {
        return matrix(rows, rank) * matrix(rank, columns);
    }

private:
    std::mt19937 rng_;
    std::uniform_real_distribution<double> uniform_{-1, 1};
};

double largest(const MatrixXd& A)
{
    if (!A.allFinite()) return std::numeric_limits<double>::infinity();
    return A.size() == 0 ? 0 : A.cwiseAbs().maxCoeff();
}

bool same(const MatrixXd& A, const MatrixXd& B)
{
    return A.rows() == B.rows() && A.cols() == B.cols() &&
           largest(A - B) <= kDigits * std::max({1.0, largest(A), largest(B)});
}

bool orthogonal(const MatrixXd& V)
{
    return same(V.transpose() * V, MatrixXd::Identity(V.cols(), V.cols()));
}

bool ascends(const VectorXd& values)
{
    for (Index i = 1; i < values.size(); ++i)
        if (!(values[i - 1] <= values[i])) return false;
    return true;
}

/// Nothing but the lower triangle.
template <class Matrix> Matrix lower_only(Matrix S)
{
    for (Index j = 1; j < S.cols(); ++j)
        S.col(j).head(j).setConstant(std::numeric_limits<double>::quiet_NaN());
    return S;
}

template <class Matrix> void check_eigen(const Matrix& S)
{
    const auto eigen = symmetric_eigen(lower_only(S));
    CHECK(ascends(eigen.values));
    CHECK(orthogonal(eigen.vectors));
    CHECK(same(eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose(), S));
    CHECK(same(symmetric_eigenvalues(lower_only(S)), eigen.values));
}

void check_rotation(const Vec3& from, const Vec3& to)
{
    const Eigen::Quaterniond turn = rotation_between(from, to);
    CHECK(turn.norm() == doctest::Approx(1).epsilon(kDigits));
    CHECK(same(turn * from.normalized(), to.normalized()));
    // The shortest: it turns by the angle between the two, about an axis across both.
    CHECK(std::abs(turn.w()) ==
          doctest::Approx(std::cos(0.5 * std::atan2(from.cross(to).norm(), from.dot(to))))
              .epsilon(kDigits));
    CHECK(std::abs(turn.vec().dot(from.normalized())) <= kDigits);
    CHECK(std::abs(turn.vec().dot(to.normalized())) <= kDigits);
}

} // namespace

TEST_CASE("a symmetric matrix is its eigenvalues along orthogonal axes and only its lower triangle "
          "is read")
{
    RandomDense random(1);
    for (const Index n : {1, 2, 3, 5, 12, 40})
        check_eigen(random.symmetric(n));
    for (int k = 0; k < 20; ++k) {
        const Mat3 S = random.symmetric(3);
        CHECK(same(symmetric_eigenvalues(lower_only(S)), symmetric_eigenvalues(MatrixXd(S))));
        check_eigen(Mat6(random.symmetric(6)));
    }
    CHECK(same(symmetric_eigenvalues(Mat3(Mat3::Identity())), Vec3::Ones()));
    check_eigen(Mat6(Mat6::Zero()));
}

TEST_CASE("the sum of eigenvalues is the trace and that of their squares the square of the norm")
{
    RandomDense random(2);
    for (const Index n : {1, 4, 30}) {
        const MatrixXd S = random.symmetric(n);
        const VectorXd values = symmetric_eigenvalues(S);
        CHECK(values.sum() == doctest::Approx(S.trace()).epsilon(kDigits));
        CHECK(values.squaredNorm() == doctest::Approx(S.squaredNorm()).epsilon(kDigits));
    }
}

TEST_CASE("eigenvalues that are not a number are reported not to have converged")
{
    MatrixXd S = MatrixXd::Identity(4, 4);
    CHECK(symmetric_eigen(S).converged);
    S(2, 1) = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(symmetric_eigen(S).converged);
}

TEST_CASE("a generalised problem holds for each pair and its vectors are orthonormal in the second "
          "matrix")
{
    RandomDense random(3);
    for (const Index n : {1, 3, 8, 25}) {
        const MatrixXd A = random.symmetric(n), B = random.positive(n);
        const SymmetricEigen eigen = generalised_eigen(A, B);
        CHECK(eigen.converged);
        CHECK(ascends(eigen.values));
        CHECK(same(A * eigen.vectors, B * eigen.vectors * eigen.values.asDiagonal()));
        CHECK(same(eigen.vectors.transpose() * B * eigen.vectors, MatrixXd::Identity(n, n)));
    }
}

TEST_CASE("a system solved by LU holds and its inverse and determinant are those of the matrix")
{
    RandomDense random(4);
    for (const Index n : {1, 2, 7, 40}) {
        const MatrixXd A = random.regular(n), B = random.matrix(n, 5);
        const VectorXd b = random.vector(n);
        const LuFactor lu(A);
        CHECK(same(A * lu.solve(b), b));
        CHECK(same(A * lu.solve_all(B), B));
        CHECK(same(A * lu.inverse(), MatrixXd::Identity(n, n)));
        const double twice = LuFactor(A * A).determinant();
        CHECK(twice == doctest::Approx(lu.determinant() * lu.determinant()).epsilon(1e-9));
    }
    // Pivots of 0 where they stand, and an odd exchange.
    MatrixXd exchange = MatrixXd::Zero(3, 3);
    exchange(0, 1) = exchange(1, 0) = 1;
    exchange(2, 2) = 3;
    CHECK(LuFactor(exchange).determinant() == -3);
    CHECK(LuFactor(exchange).solve(Vec3(1, 2, 3)) == Vec3(2, 1, 1));
    CHECK(LuFactor(MatrixXd(0, 0)).determinant() == 1);
}

TEST_CASE("a copy of an LU keeps its matrix when the first takes another")
{
    RandomDense random(5);
    const MatrixXd A = random.regular(6), B = random.regular(4);
    const VectorXd a = random.vector(6), b = random.vector(4);
    LuFactor first(A);
    const LuFactor copy(first);
    first.compute(B);
    CHECK(same(A * copy.solve(a), a));
    CHECK(same(B * first.solve(b), b));
    LuFactor assigned;
    assigned = copy;
    const LuFactor moved(std::move(first));
    CHECK(same(A * assigned.solve(a), a));
    CHECK(same(B * moved.solve(b), b));
}

TEST_CASE("a symmetric system holds by LDLT also with eigenvalues of both signs")
{
    RandomDense random(6);
    for (const Index n : {1, 2, 9, 30}) {
        MatrixXd A = random.symmetric(n);
        A.diagonal().array() += 2 * std::sqrt(double(n));
        A.diagonal()[n - 1] -= 6 * std::sqrt(double(n));
        const MatrixXd B = random.matrix(n, 4);
        const VectorXd b = random.vector(n);
        const LdltFactor ldl(A);
        CHECK(same(A * ldl.solve(b), b));
        CHECK(same(A * ldl.solve_all(B), B));
    }
}

TEST_CASE("the root of a matrix without negative eigenvalues times its transpose is the matrix")
{
    RandomDense random(7);
    for (const Index n : {1, 3, 10, 30}) {
        const MatrixXd A = random.positive(n);
        const MatrixXd G = LdltFactor(A).root();
        CHECK(same(G * G.transpose(), A));
        const MatrixXd low = random.matrix(n, (n + 1) / 2);
        const MatrixXd S = low * low.transpose(); // of half the rank
        const MatrixXd H = LdltFactor(S).root();
        CHECK(same(H * H.transpose(), S));
    }
}

TEST_CASE("a matrix is positive definite if and only if its least eigenvalue is positive")
{
    RandomDense random(8);
    for (const Index n : {1, 4, 20, 60}) {
        MatrixXd A = random.symmetric(n);
        const double least = symmetric_eigenvalues(A)[0];
        for (const double above : {-1e-6, 1e-6}) {
            MatrixXd shifted = A;
            shifted.diagonal().array() += above - least;
            const bool positive = above > 0;
            CHECK(is_positive_definite(MatrixXd(shifted)) == positive);
            const MatrixXd U = cholesky_root(shifted);
            CHECK((U.size() > 0) == positive);
            if (!positive) continue;
            CHECK(same(U.transpose() * U, shifted));
            CHECK(MatrixXd(U.triangularView<Eigen::StrictlyLower>()).isZero(0));
        }
    }
}

TEST_CASE("systems of three to six unknowns hold")
{
    RandomDense random(9);
    for (int k = 0; k < 50; ++k) {
        const Mat3 A3 = random.regular(3), S3 = random.positive(3);
        const Vec3 b3 = random.vector(3);
        CHECK(same(A3 * solve_small(A3, b3), b3));
        CHECK(same(A3.transpose() * solve_transposed(A3, b3), b3));
        CHECK(same(S3 * solve_symmetric(S3, b3), b3));
        const Eigen::Matrix4d A4 = random.regular(4);
        const Eigen::Vector4d b4 = random.vector(4);
        CHECK(same(A4 * solve_small(A4, b4), b4));
        const Mat6 A6 = random.regular(6);
        CHECK(same(A6 * inverse_of(A6), Mat6::Identity()));
    }
}

TEST_CASE("a system solved by full pivots holds also without full rank where it can")
{
    RandomDense random(10);
    for (const Index n : {1, 4, 20}) {
        const MatrixXd A = random.regular(n);
        const VectorXd b = random.vector(n);
        CHECK(same(A * solve_full_pivots(A, b), b));
    }
    // Without full rank, as many unknowns as that are used.
    const MatrixXd A = random.of_rank(7, 7, 4);
    const VectorXd b = A * random.vector(7), x = solve_full_pivots(A, b);
    CHECK(same(A * x, b));
    CHECK((x.array() != 0).count() == 4);
}

TEST_CASE("what least squares leave is across all columns")
{
    RandomDense random(11);
    for (const auto& [rows, columns] : {std::pair<Index, Index>{5, 5}, {9, 4}, {50, 20}, {3, 1}}) {
        const MatrixXd A = random.matrix(rows, columns);
        const VectorXd b = random.vector(rows);
        const VectorXd left = A * least_squares(A, b) - b;
        CHECK(largest(A.transpose() * left) <= kDigits * double(rows));
        if (rows == columns) CHECK(largest(left) <= 1e-10);
    }
}

TEST_CASE("of the least squares of a matrix without full rank the shortest is in the space of its "
          "rows")
{
    RandomDense random(12);
    constexpr double kThreshold = 1e-10;
    for (const Index rank : {1, 3, 6}) {
        const MatrixXd A = random.of_rank(9, 8, rank);
        const VectorXd b = random.vector(9);
        const VectorXd x = shortest_least_squares(A, b, kThreshold);
        CHECK(largest(A.transpose() * (A * x - b)) <= 1e-11);
        // Whatever A does not see is across it, so nothing shorter fits as well.
        const RightSingular svd = right_singular(A);
        CHECK(largest(svd.V.rightCols(8 - rank).transpose() * x) <= 1e-11);
    }
    // A column of 1e-8 counts or not, depending on the threshold.
    MatrixXd A = MatrixXd::Identity(3, 3);
    A(2, 2) = 1e-8;
    CHECK(same(shortest_least_squares(A, Vec3(1, 2, 3), 1e-6), Vec3(1, 2, 0)));
    CHECK(same(shortest_least_squares(A, Vec3(1, 2, 3), 1e-10), Vec3(1, 2, 3e8)));
}

TEST_CASE("the shortest rotation takes one direction into another also where they are opposite")
{
    RandomDense random(13);
    for (int k = 0; k < 50; ++k) {
        const Vec3 from = random.vector(3), to = 5 * random.vector(3);
        check_rotation(from, to);
        check_rotation(from, 3 * from);
    }
    // About any axis across, where they are opposite.
    for (const Vec3& d : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(-Vec3::UnitZ()),
                          Vec3(1, -2, 3), Vec3(1e-3, 1, 0)}) {
        const Eigen::Quaterniond turn = rotation_between(d, -2 * d);
        CHECK(turn.norm() == doctest::Approx(1).epsilon(kDigits));
        CHECK(largest(turn * d.normalized() + d.normalized()) <= 1e-7);
    }
}

TEST_CASE("singular values descend along orthogonal axes on both sides")
{
    RandomDense random(14);
    for (int k = 0; k < 30; ++k) {
        const Mat3 A = k == 0 ? MatrixXd(MatrixXd::Zero(3, 3)) : random.of_rank(3, 3, 1 + k % 3);
        const SingularValues3 svd = singular_values(A);
        CHECK(ascends(-svd.values));
        CHECK(svd.values[2] >= 0);
        CHECK(orthogonal(svd.U));
        CHECK(orthogonal(svd.V));
        CHECK(same(svd.U * svd.values.asDiagonal() * svd.V.transpose(), A));
    }
}

TEST_CASE("right singular vectors are axes along which columns are across each other")
{
    RandomDense random(15);
    for (const auto& [rows, columns] : {std::pair<Index, Index>{6, 6}, {20, 6}, {5, 1}}) {
        const MatrixXd A = random.matrix(rows, columns);
        const RightSingular svd = right_singular(A);
        CHECK(ascends(-svd.values));
        CHECK(orthogonal(svd.V));
        const MatrixXd turned = A * svd.V;
        CHECK(same(turned.transpose() * turned,
                   MatrixXd(svd.values.array().square().matrix().asDiagonal())));
    }
}
