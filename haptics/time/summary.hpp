#pragma once

#include "haptics/loop/haptic_loop.hpp"

#include <array>
#include <span>
#include <string>

// What a paper reports of a haptic loop, from its records.

namespace amontons {

/// Of one quantity over all ticks.
struct Percentiles {
    /// Percentiles in the unit of the quantity.
    double p50 = 0, p99 = 0, p999 = 0, max = 0;
};
/// Of any numbers; all 0 if there are none. The share q of them is no larger than the percentile.
Percentiles percentiles(std::vector<double> numbers);

/// Ticks that were not finished when the next was due, by cause.
struct MissedTicks {
    long compute = 0; ///< their own work
    /// A pause of the host, which a virtual machine counts as processor time: half of the ticks
    /// with as many products or more took less than half a period.
    long host = 0;
    long wake = 0;      ///< a late start
    long preempted = 0; ///< other processes on the processor
    long longest = 0;   ///< left out in a row
};

/// Quantities of a run, as `haptics.json` writes them.
struct HapticSummary {
    double rate = 0; ///< ticks over the time they took [Hz]
    long ticks = 0;
    MissedTicks missed;
    Percentiles compute, wake, cpu; ///< [s]
    Percentiles error;              ///< of the natural map at the end of a tick [-]
    Percentiles sweeps;
    double over_tolerance = 0; ///< share of ticks that ended above their tolerance [-]
    int most_contacts = 0;     ///< of an operator
    int most_closed = 0;
    /// Largest change of the computed force in a tick where a new operator came in, or where a
    /// contact closed or opened, less the largest change in the ticks about it where nothing of the
    /// kind happened: what the hand's own motion does not explain [N].
    double handover_jump = 0, contact_jump = 0;
    double largest_change = 0; ///< of the force from tick to tick, whatever the cause [N]
    /// The same of what was sent in all ticks, those in a fault, too [N].
    double largest_change_sent = 0;
    /// By how much the size of what was sent rose in a tick beyond what the computed force did [N].
    double largest_rise_sent = 0;
    double largest_force = 0;   ///< sent [N]
    double energy_injected = 0; ///< largest net energy given to the hand, 0 if none [J]
    double energy = 0;          ///< given to the hand in all [J]
    long clamped = 0, slewed = 0, interpolated = 0, controlled = 0; ///< ticks
    double oldest_operator = 0;                                     ///< [s]
    long operators = 0;                                             ///< taken over
    long outside_validity = 0; ///< ticks beyond the operator's reach
    long faults = 0;
    std::array<long, kSafetyStates> ticks_in{}; ///< in each state
    SafetyState last_fault = SafetyState::running, state = SafetyState::no_operator;
};

/// @param period  of the loop [s];  @param real_time  false: deadlines are not counted
template <class Real>
HapticSummary summarise(std::span<const TickRecord> records, const HapticLoop<Real>& loop,
                        double period, bool real_time);

/// The records as CSV, units in the header.
std::string trace_csv(std::span<const TickRecord> records);

extern template HapticSummary summarise(std::span<const TickRecord>, const HapticLoop<float>&,
                                        double, bool);
extern template HapticSummary summarise(std::span<const TickRecord>, const HapticLoop<double>&,
                                        double, bool);

} // namespace amontons
