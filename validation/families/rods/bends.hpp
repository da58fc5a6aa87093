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
    constexpr double half_turn = std::numbers::pi;
    return {{"90 degrees", {half_turn / 2}},
            {"180 degrees", {half_turn}},
            {"360 degrees", {half_turn, half_turn}}};
}

} // namespace amontons::validation
