#pragma once

#include "haptics/pose.hpp"

namespace amontons {

/// What a device states in a tick. `valid` is false when it has nothing to report: unplugged,
/// silent.
struct DeviceSample {
    double time = 0; ///< when it was measured, on the loop's clock [s]
    HandPose pose;
    unsigned buttons = 0; ///< one bit each
    bool valid = false;
};

} // namespace amontons
