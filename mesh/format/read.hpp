#pragma once

#include "mesh/polyline.hpp"
#include "mesh/surface_mesh.hpp"

#include <functional>
#include <string>
#include <vector>

namespace amontons {

struct SizeSource;

/// Reads a .vtp file, unscaled. Passed in by the caller: VTK is a module on which this room does
/// not depend. May throw InputError.
using VtpReader = std::function<SurfaceMesh(const std::string& path)>;

/// A surface from a file; the suffix (.stl .obj .ply .vtp, in any case) determines its format.
///
/// Vertices at exactly the same place are merged. Nothing else is changed or checked: see
/// check_surface.
/// @param scale  > 0, of the file's lengths [m per unit]
/// @param vtp    needed for .vtp only
/// @param merged if not null: how many vertices were merged; 0 for STL, which has no vertices but
///               corners
/// @throws InputError  unknown suffix, scale that is not > 0 and finite, file that cannot be
///                     read or understood, surface without triangles
SurfaceMesh read_surface(const std::string& path, double scale, const VtpReader& vtp = {},
                         std::int64_t* merged = nullptr);

/// A centreline from a file: .mrk.json (3D Slicer's markups, LPS), or text with one point a line
/// (.csv .txt .dat).
/// @param scale  > 0, of the file's lengths [m per unit], and of its radii
/// @throws InputError  as read_surface
Polyline read_centreline(const std::string& path, double scale);

/// Places with a size each, as read_centreline; a .mrk.json is a centreline with its radius.
/// @throws InputError  as read_surface; no place, or a place without a size
/// @param scale  > 0, of the file's lengths [m per unit]
std::vector<SizeSource> read_size_field(const std::string& path, double scale);

/// The unit that a format prescribes: 1e-3 for .mrk.json, which is in mm, else 1 [m per unit].
/// For scenes that give no scale.
double default_scale(const std::string& path);

/// Writes a surface as its suffix specifies: .stl (binary, rounded to float), .obj or .ply.
/// @throws InputError  unknown suffix
/// @throws WriteError  see write_file
void write_surface(const std::string& path, const SurfaceMesh& mesh);

} // namespace amontons
