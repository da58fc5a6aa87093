#include "solver/step/closed_rows.hpp"

#include "mesh/base/dense.hpp"

#include <cmath>
#include <numeric>

// With the rows in an order in which the kept ones P come first, W (scaled) is
//
//   W = [A, A M; M^T A, M^T A M],   A = W_PP = U^T U,   M = A^-1 W_PN,
//
// and no force in the span of N = [-M; 1] moves anything. The answer with nothing in the rows that
// are left is r = [-A^-1 u_P; 0]; the smallest one is r less its part in N:
// r - N (N^T N)^-1 N^T r, with N^T N = 1 + M^T M.

namespace amontons {
namespace {

constexpr double kRepeats = 1e-10; // of a row's compliance: less is left to it by the others

/// x = U^-1 U^-T b. @param U  upper triangular
void solve_by_root(const Eigen::MatrixXd& U, Eigen::Ref<Eigen::VectorXd> x)
{
    const Eigen::Index n = U.cols();
    for (Eigen::Index i = 0; i < n; ++i)
        x[i] = (x[i] - U.col(i).head(i).dot(x.head(i))) / U(i, i);
    for (Eigen::Index i = n - 1; i >= 0; --i) {
        x[i] /= U(i, i);
        x.head(i) -= x[i] * U.col(i).head(i);
    }
}

/// Rows by Cholesky's factor that takes the largest diagonal entry next.
void choose_independent(const Eigen::MatrixXd& W, std::vector<int>& kept, std::vector<int>& left)
{
    const Eigen::Index n = W.rows();
    Eigen::MatrixXd columns(n, n);
    Eigen::VectorXd rest = W.diagonal();
    Eigen::Index pivot = 0;
    std::vector<char> in(std::size_t(n), 0);
    for (Eigen::Index k = 0; k < n && rest.maxCoeff(&pivot) > kRepeats; ++k) {
        auto own = columns.col(k);
        own = W.col(pivot);
        own.noalias() -= columns.leftCols(k) * columns.row(pivot).head(k).transpose();
        own /= std::sqrt(rest[pivot]);
        rest -= own.cwiseAbs2();
        rest[pivot] = 0;
        in[std::size_t(pivot)] = 1;
    }
    kept.clear();
    for (int i = 0; i < int(n); ++i)
        (in[std::size_t(i)] ? kept : left).push_back(i);
}

} // namespace

ClosedRows close_rows(const Eigen::MatrixXd& W)
{
    ClosedRows c;
    if (!(W.diagonal().minCoeff() > 0)) return c;
    c.scale = W.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = c.scale.asDiagonal() * W * c.scale.asDiagonal();
    c.kept.resize(std::size_t(W.rows()));
    std::iota(c.kept.begin(), c.kept.end(), 0);
    c.root = cholesky_root(scaled);
    bool repeats = c.root.size() == 0;
    for (Eigen::Index i = 0; i < c.root.cols(); ++i)
        repeats |= !(c.root(i, i) * c.root(i, i) > kRepeats);
    if (!repeats) return c;
    choose_independent(scaled, c.kept, c.left);
    c.root = cholesky_root(scaled(c.kept, c.kept));
    if (c.empty()) return c;
    c.share = scaled(c.kept, c.left);
    for (Eigen::Index j = 0; j < c.share.cols(); ++j)
        solve_by_root(c.root, c.share.col(j));
    Eigen::MatrixXd squares = c.share.transpose() * c.share;
    squares.diagonal().array() += 1;
    c.left_root = cholesky_root(squares);
    return c;
}

Eigen::VectorXd closing_forces(const ClosedRows& c, const Eigen::VectorXd& u)
{
    Eigen::VectorXd r = -c.scale.cwiseProduct(u);
    if (c.left.empty()) {
        solve_by_root(c.root, r);
        return c.scale.cwiseProduct(r);
    }
    Eigen::VectorXd kept = r(c.kept);
    solve_by_root(c.root, kept);
    Eigen::VectorXd left = c.share.transpose() * kept;
    solve_by_root(c.left_root, left);
    r(c.kept) = kept - c.share * left;
    r(c.left) = left;
    return c.scale.cwiseProduct(r);
}

} // namespace amontons
