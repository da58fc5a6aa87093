#pragma once

#include "mesh/volume_mesh.hpp"

#include <string>

namespace amontons {

/// A mesh of solids as a .vtu file that parse_vtu (mesh/format/vtu.hpp) reads back with its sets:
/// each set is an array of 0 and 1, the faces of face sets are cells behind the elements.
std::string volume_vtu_bytes(const VolumeMesh& mesh);

} // namespace amontons
