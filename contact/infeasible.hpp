#pragma once

#include "contact/certificate.hpp"

#include <optional>

namespace amontons {

/// Looks for the proof that no reaction can prevent penetration.
///
/// The suspect is how a solver's normal reactions run away; it is cleaned by inverse iteration
/// on the null space of its own rows, then judged by the definition of InfeasibilityProof alone.
/// Never wrong about an infeasible problem beyond round-off; may miss one.
/// @param growth  difference of two iterates, rows [N]
/// Cost: one factorisation of the rows that grow, O(m^3), and two products with W.
std::optional<InfeasibilityProof> prove_infeasible(const ContactProblem& problem,
                                                   const Eigen::VectorXd& growth);

} // namespace amontons
