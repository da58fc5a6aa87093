#pragma once

#include "solver/step/body_step.hpp"
#include "solver/step/simulation.hpp"

#include <string>

namespace amontons {

/// Bodies that stand in each other when the run begins, deeper than their meshes leave, and are not
/// reported to be pressed out: one finding for each pair, with depth and place.
/// Ends of rods beyond the walls that they touch are reported as such.
/// @param obstacles  of the scene
std::vector<Issue> start_overlaps(BodySystem& system, const Scene& scene,
                                  const std::vector<Obstacle>& obstacles);

/// Of bodies in motion that are inside each other: a step that nothing strikes in, from a second
/// before the start of the run to `time`, at rest, without weight and loads, so that places change
/// by the least motion that masses and stiffness allow. Velocities are kept.
/// @param time  where what is driven stands [s]
BodyStepReport separation_step(BodySystem& system, const BodyStepOptions& options, double time = 0);

/// The depth of rigid bodies in motion in each other where they begin, as far as a step would not
/// undo it at once: less than what a start is refused for [m]. 0 where anything could be strained.
double slight_overlap(BodySystem& system);

/// Repeats steps of separation, which undo a share of the overlap each, until none is left.
/// @return  false if a step is not accepted
bool undo_slight_overlaps(const std::atomic<bool>& stop,
                          const std::function<const BodyStepReport&()>& step);

/// Presses bodies that begin inside each other apart, in parts of the depth.
/// @param step  a step at the start, of which at rest the first balance comes
/// @return  false if some step is not accepted, or `stop` is set
bool resolve_start_overlaps(ContactFinder& finder, bool dynamic, const std::atomic<bool>& stop,
                            const std::function<const BodyStepReport&()>& step);

} // namespace amontons
