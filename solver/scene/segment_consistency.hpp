#pragma once

#include "solver/scene/findings.hpp"
#include "solver/scene/scene.hpp"

#include <string>
#include <vector>

namespace amontons {

double length_of(const std::vector<BeamSegment>& segments); ///< [m]

/// What is wrong between the fields of the segments of one wire or rod.
/// @param place  of the body, "/bodies/NAME"
/// @param cables  EI and GJ may be 0 if they are so everywhere
/// @param load  weight and loads of a rod: where they are large, its stretching may be stiffer [N]
void check_segments(const std::vector<BeamSegment>& segments, const std::string& place, bool cables,
                    const Scene& scene, Findings& findings, double load = 0);

/// Adds an Issue where this spacing makes more contact points than a wire or rod can need.
/// @param spacing  of contact points [m]
void check_contact_spacing(double spacing, const std::vector<BeamSegment>& segments,
                           const std::string& place, Findings& findings);

} // namespace amontons
