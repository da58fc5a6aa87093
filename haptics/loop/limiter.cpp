#include "haptics/loop/limiter.hpp"

namespace amontons {
namespace {

bool shorten(Vec3& f, double most)
{
    const double size = f.norm();
    if (!(size > most)) return false;
    f *= most / size;
    return true;
}

} // namespace

Wrench Limiter::clamp(Wrench wrench)
{
    const bool force = shorten(wrench.force, options_.max_force),
               torque = shorten(wrench.torque, options_.max_torque);
    clamped_ += force || torque;
    return wrench;
}

Vec3 Limiter::approach_one(const Vec3& target, const Vec3& last, double slew, double above,
                           int& steps_left)
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
    return f;
}

Wrench Limiter::approach(const Wrench& wrench)
{
    interpolates_ = slews_ = false;
    last_ = {approach_one(wrench.force, last_.force, options_.max_slew, options_.interpolate_above,
                          steps_left_),
             approach_one(wrench.torque, last_.torque, options_.max_torque_slew,
                          options_.interpolate_torque_above, torque_steps_left_)};
    interpolated_ += interpolates_;
    slewed_ += slews_;
    return last_;
}

} // namespace amontons
