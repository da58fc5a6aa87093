#pragma once

#include "solver/scene/scene.hpp"

namespace amontons::validation {

constexpr double kG = 9.81, kPi = 3.14159265358979323846;

inline ShapeInput box(const Vec3& size)
{
    ShapeInput s;
    s.generate = "box";
    s.size = size;
    return s;
}

inline ShapeInput ball(double radius)
{
    ShapeInput s;
    s.generate = "ball";
    s.radius = radius;
    return s;
}

} // namespace amontons::validation
