#include "haptics/loop/limiter.hpp"

#include <algorithm>

namespace amontons {
namespace {

bool shorten(Vec3& f, double most)
{
    const double size = f.norm();
    if (!(size > most)) return false;
    f *= most / size;
    return true;
}

/// The point nearest to f on the way from `last` to nothing.
Vec3 on_way_down(const Vec3& f, const Vec3& last)
{
    const double square = last.squaredNorm();
    return square > 0 ? Vec3(std::clamp(f.dot(last) / square, 0.0, 1.0) * last) : Vec3(0, 0, 0);
}

double rise(const Vec3& computed, const Vec3& before)
{
    return std::max(0.0, computed.norm() - before.norm());
}

constexpr int kBisections = 20; // of a share

} // namespace

Wrench Limiter::clamp(Wrench wrench)
{
    const bool force = shorten(wrench.force, options_.max_force),
               torque = shorten(wrench.torque, options_.max_torque);
    clamped_ += force || torque;
    return wrench;
}

void Limiter::begin(const Wrench* computed, bool grows)
{
    const bool both = computed && has_computed_;
    const auto room_of = [&](const Vec3& last, const Vec3* now, const Vec3& before, double more) {
        if (!grows) return Room{last, last.norm(), 0};
        return Room{last, last.norm() + more + (now ? rise(*now, before) : 0),
                    more + (now ? (*now - before).norm() : 0)};
    };
    force_ =
        room_of(last_.force, both ? &computed->force : nullptr, computed_.force, options_.max_rise);
    torque_ = room_of(last_.torque, both ? &computed->torque : nullptr, computed_.torque,
                      options_.max_torque_rise);
    has_computed_ = computed != nullptr;
    if (computed) computed_ = *computed;
}

Vec3 Limiter::approach_one(const Vec3& target, const Vec3& last, const Room& room, double slew,
                           double above, int& steps_left)
{
    Vec3 f = target;
    shorten(f, room.most);
    const Vec3 near = on_way_down(f, room.from);
    Vec3 aside = f - near;
    if (shorten(aside, room.about)) f = near + aside;
    if (steps_left == 0 && (f - last).norm() > above) steps_left = options_.interpolation;
    if (steps_left > 0) {
        f = last + (f - last) / steps_left;
        --steps_left;
        interpolates_ = true;
    }
    const double change = (f - last).norm(), most = slew * options_.period;
    if (change > most) {
        f = last + most / change * (f - last);
        slews_ = true;
    }
    return f;
}

Wrench Limiter::approach(const Wrench& wrench)
{
    interpolates_ = slews_ = false;
    last_ = {approach_one(wrench.force, last_.force, force_, options_.max_slew,
                          options_.interpolate_above, steps_left_),
             approach_one(wrench.torque, last_.torque, torque_, options_.max_torque_slew,
                          options_.interpolate_torque_above, torque_steps_left_)};
    interpolated_ += interpolates_;
    slewed_ += slews_;
    return last_;
}

Wrench Limiter::add(const Wrench& wrench, const Wrench& addition) const
{
    const auto share = [](const Vec3& f, const Vec3& more, const Room& room, double most) {
        const auto fits = [&](double s) {
            const Vec3 g = f + s * more;
            return g.norm() <= std::min(most, room.most) &&
                   (g - on_way_down(g, room.from)).norm() <= room.about;
        };
        if (fits(1)) return 1.0;
        double low = 0, high = 1;
        for (int i = 0; i < kBisections; ++i) {
            const double middle = (low + high) / 2;
            (fits(middle) ? low : high) = middle;
        }
        return low;
    };
    return {wrench.force +
                share(wrench.force, addition.force, force_, options_.max_force) * addition.force,
            wrench.torque + share(wrench.torque, addition.torque, torque_, options_.max_torque) *
                                addition.torque};
}

} // namespace amontons
