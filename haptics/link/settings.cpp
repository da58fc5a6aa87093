#include "haptics/link/settings.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kLeastDamping = 1;   // of a hand that holds a device [N s/m]
constexpr double kLeastMass = 0.05;   // of hand and device, where the profile has none [kg]
constexpr double kFullTorqueAt = 0.1; // turn at which the spring gives the device's torque [rad]
constexpr double kStepsOnTrust = 3;   // of the encoder: a force may begin that is sure after them
constexpr int kMostSweeps = 200;      // of a tick; in real time its budget ends sooner
constexpr double kMostOnTrust = 5e-6; // ... and what may be given for that in all [J]
constexpr double kSlewTime = 2e-3;    // from nothing to the device's largest force, at most [s]

} // namespace

double coupling_stiffness(const DeviceSpec& device, double rate)
{
    const double stable = kLeastDamping * rate;
    return device.max_stiffness > 0 ? std::min(device.max_stiffness, stable) : stable;
}

HapticSettings make_settings(const HapticInput& input, const DeviceSpec& device, int late)
{
    constexpr double kNone = std::numeric_limits<double>::infinity();
    HapticSettings s;
    s.device = device;
    const bool turns = device.free[3] || device.free[4] || device.free[5];
    HandleSpring& spring = s.link.spring;
    spring.stiffness =
        input.stiffness > 0 ? input.stiffness : coupling_stiffness(device, input.rate);
    spring.turn_stiffness = input.turn_stiffness > 0         ? input.turn_stiffness
                            : turns && device.max_torque > 0 ? device.max_torque / kFullTorqueAt
                                                             : kNone;

    s.loop.period = 1 / input.rate;
    s.loop.proxy.max_sweeps = kMostSweeps;
    s.loop.clutch = true;
    s.loop.coupling_stiffness = spring.stiffness;
    s.loop.coupling_damping = input.damping;
    if (device.max_force > 0) {
        s.loop.limiter.max_force = device.max_force;
        s.loop.limiter.max_slew = device.max_force / kSlewTime;
    }
    s.loop.torque = turns;
    if (device.max_torque > 0) s.loop.limiter.max_torque = device.max_torque;
    if (device.max_torque > 0 && device.max_force > 0) // the same share of what it can give
        s.loop.limiter.max_torque_rise =
            device.max_torque * s.loop.limiter.max_rise / device.max_force;
    s.loop.safety.ramp_up = input.ramp;
    s.loop.passivity.max_damping = device.max_damping > 0 ? device.max_damping : 5;
    s.loop.passivity.resolution = device.resolution;
    s.loop.passivity.least_mass = device.mass > 0 ? device.mass : kLeastMass;
    s.loop.passivity.horizon = 1 + late;
    s.loop.passivity.allowance =
        std::min(kMostOnTrust, spring.stiffness * std::pow(kStepsOnTrust * device.resolution, 2));

    s.link.condense.speed = input.speed;
    s.link.condense.most_speed = s.loop.safety.max_speed;
    s.link.condense.period = 1 / input.simulation_rate;
    s.link.condense.damper_spring = input.damping * input.rate;
    s.link.condense.most_contacts = input.contacts;

    s.hand.mass = input.hand.mass;
    s.hand.damping = input.hand.damping;
    s.hand.stiffness = input.hand.stiffness;
    if (device.mass > 0) s.hand.device_mass = device.mass;
    s.hand.friction = device.friction;
    s.hand.resolution = device.resolution;
    s.hand.max_force = device.max_force;
    s.hand.period = s.loop.period;
    return s;
}

} // namespace amontons
