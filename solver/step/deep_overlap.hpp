#pragma once

#include "solver/step/body_step.hpp"

#include <string>

namespace amontons {

/// Bodies that stand in each other when the run begins, deeper than their meshes leave, and are not
/// said to be pressed out: one finding for each pair, with depth and place.
/// @param file  of the scene, for messages
std::vector<Issue> start_overlaps(BodySystem& system, const std::string& file);

/// Rods whose middle lines meet, each other's or their own, so that nothing tells their sides
/// apart.
std::vector<Issue> rods_in_each_other(const std::vector<BodyRef>& bodies,
                                      const std::vector<ContactPair>& pairs,
                                      const std::string& file);

} // namespace amontons
