#include "haptics/loop/passivity.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kMostHeld = 20; // ticks from one pose to the next that are looked ahead

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

Wrench Passivity::allow(Wrench wrench, double most_force, double most_torque, bool damp)
{
    const Vec3 x = step_.head<3>(), t = step_.tail<3>();
    double more = surprise_ + options_.resolution;
    // In a fault the force goes away by itself, evenly: what might come is not reason enough to drop it.
    if (!damp)
        more = 0;
    else if (options_.least_mass > 0)
        more += (wrench.force.norm() + sent_.force.norm()) * options_.period * options_.period /
                options_.least_mass;
    const double turn_more = damp ? turn_surprise_ + options_.turn_resolution : 0;
    // The step may change by `more` in every tick. Convex in the number of ticks: the ends decide.
    const auto work_of = [&](const Wrench& w, double ticks) {
        return ticks * (w.force.dot(x) + w.torque.dot(t) +
                        (ticks + 1) / 2 * (more * w.force.norm() + turn_more * w.torque.norm()));
    };
    const auto worst_work = [&](const Wrench& w) {
        return std::max(work_of(w, 1), work_of(w, std::max(options_.horizon, held_)));
    };
    const double wanted = worst_work(wrench), budget = std::max(credit_, 0.0);
    if (options_.control && wanted > credit_) {
        ++controlled_;
        // Damping that takes what is missing, as far as the device bears it.
        const double T = options_.period, x2 = x.squaredNorm(), t2 = t.squaredNorm();
        if (damp && x2 + t2 > 0) {
            const double missing = wanted - credit_;
            const double b = std::min(options_.max_damping, x2 > 0 ? missing * T / x2 : 0);
            const double c = std::min(options_.max_turn_damping, t2 > 0 ? missing * T / t2 : 0);
            Wrench damped = wrench;
            damped.force -= b / T * x;
            damped.torque -= c / T * t;
            const double f = damped.force.norm(), m = damped.torque.norm();
            if (f > most_force) damped.force *= most_force / f;
            if (m > most_torque) damped.torque *= most_torque / m;
            if (worst_work(damped) < wanted) wrench = damped;
        }
        const double left = worst_work(wrench);
        if (left > budget) {
            wrench.force *= budget / left;
            wrench.torque *= budget / left;
        }
        removed_ += wanted - worst_work(wrench);
    }
    sent_ = wrench;
    sum_.force += wrench.force;
    sum_.torque += wrench.torque;
    ++sums_;
    return wrench;
}

} // namespace amontons
