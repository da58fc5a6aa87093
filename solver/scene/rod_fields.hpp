#pragma once

#include "solver/scene/fields.hpp"
#include "solver/scene/findings.hpp"

namespace amontons {

/// The kind "rod" of bodies.
/// @param segment, centreline  outlive the result
VariantDeclaration rod_variant(const ObjectDeclaration& segment,
                               const ObjectDeclaration& centreline);

/// What is wrong between the fields of rods.
void check_rods(const Scene& scene, Findings& findings);

/// Which parts of a rod its pairs name, and whose friction there is.
void check_rod_contacts(const RodInput& rod, const Scene& scene, Findings& findings);

} // namespace amontons
