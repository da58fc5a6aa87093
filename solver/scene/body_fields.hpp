#pragma once

#include "solver/scene/fields.hpp"

namespace amontons {

/// The kinds of bodies that are neither obstacles nor beams: "solid" and "rigid".
/// @param centreline  outlives the result
std::vector<VariantDeclaration> body_variants(const ObjectDeclaration& centreline);

/// A box and a ball, of sets and branches.
const ObjectDeclaration& declare_box();
const ObjectDeclaration& declare_ball();

ObjectDeclaration declare_contact();
ObjectDeclaration declare_coupling();

} // namespace amontons
