#pragma once

#include "mesh/base/curve.hpp"

#include <vector>

namespace amontons {

/// The first knot after a time by more than 1e-12 of the end of the run, which is the latest [s].
double next_knot(const std::vector<const CurvePoints*>& curves, double time, double end);

/// Length of a step that is shortened, or lengthened a little, to end at a required time.
struct CutStep {
    double h = 0; ///< [s]
    bool cut = false;
};
/// The step from `time` that ends at `end` at the latest.
/// @param h       its length otherwise [s]
/// @param latest   latest end [s]; times that agree to 1e-12 count as equal
/// @param sliver  a step may become longer by this, so that no such short step follows [s]
CutStep cut_step(double time, double h, double latest, double sliver);

} // namespace amontons
