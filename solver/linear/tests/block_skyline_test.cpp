#include "solver/linear/block_skyline.hpp"

#include "solver/linear/tests/chain_matrix.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

/// The same matrix as blocks and dense; rows begin up to `width` blocks before the diagonal.
struct SkylineMatrix {
    BlockSkyline blocks;
    Eigen::MatrixXd dense;
};

SkylineMatrix random_skyline(int nodes, int width, bool symmetric, double diagonal, unsigned seed)
{
    std::mt19937 rng{seed};
    std::uniform_real_distribution<double> uniform{-1, 1};
    std::uniform_int_distribution<int> reach{0, width};
    std::vector<int> top;
    for (int i = 0; i < nodes; ++i)
        top.push_back(std::max(0, i - reach(rng)));
    SkylineMatrix m;
    m.blocks.set_pattern(top);
    m.dense = Eigen::MatrixXd::Zero(6 * nodes, 6 * nodes);
    for (int i = 0; i < nodes; ++i)
        for (int j = top[std::size_t(i)]; j <= i; ++j)
            for (int r = 0; r < 6; ++r)
                for (int c = 0; c < 6; ++c) {
                    if (i == j && symmetric && c > r) continue;
                    const double a = uniform(rng) + (i == j && r == c ? diagonal : 0);
                    const double b = symmetric ? a : uniform(rng);
                    m.dense(6 * i + r, 6 * j + c) = m.blocks.block(i, j)(r, c) = a;
                    if (i == j && !symmetric) continue;
                    m.dense(6 * j + c, 6 * i + r) = m.blocks.block(j, i)(c, r) = b;
                }
    return m;
}

double error_of_solve(const SkylineMatrix& m, const BlockSkyline& factored)
{
    std::mt19937 rng{7};
    std::uniform_real_distribution<double> uniform{-1, 1};
    const Eigen::VectorXd x =
        Eigen::VectorXd::NullaryExpr(m.dense.rows(), [&](Eigen::Index) { return uniform(rng); });
    const Eigen::VectorXd b = m.dense * x;
    std::vector<Node6> nodes = test::node_values(b);
    factored.solve(nodes);
    double worst = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (int k = 0; k < 6; ++k)
            worst = std::max(worst, std::abs(nodes[i].value[k] - x[6 * Eigen::Index(i) + k]));
    return worst;
}

} // namespace

TEST_CASE("a skyline of blocks is solved as the dense matrix is")
{
    for (int width : {0, 1, 3, 6})
        for (bool symmetric : {true, false}) {
            CAPTURE(width);
            CAPTURE(symmetric);
            SkylineMatrix m = random_skyline(40, width, symmetric, 12, 3);
            m.blocks.factor(0);
            CHECK(error_of_solve(m, m.blocks) < 1e-12);
        }
}

TEST_CASE("negative pivots of a symmetric skyline are its negative eigenvalues")
{
    for (double diagonal : {-6.0, 0.0, 2.0, 12.0}) {
        CAPTURE(diagonal);
        SkylineMatrix m = random_skyline(20, 4, true, diagonal, 11);
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(m.dense);
        CHECK(m.blocks.factor(0) == (eigen.eigenvalues().array() < 0).count());
    }
}

TEST_CASE("a skyline is factored again from the node that changed")
{
    SkylineMatrix m = random_skyline(30, 4, false, 12, 5);
    BlockSkyline work;
    std::vector<int> top;
    for (int i = 0; i < 30; ++i)
        top.push_back(m.blocks.top(i));
    work.set_pattern(top);
    work.copy_from(m.blocks, 0);
    work.factor(0);
    for (int row : {17, 25}) {
        m.blocks.block(row, row)(2, 3) += 1.5;
        m.dense(6 * row + 2, 6 * row + 3) += 1.5;
    }
    work.copy_from(m.blocks, 17);
    work.factor(17);
    CHECK(error_of_solve(m, work) < 1e-12);
}
