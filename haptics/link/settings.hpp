#pragma once

#include "haptics/device/simulated_hand.hpp"
#include "haptics/link/handle_link.hpp"
#include "haptics/loop/haptic_loop.hpp"

namespace amontons {

/// What follows from a scene's "haptic" and the profile of the device.
struct HapticSettings {
    /// Device, by its profile.
    DeviceSpec device;
    /// Options of the fast loop.
    HapticOptions loop;
    /// Options of the simulation's side.
    LinkOptions link;
    HandOptions hand; ///< its path is HandleLink::path
};

/// The spring between device and handle that a scene does not name: the device's own largest
/// stiffness, but no more than half of what the virtual wall stays stable with at this rate when
/// the hand damps by 1 N s/m at least (K < 2 b / T; Colgate & Schenkel). A hand that is lighter
/// than this is held by passivity control [N/m].
double coupling_stiffness(const DeviceSpec& device, double rate);

/// @param late  ticks that may come late in a row, for which passivity control allows
HapticSettings make_settings(const HapticInput& input, const DeviceSpec& device, int late);

} // namespace amontons
