#pragma once

#include "mesh/cgal/cgal_module.hpp"

namespace amontons {

/// Fills the places where input.outside is < 0.
/// @throws  what CGAL or the callbacks throw; what `mesh` holds by then is to be freed
void fill_implicit(const AmontonsCgalInput& input, AmontonsCgalMesh& mesh);

} // namespace amontons
