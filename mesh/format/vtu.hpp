#pragma once

#include "mesh/format/volume_builder.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// Solids from VTK's unstructured grid (.vtu): ASCII, binary and appended data, raw or base64, of
/// either byte order, compressed by zlib or not; several pieces become one mesh.
///
/// Sets: cell arrays of whole numbers "element_set:NAME", "face_set:NAME" and point arrays
/// "node_set:NAME" hold 1 for the members (so this program writes them); faces are cells of two
/// dimensions in the same file. Else the first cell array of a known name (gmsh:physical,
/// medit:ref, ElementBlockIds, MaterialIDs, CellEntityIds) makes a set of each value but 0. Nodes
/// and elements are counted from 0, as in ParaView.
/// @param file   as the user wrote it
/// @param scale  of coordinates [m per unit]
/// @throws InputError  if the file is damaged or cut off, has solid cells of other kinds than
///                     tetrahedron (10, 24), hexahedron (12) and voxel (11), or none
/// Source: VTK's "XML File Formats"; tested with files that VTK wrote.
VolumeFile parse_vtu(std::string_view bytes, const std::string& file, double scale = 1);

/// In front of a set's name in the name of its array.
constexpr const char* kVtuElementSet = "element_set:";
constexpr const char* kVtuFaceSet = "face_set:";
constexpr const char* kVtuNodeSet = "node_set:";

/// VTK's number of a kind of elements, and of its faces.
std::uint8_t vtk_type(ElementKind kind);
/// VTK's type number of the faces of an element.
std::uint8_t vtk_face_type(ElementKind kind);

} // namespace amontons
