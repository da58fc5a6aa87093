#pragma once

#include "mesh/surface_mesh.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// A surface from the bytes of a PLY file, ASCII or binary of either byte order: `x`, `y`, `z`
/// of element `vertex` and the list `vertex_indices` (or `vertex_index`) of element `face`,
/// polygons of any size. All other elements and properties are passed over.
/// @param file   for messages
/// @param scale  > 0, of the file's lengths [m per unit]
/// @throws InputError  header that is not understood, sizes that the file cannot hold,
///                     coordinates that are not finite, indices of no vertex, bytes left over,
///                     no face. Vertices and faces count from 0, lines from 1.
SurfaceMesh parse_ply(std::string_view bytes, const std::string& file, double scale = 1);

/// How numbers are stored in a PLY file.
enum class PlyEncoding { ascii, little_endian, big_endian };

/// PLY in doubles; reads back exactly.
std::string ply_bytes(const SurfaceMesh& mesh, PlyEncoding encoding = PlyEncoding::little_endian);

} // namespace amontons
