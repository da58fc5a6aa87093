#pragma once

#include "mesh/surface_mesh.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// A surface from the bytes of an STL file, binary or ASCII (distinguished by size, not by the
/// word "solid", with which binary files begin as well). Corners at exactly the same place
/// become one vertex. Normals and attributes are not read: the corners' order determines the side.
/// @param file   for messages
/// @param scale  > 0, of the file's lengths [m per unit]
/// @throws InputError  cut or padded file, unexpected word, coordinates that are not finite,
///                     no triangle. Triangles count from 0, lines from 1.
SurfaceMesh parse_stl(std::string_view bytes, const std::string& file, double scale = 1);

/// Binary STL: 50 bytes a triangle, coordinates rounded to float.
std::string stl_bytes(const SurfaceMesh& mesh);

/// ASCII STL: coordinates read back exactly.
std::string stl_text(const SurfaceMesh& mesh);

} // namespace amontons
