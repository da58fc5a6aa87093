#pragma once

#include "haptics/device/device.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "haptics/time/virtual_time.hpp"

#include <atomic>
#include <span>
#include <string>
#include <vector>

// The loop in a thread of its own, in real time; the simulation in the thread that calls.

namespace amontons {

/// How the loop's thread runs.
struct RealTimeOptions {
    double duration = 1;           ///< [s]
    double period = 1e-3;          ///< of the loop [s]
    double operator_period = 0.02; ///< of the simulation: its steps begin no sooner than this [s]
    bool scheduler = true;         ///< request SCHED_FIFO, locked memory, timers without slack
    int priority = 80;
    /// True if the process does nothing else: its allocator then never returns freed memory to the
    /// system.
    bool own_process = true;
    bool bare = true; ///< run a reference thread beside it that only sleeps, by the same clock
    const std::atomic<bool>* stop = nullptr; ///< ends the run when it is set
    /// Called in the simulation's thread, before a step, with the share of the ticks since the last
    /// one that ended above their tolerance, after `budget` [s]: for lack of time.
    std::function<void(double share)> on_overload;
    double budget = 0;
    /// Called in the simulation's thread when the loop's state has changed, and at the end of the
    /// run: for messages to the user.
    std::function<void(SafetyState state)> on_state;
    /// Called in the simulation's thread, once at most, if it makes fewer than 0.8 of the steps a
    /// second that operator_period prescribes.
    /// Its argument is that rate [1/s].
    std::function<void(double rate)> on_slow;
    /// Called in the simulation's thread before a step, with all ticks that are done.
    std::function<void(std::span<const TickRecord> ticks)> on_ticks;
    /// Called by the loop at the end of each tick, with the number of periods since the last: what
    /// a simulated device does in them. No allocation, no lock.
    std::function<void(long periods)> advance;
};

/// What a run in real time measured.
struct RealTimeRun {
    std::vector<TickRecord> records;
    std::string scheduling; ///< which requests were granted, which refused, and how to obtain them
    bool fifo = false, locked = false;
    // Of the loop's thread, after its first ticks:
    long page_faults = 0, waits = 0, preempted = 0; ///< waits: voluntary, one a tick
    /// Pages moved by the kernel meanwhile, on the whole machine. It moves locked pages, too, and
    /// access to one being moved faults, unless the sysctl vm.compact_unevictable_allowed is 0.
    long pages_moved = 0;
    /// How late the ticks of the reference thread were in the same run [s].
    std::vector<double> bare_wake;
    /// Ticks of the reference thread that were late by a period or more.
    long bare_missed = 0;
    double step_rate = 0;    ///< of the simulation, over its last whole second [1/s]; 0: none yet
    double slowest_step = 0; ///< of the simulation, publication included [s]
    long steps = 0, failed_steps = 0;
    std::string stopped; ///< the exception that ended the simulation, if one did
};

/// Runs loop, device and simulation until the duration is over or `stop` is set. A late tick is not
/// repeated: the next one begins at the next full period.
///
/// In the loop: no lock, no allocation, no page fault. The simulation never makes it wait, nor it
/// the simulation. The first operator is made before the first tick. If the simulation throws
/// later, it has stopped: the force is reduced to zero, and the run continues to its end without
/// it. When the run ends, or is ended, the last force tends to zero in 50 ms.
template <class Real>
RealTimeRun run_in_real_time(HapticLoop<Real>& loop, Device& device, int most_contacts,
                             const Publisher<Real>& publish, const RealTimeOptions& options);

extern template RealTimeRun run_in_real_time(HapticLoop<float>&, Device&, int,
                                             const Publisher<float>&, const RealTimeOptions&);
extern template RealTimeRun run_in_real_time(HapticLoop<double>&, Device&, int,
                                             const Publisher<double>&, const RealTimeOptions&);

} // namespace amontons
