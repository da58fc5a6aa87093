#include "contact/linear/block_lu.hpp"

#include <Eigen/Dense>
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <utility>

using namespace amontons;

namespace {

using Pattern = std::vector<std::pair<int, int>>; ///< blocks below the diagonal: (row, column)

/// A matrix of 3 x 3 blocks, (row, column) -> block, of symmetric pattern.
struct BlockMatrix {
    int n = 0;
    std::map<std::pair<int, int>, Mat3> block;

    Eigen::MatrixXd dense() const
    {
        Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3 * n, 3 * n);
        for (const auto& [at, value] : block)
            A.block<3, 3>(3 * at.first, 3 * at.second) = value;
        return A;
    }
};

/// W + D: W a sum of semidefinite pairs, D of positive definite symmetric part with a skew one.
BlockMatrix random_blocks(int n, const Pattern& pattern, std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    const auto random = [&] { return Mat3(Mat3::NullaryExpr([&] { return normal(rng); })); };
    BlockMatrix A{n, {}};
    for (int i = 0; i < n; ++i) {
        const Mat3 skew = random(), root = random();
        A.block[{i, i}] =
            Mat3::Identity() + 0.1 * root * root.transpose() + skew - skew.transpose();
    }
    for (const auto& [i, j] : pattern) {
        const Mat3 g = random(), h = random();
        A.block[{i, i}] += g * g.transpose();
        A.block[{j, j}] += h * h.transpose();
        A.block.try_emplace({i, j}, Mat3::Zero()).first->second += g * h.transpose();
        A.block.try_emplace({j, i}, Mat3::Zero()).first->second += h * g.transpose();
    }
    return A;
}

void analyse(BlockLu& lu, const BlockMatrix& A)
{
    std::vector<std::vector<int>> columns(static_cast<std::size_t>(A.n));
    for (const auto& [at, value] : A.block)
        columns[static_cast<std::size_t>(at.second)].push_back(at.first);
    std::vector<std::size_t> start{0};
    std::vector<int> neighbour;
    for (const std::vector<int>& column : columns) {
        neighbour.insert(neighbour.end(), column.begin(), column.end());
        start.push_back(neighbour.size());
    }
    lu.analyse(start, neighbour);
}

bool factorise(BlockLu& lu, const BlockMatrix& A)
{
    lu.clear();
    for (const auto& [at, value] : A.block)
        lu.add(at.first, at.second, value);
    return lu.factorise();
}

Eigen::VectorXd random_right_side(int n, std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    return Eigen::VectorXd::NullaryExpr(3 * n, [&] { return normal(rng); });
}

/// Small residual, in the size of the terms, and the solution of a dense factor.
void check_solution(const BlockLu& lu, const BlockMatrix& A, std::mt19937& rng)
{
    const Eigen::MatrixXd dense = A.dense();
    const Eigen::VectorXd b = random_right_side(A.n, rng), expected = dense.partialPivLu().solve(b);
    Eigen::VectorXd x = b;
    lu.solve(x);
    CHECK((b - dense * x).norm() <= 1e-12 * b.norm());
    CHECK((x - expected).norm() <= 1e-11 * expected.norm());
}

Pattern chain(int n)
{
    Pattern pattern;
    for (int i = 1; i < n; ++i)
        pattern.emplace_back(i, i - 1);
    return pattern;
}

Pattern arrow(int n)
{
    Pattern pattern;
    for (int i = 1; i < n; ++i)
        pattern.emplace_back(i, 0);
    return pattern;
}

Pattern full_pattern(int n)
{
    Pattern pattern;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < i; ++j)
            pattern.emplace_back(i, j);
    return pattern;
}

Pattern random_graph(int n, int edges, std::mt19937& rng)
{
    std::uniform_int_distribution<int> any(0, n - 1);
    Pattern pattern;
    while (static_cast<int>(pattern.size()) < edges) {
        const int i = any(rng), j = any(rng);
        if (i != j) pattern.emplace_back(std::max(i, j), std::min(i, j));
    }
    return pattern;
}

/// Cells of a grid with k contacts each: those of a cell and of its neighbours are coupled.
Pattern grid(int side, int k)
{
    Pattern pattern;
    const int n = side * side * k;
    const auto cell = [&](int i) { return std::pair(i / k / side, i / k % side); };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < i; ++j)
            if (std::abs(cell(i).first - cell(j).first) +
                    std::abs(cell(i).second - cell(j).second) <=
                1)
                pattern.emplace_back(i, j);
    return pattern;
}

Pattern two_components(int n, std::mt19937& rng)
{
    Pattern pattern = random_graph(n / 2, n, rng);
    for (const auto& [i, j] : full_pattern(n - n / 2))
        pattern.emplace_back(i + n / 2, j + n / 2);
    return pattern;
}

std::vector<std::pair<int, Pattern>> patterns(std::mt19937& rng)
{
    return {{1, {}},
            {7, {}},
            {40, chain(40)},
            {30, arrow(30)},
            {25, full_pattern(25)},
            {60, full_pattern(60)},
            {50, random_graph(50, 40, rng)},
            {80, random_graph(80, 200, rng)},
            {100, random_graph(100, 800, rng)},
            {64, grid(4, 4)},
            {147, grid(7, 3)},
            {40, two_components(40, rng)}};
}

} // namespace

TEST_CASE("the block factor solves what a dense one solves for every pattern")
{
    std::mt19937 rng(1);
    for (const auto& [n, pattern] : patterns(rng)) {
        CAPTURE(n);
        CAPTURE(pattern.size());
        const BlockMatrix A = random_blocks(n, pattern, rng);
        BlockLu lu;
        analyse(lu, A);
        REQUIRE(factorise(lu, A));
        check_solution(lu, A, rng);
    }
}

TEST_CASE("a pattern can be used again with other values and after a failure too")
{
    std::mt19937 rng(2);
    for (const auto& [n, pattern] : patterns(rng)) {
        CAPTURE(n);
        BlockMatrix A = random_blocks(n, pattern, rng);
        BlockLu lu;
        analyse(lu, A);
        REQUIRE(factorise(lu, A));
        BlockMatrix zero = A;
        for (auto& [at, value] : zero.block)
            value.setZero();
        CHECK_FALSE(factorise(lu, zero));
        A = random_blocks(n, pattern, rng);
        REQUIRE(factorise(lu, A));
        check_solution(lu, A, rng);
        // And the object serves another pattern.
        const BlockMatrix other = random_blocks(12, chain(12), rng);
        analyse(lu, other);
        REQUIRE(factorise(lu, other));
        check_solution(lu, other, rng);
    }
}

TEST_CASE("a pattern that is not symmetric is completed")
{
    std::mt19937 rng{21};
    std::uniform_int_distribution<int> any(0, 39);
    for (int k = 0; k < 20; ++k) {
        BlockMatrix A = random_blocks(40, {}, rng); // then one-sided couplings, weak ones
        for (int e = 0; e < 60; ++e)
            if (const int i = any(rng), j = any(rng); i != j && !A.block.count({j, i}))
                A.block[{i, j}] = 0.02 * Mat3::Random();
        BlockLu lu;
        analyse(lu, A);
        REQUIRE(factorise(lu, A));
        check_solution(lu, A, rng);
    }
}

TEST_CASE("an empty matrix is regular")
{
    BlockLu lu;
    lu.analyse({0}, {});
    lu.clear();
    CHECK(lu.factorise());
    Eigen::VectorXd x(0);
    lu.solve(x);
    CHECK(lu.fill() == 0);
}

TEST_CASE("a singular pivot and one that is not finite are refused")
{
    std::mt19937 rng(3);
    for (const auto& [n, pattern] : patterns(rng))
        for (double bad : {0.0, std::numeric_limits<double>::quiet_NaN()}) {
            CAPTURE(n);
            // Row and column 1 of a contact vanish: no order of elimination saves it.
            BlockMatrix A = random_blocks(n, pattern, rng);
            const int contact = n / 2;
            for (auto& [at, value] : A.block) {
                if (at.first == contact) value.row(1).setConstant(bad);
                if (at.second == contact) value.col(1).setConstant(bad);
            }
            BlockLu lu;
            analyse(lu, A);
            CHECK_FALSE(factorise(lu, A));
        }
}

TEST_CASE("rows are exchanged inside a pivot block")
{
    // Zeros on the diagonal: the blocks are regular, none of their diagonal entries is a pivot.
    std::mt19937 rng(4);
    for (int n : {1, 2, 5, 8, 12, 30}) {
        BlockMatrix A{n, {}};
        Mat3 cycle = Mat3::Zero();
        cycle(1, 0) = cycle(2, 1) = cycle(0, 2) = 1;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                A.block[{i, j}] = (i == j ? 1 : 0.1 / n) * cycle;
        BlockLu lu;
        analyse(lu, A);
        REQUIRE(factorise(lu, A));
        check_solution(lu, A, rng);
    }
}

TEST_CASE("a permutation of the blocks permutes the solution")
{
    std::mt19937 rng(5);
    const int n = 100;
    const BlockMatrix A = random_blocks(n, random_graph(n, 300, rng), rng);
    const Eigen::VectorXd b = random_right_side(n, rng);
    std::vector<int> to(n);
    std::iota(to.begin(), to.end(), 0);
    std::shuffle(to.begin(), to.end(), rng);
    BlockMatrix P{n, {}};
    for (const auto& [at, value] : A.block)
        P.block[{to[static_cast<std::size_t>(at.first)], to[static_cast<std::size_t>(at.second)]}] =
            value;
    Eigen::VectorXd x = b, y(3 * n);
    for (int i = 0; i < n; ++i)
        y.segment<3>(3 * to[static_cast<std::size_t>(i)]) = b.segment<3>(3 * i);
    BlockLu lu;
    analyse(lu, A);
    REQUIRE(factorise(lu, A));
    lu.solve(x);
    analyse(lu, P);
    REQUIRE(factorise(lu, P));
    lu.solve(y);
    for (int i = 0; i < n; ++i)
        CHECK((x.segment<3>(3 * i) - y.segment<3>(3 * to[static_cast<std::size_t>(i)])).norm() <=
              1e-11 * x.norm());
}

TEST_CASE("add sums and a place is where add puts its block")
{
    std::mt19937 rng(6);
    const BlockMatrix A = random_blocks(147, grid(7, 3), rng);
    BlockLu lu;
    analyse(lu, A);
    lu.clear();
    for (const auto& [at, value] : A.block) {
        const BlockLu::Place place = lu.place(at.first, at.second);
        lu.add_at(place, 0.25 * value);
        lu.add(at.first, at.second, 0.75 * value);
    }
    REQUIRE(lu.factorise());
    check_solution(lu, A, rng);
}

TEST_CASE("the cost grows with the work and is linear in copies")
{
    std::mt19937 rng(7);
    const auto cost = [&](int n, const Pattern& pattern) {
        BlockLu lu;
        analyse(lu, random_blocks(n, pattern, rng));
        return lu.cost();
    };
    CHECK(cost(40, {}) == doctest::Approx(10 * cost(4, {})));
    CHECK(cost(60, full_pattern(60)) > 4 * cost(30, full_pattern(30)));
    CHECK(cost(30, arrow(30)) < cost(30, full_pattern(30)));
}

TEST_CASE("what a matrix's inverse is between a few rows is found along their branches")
{
    std::mt19937 rng{7};
    for (const int side : {3, 9, 16}) { // a net, whose last supernode is wide
        Pattern pattern;
        const int n = side * side;
        for (int i = 0; i < n; ++i) {
            if (i % side > 0) pattern.emplace_back(i, i - 1);
            if (i >= side) pattern.emplace_back(i, i - side);
            if (i >= side && i % side > 0) pattern.emplace_back(i, i - side - 1);
        }
        const BlockMatrix A = random_blocks(n, pattern, rng);
        BlockLu lu;
        analyse(lu, A);
        REQUIRE(factorise(lu, A));
        for (const std::vector<int>& blocks :
             {std::vector<int>{0}, {n - 1, 1}, {n / 2, n / 3, n - 2, 2}}) {
            const auto rows = 3 * static_cast<Eigen::Index>(blocks.size());
            const Eigen::MatrixXd C =
                Eigen::MatrixXd::NullaryExpr(rows, 5, [&] { return random_right_side(1, rng)[0]; });
            Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(3 * n, 5);
            for (std::size_t b = 0; b < blocks.size(); ++b)
                whole.middleRows<3>(3 * blocks[b]) =
                    C.middleRows<3>(3 * static_cast<Eigen::Index>(b));
            const Eigen::MatrixXd expected = whole.transpose() * A.dense().lu().solve(whole);
            CHECK((lu.between(blocks, C) - expected).norm() < 1e-11 * expected.norm());
        }
    }
}
