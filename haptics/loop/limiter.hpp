#pragma once

#include "haptics/pose.hpp"

#include <limits>

namespace amontons {

/// What may reach the device. A tick in which a limit acts did not render the contact's force: all
/// are counted.
struct LimiterOptions {
    double period = 1e-3;                                             ///< of the loop [s]
    double max_force = std::numeric_limits<double>::infinity();       ///< [N]
    double max_torque = std::numeric_limits<double>::infinity();      ///< [N m]
    double max_slew = std::numeric_limits<double>::infinity();        ///< [N/s]
    double max_torque_slew = std::numeric_limits<double>::infinity(); ///< [N m/s]
    /// By how much more than the computed force what is sent may rise, or turn, in a tick [N], [N
    /// m].
    double max_rise = 0.2, max_torque_rise = 2e-3;
    /// A force that changes by more than this in a tick is reached in `interpolation` equal steps,
    /// each towards the newest target: the limiter by interpolation [N], [N m].
    double interpolate_above = std::numeric_limits<double>::infinity();
    /// Above this torque the change is interpolated [N m].
    double interpolate_torque_above = std::numeric_limits<double>::infinity();
    int interpolation = 10; ///< steps, >= 1 [-]
};

/// Bounds on the force and the torque sent in a tick, and the steps towards a target.
///
/// With s the force sent in the tick before, and c and c_before those computed in this tick and in
/// the one before (both within the largest force), a force f may be sent if
///
///     |f| <= |s| + max(|c| - |c_before|, 0) + max_rise,
///     |f - a s| <= |c - c_before| + max_rise  for some a in [0, 1],
///
/// the same for torques. So a force may fall at once, also to zero, but neither jump up nor
/// reverse. Where c or c_before is not known, c counts as unchanged; where nothing may grow, f = a
/// s. The set is convex and contains 0, so that a force that is scaled down afterwards stays within
/// it. Vectors are scaled, never cut by component.
class Limiter {
public:
    explicit Limiter(const LimiterOptions& options = {}) : options_(options) {}

    /// Within the largest force and torque.
    Wrench clamp(Wrench wrench);
    /// Called first in a tick: sets the bounds of this tick.
    /// @param computed  the wrench computed in this tick, clamped; null: none was
    /// @param grows     false: the wrench that is sent may only shrink
    void begin(const Wrench* computed, bool grows);
    /// The next step towards a target: its nearest wrench within the bounds, after interpolation
    /// and the limit of the slew rate.
    /// @param wrench  finite and clamped; the result then is so, too
    Wrench approach(const Wrench& wrench);
    /// `wrench` plus the largest share, in [0, 1], of `addition` with which it stays within bounds.
    Wrench add(const Wrench& wrench, const Wrench& addition) const;
    /// To be called with the wrench that was sent in the end, if it was changed after approach().
    void sent(const Wrench& wrench) { last_ = wrench; }

    /// Ticks whose force was interpolated.
    long ticks_interpolated() const { return interpolated_; }
    /// Ticks whose change was limited.
    long ticks_slewed() const { return slewed_; }
    /// Ticks whose size was limited.
    long ticks_clamped() const { return clamped_; }

private:
    struct Room {           // of a force or a torque, in this tick
        Vec3 from{0, 0, 0}; // sent in the tick before
        double most = std::numeric_limits<double>::infinity();  // of its size
        double about = std::numeric_limits<double>::infinity(); // from the way to nothing
    };
    Vec3 approach_one(const Vec3& target, const Vec3& last, const Room& room, double slew,
                      double above, int& steps_left);

    LimiterOptions options_;
    Wrench last_;
    Wrench computed_; // of the tick before ...
    bool has_computed_ = false;
    Room force_, torque_;
    int steps_left_ = 0, torque_steps_left_ = 0;
    bool interpolates_ = false, slews_ = false; // in this tick
    long interpolated_ = 0, slewed_ = 0, clamped_ = 0;
};

} // namespace amontons
