#include "solver/rod10/plain_lu.hpp"

#include <algorithm>

namespace amontons {

void factor_band(BandMatrix& A)
{
    const int n = A.size(), m = A.reach();
    for (int k = 0; k < n; ++k) {
        const int last = std::min(n - 1, k + m);
        const double inverse = 1 / A(k, k);
        for (int i = k + 1; i <= last; ++i) {
            const double l = A(i, k) *= inverse;
            for (int j = k + 1; j <= last; ++j)
                A(i, j) -= l * A(k, j);
        }
    }
}

void solve_band(const BandMatrix& LU, std::span<double> b)
{
    const int n = LU.size(), m = LU.reach();
    for (int i = 0; i < n; ++i)
        for (int j = std::max(0, i - m); j < i; ++j)
            b[std::size_t(i)] -= LU(i, j) * b[std::size_t(j)];
    for (int i = n - 1; i >= 0; --i) {
        for (int j = i + 1; j <= std::min(n - 1, i + m); ++j)
            b[std::size_t(i)] -= LU(i, j) * b[std::size_t(j)];
        b[std::size_t(i)] /= LU(i, i);
    }
}

void factor_full(FullMatrix& A)
{
    const int n = A.size;
    for (int k = 0; k < n; ++k) {
        const double inverse = 1 / A(k, k);
        for (int i = k + 1; i < n; ++i) {
            const double l = A(i, k) *= inverse;
            for (int j = k + 1; j < n; ++j)
                A(i, j) -= l * A(k, j);
        }
    }
}

void solve_full(const FullMatrix& LU, std::span<double> b)
{
    const int n = LU.size;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < i; ++j)
            b[std::size_t(i)] -= LU(i, j) * b[std::size_t(j)];
    for (int i = n - 1; i >= 0; --i) {
        for (int j = i + 1; j < n; ++j)
            b[std::size_t(i)] -= LU(i, j) * b[std::size_t(j)];
        b[std::size_t(i)] /= LU(i, i);
    }
}

} // namespace amontons
