#include "solver/step/body_rows.hpp"

#include <doctest/doctest.h>
#include <random>

using namespace amontons;

TEST_CASE("sparse W of many bodies is the sum of what each of them states")
{
    // A chain of bodies, each with the rows of two contacts; one row of none, one that a body has
    // on both sides, and springs on three of them.
    constexpr int kBodies = 30;
    Rows rows;
    rows.count = 3 * (kBodies + 1) + 1;
    rows.row.resize(kBodies);
    for (int b = 0; b < kBodies; ++b)
        for (int k = 0; k < 6; ++k)
            rows.row[std::size_t(b)].push_back(3 * b + k);
    rows.row[7].insert(rows.row[7].begin() + 4, 3 * 7 + 1);
    std::mt19937 random{3};
    std::normal_distribution<double> number;
    std::vector<Eigen::MatrixXd> W;
    for (const std::vector<int>& own : rows.row) {
        const Eigen::MatrixXd C = Eigen::MatrixXd::NullaryExpr(6, Eigen::Index(own.size()),
                                                               [&] { return number(random); });
        W.emplace_back(C.transpose() * C);
    }
    const std::vector<std::pair<int, double>> soft = {
        {4, 0.5}, {4, 0.25}, {3 * (kBodies + 1), 2.0}};

    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(rows.count, rows.count);
    for (std::size_t b = 0; b < W.size(); ++b)
        for (std::size_t j = 0; j < rows.row[b].size(); ++j)
            for (std::size_t i = 0; i < rows.row[b].size(); ++i)
                expected(rows.row[b][i], rows.row[b][j]) += W[b](Eigen::Index(i), Eigen::Index(j));
    for (const auto& [row, compliance] : soft)
        expected(row, row) += compliance;

    const Delassus sum = sum_of_bodies(rows, W, soft);
    REQUIRE(sum.is_sparse());
    CHECK(sum.sparse().isCompressed());
    CHECK((Eigen::MatrixXd(sum.sparse()) - expected).cwiseAbs().maxCoeff() <=
          1e-14 * expected.cwiseAbs().maxCoeff());
    CHECK(sum.sparse().nonZeros() < rows.count * 10);
}

TEST_CASE("rows of some contacts are those of all and in their order")
{
    // Four contacts of 3, 1, 3 and 1 rows: the first on body 0, the second on both, the others on
    // body 1, the third on both of its sides.
    Rows all;
    all.chosen = {0, 1, 2, 3};
    all.first = {0, 3, 4, 7};
    all.count = 8;
    all.row = {{0, 1, 2, 3}, {3, 4, 5, 6, 4, 5, 6, 7}};
    for (const std::vector<int>& own : all.row) {
        Eigen::MatrixXd C = Eigen::MatrixXd::Zero(5, Eigen::Index(own.size()));
        for (Eigen::Index j = 0; j < C.cols(); ++j)
            C(j % 5, j) = C((3 * j + 1) % 5, j) = double(10 * C.cols() + j);
        all.columns.emplace_back(C.sparseView());
    }
    Rows some;
    some.chosen = {1, 2};
    choose_rows(all, some);
    CHECK(some.count == 4);
    CHECK(some.first == std::vector<int>{0, 1});
    CHECK(some.row == std::vector<std::vector<int>>{{0}, {0, 1, 2, 3, 1, 2, 3}});
    const Eigen::MatrixXd first = all.columns[0], second = all.columns[1];
    CHECK(Eigen::MatrixXd(some.columns[0]) == first.rightCols(1));
    CHECK(Eigen::MatrixXd(some.columns[1]) == second.leftCols(7));
    some.chosen = all.chosen;
    choose_rows(all, some);
    CHECK(some.first == all.first);
    CHECK(Eigen::MatrixXd(some.columns[1]) == second);
}
