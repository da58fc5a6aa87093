#pragma once

#include "mesh/format/volume_builder.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// Solids from an Abaqus or CalculiX input file (.inp).
///
/// *NODE, *ELEMENT (C3D4, C3D10, C3D8 and their variants such as C3D8R, C3D8I, C3D10M), *NSET and
/// *ELSET (lists, names of other sets, GENERATE), *SURFACE (element faces S1 to S6, or nodes).
/// Elements of surfaces (CPS3, S4, ...) are faces of solids: their ELSETs become face sets. Other
/// keywords are passed over and named in the notes; what would change the mesh (*INCLUDE, *NGEN,
/// a second part, ...) is refused. Names of sets are the same in upper and lower case; the first
/// spelling stays.
/// @param file   as the user wrote it
/// @param scale  of coordinates [m per unit]
/// @throws InputError  if the file is damaged, has solid elements of other kinds, or none. The
///                     format has no end mark: a file cut off between two lines cannot be
///                     distinguished from a shorter one.
/// Source of the faces' numbers: CalculiX's manual, "Facial distributed loading".
VolumeFile parse_abaqus(std::string_view text, const std::string& file, double scale = 1);

/// A mesh as an input file, nodes and elements numbered from 1. What no name may contain becomes _;
/// names that would then be alike get a number.
/// @param notes  gets one sentence for each set that had to be renamed; may be null
std::string abaqus_text(const VolumeMesh& mesh, std::vector<std::string>* notes = nullptr);

} // namespace amontons
