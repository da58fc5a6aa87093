#pragma once

#include "solver/scene/findings.hpp"
#include "solver/scene/scene.hpp"

namespace amontons {

/// Whether instruments (`beam`) are solved as rods fed from a sheath, in one problem with the
/// scene's bodies, because they may touch more than walls and what lies in their bore. True for
/// scenes with a rigid body, a rod, a coupling or a solid that is not a vessel's wall, for
/// instruments that touch themselves or one another from different introducers, and for those with
/// a density in gravity.
bool instruments_are_rods(const Scene& scene);

/// Whether two instruments come out of one introducer, so that one slides in the other.
bool share_introducer(const BeamInput& a, const BeamInput& b);

/// The same of instruments as rods.
bool slide_in_one_another(const RodInput& a, const RodInput& b);

/// Whether an instrument has room in the bore of another one, all along.
bool fits_in(const RodInput& inner, const RodInput& outer);

/// Adds an Issue for each feature of such a scene's instruments that rods do not have.
void check_instrument_rods(const Scene& scene, Findings& findings);

/// The direction across an introducer to which a curvature of angle 0 bends a wire; a unit vector.
Vec3 introducer_normal(const IntroducerInput& introducer, const std::optional<Vec3>& plane);

/// The same scene with rods in the place of its beams: straight in their introducers, fed by
/// `drive.insertion`. What is in an introducer is rigid (of a wire it is elastic).
/// @param scene  its introducers have their place and direction
Scene with_instruments_as_rods(Scene scene);

} // namespace amontons
