#pragma once

#include "solver/step/body_step.hpp"
#include "solver/step/simulation.hpp"

namespace amontons {

/// Makes the solids and rigid bodies of a scene, its pairs and its couplings.
/// @param obstacles  outlive the result
/// @param warnings   gets what may be meant otherwise (slivers, millimetres)
/// @param refuse     where no way to solve the linear systems fits into the memory
/// @throws InputError  with all Issues of all bodies
std::unique_ptr<BodySystem> build_bodies(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                         std::vector<Issue>& warnings, bool refuse = true);

/// A rigid body's shape, in its own frame.
/// @param warnings  gets what may be meant otherwise
/// @throws InputError  for what is no solid, with all Issues
RigidShape build_shape(const ShapeInput& input, const Scene& scene, std::vector<Issue>& warnings);

/// The contact laws of a scene with "*" written out; pairs that are named stay as they are.
/// @param rest  if given, pairs of free rigid bodies that only a law of "*" and "*" names are not
///              written out, and this becomes that law; null if there is none
/// Cost: O(pairs).
std::vector<ContactLaw> written_out(const Scene& scene, const ContactLaw** rest = nullptr);

/// The rule of a scene's dynamic steps.
TimeRule time_rule(const TimeInput& time);

} // namespace amontons
