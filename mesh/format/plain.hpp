#pragma once

#include "mesh/format/volume_builder.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// Solids from two text files: nodes, and what connects them.
///
///     # NAME.nodes                 # NAME.elements
///     0.0  0.0  0.0                index_from 1            (needed only if it cannot be seen)
///     0.01 0.0  0.0                t10_order gmsh          (default: vtk)
///     ...                          1 2 3 4                 (4, 8 or 10 nodes: T4, H8, T10)
///                                  node_set fixed
///                                  1 2 3
///                                  element_set soft
///                                  1
///                                  face_set top            (pairs: element, local face from 0)
///                                  1 3
///
/// One node or element a line; numbers are separated by blanks or commas; # begins a comment.
/// Nodes and elements are counted from 0 if node 0 is used, from 1 if the last node is used as the
/// number of nodes; a file where neither is so must specify index_from. Faces: see volume_mesh.hpp.
/// @param nodes_file, elements_file  as the user would write them
/// @param scale  of coordinates [m per unit]
/// @throws InputError  with the lines that cannot be understood
VolumeFile parse_plain(std::string_view nodes, std::string_view elements,
                       const std::string& nodes_file, const std::string& elements_file,
                       double scale = 1);

/// The two texts of a mesh.
struct PlainText {
    /// Text of the two files.
    std::string nodes, elements;
};
/// A mesh as plain text: docs/mesh_formats.md.
PlainText plain_text(const VolumeMesh& mesh);

} // namespace amontons
