#pragma once

#include "validation/measure.hpp"

namespace amontons::validation {

std::vector<Measured> generated_problems();

} // namespace amontons::validation
