#pragma once

#include "solver/scene/fields.hpp"

// Fields of a segment of a beam and of the layers of its section.

namespace amontons {

/// Fields of a layer of a segment's section.
ObjectDeclaration declare_layer();
/// Fields of a segment; what is not given of its stiffness follows from the rest.
/// @param layer  of declare_layer()
ObjectDeclaration declare_segment(const ObjectDeclaration& layer);

} // namespace amontons
