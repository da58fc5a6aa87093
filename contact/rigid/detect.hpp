#pragma once

#include "contact/rigid/shape.hpp"
#include "mesh/wall.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace amontons {

/// A place where two rigid bodies touch or nearly do.
struct RigidContact {
    Vec3 point_a = Vec3::Zero(), point_b = Vec3::Zero(); ///< on each surface [m]
    Vec3 normal = Vec3::UnitZ();                         ///< unit, from b into a
    double gap = 0;       ///< (point_a - point_b) . normal [m], < 0: overlap
    std::uint64_t id = 0; ///< which features of a and b; the same over steps while they touch
};

/// Appends the contacts of a with b whose gap is at most `reach`.
///
/// Exact for all pairs of shapes. Faces that touch give the corners of their overlap
/// (corners of one on the other and crossings of the outlines), an edge on a face its two ends,
/// parallel edges the ends of their overlap. Of faces that are inclined towards each other by up to
/// 30 degrees, all corners within reach are given, not only the nearest. Two contacts never have
/// the same points (within 1e-9 of the smaller body) and the same normal.
///
/// Overlap: convex bodies (with up to 20 000 pairs of edges) are pushed along the direction of
/// least penetration, however deep. Of others, each corner is pushed to the nearest face that it
/// may cross, which is right while the overlap is shallower than the bodies are thick.
///
/// Swapping a and b turns every normal round and swaps the points; nothing depends on where in
/// space the pair is.
/// @param reach  [m], >= 0; within it, a face may be opposed by all of another body's corners
void detect(const RigidShape& a, const Pose& pose_a, const RigidShape& b, const Pose& pose_b,
            double reach, std::vector<RigidContact>& out);

/// The signed distance to an obstacle's wall near a place: Wall::sample, or anything as smooth.
using SampleWall = std::function<WallSample(const Vec3&)>;

/// The same with an obstacle given by the distance from its wall: point_b is on the wall, normals
/// are the wall's. A ball and every corner exactly (where the distance is); edges, faces and the
/// sides of cylinders where the wall bulges into them; nothing for a Plane.
/// Cost: one sample for each corner, edge and face near the wall, some more where it bulges.
/// @param reach  [m], >= 0
void detect_wall(const RigidShape& a, const Pose& pose_a, const SampleWall& wall, double reach,
                 std::vector<RigidContact>& out);

} // namespace amontons
