#include "contact/curve/bore_contact.hpp"
#include "contact/curve/curve_contact.hpp"
#include "contact/rigid/broad_phase.hpp"
#include "mesh/box_tree.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_contacts.hpp"

#include <algorithm>
#include <cmath>

// Contacts of rods: with obstacles, rigid bodies, solids, other rods and themselves.

namespace amontons {
namespace {

constexpr double kShapeRounding = 1e-6; // of a rod's size: of shapes that are read
constexpr int kHalvings = 10;           // of a piece, however thin the rod is
constexpr double kParts = 1e4;          // of a way ...

/// The stations that may touch: all, or those of one end.
std::span<const CurvePlace> touching_stations(const RodBody& rod, const ContactPair& pair)
{
    const std::span<const CurvePlace> all = rod.stations();
    return pair.end_a == "start" ? all.first(1) : pair.end_a == "end" ? all.last(1) : all;
}

Vec3 inside(const Pose& at, const Vec3& x)
{
    return at.turn.conjugate() * (x - at.place);
}

/// Searches for places of a rod whose middle line comes nearer to a wall or a rigid body than half
/// the radius on its way through a step.
struct RodSweep {
    const Curve &before, &now;
    Pose from, to; // of the body
    /// Distance of a place in its frame: exact, or a lower bound that is more than `enough`.
    std::function<double(const Vec3&, double enough)> distance;

    /// True if it comes nearer than `least` on a way in the body's frame, by time from 0 to 1.
    /// @param length  at most of the way [m]: distances change no faster
    template <class Way> bool comes_near(Way way, double length, double least, double radius) const
    {
        const double smallest = std::max(0.1 * radius / length, 1 / kParts);
        for (double w = 0; w < 1;) {
            const double d = distance(way(w), least + (1 - w) * length);
            if (d < least) return true;
            w += std::max((d - least) / length, smallest);
        }
        return false;
    }

    /// Of the places within `half` (of a piece's length) around this one; 0: of it alone.
    bool passes(const CurvePlace& at, double half) const
    {
        const CurvePiece &p0 = before.pieces[std::size_t(at.piece)],
                         &p1 = now.pieces[std::size_t(at.piece)];
        const Vec3 x0 = p0.at(at.t), x1 = p1.at(at.t);
        const Vec3 a = inside(from, x0), b = inside(to, x1);
        const double radius = p1.radius, least = 0.5 * radius;
        // They are not farther than this from the one between them, at any time.
        const double around = half > 0 ? half * std::max(steepest(p0), steepest(p1)) : 0;
        const double length = (b - a).norm() + 2 * around;
        if (length <= radius) return false;
        const auto straight = [&](double w) { return Vec3(a + w * (b - a)); };
        if (half > 0) {
            if (!comes_near(straight, (b - a).norm(), least + around, radius)) return false;
            // So near to each other that nothing much thinner than the rod is between them.
            const bool fine = 2 * around <= radius || half < std::ldexp(1, -kHalvings);
            const auto part = [&](double t) {
                return passes({at.piece, t}, fine ? 0 : 0.5 * half);
            };
            return fine ? part(at.t) : part(at.t - 0.5 * half) || part(at.t + 0.5 * half);
        }
        if (distance(a, least) < least) return false; // it began in there
        if (!comes_near(straight, length, least, radius)) return false;
        // A body that rotates below a rod at rest contains a straight path in its own frame, and
        // one that takes the rod along a straight path in space: a place has passed only if it does
        // so on both.
        const double angle = from.turn.angularDistance(to.turn);
        if (angle == 0) return true;
        const double in_space =
            ((x1 - x0) - (to.place - from.place)).norm() + angle * std::max(a.norm(), b.norm());
        return comes_near(
            [&](double w) { return inside(pose_between(from, to, w), x0 + w * (x1 - x0)); },
            in_space, least, radius);
    }

    /// Of the whole piece.
    bool passes(int piece) const
    {
        const std::size_t i = std::size_t(piece);
        // Beside a body that does not turn, no way is longer than one of its polygon's.
        if (from.turn.coeffs() == to.turn.coeffs() &&
            longest_way(before.pieces[i], now.pieces[i]) <= now.pieces[i].radius)
            return false;
        return passes({piece, 0.5}, 0.5);
    }

private:
    double longest_way(const CurvePiece& p, const CurvePiece& q) const
    {
        const Vec3 own = to.place - from.place, start = q.x0 - p.x0 - own, end = q.x1 - p.x1 - own;
        return std::max({start.norm(), (start + (q.d0 - p.d0) / 3).norm(),
                         (end - (q.d1 - p.d1) / 3).norm(), end.norm()});
    }
    /// No slope of the piece is steeper: they are within those of its polygon.
    static double steepest(const CurvePiece& p)
    {
        return std::max({p.d0.norm(), p.d1.norm(), (3 * (p.x1 - p.x0) - p.d0 - p.d1).norm()});
    }
};

} // namespace

namespace {

/// Stores the ids found by an iteration for the following ones.
template <class Contact, class Id>
void store_known(const std::vector<Contact>& found, Id id, std::vector<std::int64_t>& known)
{
    for (const Contact& c : found)
        known.push_back(id(c));
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
}

/// The rod's side of a contact, the only one so far.
BodyContact of_rod(const CurveContact& c, const RodBody& rod, const ContactPair& p, int pair,
                   BodyContacts& out)
{
    BodyContact k;
    if (!p.friction_of_segment.empty())
        k.friction = p.friction_of_segment[std::size_t(rod.segment_of(c.a))];
    k.pair = pair;
    k.id = c.id;
    k.a = p.a;
    k.b = p.b;
    k.frame = contact_frame(c.normal);
    k.gap = c.gap;
    k.point = c.point;
    k.a_begin = std::int32_t(out.stencil.size());
    out.stencil.push_back(rod.acting_place(c.a));
    k.a_end = k.b_begin = k.b_end = std::int32_t(out.stencil.size());
    return k;
}

} // namespace

void ContactFinder::rod_on_solid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const RodBody& rod = *bodies[std::size_t(p.a)].rod;
    const SolidBody& solid = *bodies[std::size_t(p.b)].solid;
    const Curve own = rod.curve();
    std::vector<CurveOnFaces> found;
    std::vector<std::int64_t>& known = sharp_[std::size_t(pair)];
    touch_faces(own, p.stations, {p.surface_b->outside, p.surface_b->sharp, solid.places()},
                solid.mesh().nodes, reach_, known, found);
    store_known(
        found, [](const CurveOnFaces& c) { return c.curve.id; }, known);
    for (const CurveOnFaces& c : found) {
        if (rod.in_sheath(c.curve.a)) continue; // which leads through the solid
        BodyContact k = of_rod(c.curve, rod, p, pair, out);
        k.area = c.area;
        out.stencil.insert(out.stencil.end(), c.node.begin(), c.node.begin() + c.nodes);
        k.b_end = std::int32_t(out.stencil.size());
        out.contact.push_back(k);
    }
}

void ContactFinder::rod_on_any(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    if (p.b >= 0 && bodies[std::size_t(p.b)].solid) return rod_on_solid(bodies, pair, out);
    const RodBody& rod = *bodies[std::size_t(p.a)].rod;
    const Curve own = rod.curve();
    std::vector<CurveContact> found;
    std::vector<std::int64_t>& known = sharp_[std::size_t(pair)];
    if (p.b < 0) {
        const Wall& wall = *walls_[std::size_t(p.obstacle)];
        const std::span<const CurvePlace> stations = touching_stations(rod, p);
        // The sheath leads through the wall: of the stations in it the last one ends at its end.
        std::size_t first = 0;
        while (first + 1 < stations.size() && rod.in_sheath(stations[first + 1]))
            ++first;
        touch_surface(
            own, stations,
            [&wall, hint = WallHint()](const Vec3& x) mutable { return wall.sample(x, hint); },
            std::min(reach_, rod.reach_of_iteration()), known, found, first,
            &seen_[std::size_t(pair)],
            [&wall, hint = WallHint()](const Vec3& x) mutable { return wall.clearance(x, hint); });
    } else if (const RigidBody* rigid = bodies[std::size_t(p.b)].rigid) {
        touch_surface(own, touching_stations(rod, p), distance_from(*rigid, rigid->placement()),
                      reach_, known, found);
    } else if (p.b == p.a) {
        touch_curve(own, rod.stations(), own, reach_, found);
    } else if (const RodBody* second = bodies[std::size_t(p.b)].rod; second->lies_in(rod)) {
        const Curve inner = second->curve();
        const std::vector<double> bore = rod.bore();
        touch_bore({own, inner, bore, rod.first_outside(), second->first_outside()}, rod.stations(),
                   reach_, found);
    } else {
        touch_curve(own, rod.stations(), second->curve(), reach_, found);
    }
    store_known(
        found, [](const CurveContact& c) { return c.id; }, known);
    // Held places do not move: a contact within round-off is left out, a deeper one is an overlap
    // that no force can prevent.
    const RodBody* other = p.b >= 0 ? bodies[std::size_t(p.b)].rod : nullptr;
    const bool still =
        p.b < 0 || (!other && bodies[std::size_t(p.b)].body->matrix().modes().cols() == 0);
    const auto stuck = [&](const CurveContact& c) {
        if (p.b < 0 && rod.in_sheath(c.a)) return true;
        return c.gap > -kShapeRounding * rod.size() && rod.holds(c.a, c.normal) &&
               (still || (other && other->holds(c.b, c.normal)));
    };
    for (const CurveContact& c : found) {
        if (stuck(c)) continue;
        BodyContact k = of_rod(c, rod, p, pair, out);
        k.curvature = c.curvature;
        k.slides_a = c.slides_a && !rod.in_sheath(c.a);
        k.slides_b = c.slides_b && !(other && other->in_sheath(c.b));
        if (c.b.piece >= 0) {
            out.stencil.push_back(other ? other->acting_place(c.b)
                                        : StencilEntry{c.b.piece, c.b.t});
            k.b_end = std::int32_t(out.stencil.size());
        }
        out.contact.push_back(k);
    }
}

void ContactFinder::sweep_rods(const std::vector<BodyRef>& bodies)
{
    const auto is_rod = [](const BodyRef& b) { return b.rod != nullptr; };
    if (std::none_of(bodies.begin(), bodies.end(), is_rod)) return;
    swept_.assign(bodies.size(), {});
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (const RodBody* rod = bodies[b].rod) {
            const AxisBox before = rod->box_before(), now = rod->box();
            swept_[b] = {before.low.cwiseMin(now.low), before.high.cwiseMax(now.high)};
        } else if (const RigidBody* rigid = bodies[b].rigid) {
            swept_[b] = swept_box(*rigid);
        } else if (const SolidBody* solid = bodies[b].solid) {
            BoundingBox box;
            for (const std::int32_t node : solid->touching()) {
                box.add(solid->places_before()[std::size_t(node)]);
                box.add(solid->places()[std::size_t(node)]);
            }
            swept_[b] = {box.low, box.high};
        }
}

bool ContactFinder::rod_passed(const std::vector<BodyRef>& bodies, const ContactPair& pair)
{
    const RodBody& rod = *bodies[std::size_t(pair.a)].rod;
    if (const RodBody* b = pair.b < 0 ? nullptr : bodies[std::size_t(pair.b)].rod;
        b && b->lies_in(rod))
        return false; // how deep it is in the bore's wall shows where it is
    const AxisBox& box = swept_[std::size_t(pair.a)]; // its ways are straight: within
    WallHint hint;
    if (pair.b >= 0) {
        const AxisBox& other = swept_[std::size_t(pair.b)];
        if ((box.low.array() > other.high.array()).any() ||
            (other.low.array() > box.high.array()).any())
            return false;
    } else if (walls_[std::size_t(pair.obstacle)]->distance(0.5 * (box.low + box.high), hint) >
               0.5 * (box.high - box.low).norm()) {
        return false;
    }
    const Curve before = rod.curve_before(), now = rod.curve();
    if (pair.b == pair.a) return pass_through(before, now, before, now);
    if (pair.b >= 0 && bodies[std::size_t(pair.b)].rod) {
        const RodBody& other = *bodies[std::size_t(pair.b)].rod;
        return pass_through(before, now, other.curve_before(), other.curve());
    }
    if (pair.b >= 0 && bodies[std::size_t(pair.b)].solid) {
        const SolidBody& solid = *bodies[std::size_t(pair.b)].solid;
        return pass_through_faces(before, now, solid.places_before(),
                                  {pair.surface_b->outside, pair.surface_b->sharp, solid.places()});
    }
    RodSweep sweep{before, now, {}, {}, {}};
    if (pair.b < 0) {
        const Wall& wall = *walls_[std::size_t(pair.obstacle)];
        sweep.distance = [&wall, hint](const Vec3& x, double enough) mutable {
            const double least = wall.clearance(x, hint);
            return least > enough ? least : wall.distance(x, hint);
        };
    } else {
        const RigidBody& rigid = *bodies[std::size_t(pair.b)].rigid;
        sweep.from = pose_of(rigid.start_placement());
        sweep.to = pose_of(rigid.placement());
        sweep.distance = [surface = distance_from(rigid, {})](const Vec3& x, double) {
            return surface(x).distance;
        };
    }
    if (!pair.end_a.empty()) return sweep.passes(touching_stations(rod, pair)[0], 0);
    for (std::size_t e = 0; e < now.pieces.size(); ++e)
        if (sweep.passes(int(e))) return true;
    return false;
}

} // namespace amontons
