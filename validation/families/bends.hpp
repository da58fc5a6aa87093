#pragma once

#include <numbers>
#include <numeric>
#include <vector>

namespace amontons::validation {

/// Tubes through which wires and rods are drawn: bends to one side and the other [rad].
struct Bends {
    const char* name;
    std::vector<double> angles;

    double all() const { return std::accumulate(angles.begin(), angles.end(), 0.0); }
};

inline std::vector<Bends> bent_tubes()
{
    constexpr double kPi = std::numbers::pi;
    return {{"90 degrees", {kPi / 2}}, {"180 degrees", {kPi}}, {"360 degrees", {kPi, kPi}}};
}

} // namespace amontons::validation
