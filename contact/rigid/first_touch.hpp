#pragma once

#include "contact/rigid/shape.hpp"

namespace amontons {

/// When two bodies that move from one pose to another first touch: a part of the motion in [0, 1],
/// 1 if they do not. Motions are those of pose_between, both at the same part.
///
/// Never late: at the time returned the bodies are still apart, by less than 1e-6 of the smaller
/// one (more only after 1000 steps without arriving, with edges that slide along each other).
/// 0 if they touch, or overlap, at the start: detect() then returns their contacts.
/// Source: conservative advancement, Mirtich 1996 (thesis, Berkeley); distances of convex bodies
/// by Gilbert, Johnson & Keerthi 1988, IEEE J. Robotics Autom. 4, 193-203.
double first_touch(const RigidShape& a, const Pose& a0, const Pose& a1, const RigidShape& b,
                   const Pose& b0, const Pose& b1);

} // namespace amontons
