#pragma once

#include "contact/surface/overlap.hpp"

namespace amontons {

/// Whether a place of a body's surface lies in a part of the body that has none of its nodes.
using InOtherPart = std::function<bool(const Vec3&, const SurfacePlace&)>;

/// Places of a part a of a body's surface that are inside another part of the same body: its nodes,
/// middles of faces, of edges and of what of them is between two crossings. Their depth is that
/// below the nearest place of b whose normal is not theirs and which has none of the nodes of their
/// faces. What shares a node, and depths below 1e-3 of a face (closed slits), are left out.
/// @param b  of the same body
/// Cost: one call of `inside` for each place; O(log n) for each that is inside.
void self_overlap_spots(const PlacedSurface& a, const PlacedSurface& b, const InOtherPart& inside,
                        std::vector<OverlapSpot>& spots, const Shallow& shallow = {});

} // namespace amontons
