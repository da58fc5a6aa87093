#pragma once

#include "haptics/device/device.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "haptics/virtual_time.hpp"

#include <atomic>
#include <span>
#include <string>
#include <vector>

// The loop in a thread of its own, by the clock; the simulation in the thread that calls.

namespace amontons {

/// How the loop's thread runs.
struct RealTimeOptions {
    double duration = 1;           ///< [s]
    double period = 1e-3;          ///< of the loop [s]
    double operator_period = 0.02; ///< of the simulation: its steps begin no sooner than this [s]
    bool scheduler = true;         ///< ask for SCHED_FIFO, locked memory, sharp timers
    int priority = 80;
    /// The process has nothing else to do: for good, its allocator keeps what a step frees.
    bool own_process = true;
    bool bare = true; ///< beside it a thread that only sleeps, by the same clock
    const std::atomic<bool>* stop = nullptr; ///< ends the run when it is set
    /// Called in the simulation's thread, before a step, with the share of the ticks since the last
    /// one that ended above their tolerance, after `budget` [s]: for lack of time.
    std::function<void(double share)> on_overload;
    double budget = 0;
    /// Called in the simulation's thread where the loop's state is another than it was, and when
    /// the run has ended: for the user, who is reported while it lasts.
    std::function<void(SafetyState state)> on_state;
    /// Called in the simulation's thread, once at most, where it makes fewer than 0.8 of the steps
    /// a second that operator_period asks for.
    std::function<void(double rate)> on_slow;
    /// Called in the simulation's thread before a step, with all ticks that are done.
    std::function<void(std::span<const TickRecord> ticks)> on_ticks;
    /// Called by the loop at the end of each tick, with the number of periods since the last: what
    /// a simulated device does in them. No allocation, no lock.
    std::function<void(long periods)> advance;
};

/// What a run by the clock measured.
struct RealTimeRun {
    std::vector<TickRecord> records;
    std::string scheduling; ///< what was had, and what was refused, and how to get it
    bool fifo = false, locked = false;
    // Of the loop's thread, after its first ticks:
    long page_faults = 0, waits = 0, preempted = 0; ///< waits: of its own will, one a tick
    /// By the kernel, on the whole machine, meanwhile: it moves locked pages, too, and one that is
    /// on its way faults, unless the sysctl vm.compact_unevictable_allowed is 0.
    long pages_moved = 0;
    /// Of the bare thread, at the same time: how late its ticks were [s]; and how many by a period.
    std::vector<double> bare_wake;
    /// Ticks that the bare thread missed.
    long bare_missed = 0;
    double step_rate = 0;    ///< of the simulation, over its last whole second [1/s]; 0: none yet
    double slowest_step = 0; ///< of the simulation, publication included [s]
    long steps = 0, failed_steps = 0;
    std::string stopped; ///< the exception that ended the simulation, if one did
};

/// Runs loop, device and simulation until the duration is over or `stop` is set. A tick that is
/// late is not made up for: the next one comes at the next full period.
///
/// In the loop: no lock, no allocation, no page fault. The simulation never makes it wait, nor it
/// the simulation. The first operator is made before the first tick. A simulation that throws later
/// has stopped: the force is taken away, and the run continues to its end without. When the run
/// ends, or is ended, the last force tends to zero in 50 ms.
template <class Real>
RealTimeRun run_in_real_time(HapticLoop<Real>& loop, Device& device, int most_contacts,
                             const Publisher<Real>& publish, const RealTimeOptions& options);

extern template RealTimeRun run_in_real_time(HapticLoop<float>&, Device&, int,
                                             const Publisher<float>&, const RealTimeOptions&);
extern template RealTimeRun run_in_real_time(HapticLoop<double>&, Device&, int,
                                             const Publisher<double>&, const RealTimeOptions&);

} // namespace amontons
