#pragma once

#include "contact/solvers/columns.hpp"

#include <vector>

namespace amontons {

/// The contacts of a W of bodies, in an order in which some can be visited side by side.
struct Colours {
    std::vector<int> contact; ///< in the order of visits
    std::vector<int> group;   ///< groups of the same bodies: where each begins, and the end
    std::vector<int> colour;  ///< of groups without a common body: where each begins, and the end
};

/// Greedy colouring, in the order of the contacts: a group receives the lowest colour that none of
/// its bodies has.
Colours colours_of(const Columns& columns, int contacts);

} // namespace amontons
