#pragma once

#include "mesh/surface_mesh.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// A surface from the text of a Wavefront OBJ file: `v` and `f` lines, polygons of any size,
/// indices as `1`, `1/2`, `1/2/3`, `1//3` or counted back from the last vertex (`-1`). All
/// other lines (normals, texture, groups, materials) are passed over.
/// @param file   for messages
/// @param scale  > 0, of the file's lengths [m per unit]
/// @throws InputError  naming the lines: words that are no numbers, coordinates that are not
///                     finite, indices of no vertex, no face
SurfaceMesh parse_obj(std::string_view text, const std::string& file, double scale = 1);

/// OBJ with `v` and `f` lines; reads back exactly.
std::string obj_text(const SurfaceMesh& mesh);

} // namespace amontons
