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

/// Groups take the lowest colour that none of their bodies has, in the order of the contacts.
Colours colours_of(const Columns& columns, int contacts);

} // namespace amontons
