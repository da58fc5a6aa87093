#pragma once

#include "mesh/base/dense.hpp"
#include "solver/linear/block_tridiagonal.hpp"

#include <cmath>
#include <vector>

namespace amontons::pivoting {

constexpr int kLanczosSteps = 6;

/// The size of the most negative eigenvalue of K x = lambda M x, from a factor of K that has one:
/// what shift of K by M it takes. Never too small where there is only one, for it is a Ritz value
/// of K^-1 M, whose spectrum it ends; 0 if these few steps found none.
/// @param start  any vector
/// @param weigh  x <- M x, diagonal, >= 0
/// @param solve  x <- K^-1 x
template <class Weigh, class Solve>
double negative_eigenvalue(const std::vector<Node6>& start, const Weigh& weigh, const Solve& solve)
{
    using Nodes = std::vector<Node6>;
    const auto dot = [](const Nodes& a, const Nodes& b) {
        Column6 sum{};
        for (std::size_t i = 0; i < a.size(); ++i)
            sum += a[i].column * b[i].column;
        return sum[0] + sum[1] + sum[2] + sum[3] + sum[4] + sum[5];
    };
    std::vector<Nodes> v, Mv; // orthonormal by M
    Eigen::MatrixXd T = Eigen::MatrixXd::Zero(kLanczosSteps, kLanczosSteps);
    Nodes w = start;
    solve(w); // the soft motions, at once
    for (int k = 0; k < kLanczosSteps; ++k) {
        for (int twice = 0; twice < 2; ++twice)
            for (std::size_t j = 0; j < v.size(); ++j) {
                const double along = dot(w, Mv[j]);
                T(Eigen::Index(j), k - 1) += along;
                for (std::size_t i = 0; i < w.size(); ++i)
                    w[i].column -= splat6(along) * v[j][i].column;
            }
        if (k == kLanczosSteps - 1) break;
        Nodes Mw = w;
        weigh(Mw);
        const double size = std::sqrt(dot(w, Mw));
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
