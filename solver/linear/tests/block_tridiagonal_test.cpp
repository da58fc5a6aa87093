#include "solver/linear/block_tridiagonal.hpp"

#include "solver/linear/tests/chain_matrix.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <doctest/doctest.h>
#include <random>
#include <vector>

using namespace amontons;
using test::ChainMatrix;
using test::node_values;
using test::vector_of;

namespace {

ChainMatrix random_tridiagonal(int nodes, bool symmetric, double diagonal, unsigned seed)
{
    std::mt19937 rng{seed};
    std::uniform_real_distribution<double> uniform{-1, 1};
    const auto block = [&] {
        return Mat6{Mat6::NullaryExpr([&](Eigen::Index, Eigen::Index) { return uniform(rng); })};
    };
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(6 * nodes, 6 * nodes);
    for (int i = 0; i < nodes; ++i) {
        Mat6 d = block() + diagonal * Mat6::Identity();
        const Mat6 u = block();
        Mat6 l = block();
        if (symmetric) {
            d = (0.5 * (d + d.transpose())).eval();
            l = u.transpose();
        }
        A.block<6, 6>(6 * i, 6 * i) = d;
        if (i + 1 < nodes) {
            A.block<6, 6>(6 * i, 6 * i + 6) = u;
            A.block<6, 6>(6 * i + 6, 6 * i) = l;
        }
    }
    return test::chain_matrix(A);
}

Eigen::VectorXd random_vector(Eigen::Index size, unsigned seed)
{
    std::mt19937 rng{seed};
    std::uniform_real_distribution<double> uniform{-1, 1};
    return Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index) { return uniform(rng); });
}

} // namespace

TEST_CASE("the block solve equals a dense LU with pivoting whether symmetric or not")
{
    for (int n : {1, 2, 3, 7, 40})
        for (bool symmetric : {true, false}) {
            CAPTURE(n);
            CAPTURE(symmetric);
            ChainMatrix m = random_tridiagonal(n, symmetric, 8, unsigned(n));
            const Eigen::VectorXd b = random_vector(6 * n, 5);
            std::vector<Node6> x = node_values(b);
            m.blocks.factor(0);
            m.blocks.solve(x);
            const Eigen::VectorXd exact = m.dense.partialPivLu().solve(b);
            CHECK((vector_of(x) - exact).norm() < 1e-12 * exact.norm());
            // The comparison must be able to fail.
            m.dense(0, 0) += 1e-6;
            CHECK((vector_of(x) - m.dense.partialPivLu().solve(b)).norm() > 1e-10 * exact.norm());
        }
}

TEST_CASE("the negative pivots of a symmetric matrix are its negative eigenvalues")
{
    int most = 0;
    for (unsigned seed = 1; seed <= 40; ++seed) {
        CAPTURE(seed);
        ChainMatrix m = random_tridiagonal(6, true, 0.15 * seed, seed);
        const Eigen::VectorXd values =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(m.dense, Eigen::EigenvaluesOnly)
                .eigenvalues();
        const int negative = int((values.array() < 0).count());
        most = std::max(most, negative);
        CHECK(m.blocks.factor(0) == negative);
    }
    CHECK(most > 10); // else the law was tried on positive definite matrices only
}

TEST_CASE("a chain that begins later is the matrix without its first nodes")
{
    const int n = 9, first = 4;
    ChainMatrix m = random_tridiagonal(n, false, 8, 3);
    const Eigen::VectorXd b = random_vector(6 * n, 4);
    std::vector<Node6> x = node_values(b);
    m.blocks.set_first(first);
    m.blocks.factor(first);
    m.blocks.solve(x);
    const Eigen::Index rows = 6 * (n - first);
    const Eigen::VectorXd exact =
        m.dense.bottomRightCorner(rows, rows).partialPivLu().solve(b.tail(rows));
    const Eigen::VectorXd got = vector_of(x);
    CHECK((got.tail(rows) - exact).norm() < 1e-12 * exact.norm());
    CHECK(got.head(6 * first) == b.head(6 * first)); // not touched
}

TEST_CASE("factoring again from a changed node and solving from it change no result")
{
    const int n = 12, changed = 7;
    ChainMatrix m = random_tridiagonal(n, true, 8, 6);
    m.blocks.factor(0);
    const int whole_before = m.blocks.factor(0);
    for (int k = 0; k < 6; ++k) {
        m.blocks.diagonal(changed)(k, k) -= 14; // several eigenvalues change sign
        m.dense(6 * changed + k, 6 * changed + k) -= 14;
    }
    const int partly = m.blocks.factor(changed);
    Eigen::VectorXd b = random_vector(6 * n, 8);
    b.head(6 * changed).setZero();
    std::vector<Node6> all = node_values(b), from = node_values(b);
    m.blocks.solve(all);
    m.blocks.solve_from(from, changed);
    const Eigen::VectorXd exact = m.dense.partialPivLu().solve(b);
    CHECK((vector_of(all) - exact).norm() < 1e-11 * exact.norm());
    CHECK((vector_of(from) - exact).norm() < 1e-11 * exact.norm());
    CHECK(partly == m.blocks.factor(0));
    CHECK(partly > whole_before);
}

TEST_CASE("negative determinants of an unsymmetric matrix are the same in all axes of the nodes "
          "but its pivots' signs are not")
{
    int pivots_changed = 0, seen = 0;
    for (unsigned seed = 1; seed <= 40; ++seed) {
        ChainMatrix m = random_tridiagonal(6, false, 0.8, seed);
        const int pivots = m.blocks.factor(0), determinants = m.blocks.negative_determinants();
        for (int i = 0; i < 6; ++i) {
            const Mat6 Q = Eigen::HouseholderQR<Mat6>(
                               random_tridiagonal(1, false, 0, 100 * seed + unsigned(i)).dense)
                               .householderQ();
            for (int k = 0; k < 3; ++k) { // diagonal, coupling to the next, coupling to the last
                if ((k == 1 && i == 5) || (k == 2 && i == 0)) continue;
                for (const bool lower : {false, true}) {
                    if (k == 0 && lower) continue;
                    Block6& b = k == 0   ? m.blocks.diagonal(i)
                                : k == 1 ? (lower ? m.blocks.lower(i) : m.blocks.upper(i))
                                         : (lower ? m.blocks.lower(i - 1) : m.blocks.upper(i - 1));
                    Mat6 d;
                    for (int r = 0; r < 6; ++r)
                        for (int c = 0; c < 6; ++c)
                            d(r, c) = b(r, c);
                    // rows of node i: upper(i), lower(i - 1); its columns: the other two
                    const bool rows = k == 0 || (k == 1) != lower;
                    const bool columns = k == 0 || (k == 1) == lower;
                    if (rows) d = (Q * d).eval();
                    if (columns) d = (d * Q.transpose()).eval();
                    for (int r = 0; r < 6; ++r)
                        for (int c = 0; c < 6; ++c)
                            b(r, c) = d(r, c);
                }
            }
        }
        const int turned = m.blocks.factor(0);
        CHECK(m.blocks.negative_determinants() == determinants);
        pivots_changed += turned != pivots;
        seen += determinants > 0;
    }
    CHECK(seen > 5);
    CHECK(pivots_changed > 5);
}
