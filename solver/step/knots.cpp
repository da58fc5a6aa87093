#include "solver/step/knots.hpp"

namespace amontons {

std::vector<const CurvePoints*> curves_of(const Scene& scene)
{
    std::vector<const CurvePoints*> all;
    const auto drive = [&](const DriveInput& d) {
        all.insert(all.end(), {&d.x, &d.y, &d.z, &d.angle});
    };
    for (const SolidInput& s : scene.solids) {
        drive(s.drive);
        for (const HoldInput& h : s.hold)
            all.insert(all.end(), {&h.x, &h.y, &h.z});
        for (const LoadInput& l : s.loads)
            all.insert(all.end(), {&l.pressure, &l.volume, &l.over});
    }
    for (const RodInput& r : scene.rods) {
        for (const RodHold& h : r.hold)
            all.insert(all.end(), {&h.x, &h.y, &h.z, &h.angle});
        for (const RodLoad& l : r.loads)
            all.push_back(&l.over);
        all.push_back(&r.fed);
    }
    for (const RigidInput& r : scene.rigids) {
        drive(r.drive);
        all.push_back(&r.over);
    }
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

} // namespace amontons
