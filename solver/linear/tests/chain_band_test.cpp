#include "solver/linear/chain_band.hpp"

#include "solver/linear/tests/chain_matrix.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>
#include <random>

using namespace amontons;
using test::ChainMatrix;

namespace {

ChainMatrix random_band(int nodes, bool symmetric, double diagonal, unsigned seed)
{
    std::mt19937 rng{seed};
    std::uniform_real_distribution<double> uniform{-1, 1};
    Eigen::MatrixXd A =
        Eigen::MatrixXd::NullaryExpr(6 * nodes, 6 * nodes, [&] { return uniform(rng); });
    if (symmetric) A = (0.5 * (A + A.transpose())).eval();
    A.diagonal().array() += diagonal;
    return test::chain_matrix(A);
}

Eigen::VectorXd solved(const ChainBand& band, const Eigen::VectorXd& b)
{
    std::vector<Node6> x = test::node_values(b);
    band.solve(x);
    return test::vector_of(x);
}

} // namespace

TEST_CASE("a band solves as a dense LU with pivoting does whether symmetric or not")
{
    for (int n : {1, 2, 3, 7, 40})
        for (bool symmetric : {true, false}) {
            CAPTURE(n);
            CAPTURE(symmetric);
            const ChainMatrix m = random_band(n, symmetric, 8, unsigned(n));
            const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6 * n, -1, 2);
            ChainBand band;
            band.factor(m.blocks, 0);
            const Eigen::VectorXd exact = m.dense.partialPivLu().solve(b);
            CHECK((solved(band, b) - exact).norm() < 1e-12 * exact.norm());
        }
    const int n = 9, first = 4;
    const ChainMatrix m = random_band(n, false, 8, 3);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6 * n, -1, 2);
    ChainBand band;
    band.factor(m.blocks, first);
    const Eigen::Index rows = 6 * (n - first);
    const Eigen::VectorXd exact =
        m.dense.bottomRightCorner(rows, rows).partialPivLu().solve(b.tail(rows));
    const Eigen::VectorXd got = solved(band, b);
    CHECK((got.tail(rows) - exact).norm() < 1e-12 * exact.norm());
    CHECK(got.head(6 * first) == b.head(6 * first)); // not touched
}

TEST_CASE("pivots of a band that are not positive are a symmetric matrix' negative eigenvalues")
{
    int most = 0;
    for (unsigned seed = 1; seed <= 40; ++seed) {
        CAPTURE(seed);
        const ChainMatrix m = random_band(6, true, 0.15 * seed, seed);
        const Eigen::VectorXd values =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(m.dense, Eigen::EigenvaluesOnly)
                .eigenvalues();
        const int negative = int((values.array() < 0).count());
        most = std::max(most, negative);
        ChainBand band;
        CHECK(band.factor(m.blocks, 0) == negative);
    }
    CHECK(most > 10); // else the law was tried on positive definite matrices only
}

TEST_CASE("a band loses the condition of a chain and not its square")
{
    // A chain of springs along a half circle, 1e10 stiff along it and 1 across and in turning, the
    // first node held: right to 1e-16 times the condition and a small factor. Elimination by
    // inverses of blocks has no digit left.
    const int n = 30;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(6 * n, 6 * n);
    for (int i = 0; i < n; ++i) {
        const double a = std::numbers::pi * i / n;
        Vec6 along = Vec6::Zero();
        along[0] = std::cos(a), along[1] = std::sin(a);
        const Mat6 k = Mat6::Identity() + 1e10 * along * along.transpose();
        A.block<6, 6>(6 * i, 6 * i) += k;
        if (i == 0) continue;
        A.block<6, 6>(6 * i - 6, 6 * i - 6) += k;
        A.block<6, 6>(6 * i - 6, 6 * i) -= k;
        A.block<6, 6>(6 * i, 6 * i - 6) -= k;
    }
    const ChainMatrix m = test::chain_matrix(A);
    const Eigen::VectorXd exact = Eigen::VectorXd::LinSpaced(6 * n, 1, 2);
    Eigen::VectorXd b(6 * n);
    for (Eigen::Index i = 0; i < b.size(); ++i) { // rounded once
        long double sum = 0;
        for (Eigen::Index j = 0; j < b.size(); ++j)
            sum += static_cast<long double>(m.dense(i, j)) * exact[j];
        b[i] = double(sum);
    }
    ChainBand band;
    CHECK(band.factor(m.blocks, 0) == 0);
    CHECK((solved(band, b) - exact).norm() < 1e-3 * exact.norm());
}
