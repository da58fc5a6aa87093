#include "contact/linear/dense_lu.hpp"

#include <Eigen/Dense>
#include <doctest/doctest.h>

#include <random>

using namespace amontons;

namespace {

/// W + D: W of the given rank, D's 3 x 3 blocks of positive definite symmetric part with a skew
/// one.
Eigen::MatrixXd random_of_rank(int rows, int rank, double stiff, std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    const auto random = [&] { return normal(rng); };
    const Eigen::MatrixXd G = Eigen::MatrixXd::NullaryExpr(rows, rank, random);
    Eigen::MatrixXd A = G * G.transpose() / rank;
    for (int i = 0; i < rows; i += 3) {
        const int size = std::min(3, rows - i);
        const Mat3 skew = Mat3::NullaryExpr(random);
        const double scale = i % 2 ? 1 : stiff;
        A.block(i, i, size, size) +=
            scale * (0.1 * Mat3::Identity() + skew - skew.transpose()).topLeftCorner(size, size);
    }
    return A;
}

double relative_residual(DenseLu& lu, const Eigen::MatrixXd& A, std::mt19937& rng)
{
    const int rows = static_cast<int>(A.rows());
    lu.open(rows);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < rows; ++i)
            lu.column(j)[i] = A(i, j);
    if (!lu.factorise()) return std::numeric_limits<double>::infinity();
    std::normal_distribution<double> normal;
    const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(rows, [&] { return normal(rng); });
    Eigen::VectorXd x = b;
    lu.solve(x);
    return (A * x - b).norm() / (A.norm() * x.norm() + b.norm());
}

} // namespace

TEST_CASE("a dense factor of any size solves to round-off one object after another")
{
    std::mt19937 rng{1};
    DenseLu lu;
    // Around whole blocks of columns, whole vectors, and once smaller than before.
    for (const int rows : {1, 2, 3, 7, 8, 9, 23, 24, 25, 47, 48, 49, 100, 201, 30, 4}) {
        CAPTURE(rows);
        CHECK(relative_residual(lu, random_of_rank(rows, rows, 1, rng), rng) <= 1e-13);
    }
}

TEST_CASE("a dense factor is accurate for a W of low rank beside stiff contacts")
{
    std::mt19937 rng{2};
    DenseLu lu;
    for (const double stiff : {1e-6, 1.0, 1e6, 1e10})
        for (const int rank : {1, 10, 60}) {
            CAPTURE(stiff);
            CAPTURE(rank);
            CHECK(relative_residual(lu, random_of_rank(120, rank, stiff, rng), rng) <= 1e-9);
        }
}

TEST_CASE("a dense factor refuses what it cannot divide by")
{
    std::mt19937 rng{3};
    DenseLu lu;
    CHECK(!std::isfinite(relative_residual(lu, Eigen::MatrixXd::Zero(5, 5), rng)));
    Eigen::MatrixXd A = Eigen::MatrixXd::Identity(30, 30);
    A(28, 28) = std::numeric_limits<double>::quiet_NaN();
    CHECK(!std::isfinite(relative_residual(lu, A, rng)));
}
