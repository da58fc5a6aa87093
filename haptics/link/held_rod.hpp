#pragma once

#include "haptics/link/condensed.hpp"
#include "solver/step/simulation.hpp"
#include "solver/step/wire_step.hpp"

namespace amontons {

/// A straight rod of a scene in the hand, as a wire that is clamped to the device: its node 0 is
/// the device, and its first element the spring between device and rod.
/// @param walls     out: places in `obstacles` of those that it can touch
/// @param warnings  gets what of the scene is left out
/// @throws InputError  if the rod cannot be held: bent, held elsewhere, loaded
WireBody make_held_rod(const Scene& scene, const RodInput& rod,
                       const std::vector<Obstacle>& obstacles, const HandleSpring& spring,
                       std::vector<int>& walls, std::vector<Issue>& warnings);

/// Where the device is, of such a wire; and brings it elsewhere, the rest of the wire as it is.
HandPose device_of(const Wire& rod);
/// Moves the first node of a held rod to the device.
void place_device(Wire& rod, const HandPose& device);

} // namespace amontons
