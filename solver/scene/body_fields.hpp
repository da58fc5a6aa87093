#pragma once

#include "solver/scene/fields.hpp"

namespace amontons {

/// The kinds of bodies that are neither obstacles nor beams: "solid" and "rigid".
/// @param centreline  outlives the result
std::vector<VariantDeclaration> body_variants(const ObjectDeclaration& centreline);

/// A box and a ball, of sets and branches.
const ObjectDeclaration& declare_box();
/// Fields of a ball of places.
const ObjectDeclaration& declare_ball();

/// Fields of a contact law.
ObjectDeclaration declare_contact();
/// Fields of a coupling.
ObjectDeclaration declare_coupling();

} // namespace amontons
