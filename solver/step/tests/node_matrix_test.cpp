#include "solver/step/node_matrix.hpp"

#include "solver/linear/tests/chain_matrix.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <doctest/doctest.h>
#include <random>

// The two formats of a matrix of nodes solve alike; of a chain only what has changed is factored.

using namespace amontons;

namespace {

using Pairs = std::vector<std::array<int, 2>>;

struct Both {
    NodeMatrix matrix;
    Eigen::MatrixXd dense;
};

/// Random blocks where a pattern has them.
Both filled(int nodes, const Pairs& coupled, unsigned seed)
{
    std::mt19937 rng{seed};
    std::uniform_real_distribution<double> uniform{-1, 1};
    Both m;
    m.matrix.set_pattern(nodes, coupled);
    m.dense = Eigen::MatrixXd::Zero(6 * nodes, 6 * nodes);
    const auto fill = [&](int i, int j) {
        for (int r = 0; r < 6; ++r)
            for (int c = 0; c < 6; ++c)
                m.matrix.block(i, j)(r, c) = m.dense(6 * i + r, 6 * j + c) =
                    uniform(rng) + (i == j && r == c ? 9 : 0);
    };
    for (int i = 0; i < nodes; ++i)
        fill(i, i);
    for (const auto& [i, j] : coupled) {
        fill(i, j);
        fill(j, i);
    }
    m.matrix.set_unsymmetric();
    return m;
}

Eigen::VectorXd solved(NodeMatrix& matrix, const Eigen::VectorXd& b)
{
    std::vector<Node6> x = test::node_values(b);
    matrix.solve(x);
    return test::vector_of(x);
}

} // namespace

TEST_CASE("a chain of the same length keeps its blocks, one of another length begins with zeros")
{
    const int n = 7;
    Pairs chain;
    for (int i = 0; i + 1 < n; ++i)
        chain.push_back({i, i + 1});
    Both m = filled(n, chain, 5);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6 * n, -1, 2);
    m.matrix.set_chain(n);
    CHECK(m.matrix.is_chain());
    m.matrix.factor(0);
    CHECK((m.dense * solved(m.matrix, b) - b).norm() < 1e-12);
    m.matrix.set_chain(n + 1);
    CHECK(m.matrix.size() == n + 1);
    for (int i = 0; i < n; ++i)
        for (const auto& [row, col] : {std::array{i, i}, {i, i + 1}, {i + 1, i}})
            for (int k = 0; k < 36; ++k)
                CHECK(m.matrix.block(row, col)(k % 6, k / 6) == 0);
}

TEST_CASE("nodes that are coupled along a chain or anyhow are solved as a dense LU does")
{
    const int n = 11;
    Pairs chain; // of two: nodes 4 and 5 are not coupled
    for (int i = 0; i + 1 < n; ++i)
        if (i != 4) chain.push_back({i, i + 1});
    Pairs crossed = chain;
    crossed.push_back({9, 2});
    for (const Pairs& coupled : {chain, crossed}) {
        Both m = filled(n, coupled, 5);
        CHECK(m.matrix.is_chain() == (coupled.size() == chain.size()));
        m.matrix.factor(0);
        const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6 * n, -1, 2),
                              exact = m.dense.partialPivLu().solve(b);
        CHECK((solved(m.matrix, b) - exact).norm() < 1e-12 * exact.norm());
    }
    Both one = filled(1, {}, 2);
    one.matrix.factor(0);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6, -1, 2);
    CHECK((solved(one.matrix, b) - one.dense.partialPivLu().solve(b)).norm() < 1e-12);
}

TEST_CASE("a chain that is factored again from a node on has the bits of one factored as a whole")
{
    const int n = 9;
    Pairs chain;
    for (int i = 0; i + 1 < n; ++i)
        chain.push_back({i, i + 1});
    const Both base = filled(n, chain, 7);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6 * n, -1, 2);
    for (int from = 0; from < n; ++from) {
        CAPTURE(from);
        Both parts = filled(n, chain, 8), whole = filled(n, chain, 8);
        parts.matrix.copy_values(base.matrix);
        parts.matrix.factor(0);
        for (NodeMatrix* m : {&parts.matrix, &whole.matrix}) {
            m->copy_values(base.matrix, m == &parts.matrix ? from : 0);
            for (int i = from; i < n; ++i)
                m->block(i, i)(2, 3) += 5;
        }
        CHECK(parts.matrix.factor(from) == whole.matrix.factor(0));
        CHECK(parts.matrix.negative_determinants() == whole.matrix.negative_determinants());
        CHECK(solved(parts.matrix, b) == solved(whole.matrix, b));
    }
}

TEST_CASE("a chain counts its negative pivots and the nodes with an odd number of them")
{
    const int n = 4;
    NodeMatrix m;
    m.set_pattern(n, {{0, 1}, {1, 2}, {2, 3}});
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < 6; ++k)
            m.block(i, i)(k, k) = 1;
    m.block(1, 1)(2, 2) = -1;
    for (int k : {0, 5})
        m.block(3, 3)(k, k) = -1;
    CHECK(m.factor(0) == 3);
    CHECK(m.negative_determinants() == 1);
    m.block(3, 3)(5, 5) = 1;
    CHECK(m.factor(3) == 2);
    CHECK(m.negative_determinants() == 2);
    m.guarded = false;
    CHECK(m.factor(0) == 0);
}
