// Times of one haptic tick: a flat tool with n frictional contacts pressed into an elastic
// half-space, dragged at 0.1 m/s and turned, with a new operator every 20 ms. Processor time of the
// thread: what an uninterrupted tick takes. The haptic thread's own clock: amontons
// haptic.
//
//   build/release/bin/haptic_tick [ticks [budget in microseconds of wall time]]

#include "haptics/loop/proxy_loop.hpp"
#include "haptics/tests/scenes.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

using namespace amontons;
using namespace amontons::test;

namespace {

/// Processor time of this thread [s]: other processes do not count.
double cpu_time()
{
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double percentile(std::vector<double> x, double share)
{
    std::sort(x.begin(), x.end());
    return x[std::min(x.size() - 1,
                      static_cast<std::size_t>(share * static_cast<double>(x.size())))];
}

template <class Real> void measure(int n, SimdLevel level, int ticks, double budget)
{
    Bed bed;
    bed.points = grid(n, 4e-3);
    bed.shear = 2e4;
    bed.k = 1000;
    ReducedOperator<Real> one(n), other(n);
    ProxyOptions options;
    options.simd = level;
    options.budget = budget;
    ProxyLoop<Real> loop(n, options);
    std::vector<double> micro, error, sweeps, hand_over;
    int closed = 0;
    for (int k = 0; k < ticks; ++k) {
        const double t = 1e-3 * k;
        // 2 to 4 mm deep, on a circle at 0.1 m/s, rocking by 0.02 rad.
        const HandPose pose{
            {0.02 * std::cos(5 * t), 0.02 * std::sin(5 * t), -0.003 + 1e-3 * std::sin(9 * t)},
            turn({0.02 * std::sin(7 * t), 0.02 * std::cos(6 * t), 0})};
        const bool fresh = k % 20 == 0;
        ReducedOperator<Real>& next = k % 40 == 0 ? one : other;
        if (fresh) publish(next, bed, pose, t, static_cast<std::uint64_t>(k + 1));
        const double start = cpu_time();
        if (fresh) loop.take(next, t);
        const ProxyTick tick = loop.tick(pose, t);
        const double us = 1e6 * (cpu_time() - start);
        if (k < 40) continue; // caches, and the first touch
        micro.push_back(us);
        if (fresh) hand_over.push_back(us);
        error.push_back(tick.error);
        sweeps.push_back(tick.sweeps);
        closed = std::max(closed, tick.closed);
    }
    std::printf("%4d %-6s %-8s %6d %8.1f %8.1f %8.1f %8.1f %8.1f %6.0f %6.0f %10.1e\n", n,
                sizeof(Real) == 4 ? "float" : "double", name(level), closed, percentile(micro, 0.5),
                percentile(micro, 0.99), percentile(micro, 0.999), percentile(micro, 1),
                percentile(hand_over, 0.5), percentile(sweeps, 0.5), percentile(sweeps, 0.99),
                percentile(error, 0.99));
}

} // namespace

int main(int argc, char** argv)
{
    const int ticks = argc > 1 ? std::max(100, std::atoi(argv[1])) : 2000;
    const double budget = argc > 2 ? 1e-6 * std::atof(argv[2]) : 0;
    std::printf("   n real   simd     closed  p50[us]      p99    p99.9      max take+p50 sweeps   "
                " p99  error p99\n");
    for (const int n : {10, 50, 100, 200})
        for (int level = 0; level <= static_cast<int>(best_simd_level()); ++level) {
            measure<float>(n, static_cast<SimdLevel>(level), ticks, budget);
            measure<double>(n, static_cast<SimdLevel>(level), ticks, budget);
        }
}
