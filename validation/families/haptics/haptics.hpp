#pragma once

#include "validation/measure.hpp"

// The loop of the hand, without a clock and without a device.

namespace amontons::validation {

std::vector<Measured> virtual_wall();
std::vector<Measured> god_object();
std::vector<Measured> reduced_operator();

} // namespace amontons::validation
