#pragma once

#include "haptics/loop/force_output.hpp"
#include "haptics/loop/proxy_loop.hpp"
#include "haptics/sample.hpp"
#include "haptics/triple_buffer.hpp"

namespace amontons {

/// All options of the fast loop.
struct HapticOptions {
    double period = 1e-3; ///< of the loop [s]; overrides those below
    ProxyOptions proxy;
    SafetyOptions safety;
    LimiterOptions limiter;
    PassivityOptions passivity;
    /// Damper beside the spring between device and tool [N s/m]. The operators must then be made
    /// with k = coupling_stiffness + coupling_damping / period (see coupling()).
    double coupling_damping = 0;
    double coupling_stiffness = 0; ///< of the spring [N/m]; needed with a damper only
    bool torque = true;            ///< the device has motors for turns
    /// The first sample is taken to be the operator's pose, axes kept; and one that jumped to be
    /// the pose before: a device that was re-calibrated or replaced has the handle where it was.
    bool clutch = false;
};

/// The k [N/m] that add_coupling needs for these options.
double coupling(const HapticOptions& options);

/// What happened in a tick; plain, for a ring that another thread writes out.
struct TickRecord {
    double time = 0; ///< [s]
    HandPose handle; ///< in the operator's frame
    Wrench computed; ///< J^T r
    Wrench sent;     ///< after ramps, limits and passivity control: see ForceOutput
    ProxyTick proxy;
    SafetyState state = SafetyState::no_operator;
    double energy = 0;       ///< given to the hand since the start [J]
    double operator_age = 0; ///< since the pose it was made for [s]
    double compute = 0;      ///< real time that the tick took; set by the caller of the loop [s]
    double cpu = 0;          ///< processor time of it: what is less than `compute` others took [s]
    double wake = 0;         ///< how late it began [s]
};

/// A tick of the haptic thread, without thread, clock or device: sample in, wrench out.
///
/// operator -> pose -> contacts -> ForceOutput. No lock, allocation, exception or system call.
template <class Real> class HapticLoop {
public:
    HapticLoop(int most_contacts, const HapticOptions& options);

    /// @param time  of this tick, on the clock of the operators' times [s]
    TickRecord tick(const DeviceSample& sample, TripleBuffer<ReducedOperator<Real>>& operators,
                    double time, bool simulation_stopped = false);

    /// That share in [0, 1] of the last wrench: what is sent to the device after the last tick.
    Wrench fade_out(double share) { return output_.fade_out(share); }

    /// Where a device's pose has the handle: the same, or by the clutch; one that jumped away from
    /// the last, where that had it. Before the first valid sample: where the operator has it, if
    /// there is one.
    HandPose handle_of(const HandPose& device) const;

    const ProxyLoop<Real>& proxy() const { return proxy_; }
    /// Faults and states.
    const Safety& safety() const { return output_.safety; }
    /// Limits of the force.
    const Limiter& limiter() const { return output_.limiter; }
    /// Energy given to the hand.
    const Passivity& passivity() const { return output_.passivity; }

private:
    HandPose clutched_pose(const HandPose& device) const;
    bool is_jump(const HandPose& device) const;

    HapticOptions options_;
    ProxyLoop<Real> proxy_;
    ForceOutput output_;
    HandPose device_origin_, handle_origin_; // of the clutch
    HandPose last_device_;
    double measured_ = -1; // when that was [s]
    Wrench last_computed_; // repeated where one sample is missing
    bool clutched_ = false, seen_ = false;
    bool unknown_ = false; // what the device did in the last fault
    Vec3 lag_{0, 0, 0};    // tool minus device of the damper's last tick [m]
    double arrival_ = -1, next_period_ = 0;
    double last_time_ = -1, late_ = 1; // of the last tick [s]; how late ticks are [periods]
};

extern template class HapticLoop<float>;
extern template class HapticLoop<double>;

} // namespace amontons
