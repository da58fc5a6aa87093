#pragma once

#include "mesh/base/error.hpp"
#include "solver/scene/scene.hpp"

#include <vector>

namespace amontons {

/// Adds what is wrong between the fields of a scene: a wire shorter than its insertion, an
/// unknown body in a pair, ...
///
/// @param issues  those of the fields themselves, on entry; what rests on a field that is
///                itself wrong is not reported again
void check_consistency(const Scene& scene, std::vector<Issue>& issues);

/// Whether one instrument can slide in the bore of another, all along.
bool fits_in(const BeamInput& inner, const BeamInput& outer);

} // namespace amontons
