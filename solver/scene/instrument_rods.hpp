#pragma once

#include "solver/scene/findings.hpp"
#include "solver/scene/scene.hpp"

namespace amontons {

/// Do instruments (`beam`) touch more than walls and what lies in their bore? Then they are solved
/// as rods that a sheath feeds, in one problem with the scene's bodies. So it is of scenes with a
/// rigid body, a rod, a coupling or a solid that is no vessel's wall, of instruments that touch
/// themselves or one another from different introducers, and of those with a density in gravity.
bool instruments_are_rods(const Scene& scene);

/// Two of them slide in each other: they come out of one introducer.
bool share_introducer(const BeamInput& a, const BeamInput& b);

/// What such a scene asks of its instruments and rods cannot do.
void check_instrument_rods(const Scene& scene, Findings& findings);

/// Across an introducer: where the curvature of angle 0 bends a wire to [-], unit.
Vec3 introducer_normal(const IntroducerInput& introducer, const std::optional<Vec3>& plane);

/// The same scene with rods in the place of its beams: straight in their introducers, fed by
/// `drive.insertion`. What is in an introducer is rigid (of a wire it is elastic).
/// @param scene  its introducers have their place and direction
Scene with_instruments_as_rods(Scene scene);

} // namespace amontons
