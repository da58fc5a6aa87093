#pragma once

#include "solver/obstacle/build.hpp"

#include <cstdio>

namespace amontons::validation {

/// What a wire did that was fed into a ball about the origin, from its nodes' places alone.
struct Nest {
    int steps = 0, uncertified = 0;
    int contacts = 0, own = 0; ///< at most at one time; of the wire with itself
    double least = 3;          ///< distance of its middle line from itself, in diameters, all steps
    double least_between = 3;  ///< on the straight ways between the steps
    double beyond = -1;        ///< of its surface out of the ball, in diameters
    double error = 0;          ///< of the worst certificate
    double energy_error = 0;   ///< over the work
    double seconds = 0;        ///< of all steps
};

/// Runs a scene of one such wire; a line for every 20th step.
/// @throws std::runtime_error  if it does not get to its end
Nest fill_nest(const Scene& scene, std::FILE* log = nullptr);

} // namespace amontons::validation
