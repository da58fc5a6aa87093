#pragma once

#include "mesh/extract_surface.hpp"

namespace amontons {

/// Which of two surfaces carries the multipliers: the coarser where they are near each other, as
/// a finer one has more of them than the other side can follow. A contrast of stiffness of 30
/// decides before that: the softer, which follows whatever stands beside it (multipliers of a
/// coarse stiff one leave its fine bulges between them free to pass). Alike: the softer, then the
/// first.
///
/// Coarse is what has much area for each multiplier.
/// @param a_places, b_places        of all nodes of each mesh [m]
/// @param a_stiffness, b_stiffness  Young's moduli [Pa]; infinity: rigid, never the slave of one
///                                  that is not
/// @param covered_first  before the coarser, where areas per multiplier differ by less than a
///                       factor of 4, comes a side whose nearest faces the other covers wholly:
///                       multipliers of faces that are covered in part begin and end where an edge
///                       slides over them, which makes or takes energy
/// @return  true if a is the slave
bool first_is_slave(const ExternalSurface& a, std::span<const Vec3> a_places, double a_stiffness,
                    const ExternalSurface& b, std::span<const Vec3> b_places, double b_stiffness,
                    bool covered_first = false);

} // namespace amontons
