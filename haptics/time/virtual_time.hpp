#pragma once

#include "haptics/device/simulated_hand.hpp"
#include "haptics/loop/haptic_loop.hpp"

#include <atomic>
#include <functional>
#include <span>
#include <vector>

namespace amontons {

/// How a run without a clock is timed.
struct VirtualOptions {
    double duration = 1;           ///< [s]
    double operator_period = 0.02; ///< of the publisher [s]
    /// Periods between the pose that an operator is made for and its publication: what a step
    /// takes.
    int operator_latency = 1;
    double late_share = 0;             ///< of ticks that come late [-]
    int late_ticks = 3;                ///< by how many ticks; the force of the last one is held
    unsigned seed = 1;                 ///< of which ticks are late
    double stop_publishing_at = 1e300; ///< [s]
    const std::atomic<bool>* stop = nullptr; ///< ends the run when it is set
    /// Called after each step of the simulation, with all ticks that are done.
    std::function<void(std::span<const TickRecord> ticks)> on_ticks;
    /// The clock is waited for: a second of the run takes one, if the machine is quick enough.
    bool by_clock = false;
};

/// Makes the operator for a handle pose: what the simulation thread does. False: there is none.
/// Its `time` is that of the simulation [s].
template <class Real>
using Publisher = std::function<bool(ReducedOperator<Real>& op, const HandPose& handle, double time,
                                     std::uint64_t sequence)>;

/// Loop, device and publisher in one thread, in virtual time: the same input gives the same ticks,
/// whatever the machine does. Late ticks have no record; `compute` is real time nevertheless.
/// @param advance  called at the end of each tick: what the device does in it
/// @param period   of the simulation [s]
template <class Real>
std::vector<TickRecord> run_in_virtual_time(HapticLoop<Real>& loop, Device& device,
                                            const std::function<void()>& advance, int most_contacts,
                                            const Publisher<Real>& publish, double period,
                                            const VirtualOptions& options);

/// The same with a simulated hand. @param period  of the simulation [s]
template <class Real>
std::vector<TickRecord> run_in_virtual_time(HapticLoop<Real>& loop, SimulatedHand& hand,
                                            int most_contacts, const Publisher<Real>& publish,
                                            double period, const VirtualOptions& options)
{
    return run_in_virtual_time<Real>(
        loop, hand, [&] { hand.advance(); }, most_contacts, publish, period, options);
}

extern template std::vector<TickRecord> run_in_virtual_time(HapticLoop<float>&, Device&,
                                                            const std::function<void()>&, int,
                                                            const Publisher<float>&, double,
                                                            const VirtualOptions&);
extern template std::vector<TickRecord> run_in_virtual_time(HapticLoop<double>&, Device&,
                                                            const std::function<void()>&, int,
                                                            const Publisher<double>&, double,
                                                            const VirtualOptions&);

} // namespace amontons
