#pragma once

#include "solver/step/body_step.hpp"
#include "solver/step/simulation.hpp"

// The records of a step of solids, rigid bodies and rods: quantities for history.csv, shapes and
// fields for files and pictures.

namespace amontons {

/// Forces of named pairs and of holds, places, velocities and momenta, forces of couplings.
std::vector<Quantity> body_quantities(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                      const BodySystem& system, const BodyStepReport& step);

/// The contacts of a step that carry a force. Bodies are numbered as in contact_bodies(scene).
std::vector<ContactRecord> contact_records_of(const BodySystem& system, const BodyStepReport& step,
                                              int obstacles);

/// A rod as a line of points, with the internal forces and moments of its sections.
BeamRecord record_rod(const RodBody& rod, const std::string& name);

/// Surface, displacements and stresses of body b at the end of the step.
BodyRecord record_body(const BodySystem& system, std::size_t b, const BodyStepReport& step);

} // namespace amontons
