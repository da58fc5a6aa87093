#pragma once

#include "solver/step/body_contacts.hpp"

#include <string>

namespace amontons {

/// Solids that lie deeper in another solid or an obstacle than contacts are looked for: there none
/// is found, and nothing would hold the two apart. One finding for each pair.
/// @param walls  of the obstacles, as the finder has them
/// @param file   of the scene, for messages
std::vector<Issue> deep_overlaps(const std::vector<BodyRef>& bodies,
                                 const std::vector<ContactPair>& pairs,
                                 const std::vector<const Wall*>& walls, const std::string& file);

/// Rods whose middle lines meet, each other's or their own, so that nothing tells their sides
/// apart.
std::vector<Issue> rods_in_each_other(const std::vector<BodyRef>& bodies,
                                      const std::vector<ContactPair>& pairs,
                                      const std::string& file);

} // namespace amontons
