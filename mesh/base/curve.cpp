#include "mesh/base/curve.hpp"

#include <algorithm>
#include <limits>

namespace amontons {
namespace {

// The first point whose time is after t.
CurvePoints::const_iterator after(const CurvePoints& curve, double t)
{
    return std::upper_bound(curve.begin(), curve.end(), t,
                            [](double time, const auto& point) { return time < point[0]; });
}

} // namespace

double curve_value(const CurvePoints& curve, double t)
{
    if (curve.empty()) return 0;
    const auto b = after(curve, t);
    if (b == curve.begin()) return curve.front()[1];
    const auto a = b - 1;
    if (b == curve.end() || t == (*a)[0]) return (*a)[1];
    const double s = (t - (*a)[0]) / ((*b)[0] - (*a)[0]);
    return (1 - s) * (*a)[1] + s * (*b)[1]; // exact at both ends, unlike a + s (b - a)
}

double curve_rate(const CurvePoints& curve, double t)
{
    const auto b = after(curve, t);
    if (b == curve.begin() || b == curve.end()) return 0;
    const auto a = b - 1;
    return ((*b)[1] - (*a)[1]) / ((*b)[0] - (*a)[0]);
}

double next_knot(const CurvePoints& curve, double t)
{
    const auto b = after(curve, t);
    return b == curve.end() ? std::numeric_limits<double>::infinity() : (*b)[0];
}

std::vector<double> knots(const CurvePoints& curve)
{
    std::vector<double> times;
    for (const auto& point : curve)
        if (times.empty() || point[0] != times.back()) times.push_back(point[0]);
    return times;
}

} // namespace amontons
