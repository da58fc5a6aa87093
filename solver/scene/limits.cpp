#include "solver/scene/limits.hpp"

#include "mesh/base/error.hpp"

#include <cmath>

namespace amontons {

UnitLimits limits_of(std::string_view unit)
{
    struct Row {
        std::string_view unit;
        UnitLimits limits;
    };
    // Rows follow from metres, seconds and pascals as far as products allow.
    static constexpr Row kRows[] = {
        {"", {1e-12, 1e12}},        {"m", {1e-9, 1e9}},         {"m^3", {1e-27, 1e27}},
        {"1/m", {1e-9, 1e9}},       {"rad", {1e-9, 1e9}},       {"degree", {1e-9, 1e9}},
        {"rad/m", {1e-9, 1e9}},     {"s", {1e-12, 1e12}},       {"1/s", {1e-12, 1e12}},
        {"Hz", {1e-12, 1e12}},      {"m/s", {1e-12, 1e12}},     {"rad/s", {1e-12, 1e12}},
        {"m/s^2", {1e-12, 1e12}},   {"Pa", {1e-12, 1e18}},      {"N/m^2", {1e-12, 1e18}},
        {"N/m^3", {1e-12, 1e24}},   {"N/m", {1e-18, 1e24}},     {"N", {1e-24, 1e24}},       {"N m", {1e-30, 1e30}},
        {"N m^2", {1e-24, 1e24}},   {"N m/rad", {1e-30, 1e30}}, {"N s/m", {1e-24, 1e24}},
        {"N s/m^2", {1e-24, 1e24}}, {"kg", {1e-24, 1e24}},      {"kg/m^3", {1e-24, 1e24}},
        {"kg m^2", {1e-36, 1e36}}};
    for (const Row& row : kRows)
        if (row.unit == unit) return row.limits;
    AMONTONS_ASSERT(false && "a field of a unit without limits");
    return {};
}

Allowed within_limits(Allowed allowed, std::string_view unit)
{
    const UnitLimits most = limits_of(unit);
    if (!std::isfinite(allowed.upper)) allowed.upper = most.most;
    if (!std::isfinite(allowed.lower)) allowed.lower = -most.most;
    if (allowed.lower == 0) {
        if (allowed.above) {
            allowed.lower = most.least;
            allowed.above = false;
        } else {
            allowed.least = most.least;
        }
    }
    return allowed;
}

} // namespace amontons
