#pragma once

#include <string>

namespace amontons {

class Session;

/// True if a name is that of a file of triangles, not of a mesh of solids.
bool is_surface_file(const std::string& file);

/// amontons mesh info of triangles: counts, size, side, and each opening with its centre, radius
/// and direction, where an introducer may be put.
/// @param scale  metres per unit of the file
/// @throws InputError  if the file cannot be read
void surface_info(const std::string& file, double scale, Session& session);

} // namespace amontons
