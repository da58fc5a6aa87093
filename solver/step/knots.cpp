#include "solver/step/knots.hpp"

#include <cmath>

namespace amontons {

double next_knot(const std::vector<const CurvePoints*>& curves, double time, double end)
{
    constexpr double kSame = 1e-12; // of the end: no step is so short
    double next = end;
    for (const CurvePoints* c : curves)
        for (const auto& p : *c)
            if (p[0] > time + kSame * end && p[0] < next) next = p[0];
    return next;
}

CutStep cut_step(double time, double h, double latest, double sliver)
{
    const double end = time + h;
    if (!(latest < end + sliver) || std::abs(latest - end) <= 1e-12 * std::abs(latest))
        return {h, false};
    return {latest - time, true};
}

} // namespace amontons
