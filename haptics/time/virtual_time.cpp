#include "haptics/time/virtual_time.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <random>
#include <thread>

namespace amontons {

template <class Real>
std::vector<TickRecord> run_in_virtual_time(HapticLoop<Real>& loop, Device& device,
                                            const std::function<void()>& advance, int most_contacts,
                                            const Publisher<Real>& publish, double period,
                                            const VirtualOptions& options)
{
    using Clock = std::chrono::steady_clock;
    struct Sampled {
        HandPose device, handle;
        double time;
    };
    TripleBuffer<ReducedOperator<Real>> buffer{ReducedOperator<Real>(most_contacts)};
    std::deque<Sampled> steps; // begun, not yet published
    std::mt19937 rng{options.seed};
    std::uniform_real_distribution<double> uniform;
    const auto ticks = std::lround(options.duration / period);
    const auto per_step = std::max(1L, std::lround(options.operator_period / period));
    std::uint64_t sequence = 0;
    int late = 0;
    bool waited = false;
    HandPose last;

    const Clock::time_point begin = Clock::now();
    std::vector<TickRecord> records;
    records.reserve(static_cast<std::size_t>(ticks));
    for (long k = 0; k < ticks && !(options.stop && *options.stop); ++k) {
        const double time = static_cast<double>(k) * period;
        if (k % per_step == 0 && time < options.stop_publishing_at) {
            const DeviceSample sample = device.read(time);
            if (sample.valid && !is_broken(sample.pose)) last = sample.pose;
            steps.push_back({last, loop.handle_of(last), time});
            // Until the first of them is done, that of the start is published again: a simulation
            // that has begun is there.
            const Sampled& begun = steps.front();
            if (publish(buffer.back(), begun.handle, begun.time, ++sequence)) buffer.publish();
            if (static_cast<int>(steps.size()) > options.operator_latency) steps.pop_front();
            if (options.on_ticks) options.on_ticks(records);
            if (options.by_clock)
                std::this_thread::sleep_until(begin + std::chrono::duration<double>(time));
        }
        // The first is in time: with it the device is found. And so is one that was waited for.
        if (late == 0 && !waited && options.late_share > 0 && uniform(rng) < options.late_share &&
            k > 0)
            late = options.late_ticks;
        waited = late > 0;
        if (waited) {
            --late;
        } else {
            const Clock::time_point start = Clock::now();
            TickRecord record = loop.tick(device.read(time), buffer, time);
            record.compute = std::chrono::duration<double>(Clock::now() - start).count();
            device.write(record.sent, time);
            records.push_back(record);
        }
        // By the clutch as this tick has it: the pose may have been the first, or have jumped.
        if (!steps.empty() && steps.back().time == time)
            steps.back().handle = loop.handle_of(steps.back().device);
        if (advance) advance();
    }
    return records;
}

template std::vector<TickRecord> run_in_virtual_time(HapticLoop<float>&, Device&,
                                                     const std::function<void()>&, int,
                                                     const Publisher<float>&, double,
                                                     const VirtualOptions&);
template std::vector<TickRecord> run_in_virtual_time(HapticLoop<double>&, Device&,
                                                     const std::function<void()>&, int,
                                                     const Publisher<double>&, double,
                                                     const VirtualOptions&);

} // namespace amontons
