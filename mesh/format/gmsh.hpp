#pragma once

#include "mesh/format/volume_builder.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// Solids from a Gmsh file (.msh), versions 2 to 2.2 and 4.1, ASCII or binary of either byte
/// order.
///
/// Physical groups become sets: volumes element sets, surfaces face sets, curves and points node
/// sets; one without a name is called by its number. Elements of all entities are read, in a group
/// or not. Sections that are no mesh are passed over with a note.
/// @param file   as the user wrote it
/// @param scale  of coordinates [m per unit]
/// @throws InputError  if the file is damaged or cut off, of another version, has solid elements
///                     other than T4, T10, H8, or none
/// Source: Gmsh's reference manual, section "MSH file format".
VolumeFile parse_gmsh(std::string_view bytes, const std::string& file, double scale = 1);

/// How to write a .msh file.
struct GmshOptions {
    bool version_2 = false; ///< 2.2 instead of 4.1
    bool binary = false;    ///< of this machine's byte order
};

/// A mesh as a Gmsh file. Sets become physical groups with their names (quotes and line ends in a
/// name become _). In version 2.2 a cell of several groups is written for each of them.
std::string gmsh_bytes(const VolumeMesh& mesh, const GmshOptions& options = {});

} // namespace amontons
