#pragma once

#include "solver/beam/wire.hpp"
#include "solver/beam/wire_contact.hpp"

// A wire whose tip is held: its unknowns there are taken from every row and column, and what is
// left of them in the gradient is what the hold carries.

namespace amontons {

/// Force and moment of a hold on the wire, in space [N], [N m].
struct TipLoad {
    /// On the wire, in space [N, N m].
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
};

/// Holds the tip where it is, and its section as it is.
/// @param wire  out of its sheath
void hold_tip_here(Wire& wire, bool turns);

/// Puts the tip where the hold has it, and spreads the way there over the length that is out.
/// @param moved  of the hold since it took the tip [m]
void move_held_tip(Wire& wire, const Vec3& moved);

/// Takes the tip from a system that is complete but for its contact rows.
TipLoad hold_tip(const Wire& wire, BlockTridiagonal& tangent, std::vector<Node6>& gradient);

/// Takes it from a row on the nodes of an element.
void hold_tip(const Wire& wire, int element, ContactRow& row);

/// Whether a place cannot move: a contact there has no effect.
bool is_held(const Wire& wire, int element, double xi);

} // namespace amontons
