#pragma once

#include "haptics/pose.hpp"

namespace amontons {

/// Device sample of a tick. `valid` is false if there is no data: unplugged,
/// silent.
struct DeviceSample {
    double time = 0; ///< when it was measured, on the loop's clock [s]
    HandPose pose;
    unsigned buttons = 0; ///< one bit each
    bool valid = false;
};

} // namespace amontons
