#pragma once

#include "solver/output/beam_tube.hpp"
#include "solver/record/contact_bodies.hpp"
#include "solver/step/simulation.hpp"

#include <string>

// What a frame of a run holds, as the bytes of VTK's files.

namespace amontons {

/// Points with force, normal, slip [m], gap [m], status, bodies, pressure [Pa] and area [m^2]: VTP.
/// Its field data state on which body the force acts, and the names and kinds of the bodies.
std::string contacts_bytes(const StepRecord& step, const ContactBodies& bodies);
/// The middle line: VTP. @param time  [s]
std::string beam_bytes(const BeamRecord& beam, double time);
/// Elements: VTU; else triangles: VTP.
/// @param time  of the step [s]
std::string body_bytes(const BodyRecord& body, double time);
/// The surface around a middle line at a time [s], in single precision: VTP.
std::string tube_bytes(const TubeSurface& tube, double time);

} // namespace amontons
