#pragma once

#include "solver/beam/soft_tube.hpp"
#include "solver/step/simulation.hpp"

#include <memory>
#include <vector>

namespace amontons {

/// The wall of a vessel as an elastic solid, in a scene of beams.
struct SoftVessel {
    std::string name;
    std::unique_ptr<SoftTube> tube;
};

/// The solids of a scene of beams.
/// @throws InputError
std::vector<SoftVessel> build_soft_vessels(const Scene& scene);

/// Its mesh with displacement, contact forces and stress, for files. Costs a solve.
BodyRecord record_vessel(const SoftVessel& vessel);

} // namespace amontons
