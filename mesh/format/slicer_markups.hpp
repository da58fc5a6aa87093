#pragma once

#include "mesh/polyline.hpp"

#include <string>
#include <string_view>

namespace amontons {

/// A centreline from 3D Slicer's markups (`.mrk.json`): the control points of its one curve and,
/// if it has one, the measurement "Radius" of each. The curve that Slicer draws between the
/// points is not read.
///
/// Coordinates come out in LPS (x to the patient's left, y to the back, z to the head), which is
/// what Slicer uses in surface files (STL, OBJ, PLY, VTP) as well, so that both fit together.
/// Markups in RAS have the sign of x and y changed. Lengths are in mm in the file.
/// @param file   for messages
/// @param scale  > 0, of the file's lengths [m per unit]; 1e-3 gives m
/// @throws InputError  with line and column of broken JSON, or JSON paths
Polyline parse_slicer_markups(std::string_view text, const std::string& file, double scale = 1e-3);

} // namespace amontons
