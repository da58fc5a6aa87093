#pragma once

#include <array>
#include <vector>

namespace amontons {

/// Value over time: linear between points, constant before the first and after the last.
using CurvePoints = std::vector<std::array<double, 2>>; ///< (time [s], value)

/// The curve at time t; 0 of a curve without points.
/// @param curve  times increase (equal times are a jump: its later value holds from there on)
double curve_value(const CurvePoints& curve, double t);

/// Slope of the curve on the piece that begins at or holds t; 0 outside [value / s].
double curve_rate(const CurvePoints& curve, double t);

/// The first knot after t, where the slope changes; +infinity if there is none [s].
/// Within a step that crosses no knot the curve is exactly linear.
double next_knot(const CurvePoints& curve, double t);

/// The times of the points, ascending, each once [s].
std::vector<double> knots(const CurvePoints& curve);

} // namespace amontons
