#pragma once

#include "solver/step/wire_newton.hpp"

#include <functional>

// Hyperelastic walls around a wire: the nonlinear part of their response, found between solves of
// wire and contact with their tangents. Theory: docs/theory/soft_vessels.md.

namespace amontons {

/// Sets walls of hyperelastic material to their equilibrium without contacts.
void rest_walls(Wire& wire, const std::vector<WireWall>& walls);

/// Solves wire and contacts with the walls' tangents, and finds the offsets with which walls are in
/// the balance of their material under the same contact forces. The residual is that of both.
/// Without hyperelastic walls it is one solve.
/// @param solve  wire and contacts, with offsets as they are in the wire's state
NewtonReport balance_walls(Wire& wire, const std::vector<WireWall>& walls,
                           const NewtonOptions& options,
                           const std::function<NewtonReport(const NewtonOptions&)>& solve);

} // namespace amontons
