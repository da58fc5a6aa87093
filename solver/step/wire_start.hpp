#pragma once

#include "solver/step/wire_step.hpp"

#include <atomic>

namespace amontons {

/// Brings wires from nothing to their first balance, at the bases given: straight out of their
/// sheaths and from there to contact. Where that way leads through a wall they are pushed in
/// instead, one after the other, the one that is out furthest first, as one would have done
/// before: friction holds them as it does then.
/// @param stop  set from elsewhere: no more is tried
/// @return  a report whose energy is that of the last step of the way
StepReport start_wires(WireGroup& group, const std::vector<BaseTarget>& to,
                       const std::atomic<bool>& stop);

} // namespace amontons
