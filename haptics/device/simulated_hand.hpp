#pragma once

#include "haptics/device/device.hpp"

#include <functional>
#include <vector>

namespace amontons {

/// A hand that holds a device and follows a path: mass, damper and spring on each of six axes.
///
///   (m_device + m_hand) x'' + b_device x' + friction sgn(x') = F + k (path - x) + b (path' - x')
///
/// Turns are taken as the rotation vector from the start, axis by axis. Sources of typical values:
/// docs/theory/haptics.md.
struct HandOptions {
    double mass = 0.554;        ///< of the hand [kg]
    double damping = 6.45;      ///< [N s/m]
    double stiffness = 135;     ///< [N/m]
    double device_mass = 0.1;   ///< [kg]
    double device_damping = 0;  ///< [N s/m]
    double friction = 0;        ///< [N]
    double resolution = 0;      ///< step of the encoder [m]; 0: none
    double max_force = 0;       ///< of the motors [N]; 0: no limit
    double inertia = 1e-3;      ///< hand and device, for turns [kg m^2]
    double turn_damping = 0.05; ///< [N m s/rad]
    double turn_stiffness = 2;  ///< [N m/rad]
    int delay = 0;              ///< ticks from write to the motors
    double period = 1e-3;       ///< of the ticks [s]
    int substeps = 20;          ///< per tick; each is exact but for friction and the path
    /// The pose to which the spring pulls the hand, over time [s]: position [m] and rotation vector
    /// [rad]; empty: the origin.
    std::function<Vec6(double time)> path;
    Vec6 start = Vec6::Zero();          ///< [m], [rad]
    Vec6 start_velocity = Vec6::Zero(); ///< [m/s], [rad/s]
};

/// A hand on a device, for tests, in virtual time: the state changes in advance() alone.
class SimulatedHand : public Device {
public:
    explicit SimulatedHand(HandOptions options);
    DeviceSpec spec() const override;
    DeviceSample read(double time) noexcept override;
    void write(const Wrench& wrench, double time) noexcept override;

    /// One tick of the device under the wrench that is due after the delay. The motors' work is
    /// the integral of their wrench over the displacement.
    void advance();

    /// Translation and rotation vector [m, rad].
    Vec6 position() const { return x_; }
    /// Their rates [m/s, rad/s].
    Vec6 velocity() const { return v_; }
    double motor_work() const { return work_; } ///< done on the hand so far [J]

private:
    struct Axis { // one substep of a mass, damper and spring under a constant force
        double xx = 1, xv = 0, vx = 0, vv = 1, xf = 0, vf = 0;
    };
    static Axis exact_step(double m, double b, double k, double dt);

    HandOptions options_;
    Axis linear_, angular_;
    Vec6 x_, v_, on_motors_ = Vec6::Zero();
    std::vector<Vec6> queue_; // written, not yet on the motors
    double time_ = 0, work_ = 0;
};

} // namespace amontons
