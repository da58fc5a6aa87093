#pragma once

#include "solver/linear/block_tridiagonal.hpp"

#include <Eigen/Core>
#include <vector>

// Matrices of chains, for tests.

namespace amontons::test {

/// The same matrix as blocks and dense.
struct ChainMatrix {
    BlockTridiagonal blocks;
    Eigen::MatrixXd dense;
};

/// What A has on its three block diagonals.
inline ChainMatrix chain_matrix(const Eigen::MatrixXd& A)
{
    const int n = int(A.rows()) / 6;
    ChainMatrix m{BlockTridiagonal(n), Eigen::MatrixXd::Zero(A.rows(), A.rows())};
    m.blocks.set_zero();
    const auto take = [&](Block6& to, int i, int j) {
        for (int r = 0; r < 6; ++r)
            for (int c = 0; c < 6; ++c)
                to(r, c) = m.dense(6 * i + r, 6 * j + c) = A(6 * i + r, 6 * j + c);
    };
    for (int i = 0; i < n; ++i) {
        take(m.blocks.diagonal(i), i, i);
        if (i + 1 == n) continue;
        take(m.blocks.upper(i), i, i + 1);
        take(m.blocks.lower(i), i + 1, i);
    }
    return m;
}

/// A vector as the values of nodes.
inline std::vector<Node6> node_values(const Eigen::VectorXd& b)
{
    std::vector<Node6> x(std::size_t(b.size()) / 6);
    for (std::size_t i = 0; i < x.size(); ++i) {
        x[i].column = Column6{};
        for (int k = 0; k < 6; ++k)
            x[i].value[k] = b[6 * Eigen::Index(i) + k];
    }
    return x;
}

inline Eigen::VectorXd vector_of(const std::vector<Node6>& x)
{
    Eigen::VectorXd b(6 * Eigen::Index(x.size()));
    for (std::size_t i = 0; i < x.size(); ++i)
        for (int k = 0; k < 6; ++k)
            b[6 * Eigen::Index(i) + k] = x[i].value[k];
    return b;
}

} // namespace amontons::test
