#include "contact/curve/curve_contact.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/step/body_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// Contacts of rods: with obstacles, rigid bodies, other rods and themselves.

namespace amontons {
namespace {

constexpr double kRounding = 1e-6; // of a rod's size: of shapes that are read

/// The stations that may touch: all, or those of one end.
std::span<const CurvePlace> places_of(const RodBody& rod, const ContactPair& pair)
{
    const std::span<const CurvePlace> all = rod.stations();
    return pair.end_a == "start" ? all.first(1) : pair.end_a == "end" ? all.last(1) : all;
}

} // namespace

void ContactFinder::rod_on_any(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const RodBody& rod = *bodies[std::size_t(p.a)].rod;
    const Curve own = rod.curve();
    std::vector<CurveContact> found;
    std::vector<std::int64_t>& known = sharp_[std::size_t(pair)];
    const auto on = [&](const std::function<WallSample(const Vec3&)>& surface) {
        touch_surface(own, places_of(rod, p), surface, reach_, known, found);
    };
    if (p.b < 0) {
        const Wall& wall = *walls_[std::size_t(p.obstacle)];
        on([&wall, hint = WallHint()](const Vec3& x) mutable { return wall.sample(x, hint); });
    } else if (const RigidBody* rigid = bodies[std::size_t(p.b)].rigid) {
        on(distance_from(*rigid, rigid->placement()));
    } else if (p.b == p.a) {
        touch_curve(own, rod.stations(), own, reach_, known, found);
    } else if (const RodBody* second = bodies[std::size_t(p.b)].rod) {
        touch_curve(own, rod.stations(), second->curve(), reach_, known, found);
    }
    for (const CurveContact& c : found)
        known.push_back(c.id);
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    // No force moves what is held: where it touches within rounding it is left alone, and deeper it
    // is an overlap that nothing can prevent.
    const RodBody* other = p.b >= 0 ? bodies[std::size_t(p.b)].rod : nullptr;
    const bool still = p.b < 0 || (!other && bodies[std::size_t(p.b)].body->modes().cols() == 0);
    const auto stuck = [&](const CurveContact& c) {
        return c.gap > -kRounding * rod.size() && rod.holds(c.a, c.normal) &&
               (still || (other && other->holds(c.b, c.normal)));
    };
    for (const CurveContact& c : found) {
        if (stuck(c)) continue;
        BodyContact k;
        k.pair = pair;
        k.id = c.id;
        k.a = p.a;
        k.b = p.b;
        k.frame = contact_frame(c.normal);
        k.gap = c.gap;
        k.point = c.point;
        k.curvature = c.curvature;
        k.slides_a = c.slides_a;
        k.slides_b = c.slides_b;
        k.a_begin = std::int32_t(out.stencil.size());
        out.stencil.push_back({c.a.piece, c.a.t});
        k.a_end = k.b_begin = k.b_end = std::int32_t(out.stencil.size());
        if (c.b.piece >= 0) {
            out.stencil.push_back({c.b.piece, c.b.t});
            k.b_end = std::int32_t(out.stencil.size());
        }
        out.contact.push_back(k);
    }
}

void ContactFinder::sweep_rods(const std::vector<BodyRef>& bodies)
{
    swept_.assign(bodies.size(), {});
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (const RodBody* rod = bodies[b].rod) {
            const AxisBox before = rod->box_before(), now = rod->box();
            swept_[b] = {before.low.cwiseMin(now.low), before.high.cwiseMax(now.high)};
        }
}

bool ContactFinder::rod_passed(const std::vector<BodyRef>& bodies, const ContactPair& pair)
{
    const RodBody& rod = *bodies[std::size_t(pair.a)].rod;
    if (pair.b >= 0 && bodies[std::size_t(pair.b)].rod) { // ways are straight: within their boxes
        const AxisBox &a = swept_[std::size_t(pair.a)], &b = swept_[std::size_t(pair.b)];
        if ((a.low.array() > b.high.array()).any() || (b.low.array() > a.high.array()).any())
            return false;
    }
    const Curve before = rod.curve_before(), now = rod.curve();
    if (pair.b == pair.a) return pass_through(before, now, before, now);
    if (pair.b >= 0 && bodies[std::size_t(pair.b)].rod) {
        const RodBody& other = *bodies[std::size_t(pair.b)].rod;
        return pass_through(before, now, other.curve_before(), other.curve());
    }
    // A place whose middle line came nearer than half its radius on its way.
    std::function<WallSample(const Vec3&)> surface;
    Placement from, to;
    if (pair.b < 0) {
        const Wall& wall = *walls_[std::size_t(pair.obstacle)];
        surface = [&wall, hint = WallHint()](const Vec3& x) mutable {
            WallSample s;
            s.distance = wall.distance(x, hint);
            return s;
        };
    } else {
        const RigidBody& rigid = *bodies[std::size_t(pair.b)].rigid;
        from = rigid.start_placement();
        to = rigid.placement();
        surface = distance_from(rigid, {}); // in the body's frame
    }
    const auto inside = [](const Placement& at, const Vec3& x) {
        return Vec3(at.turn.conjugate() * (x - at.shift));
    };
    double moved = 0, radius = std::numeric_limits<double>::infinity();
    for (std::size_t e = 0; e < now.pieces.size(); ++e) {
        const CurvePiece &p0 = before.pieces[e], &p1 = now.pieces[e];
        moved = std::max({moved, (inside(to, p1.x0) - inside(from, p0.x0)).norm(),
                          (inside(to, p1.x1) - inside(from, p0.x1)).norm()});
        radius = std::min(radius, p1.radius);
    }
    if (moved <= radius) return false;
    // So near to each other that nothing much thinner than the rod is between them.
    std::vector<CurvePlace> places = stations(now, radius);
    if (!pair.end_a.empty()) {
        const auto end = places_of(rod, pair);
        places.assign(end.begin(), end.end());
    }
    for (const CurvePlace& s : places) {
        const CurvePiece& piece = now.pieces[std::size_t(s.piece)];
        const Vec3 a = inside(from, before.pieces[std::size_t(s.piece)].at(s.t)),
                   b = inside(to, piece.at(s.t));
        const double way = (b - a).norm();
        if (way <= piece.radius) continue;
        const double least = 0.5 * piece.radius, start = surface(a).distance;
        if (start < least) continue; // it began in there
        // Distances change no faster than the place moves.
        for (double t = start - least; t < way;) {
            const double d = surface(a + t / way * (b - a)).distance;
            if (d < least) return true;
            t += std::max(d - least, 0.1 * piece.radius);
        }
    }
    return false;
}

} // namespace amontons
