#pragma once

#include "contact/problem.hpp"

#include <cstdint>

namespace amontons {

/// The reaction of an earlier problem, given to the contacts of a later one by their identity.
///
/// A contact that is new, or has another kind than before, starts at 0. Contacts that share an
/// identity are matched in their order. The frames (n, t1, t2) are assumed unchanged: where they
/// rotate much from step to step, rotate r first.
/// Cost: O(n log n).
/// @param earlier_identity, identity  per contact, in any order
/// @param r  reaction of the earlier problem, rows [N or N s]
/// @returns  a warm start for solve(problem, ...), rows
/// @throws InputError  if a size does not fit its problem
Eigen::VectorXd matched_warm_start(const ContactProblem& earlier,
                                   const std::vector<std::int32_t>& earlier_identity,
                                   const Eigen::VectorXd& r, const ContactProblem& problem,
                                   const std::vector<std::int32_t>& identity);

} // namespace amontons
