#include "haptics/loop/columns.hpp"

#include <algorithm>
#include <cstring>

#if defined(__x86_64__) && defined(__GNUC__)
#define AMONTONS_TARGET(set) __attribute__((target(set)))
#define AMONTONS_X86 1
#else
#define AMONTONS_TARGET(set)
#define AMONTONS_X86 0
#endif

namespace amontons {
namespace {

// Vectors are loaded through memcpy, never passed between functions: their passing depends on the
// instruction set. Inlined into each function below, this is compiled for that function's set.
template <class Real, int Bytes>
[[gnu::always_inline]] inline void add(Real* u, const Real* x0, const Real* x1, const Real* x2,
                                       Real a0, Real a1, Real a2, int count)
{
    typedef Real Vector __attribute__((vector_size(Bytes)));
    constexpr int kLanes = Bytes / static_cast<int>(sizeof(Real));
    u = static_cast<Real*>(__builtin_assume_aligned(u, 64));
    x0 = static_cast<const Real*>(__builtin_assume_aligned(x0, 64));
    x1 = static_cast<const Real*>(__builtin_assume_aligned(x1, 64));
    x2 = static_cast<const Real*>(__builtin_assume_aligned(x2, 64));
    for (int i = 0; i < count; i += kLanes) {
        Vector sum, y0, y1, y2;
        std::memcpy(&sum, u + i, Bytes);
        std::memcpy(&y0, x0 + i, Bytes);
        std::memcpy(&y1, x1 + i, Bytes);
        std::memcpy(&y2, x2 + i, Bytes);
        sum = sum + a0 * y0 + a1 * y1 + a2 * y2;
        std::memcpy(u + i, &sum, Bytes);
    }
}

template <class Real>
void add_baseline(Real* u, const Real* x0, const Real* x1, const Real* x2, Real a0, Real a1,
                  Real a2, int count)
{
    add<Real, 16>(u, x0, x1, x2, a0, a1, a2, count);
}

template <class Real>
AMONTONS_TARGET("avx2,fma")
void add_avx2(Real* u, const Real* x0, const Real* x1, const Real* x2, Real a0, Real a1, Real a2,
              int count)
{
    add<Real, 32>(u, x0, x1, x2, a0, a1, a2, count);
}

template <class Real>
AMONTONS_TARGET("avx512f,fma")
void add_avx512(Real* u, const Real* x0, const Real* x1, const Real* x2, Real a0, Real a1, Real a2,
                int count)
{
    add<Real, 64>(u, x0, x1, x2, a0, a1, a2, count);
}

} // namespace

const char* name(SimdLevel level)
{
    switch (level) {
    case SimdLevel::avx2:
        return "avx2";
    case SimdLevel::avx512:
        return "avx512";
    case SimdLevel::baseline:
        break;
    }
    return "baseline";
}

SimdLevel best_simd_level()
{
#if AMONTONS_X86
    if (__builtin_cpu_supports("avx512f")) return SimdLevel::avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return SimdLevel::avx2;
#endif
    return SimdLevel::baseline;
}

template <class Real> AddColumns<Real> add_columns(SimdLevel level)
{
    switch (std::min(level, best_simd_level())) {
    case SimdLevel::avx512:
        return add_avx512<Real>;
    case SimdLevel::avx2:
        return add_avx2<Real>;
    case SimdLevel::baseline:
        break;
    }
    return add_baseline<Real>;
}

template AddColumns<float> add_columns(SimdLevel);
template AddColumns<double> add_columns(SimdLevel);

} // namespace amontons
