#pragma once

#include "haptics/device/simulated_hand.hpp"
#include "haptics/loop/haptic_loop.hpp"

#include <functional>
#include <vector>

namespace amontons {

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
};

/// Makes the operator for a handle pose: what the simulation thread does.
template <class Real>
using Publisher = std::function<void(ReducedOperator<Real>& op, const Pose& handle, double time,
                                     std::uint64_t sequence)>;

/// Loop, hand and publisher in one thread, in virtual time: the same input gives the same ticks,
/// whatever the machine does. Late ticks have no record.
template <class Real>
std::vector<TickRecord> run_in_virtual_time(HapticLoop<Real>& loop, SimulatedHand& hand,
                                            int most_contacts, const Publisher<Real>& publish,
                                            double period, const VirtualOptions& options);

extern template std::vector<TickRecord> run_in_virtual_time(HapticLoop<float>&, SimulatedHand&, int,
                                                            const Publisher<float>&, double,
                                                            const VirtualOptions&);
extern template std::vector<TickRecord> run_in_virtual_time(HapticLoop<double>&, SimulatedHand&,
                                                            int, const Publisher<double>&, double,
                                                            const VirtualOptions&);

} // namespace amontons
