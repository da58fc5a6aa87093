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
    /// A force that changes by more than this in a tick is reached in `interpolation` equal steps,
    /// each towards the newest target: the limiter by interpolation [N], [N m].
    double interpolate_above = std::numeric_limits<double>::infinity();
    double interpolate_torque_above = std::numeric_limits<double>::infinity();
    int interpolation = 10; ///< steps, >= 1 [-]
};

/// Magnitude first, so that a ramp scales what the device can give; then interpolation and slew.
/// Vectors are scaled, never cut by component.
class Limiter {
public:
    explicit Limiter(const LimiterOptions& options = {}) : options_(options) {}

    /// Within the largest force and torque.
    Wrench clamp(Wrench wrench);
    /// The next step to there from what was sent last.
    /// @param wrench  finite, and clamped: so is then the result
    Wrench approach(const Wrench& wrench);
    /// What was sent in the end, if something after the limiter changed it.
    void sent(const Wrench& wrench) { last_ = wrench; }

    long ticks_interpolated() const { return interpolated_; }
    long ticks_slewed() const { return slewed_; }
    long ticks_clamped() const { return clamped_; }

private:
    Vec3 approach_one(const Vec3& target, const Vec3& last, double slew, double above,
                      int& steps_left);

    LimiterOptions options_;
    Wrench last_;
    int steps_left_ = 0, torque_steps_left_ = 0;
    bool interpolates_ = false, slews_ = false; // in this tick
    long interpolated_ = 0, slewed_ = 0, clamped_ = 0;
};

} // namespace amontons
