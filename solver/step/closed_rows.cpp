#include "solver/step/closed_rows.hpp"

#include "mesh/base/dense.hpp"

#include <algorithm>
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

using Begins = std::vector<Eigen::Index>;

/// The first row of each column of a symmetric matrix, up to the diagonal, that is other than 0.
Begins begins_of(const Eigen::MatrixXd& A)
{
    Begins begin;
    for (Eigen::Index j = 0; j < A.cols(); ++j) {
        Eigen::Index first = 0;
        while (first < j && A(first, j) == 0)
            ++first;
        begin.push_back(first);
    }
    return begin;
}

/// U with U^T U = A, within the envelope of A: a joint of a chain has entries with its neighbours
/// alone.
/// @return  empty where A is not positive definite
Eigen::MatrixXd root_in_envelope(const Eigen::MatrixXd& A, const Begins& begin)
{
    const Eigen::Index n = A.cols();
    Eigen::MatrixXd U = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
        const Eigen::Index first = begin[std::size_t(j)];
        for (Eigen::Index i = first; i < j; ++i) {
            const Eigen::Index from = std::max(first, begin[std::size_t(i)]);
            const double before =
                from < i ? U.col(i).segment(from, i - from).dot(U.col(j).segment(from, i - from))
                         : 0.0;
            U(i, j) = (A(i, j) - before) / U(i, i);
        }
        const double rest = A(j, j) - U.col(j).segment(first, j - first).squaredNorm();
        if (!(rest > 0)) return {};
        U(j, j) = std::sqrt(rest);
    }
    return U;
}

/// x = U^-1 U^-T b. @param U  upper triangular, with columns that begin there; empty: at row 0
void solve_by_root(const Eigen::MatrixXd& U, const Begins& begin, Eigen::Ref<Eigen::VectorXd> x)
{
    const auto first = [&](Eigen::Index i) { return begin.empty() ? 0 : begin[std::size_t(i)]; };
    const Eigen::Index n = U.cols();
    for (Eigen::Index i = 0; i < n; ++i) {
        const Eigen::Index f = first(i);
        x[i] = (x[i] - U.col(i).segment(f, i - f).dot(x.segment(f, i - f))) / U(i, i);
    }
    for (Eigen::Index i = n - 1; i >= 0; --i) {
        const Eigen::Index f = first(i);
        x[i] /= U(i, i);
        x.segment(f, i - f) -= x[i] * U.col(i).segment(f, i - f);
    }
}

/// The root of the kept rows' W, in its envelope where that is small.
void find_root(const Eigen::MatrixXd& A, ClosedRows& c)
{
    constexpr double kSmall = 0.5; // of the entries of a triangle
    c.begin = begins_of(A);
    Eigen::Index entries = 0;
    for (Eigen::Index j = 0; j < A.cols(); ++j)
        entries += j + 1 - c.begin[std::size_t(j)];
    const double all = 0.5 * double(A.cols()) * double(A.cols() + 1);
    if (double(entries) <= kSmall * all) {
        c.root = root_in_envelope(A, c.begin);
        return;
    }
    c.begin.clear();
    c.root = cholesky_root(A);
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
    find_root(scaled, c);
    bool repeats = c.root.size() == 0;
    for (Eigen::Index i = 0; i < c.root.cols(); ++i)
        repeats |= !(c.root(i, i) * c.root(i, i) > kRepeats);
    if (!repeats) return c;
    choose_independent(scaled, c.kept, c.left);
    find_root(scaled(c.kept, c.kept), c);
    if (c.empty()) return c;
    c.share = scaled(c.kept, c.left);
    for (Eigen::Index j = 0; j < c.share.cols(); ++j)
        solve_by_root(c.root, c.begin, c.share.col(j));
    Eigen::MatrixXd squares = c.share.transpose() * c.share;
    squares.diagonal().array() += 1;
    c.left_root = cholesky_root(squares);
    return c;
}

Eigen::VectorXd closing_forces(const ClosedRows& c, const Eigen::VectorXd& u)
{
    Eigen::VectorXd r = -c.scale.cwiseProduct(u);
    if (c.left.empty()) {
        solve_by_root(c.root, c.begin, r);
        return c.scale.cwiseProduct(r);
    }
    Eigen::VectorXd kept = r(c.kept);
    solve_by_root(c.root, c.begin, kept);
    Eigen::VectorXd left = c.share.transpose() * kept;
    solve_by_root(c.left_root, {}, left);
    r(c.kept) = kept - c.share * left;
    r(c.left) = left;
    return c.scale.cwiseProduct(r);
}

} // namespace amontons
