#pragma once

#include "solver/scene/scene.hpp"

#include <vector>

namespace amontons {

/// The segments with every cone (end_radius, or layers that taper) cut into pieces of its elements'
/// length: each of the radius of its middle, with stiffnesses that run on from piece to piece.
/// Stiffnesses of layers are those of their radii there; another one that differs between the ends
/// follows the power of the radius that joins them, of a solid cone the fourth (EI, GJ) and the
/// second (EA, GA), exactly; where the radius is the same, a line.
std::vector<BeamSegment> without_tapers(const std::vector<BeamSegment>& segments);

} // namespace amontons
