#include "haptics/loop/limiter.hpp"

namespace amontons {

Vec3 Limiter::limit_one(const Vec3& target, const Vec3& last, double most, double slew,
                        double above, int& steps_left)
{
    Vec3 f = target;
    if (steps_left == 0 && (f - last).norm() > above) steps_left = options_.interpolation;
    if (steps_left > 0) {
        f = last + (f - last) / steps_left;
        --steps_left;
        interpolates_ = true;
    }
    const double change = (f - last).norm(), room = slew * options_.period;
    if (change > room) {
        f = last + room / change * (f - last);
        slews_ = true;
    }
    const double size = f.norm();
    if (size > most) {
        f *= most / size;
        clamps_ = true;
    }
    return f;
}

Wrench Limiter::limit(const Wrench& wrench)
{
    interpolates_ = slews_ = clamps_ = false;
    last_ = {limit_one(wrench.force, last_.force, options_.max_force, options_.max_slew,
                       options_.interpolate_above, steps_left_),
             limit_one(wrench.torque, last_.torque, options_.max_torque, options_.max_torque_slew,
                       options_.interpolate_torque_above, torque_steps_left_)};
    interpolated_ += interpolates_;
    slewed_ += slews_;
    clamped_ += clamps_;
    return last_;
}

} // namespace amontons
