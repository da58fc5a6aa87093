#pragma once

#include "solver/beam/element.hpp"

namespace amontons {

/// Energy of an element without bending or torsional stiffness: only its length counts [J].
double cable_energy(const BeamNode& a, const BeamNode& b, const ElementLaw& law);

/// As add_elements, for a cable: its rotations have no stiffness and are held by unit rows.
/// Contact must be searched for at the nodes of a wire of radius 0, where rotations do not count.
void add_cable(int first, int last, const std::vector<BeamNode>& nodes,
               const std::vector<ElementLaw>& laws, BlockTridiagonal& tangent,
               std::vector<Node6>& gradient);

} // namespace amontons
