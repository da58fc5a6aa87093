#include "solver/step/knots.hpp"

#include <cmath>

namespace amontons {

std::vector<const CurvePoints*> held_curves(const Scene& scene)
{
    std::vector<const CurvePoints*> all;
    for (const SolidInput& s : scene.solids)
        for (const HoldInput& h : s.hold)
            all.insert(all.end(), {&h.x, &h.y, &h.z, &h.angle, &h.over});
    for (const RodInput& r : scene.rods)
        for (const RodHold& h : r.hold)
            all.insert(all.end(), {&h.x, &h.y, &h.z, &h.angle});
    std::erase_if(all, [](const CurvePoints* c) { return c->empty(); });
    return all;
}

double next_knot(const std::vector<const CurvePoints*>& curves, double time, double end)
{
    double next = end;
    for (const CurvePoints* c : curves)
        for (const auto& p : *c)
            if (p[0] > time * (1 + 1e-12) && p[0] < next) next = p[0];
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
