#include "haptics/device/simulated_hand.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

/// exp of [0 1 0; -k/m -b/m 1/m; 0 0 0] dt, by its series after halving until it is short.
SimulatedHand::Axis SimulatedHand::exact_step(double m, double b, double k, double dt)
{
    Mat3 A;
    A << 0, 1, 0, -k / m, -b / m, 1 / m, 0, 0, 0;
    A *= dt;
    // The force's column may be large where m is small; it feeds back nothing.
    const int halvings = std::max(
        0, static_cast<int>(std::ceil(std::log2(A.topLeftCorner<2, 2>().norm() + 1e-300))) + 3);
    A /= std::ldexp(1.0, halvings);
    Mat3 term = Mat3::Identity(), sum = term;
    for (int i = 1; i <= 16; ++i) {
        term = (term * A / i).eval();
        sum += term;
    }
    for (int i = 0; i < halvings; ++i)
        sum = (sum * sum).eval();
    return {sum(0, 0), sum(0, 1), sum(1, 0), sum(1, 1), sum(0, 2), sum(1, 2)};
}

SimulatedHand::SimulatedHand(HandOptions options)
    : options_(std::move(options))
    , x_(options_.start)
    , v_(options_.start_velocity)
{
    const double dt = options_.period / options_.substeps;
    linear_ = exact_step(options_.mass + options_.device_mass,
                         options_.damping + options_.device_damping, options_.stiffness, dt);
    angular_ = exact_step(options_.inertia, options_.turn_damping, options_.turn_stiffness, dt);
    queue_.assign(static_cast<std::size_t>(options_.delay), Vec6::Zero());
}

DeviceSpec SimulatedHand::spec() const
{
    DeviceSpec spec;
    spec.name = "simulated hand";
    spec.free.fill(true);
    spec.max_force = options_.max_force;
    spec.resolution = options_.resolution;
    spec.mass = options_.device_mass;
    spec.friction = options_.friction;
    return spec;
}

DeviceSample SimulatedHand::read(double time) noexcept
{
    DeviceSample sample;
    sample.time = time;
    sample.valid = true;
    sample.pose.position = x_.head<3>();
    if (options_.resolution > 0)
        for (double& x : sample.pose.position)
            x = options_.resolution * std::round(x / options_.resolution);
    sample.pose.rotation = turn(x_.tail<3>());
    return sample;
}

void SimulatedHand::write(const Wrench& wrench, double) noexcept
{
    Vec6 F;
    F << wrench.force, wrench.torque;
    const double size = wrench.force.norm();
    if (options_.max_force > 0 && size > options_.max_force)
        F.head<3>() *= options_.max_force / size;
    if (queue_.empty()) {
        on_motors_ = F;
        return;
    }
    on_motors_ = queue_.front();
    std::rotate(queue_.begin(), queue_.begin() + 1, queue_.end());
    queue_.back() = F;
}

void SimulatedHand::advance()
{
    const double dt = options_.period / options_.substeps;
    const double slowed = options_.friction * dt / (options_.mass + options_.device_mass);
    const Vec6 before = x_;
    for (int s = 0; s < options_.substeps; ++s, time_ += dt) {
        Vec6 target = Vec6::Zero(), rate = Vec6::Zero();
        if (options_.path) {
            const Vec6 a = options_.path(time_), b = options_.path(time_ + dt);
            target = (a + b) / 2;
            rate = (b - a) / dt;
        }
        for (int i = 0; i < 6; ++i) {
            const Axis& a = i < 3 ? linear_ : angular_;
            const double k = i < 3 ? options_.stiffness : options_.turn_stiffness;
            const double c = i < 3 ? options_.damping : options_.turn_damping;
            const double f = on_motors_[i] + k * target[i] + c * rate[i];
            const double x = a.xx * x_[i] + a.xv * v_[i] + a.xf * f;
            double v = a.vx * x_[i] + a.vv * v_[i] + a.vf * f;
            if (i < 3 && slowed > 0) v = std::copysign(std::max(std::abs(v) - slowed, 0.0), v);
            x_[i] = x;
            v_[i] = v;
        }
    }
    work_ += on_motors_.dot(x_ - before);
}

} // namespace amontons
