#pragma once

#include "solver/beam/wire.hpp"
#include "solver/beam/wire_contact.hpp"

// A wire that is held in a plane: the motions out of it (along its normal, and rotations about
// section axes 1 and 2; axis 3 is the normal) are removed from every row and column. Removed, not
// held by a stiffness: else round-off of the forces out of the plane would enter the plane.

namespace amontons {

/// Removes the motions out of the plane from a system that is complete but for its contact rows;
/// their diagonal stays.
void hold_in_plane(const Wire& wire, BlockTridiagonal& tangent, std::vector<Node6>& gradient);

/// Removes them from a row on the nodes of an element.
void hold_in_plane(const Wire& wire, int element, ContactRow& row);

/// Removes them from a contact's rows, slips and friction force.
void hold_in_plane(const Wire& wire, Candidate& c);

} // namespace amontons
