#pragma once

#include "haptics/pose.hpp"

#include <limits>

namespace amontons {

/// State of the force: docs/theory/haptics.md.
enum class SafetyState {
    no_operator,        ///< no operator yet: no force
    starting,           ///< the force is scaled up from zero, or restored
    running,            ///< as computed
    limited,            ///< running, but less or other than computed: passivity control, or a limit
    aged_operator,      ///< the simulation is late: the force loses stiffness
    stale_operator,     ///< the simulation published nothing for so long that none is left
    device_lost,        ///< no sample from the device
    too_fast,           ///< the device moves faster than allowed
    pose_jump,          ///< the device's pose jumped: it was re-calibrated, or replaced
    not_a_number,       ///< device or force not finite; stays
    simulation_stopped, ///< it ended, or failed; stays
};

/// Number of states.
constexpr int kSafetyStates = static_cast<int>(SafetyState::simulation_stopped) + 1;

const char* name(SafetyState state); ///< "no operator", "starting", ...
/// One sentence for the user: what happened to the force and why.
const char* reason(SafetyState state);

/// Limits above which the force is faded out.
struct SafetyOptions {
    double period = 1e-3;       ///< of the loop [s]
    double ramp_down = 0.05;    ///< from any force to none [s]
    double ramp_up = 0.5;       ///< from none to the full force, at the start and after a fault [s]
    double aged_periods = 3;    ///< age from which an operator loses stiffness, in its period [-]
    double stale_periods = 9;   ///< age at which it has none left, and is stale [-]
    double max_speed = 1;       ///< of the handle [m/s]
    double max_turn_speed = 20; ///< [rad/s]
    double max_jump = 0.05;     ///< of the pose from one sample to the next [m]
    double lost_after = 0.01;   ///< without a valid sample [s]
    double calm = 0.2;          ///< time without a fault before the force returns [s]
};

/// State of the loop in a tick, by which faults are detected.
struct SafetyInput {
    double time = 0; ///< [s]
    bool sample_valid = false;
    HandPose device;            ///< if sample_valid
    double operator_time = -1;  ///< when the operator at hand arrived; < 0: none yet [s]
    double operator_period = 0; ///< [s]
    bool simulation_stopped = false;
    /// When the pose was measured; the same as before: the same pose again. -inf: now [s].
    double sample_time = -std::numeric_limits<double>::infinity();
};

/// Detects faults, names them, and reduces the force to zero.
///
/// An operator that ages loses stiffness: from aged_periods on the force is scaled down with its
/// age, evenly, to none at stale_periods. A new operator restores it as at the start.
///
/// In a fault the last wrench that was sent varies linearly to zero within ramp_down, in real time,
/// and never grows. A fault that can pass (stale operator, lost device, too fast, jump) makes the
/// force return over ramp_up after a time `calm` without a fault; the others are permanent. A late
/// tick restores no more of the force than one in time.
class Safety {
public:
    explicit Safety(const SafetyOptions& options = {}) : options_(options) {}

    /// First in a tick. @returns whether the loop may compute with this sample
    bool watch(const SafetyInput& input);
    /// The wrench with the ramp of the state applied; in a fault what is left of the one sent last.
    /// A wrench that is not finite is a fault of its own.
    Wrench apply(const Wrench& wrench);
    /// The wrench that was sent to the device in the end, from which a ramp to zero continues.
    void sent(const Wrench& wrench) { sent_ = wrench; }

    /// Only this share of a force that is scaled up could be sent: scaling continues from there.
    void hold_back(double share);

    SafetyState state() const { return state_; } ///< never `limited`: see ForceOutput
    bool in_fault() const;                       ///< the force tends to zero, or is lost
    bool jumped() const { return jump_; } ///< the pose of this tick is far from that of the last
    SafetyState last_fault() const { return last_fault_; } ///< running: none so far
    long faults() const { return faults_; }

private:
    void fail(SafetyState state);
    SafetyState examine(const SafetyInput& input);

    SafetyOptions options_;
    SafetyState state_ = SafetyState::no_operator, last_fault_ = SafetyState::running;
    double level_ = 0; // of the force, 0 .. 1
    double stiff_ = 1; // what its age leaves of the operator, 0 .. 1
    double left_ = 0;  // of the ramp down, 1 .. 0
    Wrench sent_;
    double time_ = -1, elapsed_ = 0; // of the last tick, and since the one before
    double calm_since_ = -1, last_sample_ = -1, last_measured_ = 0;
    HandPose last_pose_;
    bool has_pose_ = false, jump_ = false;
    long faults_ = 0;
};

} // namespace amontons
