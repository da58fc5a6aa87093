#pragma once

#include "haptics/link/condensed.hpp"
#include "solver/step/wire_step.hpp"

namespace amontons {

/// Force of a wire on the hand that holds its base: at the sheath, or at the clamp of node 0.
Wrench force_on_hand(const Wire& wire);

/// State of a wire after its base has moved on, for the contacts of the start.
struct LookaheadSample {
    double share = 0;               ///< of that motion (share)
    std::vector<Candidate> contact; ///< slip since the start
    Wrench force;                   ///< on the hand
    WireState state;                ///< there: the wire continues from it if it has jumped
};
/// Samples the present state of a wire that has moved on from `start`: force on the hand, contacts
/// and their slip since then.
/// @param reach  contacts with gaps up to this are included [m]
LookaheadSample sample_ahead(WireBody& body, const StepStart& start, double reach);

/// Samples on one path of the hand, the nearest first.
struct LookaheadPath {
    Vec6 way = Vec6::Zero(); ///< of the device to its end
    std::vector<LookaheadSample> ahead;
};

/// Condenses the end of a wire's step on its contacts and those near: see docs/theory/haptics.md.
/// @param body  in balance; only its work arrays change
/// @param anchor  of the increment of a snap that the wire is in
/// @param ways  paths that the hand may follow, as far as known, the present direction first
Condensed condense_wire(WireBody& body, const ReductionOptions& options,
                        const ViscousPull& anchor = {},
                        const std::vector<LookaheadPath>& ways = {});

} // namespace amontons
