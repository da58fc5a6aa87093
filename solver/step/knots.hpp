#pragma once

#include "mesh/base/curve.hpp"

#include <vector>

namespace amontons {

/// The first knot after a time, at most `end` [s].
double next_knot(const std::vector<const CurvePoints*>& curves, double time, double end);

/// A step from `time`, of a length that is cut or drawn out a little to end where a caller asks.
struct CutStep {
    double h = 0; ///< [s]
    bool cut = false;
};
/// @param h       without the caller [s]
/// @param asked   where it is to end at the latest [s]; times that agree to 1e-12 are one
/// @param sliver  so much longer a step may become [s]
CutStep cut_step(double time, double h, double asked, double sliver);

} // namespace amontons
