// The error of the /solution in FCLib files, from W, q, mu and r in long double alone: nothing of
// the solver, its certificate or its products is used. One line a file: error, and |W||r| + |q| of
// it in units of the round-off of doubles.
//
//   build/release/bin/fclib_error FILE...
//
// validation/solve_truth.py compares it with what amontons solve reports.

#include "solver/fclib_file.hpp"

#include <cmath>
#include <cstdio>
#include <exception>

using namespace amontons;

namespace {

using Real = long double;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Vector3 = Eigen::Matrix<Real, 3, 1>;

struct Recomputed {
    Real error = 0, rounding = 0;
};

Vector3 on_cone(const Vector3& x, Real mu)
{
    const Real t = x.tail<2>().norm();
    if (mu * t <= -x[0]) return Vector3::Zero();
    if (t <= mu * x[0]) return x;
    const Real edge = (x[0] + mu * t) / (1 + mu * mu);
    return {edge, mu * edge / t * x[1], mu * edge / t * x[2]};
}

/// Contacts of three rows, rho = 3 n / trace(W), relative to |rho q|.
Recomputed recompute(const ContactProblem& p, const Eigen::VectorXd& reaction)
{
    const Eigen::Index rows = p.q.size();
    Vector u = p.q.cast<Real>(), size = u.cwiseAbs();
    Real trace = 0;
    const auto add = [&](Eigen::Index i, Eigen::Index j, double value) {
        const Real term = static_cast<Real>(value) * reaction[j];
        u[i] += term;
        size[i] += std::abs(term);
        if (i == j) trace += value;
    };
    if (p.W.is_dense()) {
        for (Eigen::Index j = 0; j < rows; ++j)
            for (Eigen::Index i = 0; i < rows; ++i)
                add(i, j, p.W.dense()(i, j));
    } else {
        const Delassus::Sparse W = p.W.as_sparse();
        for (int j = 0; j < W.outerSize(); ++j)
            for (Delassus::Sparse::InnerIterator it(W, j); it; ++it)
                add(it.row(), j, it.value());
    }
    const Real rho = static_cast<Real>(rows) / trace, q = p.q.cast<Real>().norm();
    Real sum = 0;
    for (Eigen::Index i = 0; i < p.mu.size(); ++i) {
        const Vector3 r = reaction.segment<3>(3 * i).cast<Real>(), v = u.segment<3>(3 * i);
        Vector3 x = r - rho * v;
        x[0] -= rho * static_cast<Real>(p.mu[i]) * v.tail<2>().norm();
        sum += (r - on_cone(x, p.mu[i])).squaredNorm();
    }
    return {std::sqrt(sum) / (rho * q), 2.2204e-16L * size.norm() / q};
}

} // namespace

int main(int argc, char** argv)
{
    int failed = argc < 2;
    for (int k = 1; k < argc; ++k) {
        try {
            const FclibProblem file = read_fclib(argv[k]);
            if (!file.local || !file.solution || 3 * file.local->mu.size() != file.local->q.size())
                throw std::runtime_error("no local problem of frictional contacts with a solution");
            const Recomputed e = recompute(*file.local, file.solution->r);
            std::printf("%s %.3Le %.3Le\n", argv[k], e.error, e.rounding);
        } catch (const std::exception& error) {
            std::fprintf(stderr, "%s: %s\n", argv[k], error.what());
            failed = 1;
        }
    }
    return failed;
}
