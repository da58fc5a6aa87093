// What memory gives to 1, 2, ... threads: the triad a = b + s c of STREAM (McCalpin 1995), the most
// that a solver of large sparse systems can gain from more cores of one machine.
//
//     stream_bench [THREADS]

#include <algorithm>
#include <barrier>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

namespace {

constexpr std::size_t kEach = 20'000'000; // doubles of an array: far more than caches hold
constexpr int kTimes = 10;

double now()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

/// Bytes per second of the best round.
double triad(int threads)
{
    const std::unique_ptr<double[]> a(new double[kEach]), b(new double[kEach]),
        c(new double[kEach]);
    double begun = 0, best = 1e9;
    std::barrier together(threads);
    const auto work = [&](int k) {
        const std::size_t from = kEach * std::size_t(k) / std::size_t(threads),
                          to = kEach * std::size_t(k + 1) / std::size_t(threads);
        for (std::size_t i = from; i < to; ++i) { // who touches first has it near
            a[i] = 0;
            b[i] = 1;
            c[i] = double(i);
        }
        for (int round = 0; round < kTimes; ++round) {
            together.arrive_and_wait();
            if (k == 0) begun = now();
            together.arrive_and_wait();
            for (std::size_t i = from; i < to; ++i)
                a[i] = b[i] + 3 * c[i];
            together.arrive_and_wait();
            if (k == 0) best = std::min(best, now() - begun);
        }
    };
    std::vector<std::thread> others;
    for (int k = 1; k < threads; ++k)
        others.emplace_back(work, k);
    work(0);
    for (std::thread& t : others)
        t.join();
    return 3 * sizeof(double) * double(kEach) / best;
}

} // namespace

int main(int argc, char** argv)
{
    const int most = argc > 1 ? std::atoi(argv[1]) : int(std::thread::hardware_concurrency());
    double one = 0;
    std::puts("threads,bytes_per_second,ratio");
    for (int threads = 1; threads <= most; ++threads) {
        const double rate = triad(threads);
        if (threads == 1) one = rate;
        std::printf("%d,%.4g,%.3f\n", threads, rate, rate / one);
    }
}
