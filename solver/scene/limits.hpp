#pragma once

#include "solver/scene/fields.hpp"

#include <string_view>

namespace amontons {

/// Magnitudes that values of a unit may have in any field: many decades beyond physical values in
/// any system of units, and so far from the limits of doubles that squares, products and quotients
/// of a few of them neither overflow nor underflow.
struct UnitLimits {
    double least; ///< of a value that must not be 0
    double most;
};
/// Range of sensible values of a unit.
UnitLimits limits_of(std::string_view unit);

/// What a field of this unit allows, within the unit's limits. Bounds of its own stay.
Allowed within_limits(Allowed allowed, std::string_view unit);

} // namespace amontons
