#pragma once

#include "mesh/format/gmsh.hpp"
#include "mesh/format/volume_builder.hpp"

#include <string>

namespace amontons {

/// Solids from a file; the suffix specifies its format, in any case: .msh (Gmsh), .vtu (VTK), .inp
/// (Abaqus, CalculiX), .nodes (plain text, with a file .elements beside it).
///
/// Nothing is changed or checked beyond what the format needs: see check_volume.
/// @param scale  > 0, of the file's lengths [m per unit]
/// @throws InputError  unknown suffix, scale that is not > 0 and finite, or as the format's reader
VolumeFile read_volume(const std::string& path, double scale);

/// Writes solids as the suffix specifies: .msh, .inp, or .nodes with .elements beside it.
/// @param gmsh   version and encoding of a .msh file
/// @param notes  gets what was renamed; may be null
/// @throws InputError  unknown suffix
/// @throws WriteError  see write_file
void write_volume(const std::string& path, const VolumeMesh& mesh, const GmshOptions& gmsh = {},
                  std::vector<std::string>* notes = nullptr);

/// Checks that write_volume has a format for the suffix.
/// @throws InputError  if it does not
void check_volume_suffix(const std::string& path);

/// The file of elements beside a file of nodes: a.nodes, a.elements.
std::string elements_path(const std::string& nodes_path);

} // namespace amontons
