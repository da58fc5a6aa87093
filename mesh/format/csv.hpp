#pragma once

#include "mesh/polyline.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace amontons {

struct SizeSource;

/// A centreline from text with one point a line: x, y, z and, if there is a fourth column, the
/// radius. Separated by semicolons, commas or blanks (the first of these that is in the first
/// line); decimal points, not commas. Lines that are empty or begin with # or % are passed over.
/// A header may name the columns in any order, among others: x y z (or ParaView's Points:0 ...),
/// radius (or r, or VMTK's MaximumInscribedSphereRadius); a unit may follow in brackets.
/// @param file   for messages
/// @param scale  > 0, of the file's lengths [m per unit]
/// @throws InputError  naming the lines
Polyline parse_centreline_csv(std::string_view text, const std::string& file, double scale = 1);

/// Points with an element size each, from text as that of a centreline: columns x, y, z, size, or,
/// without a column of that name, the radius of a centreline.
/// @throws InputError  naming the lines; if there is no place, or no size
/// @param scale  > 0, of the file's lengths [m per unit]
std::vector<SizeSource> parse_size_field_csv(std::string_view text, const std::string& file,
                                             double scale = 1);

/// x,y,z[,radius] in m with a header; reads back exactly.
std::string centreline_csv(const Polyline& polyline);

} // namespace amontons
