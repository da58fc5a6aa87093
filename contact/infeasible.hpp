#pragma once

#include "contact/certificate.hpp"

#include <optional>

namespace amontons {

/// Searches for the proof that no reaction can prevent penetration.
///
/// The candidate is the growth of a solver's normal reactions; it is refined by inverse iteration
/// on the null space of its own rows, then tested by the definition of InfeasibilityProof alone.
/// Never wrong about an infeasible problem beyond round-off; may miss one.
/// @param growth  difference of two iterates, rows [N]
/// Cost: one factorisation of the rows that grow, O(m^3), and two products with W.
std::optional<InfeasibilityProof> prove_infeasible(const ContactProblem& problem,
                                                   const Eigen::VectorXd& growth);

/// The frictionless problem of the same contacts, softened by `compliance` over the mean of W's
/// normal diagonal: always solvable. Where q closes the gaps along a direction d >= 0 with W d = 0,
/// its reactions are those of a bounded problem plus d times closing / compliance:
/// the difference of two such solutions is the growth that prove_infeasible() requires.
/// @param normal_rows  receives the row of each of its contacts in the original
ContactProblem softened_normals(const ContactProblem& problem, double compliance,
                                std::vector<Eigen::Index>& normal_rows);

} // namespace amontons
