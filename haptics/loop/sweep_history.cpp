#include "haptics/loop/sweep_history.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <type_traits>

namespace amontons {
namespace {

/// Relative shift of the normal equations' diagonal: differences may be parallel [-].
constexpr double kRegular = 1e-6;

/// Of all shares together: more multiplies the rounding of u, and where contacts open and close or
/// differences are rounding themselves they predict nothing. They stay below 4 in a bed of 200
/// contacts
/// [-].
constexpr double kMostShares = 100;

template <class Real> constexpr int kNumbersPerLine = static_cast<int>(64 / sizeof(Real));

/// Written by lanes: compilers may not reorder a sum.
template <class Line> double dot(const std::vector<Line>& a, const std::vector<Line>& b, int lines)
{
    using Real = std::remove_cvref_t<decltype(a[0].number[0])>;
    Line sum{};
    for (std::size_t l = 0; l < static_cast<std::size_t>(lines); ++l)
        for (int k = 0; k < kNumbersPerLine<Real>; ++k)
            sum.number[k] += a[l].number[k] * b[l].number[k];
    double all = 0;
    for (const Real x : sum.number)
        all += static_cast<double>(x);
    return all;
}

} // namespace

template <class Real> SweepHistory<Real>::SweepHistory(int most_rows)
{
    const auto lines =
        static_cast<std::size_t>((most_rows + kNumbersPerLine<Real> - 1) / kNumbersPerLine<Real>);
    for (Vector* v : {&residual_, &last_residual_, &last_u_})
        v->resize(lines);
    for (int k = 0; k < kDepth; ++k)
        for (Vector* v : {&residual_change_[k], &r_change_[k], &u_change_[k]})
            v->resize(lines);
    before_.resize(static_cast<std::size_t>(most_rows));
    last_r_.resize(static_cast<std::size_t>(most_rows));
}

template <class Real> void SweepHistory<Real>::clear()
{
    known_ = 0;
    newest_ = -1;
    has_last_ = false;
}

template <class Real> void SweepHistory<Real>::before_sweep(const double* r, int rows)
{
    rows_ = rows;
    lines_ = (rows + kNumbersPerLine<Real> - 1) / kNumbersPerLine<Real>;
    std::copy_n(r, rows, before_.data());
}

template <class Real> void SweepHistory<Real>::after_sweep(const double* r, const Real* u)
{
    const auto numbers = [](Vector& v) { return v.data()->number; };
    Real* g = numbers(residual_);
    for (int i = 0; i < rows_; ++i)
        g[i] = static_cast<Real>(r[i] - before_[static_cast<std::size_t>(i)]);
    std::fill(g + rows_, g + lines_ * kNumbersPerLine<Real>, Real{0});
    if (has_last_) {
        newest_ = (newest_ + 1) % kDepth;
        known_ = std::min(known_ + 1, kDepth);
        Real* dg = numbers(residual_change_[newest_]);
        Real* dr = numbers(r_change_[newest_]);
        Real* du = numbers(u_change_[newest_]);
        const Real *last_g = numbers(last_residual_), *last_u = numbers(last_u_);
        for (int i = 0; i < rows_; ++i)
            dr[i] = static_cast<Real>(r[i] - last_r_[static_cast<std::size_t>(i)]);
        for (int i = 0; i < lines_ * kNumbersPerLine<Real>; ++i) {
            dg[i] = g[i] - last_g[i];
            du[i] = u[i] - last_u[i];
        }
        for (int k = 0; k < known_; ++k)
            normal_(k, newest_) = normal_(newest_, k) =
                dot(residual_change_[k], residual_change_[newest_], lines_);
    }
    std::swap(residual_, last_residual_);
    std::copy_n(r, rows_, last_r_.data());
    std::copy_n(u, lines_ * kNumbersPerLine<Real>, numbers(last_u_));
    has_last_ = true;
}

template <class Real> void SweepHistory<Real>::extrapolate(double* r, Real* u)
{
    Small matrix = normal_.topLeftCorner(known_, known_);
    matrix.diagonal() *= 1 + kRegular;
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kDepth, 1> share(known_);
    for (int k = 0; k < known_; ++k)
        share[k] = dot(residual_change_[k], last_residual_, lines_);
    Eigen::LDLT<Small> factor(matrix);
    factor.solveInPlace(share);
    if (!(share.template lpNorm<1>() <= kMostShares)) return clear();
    for (int k = 0; k < known_; ++k) {
        const Real* dr = r_change_[k].data()->number;
        const Real* du = u_change_[k].data()->number;
        const double a = share[k];
        const auto b = static_cast<Real>(a);
        for (int i = 0; i < rows_; ++i)
            r[i] -= a * static_cast<double>(dr[i]);
        for (int i = 0; i < lines_ * kNumbersPerLine<Real>; ++i)
            u[i] -= b * du[i];
    }
}

template class SweepHistory<float>;
template class SweepHistory<double>;

} // namespace amontons
