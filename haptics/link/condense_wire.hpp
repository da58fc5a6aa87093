#pragma once

#include "haptics/link/condensed.hpp"
#include "solver/step/wire_step.hpp"

namespace amontons {

/// Force of a wire on the hand that holds its base: at the sheath, or at the clamp of node 0.
Wrench force_on_hand(const Wire& wire);

/// Where a wire's contacts went on the way of its base, for those of its start.
struct WireAhead {
    double share = 0;               ///< of that way
    std::vector<Candidate> contact; ///< slip since the start
    Wrench force;                   ///< on the hand
};
WireAhead look_ahead(WireBody& body, const StepStart& start, double reach);

/// What q(d) and rest are beyond first order on the way.
/// @param ahead  looks, the nearest first
/// @return  those before the first that is a jump away
std::size_t add_bends(Condensed& condensed, const std::vector<WireAhead>& ahead, const Vec6& way);

/// Condenses the end of a wire's step on its contacts and those near: see docs/theory/haptics.md.
/// @param body  in balance; only its work arrays change
/// @param anchor  of the increment of a snap that the wire is in
/// @param ahead  where it is going, as far as that is known
Condensed condense_wire(WireBody& body, const CondenseOptions& options, const Anchor& anchor = {},
                        const std::vector<WireAhead>& ahead = {});

} // namespace amontons
