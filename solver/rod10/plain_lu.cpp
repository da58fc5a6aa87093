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

// By panels of columns and tiles of what is right of them, which stay in the cache: the same
// operations in the same order as without, but the time is that of operations, not of memory.
void factor_full(FullMatrix& A)
{
    constexpr int kPanel = 48, kTile = 256;
    const int n = A.size;
    const auto subtract = [&](int i, int k, int begin, int end) {
        const double l = A(i, k);
        for (int j = begin; j < end; ++j)
            A(i, j) -= l * A(k, j);
    };
    for (int panel = 0; panel < n; panel += kPanel) {
        const int behind = std::min(panel + kPanel, n);
        for (int k = panel; k < behind; ++k) {
            const double inverse = 1 / A(k, k);
            for (int i = k + 1; i < n; ++i) {
                A(i, k) *= inverse;
                subtract(i, k, k + 1, behind);
            }
        }
        for (int tile = behind; tile < n; tile += kTile)
            for (int i = panel + 1; i < n; ++i)
                for (int k = panel; k < std::min(i, behind); ++k)
                    subtract(i, k, tile, std::min(tile + kTile, n));
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
