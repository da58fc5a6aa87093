#pragma once

#include "haptics/sample.hpp"

#include <array>
#include <span>
#include <string_view>

namespace amontons {

/// What a device can do. Numbers that its maker does not give are 0: not known.
struct DeviceSpec {
    std::string_view name;
    /// Motions that it measures and drives: x, y, z, turns about x, y, z. A catheter's base has
    /// two.
    std::array<bool, 6> free{true, true, true, false, false, false};
    double max_force = 0;     ///< [N]
    double max_torque = 0;    ///< [N m]
    double max_stiffness = 0; ///< [N/m]
    double max_damping = 0;   ///< [N s/m]
    double resolution = 0;    ///< of position [m]
    double mass = 0;          ///< apparent, at the handle [kg]
    double friction = 0;      ///< Coulomb, at the handle [N]
    double workspace = 0;     ///< radius or half the stroke [m]
    std::string_view source;  ///< of the numbers
};

/// The profiles that ship: touch, phantom-desktop, falcon, omega.3, catheter-2dof.
std::span<const DeviceSpec> device_profiles();
/// @throws InputError  if there is none of that name; states the names that there are
const DeviceSpec& device_profile(std::string_view name);

/// A device, real or not. read and write are called from the loop: they return at once, allocate
/// nothing and never throw. A slow transport has a thread of its own. A vendor's device is one more
/// file beside this one.
class Device {
public:
    virtual ~Device() = default;
    /// Description of the device: limits, rates, encoders.
    virtual DeviceSpec spec() const = 0;
    /// Connects to the device; false, with a message, if it is not available.
    virtual bool open() { return true; }
    /// The newest pose. Not valid: nothing came.
    /// @param time  of the tick, on the loop's clock [s]
    virtual DeviceSample read(double time) noexcept = 0;
    /// Force on the hand, world axes; held until the next one.
    /// @param time  of the tick [s]
    virtual void write(const Wrench& wrench, double time) noexcept = 0;
    /// Disconnects; safe to call twice.
    virtual void close() noexcept {}
};

} // namespace amontons
