#pragma once

#include "solver/step/body_step.hpp"
#include "solver/step/simulation.hpp"

namespace amontons {

/// Makes the solids and rigid bodies of a scene, its pairs and its couplings.
/// @param obstacles  outlive the result
/// @param warnings   gets an Issue for input that is valid but doubtful (slivers, millimetres)
/// @param refuse     throw where no method for the linear systems fits into the memory
/// @throws InputError  with all Issues of all bodies
std::unique_ptr<BodySystem> build_bodies(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                         std::vector<Issue>& warnings, bool refuse = true);

/// A rigid body's shape, in its own frame.
/// @param warnings  gets an Issue for input that is valid but doubtful
/// @throws InputError  if the surface encloses no solid, with all Issues
RigidShape build_shape(const ShapeInput& input, const Scene& scene, std::vector<Issue>& warnings);

/// The contact laws of a scene with "*" replaced by names; laws between two names are unchanged.
/// @param rest  if given, pairs of free rigid bodies to which only the law of "*" and "*" applies
///              are not listed, and *rest is set to that law; null if there is none
/// Cost: O(pairs).
std::vector<ContactLaw> written_out(const Scene& scene, const ContactLaw** rest = nullptr);

/// The time integration rule of a scene's dynamic steps.
TimeRule time_rule(const TimeInput& time);

} // namespace amontons
