#pragma once

#include "solver/step/wire_step.hpp"

#include <atomic>

namespace amontons {

/// Finds the first equilibrium of wires at the given bases: placed straight out of their sheaths,
/// and brought to contact from there. Where that path leads through a wall they are inserted
/// instead, one after the other, the one that is out furthest first, with the friction of that
/// insertion.
/// @param stop  set from outside, it ends the search
/// @return  a report whose energy is that of the last step of the path
StepReport start_wires(WireGroup& group, const std::vector<BaseTarget>& to,
                       const std::atomic<bool>& stop);

} // namespace amontons
