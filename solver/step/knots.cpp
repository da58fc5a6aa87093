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

CutStep cut_step(double time, double h, double asked, double sliver)
{
    const double end = time + h;
    if (!(asked < end + sliver) || std::abs(asked - end) <= 1e-12 * std::abs(asked))
        return {h, false};
    return {asked - time, true};
}

} // namespace amontons
