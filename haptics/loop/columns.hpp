#pragma once

// The one inner loop of a tick: u += three columns of W, by the widest registers there are.

namespace amontons {

/// Instruction sets that the kernels are compiled for, whatever the rest was compiled for.
enum class SimdLevel {
    baseline, ///< available on every machine of this architecture: SSE2 on x86-64
    avx2,     ///< with fused multiply-add
    avx512
};

const char* name(SimdLevel level); ///< "baseline", "avx2", "avx512"

/// The widest that this processor has.
SimdLevel best_simd_level();

/// u += a0 x0 + a1 x1 + a2 x2, all arrays on 64 bytes and `count` a multiple of 64 bytes.
template <class Real>
using AddColumns = void (*)(Real* u, const Real* x0, const Real* x1, const Real* x2, Real a0,
                            Real a1, Real a2, int count);

/// The kernel of that level, or of the best one below that this processor has.
///
/// Elementwise, so no sum is reordered: a plain loop would be the same to the rounding of the fused
/// product. Written with vectors because compilers differ in what they vectorise, and this is 9/10
/// of a tick.
template <class Real> AddColumns<Real> add_columns(SimdLevel level);

} // namespace amontons
