#pragma once

#include "mesh/base/error.hpp"
#include "mesh/extract_surface.hpp"
#include "solver/scene/scene.hpp"

namespace amontons {

/// Names of the quantities of a probe; of a line, also the possible columns of its reference.
inline constexpr const char* kProbeFields[] = {
    "displacement_x", "displacement_y", "displacement_z",  "stress_xx",
    "stress_yy",      "stress_zz",      "stress_xy",       "stress_yz",
    "stress_zx",      "von_mises",      "contact_pressure"};

/// Finds the places and sets of a solid's probes: the element around a place, or the nodes and
/// faces of a set. Of the mesh as it was read, with the input's own sets. Reads the references of
/// lines.
/// @throws InputError  places outside of the mesh, sets that it has not
void place_probes(SolidInput& input, const VolumeMesh& mesh, const std::string& file);

} // namespace amontons
