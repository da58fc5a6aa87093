#pragma once

#include "validation/measure.hpp"

// Cases of solids at large strains.

namespace amontons::validation {

std::vector<Measured> cook_plane_stress();
std::vector<Measured> cook_finite_strain();
std::vector<Measured> sphere_inflation();
std::vector<Measured> stretched_block();
std::vector<Measured> passive_beam();
std::vector<Measured> elastica_solid();
std::vector<Measured> hyperelastic_extremes();

} // namespace amontons::validation
