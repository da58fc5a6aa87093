#include "solver/step/wire_friction.hpp"

#include "solver/beam/soft_tube.hpp"

#include <algorithm>
#include <cmath>

// The force of the step's end alone would be wrong to first order in the step wherever forces
// grow: a wire that jams, or one whose contacts pass from point to point.

namespace amontons {
namespace {

/// Slip of the surface point that touched the wall when the step began, in that wall's plane.
Vec3 slip_since(const Wire& wire, const StepStart& start, const ContactBefore& b)
{
    const std::size_t p = std::size_t(b.point);
    const MaterialPoint& m = wire.material.point[p];
    const auto place = place_of(wire, wire.state, m.s, m.element, m.xi);
    const Vec3 x = place ? centreline_point(wire.state, *place) : held_point(wire, wire.state, m.s);
    const Quaternion q =
        place ? section_rotation(wire.state, *place) : held_rotation(wire, wire.state, m.s);
    const Vec3 arm = -m.radius * b.n;
    const Vec3 now = rotation_matrix(q.q) * (rotation_matrix(start.section[p].q).transpose() * arm);
    Vec3 u = x - start.point[p] + now - arm;
    if (b.soft) u -= b.soft->since_start(b.soft->place(b.along, b.around));
    if (wire.plane) u -= *wire.plane * wire.plane->dot(u);
    return u - b.n * b.n.dot(u);
}

} // namespace

std::vector<ContactBefore> contacts_before(const Wire& wire, const std::vector<WireWall>& walls,
                                           std::vector<Proximity>& proximity)
{
    std::vector<ContactBefore> list;
    const WireState& s = wire.state;
    for (std::size_t i = 0; i < s.reaction.size(); ++i) {
        const Reaction& r = s.reaction[i];
        const std::size_t p = i / walls.size();
        const WireWall& w = walls[i % walls.size()];
        if (!(r.normal > 0) || !(w.friction[p] > 0)) continue;
        const MaterialPoint& m = wire.material.point[p];
        const auto place = place_of(wire, s, m.s, m.element, m.xi);
        if (!place) break;
        const Vec3 n = w.soft && r.touch.known
                           ? r.touch.n
                           : w.wall->sample(centreline_point(s, *place), proximity[i].hint).normal;
        list.push_back({int(p), int(i), n, w.friction[p] * r.normal, r.tangential,
                        r.touch.known ? w.soft : nullptr, r.touch.along, r.touch.around});
    }
    return list;
}

double friction_work(const Wire& wire, const StepStart& start,
                     const std::vector<ContactBefore>& before,
                     const std::vector<Candidate>& candidates)
{
    double sum = 0;
    auto b = before.begin(); // both lists run from point to point
    const auto leave = [&] { sum -= 0.5 * b->tangential.dot(slip_since(wire, start, *b)), ++b; };
    for (const Candidate& c : candidates) {
        if (!(c.normal > 0)) continue;
        while (b != before.end() && b->index < c.index)
            leave();
        const double rate = -(c.tangential[0] * c.slip[0] + c.tangential[1] * c.slip[1]);
        const double force = std::hypot(c.tangential[0], c.tangential[1]);
        if (b != before.end() && b->index == c.index) {
            // Inside the cone it slips by rounding only.
            const bool slips = force > 0 && force > (1 - 1e-6) * c.mu * c.normal;
            sum += 0.5 * rate * (slips ? b->bound / force : 1);
            ++b;
        }
        sum += 0.5 * rate;
    }
    while (b != before.end())
        leave();
    return sum;
}

} // namespace amontons
