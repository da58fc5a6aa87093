#pragma once

#include "solver/linear/block_tridiagonal.hpp"

// For the block eliminations of this folder only.

namespace amontons {

typedef long long Mask6 __attribute__((vector_size(64), aligned(64)));

inline constexpr Mask6 kAllBut[6] = {{0, -1, -1, -1, -1, -1, 0, 0}, {-1, 0, -1, -1, -1, -1, 0, 0},
                                     {-1, -1, 0, -1, -1, -1, 0, 0}, {-1, -1, -1, 0, -1, -1, 0, 0},
                                     {-1, -1, -1, -1, 0, -1, 0, 0}, {-1, -1, -1, -1, -1, 0, 0, 0}};
inline constexpr Column6 kUnit[6] = {{1, 0, 0, 0, 0, 0, 0, 0}, {0, 1, 0, 0, 0, 0, 0, 0},
                                     {0, 0, 1, 0, 0, 0, 0, 0}, {0, 0, 0, 1, 0, 0, 0, 0},
                                     {0, 0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 0, 0, 1, 0, 0}};

inline Column6 without(int lane, Column6 c)
{
    return reinterpret_cast<Column6>(reinterpret_cast<Mask6>(c) & kAllBut[lane]);
}

// Gauss-Jordan in place, no row exchange: the pivots' signs are the inertia of a symmetric
// block, and the caller shifts an indefinite matrix rather than reorder it.
inline int invert_block(Block6& a)
{
    int negative = 0;
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) {
        const double pivot = a.column[k][k];
        if (!(pivot > 0)) ++negative;
        const double inverse = 1 / pivot;
        // -a_ik / pivot off the pivot's row, 1 / pivot in it
        const Column6 column =
            kUnit[k] * splat6(inverse) - without(k, a.column[k]) * splat6(inverse);
#pragma GCC unroll 6
        for (int j = 0; j < 6; ++j)
            if (j != k) a.column[j] = without(k, a.column[j]) + column * splat6(a.column[j][k]);
        a.column[k] = column;
    }
    return negative;
}

} // namespace amontons
