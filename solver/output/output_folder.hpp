#pragma once

#include "solver/scene/scene.hpp"

#include <string>

namespace amontons {

/// Results must not stand beside what they are made from.
/// @throws InputError  if the folder, or one that a run writes in it, holds the scene's file or one
///                     that it names
void check_output_folder(const std::string& folder, const Scene& scene);

} // namespace amontons
