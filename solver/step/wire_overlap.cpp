#include "solver/step/wire_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons {
namespace {

constexpr double kAllowedOfDiameter = 1e-3, kMostOfDiameter = 0.1;
constexpr double kBeyond = 1e3;   // what no step is done with comes before all else
constexpr int kElementParts = 4;  // of an element
constexpr double kClosest = 0.25; // of the diameter

} // namespace

WireOverlap deepest_overlap(const WireBody& b)
{
    const Wire& wire = b.wire;
    const WireMaterial& m = wire.material;
    WireOverlap deepest;
    double worst = 0; // of depth over what is allowed
    const double h = m.point.front().spacing;
    // Points come from the tip, wall by wall: elements from here on are measured.
    std::vector<int> measured(b.walls.size(), int(m.node.size()) - 1);
    for (const Candidate& c : b.work->candidates) {
        const WireWall& wall = b.walls[std::size_t(c.wall)];
        if (wall.foundation > 0 || c.gap > 0.5 * h) continue; // a wire bends no more than that
        int& from = measured[std::size_t(c.wall)];
        for (int e = std::min(c.place.element, from - 1); e >= std::max(c.place.element - 1, 0);
             from = e--) {
            const double start = m.node[std::size_t(e)],
                         length = m.node[std::size_t(e) + 1] - start;
            const int parts = std::max(
                {kElementParts, 2 * int(std::ceil(length / h)), int(std::ceil(length / c.radius))});
            for (int k = 1; k < parts; ++k) {
                const double xi = double(k) / parts, s = start + xi * length;
                const auto place = place_of(wire, wire.state, s, e, xi);
                if (!place || s < b.work->covered) continue;
                const Vec3 x = centreline_point(wire.state, *place);
                WallHint hint = b.work->proximity[std::size_t(c.index)].hint;
                const Vec3 at = pulled_back(wall, x, hint);
                if (wall.wall->clearance(at, hint) >= c.radius) continue;
                const double depth = c.radius - wall.wall->distance(at, hint);
                // No curvature allows less than that.
                if (!(depth > 0) || depth < worst * kAllowedOfDiameter * 2 * c.radius) continue;
                const auto beside = [&](double to) {
                    return centreline_point(wire.state, {place->element, to, place->length});
                };
                const double aside = std::min({1.0 / parts, place->xi, 1 - place->xi}),
                             way = aside * place->length;
                const double bend =
                    (beside(place->xi - aside) + beside(place->xi + aside) - 2 * x).norm() /
                    (way * way);
                const double width = std::max(h, length);
                const double bulge =
                    width * width / 8 * (wall.wall->sample(at, hint).hessian.norm() + bend);
                // A wall that bends within a wire's length would excuse any depth.
                const double allowed =
                    2 * c.radius *
                    std::clamp(bulge / (2 * c.radius), kAllowedOfDiameter, kMostOfDiameter);
                const double most = kMostOfDiameter * 2 * c.radius;
                const double share = depth > most ? kBeyond * depth / most : depth / allowed;
                if (share < worst) continue;
                worst = share;
                deepest = {depth, x, std::size_t(c.wall), allowed, most};
            }
        }
    }
    return deepest;
}

void set_halvings(WireBody& b, int halvings)
{
    if (b.halvings == halvings) return;
    WireMaterial& m = b.wire.material;
    place_contact_points(m, std::ldexp(m.point.front().spacing, b.halvings - halvings));
    b.halvings = halvings;
    for (WireWall& w : b.walls) {
        w.friction.clear();
        for (const MaterialPoint& p : m.point)
            w.friction.push_back(w.friction_of_segment[std::size_t(p.segment)]);
    }
    const std::size_t reactions = m.point.size() * b.walls.size();
    b.wire.state.reaction.assign(reactions, {});
    for (auto* list : {&b.dynamics.contact_force, &b.dynamics.contact_arm})
        list->assign(reactions, Vec3::Zero());
    b.work->proximity.assign(reactions, {});
    b.work->candidates.clear();
}

bool may_halve_spacing(const WireBody& b)
{
    double least = std::numeric_limits<double>::infinity();
    for (const BeamSegment& s : b.wire.material.segments)
        least = std::min(least, 2 * s.radius);
    return b.halvings < kMostSpacingHalvings &&
           b.wire.material.point.front().spacing > kClosest * least;
}

void halve_spacing(WireBody& b)
{
    const std::vector<Reaction> reaction = b.wire.state.reaction;
    const WireDynamics dynamics = b.dynamics;
    set_halvings(b, b.halvings + 1);
    const std::size_t walls = b.walls.size();
    for (std::size_t i = 0; i < reaction.size(); ++i) {
        const std::size_t to = 2 * (i / walls) * walls + i % walls;
        b.wire.state.reaction[to] = reaction[i];
        b.dynamics.contact_force[to] = dynamics.contact_force[i];
        b.dynamics.contact_arm[to] = dynamics.contact_arm[i];
    }
}

std::string never_done(const WireOverlap& o, const std::string& wire, const std::string& wall)
{
    return fmt::format("{} stands {:.2g} m in {} between its points of contact, near ({:.4g}, "
                       "{:.4g}, {:.4g}), more than a tenth of its diameter: shorter elements "
                       "follow the wall",
                       wire, o.depth, wall, o.point.x(), o.point.y(), o.point.z());
}

void WireOverlapLog::note(const WireOverlap& o, int in_wall, int at_step)
{
    if (!(o.depth > 0) || o.depth / o.allowed < depth / allowed) return;
    depth = o.depth;
    allowed = o.allowed;
    x = o.point.x(), y = o.point.y(), z = o.point.z();
    wall = in_wall;
    step = at_step;
}

std::string WireOverlapLog::warning(const std::string& wire, const std::string& wall_name) const
{
    if (!(depth > allowed)) return "";
    return fmt::format(
        "{} stands {:.2g} m in {} between its points of contact, near ({:.4g}, {:.4g}, "
        "{:.4g}) in step {}, where they leave {:.2g} m: shorter elements follow the wall",
        wire, depth, wall_name, x, y, z, step, allowed);
}

} // namespace amontons
