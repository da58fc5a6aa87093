#pragma once

#include "solver/beam/wire.hpp"

namespace amontons {

/// Starts a wire whose first node is clamped (no sheath) at a place and with a direction, in its
/// natural shape, free of stress.
/// @param at     place of the first node [m]
/// @param frame  columns: tangent and the section's axes 2 and 3 at the clamp
void start_clamped(Wire& wire, const Vec3& at, const Mat3& frame);

/// Places nodes 1, 2, ... behind node 0 so that every element is free of stress.
void grow_naturally(std::vector<BeamNode>& nodes, const std::vector<ElementLaw>& laws);

} // namespace amontons
