#pragma once

#include "mesh/base/dense.hpp"
#include "solver/linear/block_tridiagonal.hpp"

#include <cmath>
#include <vector>

namespace amontons::pivoting {

/// Steps of the Lanczos iteration.
constexpr int kLanczosSteps = 6;

/// Scalar product over nodes (value).
inline double node_product(const std::vector<Node6>& a, const std::vector<Node6>& b)
{
    Column6 sum{};
    for (std::size_t i = 0; i < a.size(); ++i)
        sum += a[i].column * b[i].column;
    return sum[0] + sum[1] + sum[2] + sum[3] + sum[4] + sum[5];
}

/// The smallest eigenvalue of K x = lambda M x, K positive definite, by inverse iteration; 0 where
/// the factor gives none.
/// @param x  in: any vector; out: its eigenvector
template <class Weigh, class Solve>
double smallest_eigenvalue(std::vector<Node6>& x, const Weigh& weigh, const Solve& solve)
{
    constexpr int kMost = 100;
    constexpr double kFound = 1e-4; // of the eigenvalue
    double value = 0;
    for (int i = 0; i < kMost; ++i) {
        std::vector<Node6> y = x;
        weigh(y);
        solve(y);
        std::vector<Node6> My = y;
        weigh(My);
        const double size = std::sqrt(node_product(y, My)), before = value;
        if (!(size > 0) || !std::isfinite(size)) return 0;
        value = node_product(x, My) / (size * size); // Rayleigh's quotient, of x and y
        for (std::size_t k = 0; k < x.size(); ++k)
            x[k].column = splat6(1 / size) * y[k].column;
        if (i > 0 && std::abs(value - before) <= kFound * std::abs(value)) break;
    }
    return value;
}

/// Magnitude of the most negative eigenvalue of K x = lambda M x, from a factor of K: the shift of
/// K by M that makes it definite. Never too small if there is one negative eigenvalue, since it
/// comes from an extreme Ritz value of K^-1 M; 0 if these few Lanczos steps found none.
/// @param start  any vector
/// @param weigh  x <- M x, diagonal, >= 0
/// @param solve  x <- K^-1 x
template <class Weigh, class Solve>
double negative_eigenvalue(const std::vector<Node6>& start, const Weigh& weigh, const Solve& solve)
{
    using Nodes = std::vector<Node6>;
    std::vector<Nodes> v, Mv; // orthonormal by M
    Eigen::MatrixXd T = Eigen::MatrixXd::Zero(kLanczosSteps, kLanczosSteps);
    Nodes w = start;
    solve(w); // the soft motions, at once
    for (int k = 0; k < kLanczosSteps; ++k) {
        for (int twice = 0; twice < 2; ++twice)
            for (std::size_t j = 0; j < v.size(); ++j) {
                const double along = node_product(w, Mv[j]);
                T(Eigen::Index(j), k - 1) += along;
                for (std::size_t i = 0; i < w.size(); ++i)
                    w[i].column -= splat6(along) * v[j][i].column;
            }
        if (k == kLanczosSteps - 1) break;
        Nodes Mw = w;
        weigh(Mw);
        const double size = std::sqrt(node_product(w, Mw));
        if (!(size > 0) || !std::isfinite(size)) return 0;
        for (std::size_t i = 0; i < w.size(); ++i)
            w[i].column *= splat6(1 / size), Mw[i].column *= splat6(1 / size);
        v.push_back(w);
        Mv.push_back(Mw);
        w = Mw;
        solve(w);
    }
    const auto n = Eigen::Index(v.size());
    const Eigen::MatrixXd S = T.topLeftCorner(n, n).selfadjointView<Eigen::Upper>();
    const double least = symmetric_eigenvalues(S)[0];
    return least < 0 ? -1 / least : 0;
}

} // namespace amontons::pivoting
