#include "haptics/loop/passivity.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kMostHeld = 20; // ticks from one pose to the next that are predicted

} // namespace

void Passivity::observe(const HandPose& device, double time)
{
    if (!started_) {
        last_pose_ = device;
        last_time_ = time;
        started_ = true;
        return;
    }
    Vec6 step = displacement(last_pose_, device);
    const double share = 1.0 / std::max(sums_, 1);
    const double work = share * (sum_.force.dot(step.head<3>()) + sum_.torque.dot(step.tail<3>()));
    sum_ = {};
    sums_ = 0;
    energy_ += work;
    most_energy_ = std::max(most_energy_, energy_);
    if (options_.leak > 0 && credit_ > 0) credit_ *= std::exp(-options_.period / options_.leak);
    credit_ -= work;
    const double ticks = std::round((time - last_time_) / options_.period);
    held_ = static_cast<int>(std::clamp(ticks, 1.0, kMostHeld));
    step /= std::max(1.0, ticks);
    surprise_ = (step - step_).head<3>().norm();
    turn_surprise_ = (step - step_).tail<3>().norm();
    step_ = step;
    last_pose_ = device;
    last_time_ = time;
}

void Passivity::restart(const HandPose& device, double time)
{
    last_pose_ = device;
    last_time_ = time;
    step_.setZero();
    surprise_ = turn_surprise_ = 0;
    sum_ = {};
    sums_ = 0;
    started_ = true;
}

void Passivity::drop_credit()
{
    credit_ = std::min(credit_, options_.allowance);
}

Wrench Passivity::allow(Wrench wrench, const Limiter& limiter, Motion motion, bool always)
{
    const Vec3 x = step_.head<3>(), t = step_.tail<3>();
    const bool fault = motion == Motion::fault;
    double more = fault ? 0 : surprise_ + options_.resolution;
    if (!fault && options_.least_mass > 0)
        more += (wrench.force.norm() + sent_.force.norm()) * options_.period * options_.period /
                options_.least_mass;
    const double turn_more = fault ? 0 : turn_surprise_ + options_.turn_resolution;
    // Until a pose comes in `ticks`: by the mean of what was sent since the last one and of this.
    // The step may change by `more` in every tick.
    const auto work_of = [&](const Wrench& w, int ticks) {
        const Vec3 force = sum_.force + ticks * w.force, torque = sum_.torque + ticks * w.torque;
        return force.dot(x) + torque.dot(t) +
               (sums_ + ticks + 1) / 2.0 * (more * force.norm() + turn_more * torque.norm());
    };
    const int longest = std::max({options_.horizon, held_ - sums_, 1});
    const auto worst_work = [&](const Wrench& w) { // the ends decide
        const double late = work_of(w, std::max(late_, longest)) - options_.late_trust;
        return std::max({work_of(w, 1), work_of(w, longest), late});
    };
    const double forecast = worst_work(wrench), budget = std::max(credit_, 0.0);
    if ((options_.control || always) && forecast > credit_) {
        ++controlled_;
        // Damping that dissipates the missing energy, up to the limit of the device.
        const double T = options_.period, x2 = x.squaredNorm(), t2 = t.squaredNorm();
        if (motion == Motion::known && x2 + t2 > 0) {
            const double missing = forecast - credit_;
            const double b = std::min(options_.max_damping, x2 > 0 ? missing * T / x2 : 0);
            const double c = std::min(options_.max_turn_damping, t2 > 0 ? missing * T / t2 : 0);
            const Wrench damped = limiter.add(wrench, {-b / T * x, -c / T * t});
            if (worst_work(damped) < forecast) wrench = damped;
        }
        // Convex in the share that is sent: what is between its ends is enough.
        const double left = worst_work(wrench), least = worst_work({});
        if (left > budget) {
            const double share = least < budget ? (budget - least) / (left - least) : 0;
            wrench.force *= share;
            wrench.torque *= share;
        }
        removed_ += forecast - worst_work(wrench);
    }
    sent_ = wrench;
    sum_.force += wrench.force;
    sum_.torque += wrench.torque;
    ++sums_;
    return wrench;
}

} // namespace amontons
