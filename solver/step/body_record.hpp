#pragma once

#include "solver/step/body_step.hpp"
#include "solver/step/simulation.hpp"

// What a step of solids and rigid bodies reports: numbers for the history, shapes and fields for
// files and pictures.

namespace amontons {

/// Forces of named pairs and of holds, places, velocities and momenta, forces of couplings.
std::vector<Quantity> body_quantities(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                      const BodySystem& system, const BodyStepReport& step);

/// The contacts of a step that carry something. Bodies are numbered as in contact_bodies(scene).
std::vector<ContactRecord> contact_records_of(const BodySystem& system, const BodyStepReport& step,
                                              int obstacles);

/// A rod as a line, with what its sections carry.
BeamRecord record_rod(const RodBody& rod, const std::string& name);

/// How body b looks and fares at the end of the step.
BodyRecord record_body(const BodySystem& system, std::size_t b, const BodyStepReport& step);

} // namespace amontons
