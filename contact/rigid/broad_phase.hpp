#pragma once

#include "contact/rigid/shape.hpp"

#include <span>
#include <vector>

namespace amontons {

/// The pose at the part t in [0, 1] of a motion: its place moves along a straight line, and it
/// rotates at a constant rate about one axis (by less than 180 degrees in all).
Pose pose_between(const Pose& from, const Pose& to, double t);

/// A box that contains the shape throughout the motion pose_between(from, to), and a margin [m]
/// around it.
AxisBox swept_box(const RigidShape& shape, const Pose& from, const Pose& to, double margin);

/// Two boxes that overlap or touch, by number, the smaller first.
struct BoxPair {
    /// Numbers of the two boxes, a < b.
    std::int32_t a = 0, b = 0;
    auto operator<=>(const BoxPair&) const = default;
};

/// All pairs of boxes that overlap, in ascending order. Boxes may be infinite.
/// Cost: n log n, and a comparison for each pair that overlaps along the axis on which the boxes
/// are spread most.
void overlapping_pairs(std::span<const AxisBox> boxes, std::vector<BoxPair>& pairs);

} // namespace amontons
