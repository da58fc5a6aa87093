#pragma once

#include "solver/scene/scene.hpp"

#include <vector>

namespace amontons {

/// Every curve over time of bodies and loads: a step must not pass its knots.
std::vector<const CurvePoints*> curves_of(const Scene& scene);

/// The first knot after a time, at most `end` [s].
double next_knot(const std::vector<const CurvePoints*>& curves, double time, double end);

} // namespace amontons
