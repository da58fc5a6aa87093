#include "haptics/virtual_time.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>

namespace amontons {

template <class Real>
std::vector<TickRecord> run_in_virtual_time(HapticLoop<Real>& loop, SimulatedHand& hand,
                                            int most_contacts, const Publisher<Real>& publish,
                                            double period, const VirtualOptions& options)
{
    struct Sampled {
        Pose pose;
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

    std::vector<TickRecord> records;
    for (long k = 0; k < ticks; ++k) {
        const double time = static_cast<double>(k) * period;
        if (k % per_step == 0 && time < options.stop_publishing_at) {
            steps.push_back({hand.read(time).pose, time});
            // The first one at once: the loop begins when there is something to feel.
            if (static_cast<int>(steps.size()) > options.operator_latency || sequence == 0) {
                const Sampled& s = steps.front();
                publish(buffer.back(), s.pose, s.time, ++sequence);
                buffer.publish();
                if (static_cast<int>(steps.size()) > options.operator_latency) steps.pop_front();
            }
        }
        if (late == 0 && options.late_share > 0 && uniform(rng) < options.late_share)
            late = options.late_ticks;
        if (late > 0) {
            --late;
        } else {
            records.push_back(loop.tick(hand.read(time), buffer, time));
            hand.write(records.back().sent, time);
        }
        hand.advance();
    }
    return records;
}

template std::vector<TickRecord> run_in_virtual_time(HapticLoop<float>&, SimulatedHand&, int,
                                                     const Publisher<float>&, double,
                                                     const VirtualOptions&);
template std::vector<TickRecord> run_in_virtual_time(HapticLoop<double>&, SimulatedHand&, int,
                                                     const Publisher<double>&, double,
                                                     const VirtualOptions&);

} // namespace amontons
