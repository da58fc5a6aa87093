#pragma once

#include "solver/scene/scene.hpp"
#include "solver/solid/hyperelastic.hpp"

#include <string>
#include <vector>

namespace amontons {

/// The law of a scene's solid; neo-Hooke with E and nu where it names none.
/// @throws InputError  if there is none of that name
Hyperelastic hyperelastic_of(const SolidInput& input, const std::string& file);

/// Its elements, in the mesh's order, with their fibres.
/// @throws InputError  of a file of fibres
std::vector<HyperelasticElement> hyperelastic_elements(const SolidInput& input,
                                                       const Hyperelastic& law,
                                                       const VolumeMesh& mesh,
                                                       const std::string& file);

} // namespace amontons
