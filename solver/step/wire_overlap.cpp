#include "solver/step/wire_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr double kAllowedOfDiameter = 1e-3, kMostOfDiameter = 0.1;
constexpr int kParts = 4; // of an element

} // namespace

WireOverlap deepest_overlap(const WireBody& b)
{
    const Wire& wire = b.wire;
    const WireMaterial& m = wire.material;
    WireOverlap deepest;
    double worst = 0; // of depth over what is allowed
    for (const Candidate& c : b.work->candidates) {
        const WireWall& wall = b.walls[std::size_t(c.wall)];
        const double h = m.point[std::size_t(c.point)].spacing;
        if (wall.foundation > 0 || c.gap > 0.5 * h) continue; // a wire bends no more than that
        for (const int e : {c.place.element - 1, c.place.element}) {
            if (e < 0 || std::size_t(e) + 1 >= m.node.size()) continue;
            const double start = m.node[std::size_t(e)],
                         length = m.node[std::size_t(e) + 1] - start;
            for (int k = 1; k < kParts; ++k) {
                const double xi = double(k) / kParts, s = start + xi * length;
                const auto place = place_of(wire, wire.state, s, e, xi);
                if (!place || s < b.work->covered) continue;
                const Vec3 x = centreline_point(wire.state, *place);
                WallHint hint = b.work->proximity[std::size_t(c.index)].hint;
                const WallSample there = wall.wall->sample(pulled_back(wall, x, hint), hint);
                const double depth = c.radius - there.distance;
                if (!(depth > 0)) continue;
                const auto beside = [&](double to) {
                    return centreline_point(wire.state, {place->element, to, place->length});
                };
                const double aside = std::min({1.0 / kParts, place->xi, 1 - place->xi}),
                             way = aside * place->length;
                const double bend =
                    (beside(place->xi - aside) + beside(place->xi + aside) - 2 * x).norm() /
                    (way * way);
                const double width = std::max(h, length);
                const double bulge = width * width / 8 * (there.hessian.norm() + bend);
                // A wall that bends within a wire's length would excuse any depth.
                const double allowed =
                    2 * c.radius *
                    std::clamp(bulge / (2 * c.radius), kAllowedOfDiameter, kMostOfDiameter);
                if (depth / allowed < worst) continue;
                worst = depth / allowed;
                deepest = {depth, x, std::size_t(c.wall), allowed};
            }
        }
    }
    return deepest;
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
