#pragma once

#include "solver/linear/block_tridiagonal.hpp"

// For the block eliminations of this folder only: a 6x6 block in twelve registers of four doubles.
// Compilers take vectors of eight for a memory object where the processor has none that wide: a
// product then passed through memory at every step.

namespace amontons {

/// Four doubles: half of a column of six, padded.
typedef double Half6 __attribute__((vector_size(32), aligned(32), may_alias));

/// A half with all numbers s.
inline Half6 splat_half(double s)
{
    return Half6{s, s, s, s};
}

/// A 6 x 6 block by columns, in registers.
struct Columns6 {
    Half6 low[6], high[6]; ///< rows 0 to 3, rows 4 and 5 and the padding
};

/// Reads a block.
[[gnu::always_inline]] inline Columns6 load_columns(const Block6& a)
{
    Columns6 c;
    const Half6* p = reinterpret_cast<const Half6*>(&a);
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j)
        c.low[j] = p[2 * j], c.high[j] = p[2 * j + 1];
    return c;
}

/// Writes a block.
[[gnu::always_inline]] inline void store_columns(const Columns6& c, Block6& a)
{
    Half6* p = reinterpret_cast<Half6*>(&a);
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j)
        p[2 * j] = c.low[j], p[2 * j + 1] = c.high[j];
}

/// c -= a b
[[gnu::always_inline]] inline void subtract_product(Columns6& c, const Block6& a, const Block6& b)
{
    const Half6* p = reinterpret_cast<const Half6*>(&a);
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) {
        const Half6 low = p[2 * k], high = p[2 * k + 1];
#pragma GCC unroll 6
        for (int j = 0; j < 6; ++j) {
            const Half6 s = splat_half(b(k, j));
            c.low[j] -= low * s;
            c.high[j] -= high * s;
        }
    }
}

/// out = a b; `out` may be b.
[[gnu::always_inline]] inline void store_product(const Block6& a, const Block6& b, Block6& out)
{
    const Half6* p = reinterpret_cast<const Half6*>(&a);
    Columns6 c;
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) {
        const Half6 s = splat_half(b(0, j));
        c.low[j] = p[0] * s, c.high[j] = p[1] * s;
    }
#pragma GCC unroll 5
    for (int k = 1; k < 6; ++k) {
        const Half6 low = p[2 * k], high = p[2 * k + 1];
#pragma GCC unroll 6
        for (int j = 0; j < 6; ++j) {
            const Half6 s = splat_half(b(k, j));
            c.low[j] += low * s;
            c.high[j] += high * s;
        }
    }
    store_columns(c, out);
}

/// A column in two registers.
struct Column2 {
    /// Rows 0 to 3, and rows 4, 5 with padding.
    Half6 low, high;
};
/// Reads a column of six.
[[gnu::always_inline]] inline Column2 load_column(const Node6& x)
{
    const Half6* p = reinterpret_cast<const Half6*>(&x);
    return {p[0], p[1]};
}
/// Writes a column of six.
[[gnu::always_inline]] inline void store_column(const Column2& c, Node6& x)
{
    Half6* p = reinterpret_cast<Half6*>(&x);
    p[0] = c.low, p[1] = c.high;
}
/// c -= d.
[[gnu::always_inline]] inline void subtract(Column2& c, const Column2& d)
{
    c.low -= d.low, c.high -= d.high;
}
/// A block times a column.
[[gnu::always_inline]] inline Column2 product(const Block6& a, const double* x)
{
    const Half6* p = reinterpret_cast<const Half6*>(&a);
    Column2 sum{p[0] * splat_half(x[0]), p[1] * splat_half(x[0])};
#pragma GCC unroll 5
    for (int k = 1; k < 6; ++k) {
        sum.low += p[2 * k] * splat_half(x[k]);
        sum.high += p[2 * k + 1] * splat_half(x[k]);
    }
    return sum;
}

/// Without the entry of row `row`.
[[gnu::always_inline]] inline Half6 without(int row, Half6 c)
{
    typedef long long Mask __attribute__((vector_size(32), aligned(32), may_alias));
    constexpr Mask kAllBut[4] = {
        {0, -1, -1, -1}, {-1, 0, -1, -1}, {-1, -1, 0, -1}, {-1, -1, -1, 0}};
    return reinterpret_cast<Half6>(reinterpret_cast<Mask>(c) & kAllBut[row]);
}

/// Gauss-Jordan in place, no row exchange: the pivots' signs are the inertia of a symmetric
/// block, and the caller shifts an indefinite matrix rather than reorder it.
[[gnu::always_inline]] inline int invert_columns(Columns6& a)
{
    int negative = 0;
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) {
        const bool upper = k < 4;
        const int row = upper ? k : k - 4;
        const double pivot = upper ? a.low[k][row] : a.high[k][row];
        if (!(pivot > 0)) ++negative;
        const double inverse = 1 / pivot;
        // -a_ik / pivot off the pivot's row, 1 / pivot in it
        const Half6 s = splat_half(inverse);
        Half6 low = (upper ? without(row, a.low[k]) : a.low[k]) * -s;
        Half6 high = (upper ? a.high[k] : without(row, a.high[k])) * -s;
        (upper ? low : high)[row] = inverse;
#pragma GCC unroll 6
        for (int j = 0; j < 6; ++j) {
            if (j == k) continue;
            const Half6 t = splat_half(upper ? a.low[j][row] : a.high[j][row]);
            a.low[j] = (upper ? without(row, a.low[j]) : a.low[j]) + low * t;
            a.high[j] = (upper ? a.high[j] : without(row, a.high[j])) + high * t;
        }
        a.low[k] = low, a.high[k] = high;
    }
    return negative;
}

} // namespace amontons
