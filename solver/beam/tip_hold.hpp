#pragma once

#include "solver/beam/wire.hpp"
#include "solver/beam/wire_contact.hpp"

// A wire whose tip is held: its unknowns there are removed from every row and column, and the
// gradient that remains in them is the force and moment of the hold.

namespace amontons {

/// Force and moment of a hold on the wire, in space [N], [N m].
struct TipLoad {
    /// On the wire, in space [N, N m].
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
};

/// Holds the tip where it is, and its section as it is.
/// @param wire  out of its sheath
void hold_tip_here(Wire& wire, bool turns);

/// Moves the tip to its prescribed place, and distributes the motion over the length that is out.
/// @param moved  displacement of the tip since the hold began [m]
void move_held_tip(Wire& wire, const Vec3& moved);

/// Removes the tip's unknowns from a system that is complete but for its contact rows.
TipLoad hold_tip(const Wire& wire, BlockTridiagonal& tangent, std::vector<Node6>& gradient);

/// Removes them from a row on the nodes of an element.
void hold_tip(const Wire& wire, int element, ContactRow& row);

/// Whether a place is held, so that a contact there has no effect.
/// @param xi  in the element, 0 to 1 (share)
bool is_held(const Wire& wire, int element, double xi);

} // namespace amontons
