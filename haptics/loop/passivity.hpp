#pragma once

#include "haptics/loop/limiter.hpp"
#include "haptics/pose.hpp"

// Time-domain passivity: what the loop gives to the hand is counted, and can be kept at or below
// what the hand has given to it.

namespace amontons {

/// Options of passivity control.
struct PassivityOptions {
    bool control = true;            ///< false: count only
    double period = 1e-3;           ///< of the loop [s]
    double max_damping = 5;         ///< that the device bears [N s/m]
    double max_turn_damping = 5e-3; ///< the same for its turn [N m s/rad]
    /// Motion of the hand in a tick beyond the predicted one that is allowed for: one step of the
    /// encoder [m], [rad].
    double resolution = 0, turn_resolution = 0;
    /// How many ticks a force may be held because the next one comes late, >= 1.
    int horizon = 1;
    /// Least mass of device and hand: bounds how far a new force pushes in a tick; 0: not counted
    /// [kg]
    double least_mass = 0;
    /// Credit that the hand has earned by pushing decays with this time constant, so that old
    /// dissipation does not hide new injection; 0: never [s].
    double leak = 0;
    /// What a tick that comes later than `horizon` may give beyond the credit: that it comes
    /// so late just then, while the hand moves off as fast as it may, is unlikely [J].
    double late_trust = 2e-6;
    /// Credit to begin with, which bounds the energy that may be given in all. Without any, a force
    /// cannot begin where a tick's motion is below the encoder's step: no energy was supplied yet,
    /// and the next motion is unknown. With K times the square of a few steps it can [J].
    double allowance = 0;
};

/// What is known of the device's motion in a tick.
enum class Motion {
    known,   ///< a pose came
    unknown, ///< no pose: the motion of the hand since the last one counts as predicted
    fault, ///< the force is being ramped to zero: it is reduced only for predicted motion, not for
           ///< possible motion
};

/// Measures and limits the energy given to the hand.
///
/// The force is held over a tick, so the work of a tick is exactly F . (x_k - x_(k-1)), however
/// late the tick came: no velocity is estimated. The control predicts: with the motion of the
/// last tick as forecast, and its last change as what may be added, it first damps, then scales the
/// force so that the work until the next pose does not exceed the credit: that of the wrenches sent
/// since the last pose, which may be some ticks ago, and of the one to send. Source of the idea:
/// Hannaford & Ryu, IEEE T-RA 18 (2002) 1-10, observer and controller; here the controller acts
/// before the energy is delivered, in that paper after.
class Passivity {
public:
    explicit Passivity(const PassivityOptions& options = {})
        : options_(options)
        , credit_(options.allowance)
    {
    }

    /// Counts the work on the way to this pose, done by the wrench sent before; by their mean, if
    /// several were: of a device that reports its pose every few ticks. The next one is expected
    /// after as many.
    /// @param time  of the pose: a late tick has moved farther [s]
    void observe(const HandPose& device, double time);
    /// Continues from a pose that the device did not move to: it was re-calibrated, or replaced.
    /// @param time  of the pose [s]
    void restart(const HandPose& device, double time);
    /// Sets the credit to zero, after a fault of the device.
    void drop_credit();
    /// How many ticks a force may be held from now on, besides those of the options: by the recent
    /// lateness of ticks.
    void expect_delayed(int ticks) { late_ = ticks; }
    /// The wrench that may be sent now. Stores it for observe().
    /// @param wrench   that may be sent by the limiter: what is left of it may, too
    /// @param limiter  of this tick: how much damping may be added, where the motion is known
    /// @param always   without control, too
    Wrench allow(Wrench wrench, const Limiter& limiter, Motion motion = Motion::known,
                 bool always = false);

    double energy() const { return energy_; }           ///< given to the hand since start [J]
    double most_energy() const { return most_energy_; } ///< its maximum; <= 0: passive [J]
    double credit() const { return credit_; }           ///< what may be given back [J]
    double removed() const { return removed_; } ///< work that control took away, predicted [J]
    /// Ticks in which control damped or scaled the force.
    long ticks_controlled() const { return controlled_; }

private:
    PassivityOptions options_;
    HandPose last_pose_;
    Wrench sent_, sum_;       // sum_: of those sent since the last pose
    int sums_ = 0, held_ = 1; // how many; and ticks between the last two poses
    double last_time_ = 0;
    int late_ = 1;
    Vec6 step_ = Vec6::Zero();                // in a tick, of late
    double surprise_ = 0, turn_surprise_ = 0; // how much it differed from the one before
    double energy_ = 0, most_energy_ = 0, credit_, removed_ = 0;
    long controlled_ = 0;
    bool started_ = false;
};

} // namespace amontons
