#pragma once

#include "contact/problem.hpp"

#include <optional>
#include <vector>

namespace amontons {

/// A part of a problem that can be solved alone.
struct ProblemPart {
    ContactProblem problem;
    std::vector<int> contacts;      ///< of the whole problem, ascending
    std::vector<Eigen::Index> rows; ///< of the whole problem, one for each of the part
};

/// Takes a problem apart: groups of contacts that W does not couple, without those that r = 0
/// satisfies; contacts with mu = 0 become one row, for friction takes no part in them.
///
/// Each part's solution, put in its rows, and zero elsewhere, solves the whole.
/// @returns nothing if there is nothing to gain: one group, and friction everywhere; the caller
///          then solves the problem as it is. An empty list if r = 0 is the solution
/// Cost: O(rows) where one contact couples with all others, O(numbers stored) at worst.
std::optional<std::vector<ProblemPart>> take_apart(const ContactProblem& problem);

/// W of some rows, by the bodies that have any of them. @param rows  ascending
DelassusOfBodies of_rows(const DelassusOfBodies& whole, const std::vector<Eigen::Index>& rows);

} // namespace amontons
