#include "contact/rigid/polyhedron_pair.hpp"
#include "contact/rigid/turned_cylinder.hpp"
#include "mesh/base/index.hpp"
#include "mesh/base/limits.hpp"

#include <algorithm>
#include <cmath>

// Capsules against everything: a segment, the core, with a radius around it.
//
// Its ends touch as balls do. Between them the core crosses edges and rims where the way between is
// normal to both, and passes corners whose foot on it lies between its ends: closed forms, but a
// rim's, which is Newton's method. A core that lies along a face or another core within 30 degrees
// has the contacts of both its ends, not only of the nearer one.

namespace amontons {

NearestPlace nearest_on(const Capsule& capsule, const Vec3& x)
{
    const double z = std::clamp(x[2], -capsule.half_length, capsule.half_length);
    const Vec3 from{x[0], x[1], x[2] - z};
    const double distance = from.norm();
    NearestPlace near;
    near.normal = distance > 1e-12 * capsule.radius ? Vec3(from / distance) : Vec3(Vec3::UnitX());
    near.point = Vec3{0, 0, z} + capsule.radius * near.normal;
    near.distance = distance - capsule.radius;
    const bool end = std::abs(x[2]) > capsule.half_length;
    near.feature = static_cast<std::uint32_t>(
        end ? contact_id(Feature::whole, 0, Feature::vertex, x[2] < 0 ? 0 : 1)
            : contact_id(Feature::whole, 0, Feature::face, 2));
    return near;
}

namespace {

// A capsule's core in the frame of the other body.
struct Core {
    Vec3 centre, axis;
    double half_length, radius;

    Core(const Capsule& own, const Mat3& turn, const Vec3& shift)
        : centre(shift)
        , axis(turn.col(2))
        , half_length(own.half_length)
        , radius(own.radius)
    {
    }
    double side(std::size_t end) const { return end == 0 ? -1 : 1; }
    Vec3 end(std::size_t end) const { return centre + side(end) * half_length * axis; }
    // The lowest of the core's points along n [m].
    double lowest(const Vec3& n) const
    {
        return n.dot(centre) - half_length * std::abs(n.dot(axis));
    }
    // Does an end stand higher than the other, along n, than a lying core's may?
    bool lifted(std::size_t end, const Vec3& n) const
    {
        return side(end) * n.dot(axis) > kInclined;
    }
};

// Conditions on contacts of convex bodies that overlap.
struct Way {
    double distance = -kInfinity; // of the core along the normal [m]
    Vec3 normal = Vec3::UnitZ();

    template <class Highest> void take(const Core& core, const Vec3& direction, Highest highest)
    {
        const double size = direction.norm();
        if (!(size > kParallel)) return;
        for (const double sign : {1.0, -1.0}) {
            const Vec3 n = sign / size * direction;
            const double d = core.lowest(n) - highest(n);
            if (d > distance) *this = {d, n};
        }
    }
};

// Contacts of the ends, as of balls, with the rest of the other body's id.
template <class Shape>
void touch_ends(const PairFrame& pair, const Core& core, const Shape& b, RigidContacts& out)
{
    const Ball ball{core.radius};
    for (std::size_t end = 0; end < 2; ++end) {
        PairFrame own = pair;
        own.shift = core.end(end);
        const std::size_t begin = out.size();
        touch(own, ball, b, out);
        std::size_t kept = begin;
        for (std::size_t i = begin; i < out.size(); ++i) {
            if (core.lifted(end, out[i].normal)) continue;
            out[i].id =
                (out[i].id & 0xffffffff) | contact_id(Feature::vertex, end, Feature::whole, 0);
            out[kept++] = out[i];
        }
        out.resize(kept);
    }
}

// Drops contacts whose normal is not that of the least overlap, where convex bodies overlap or
// touch.
void keep_agreeing(const Way& way, const Core& core, double size, std::size_t begin,
                   RigidContacts& out)
{
    if (way.distance - core.radius > kTouching * size) return;
    std::size_t kept = begin;
    for (std::size_t i = begin; i < out.size(); ++i)
        if (out[i].normal.dot(way.normal) > 0.5) out[kept++] = out[i];
    out.resize(kept);
    if (kept > begin) return;
    // Deep inside each other: the lowest place of the capsule alone.
    const double slope = way.normal.dot(core.axis), gap = way.distance - core.radius;
    Vec3 x = core.centre - core.radius * way.normal;
    if (std::abs(slope) > kSamePlace) x -= (slope > 0 ? 1 : -1) * core.half_length * core.axis;
    out.push_back({x, x - gap * way.normal, way.normal, gap,
                   contact_id(Feature::whole, 0, Feature::whole, 0)});
}

void touch_polyhedron(const PairFrame& pair, const Core& core, const PolyhedronSide& side,
                      bool convex, const Way& way, RigidContacts& out)
{
    const PolyhedronView& b = side.view;
    const double slack = kSamePlace * pair.size;
    const double far = core.half_length + core.radius + pair.reach;
    // Is a core that passes behind an edge not inside the body there, or not this deep?
    const auto beyond = [&](double depth, const Vec3& x) {
        return depth < 0 && (convex ? way.distance > 0 : signed_distance(side, x) > depth / 4);
    };
    for (std::size_t i = 0; i < b.edges.size(); ++i) {
        const auto& ends = b.topology->edges[i];
        const PolyhedronEdge& edge = b.edges[i];
        if (!ends.convex) continue;
        const Vec3& from = b.vertices[at(ends.vertex[0])];
        const Vec3 middle = from + edge.length / 2 * edge.along;
        if ((middle - core.centre).norm() > far + edge.length / 2) continue;
        const Vec3 cross = core.axis.cross(edge.along);
        const double sine = cross.norm();
        if (sine <= kParallel) continue;
        const Vec3 w = from - core.centre;
        const double s = w.cross(edge.along).dot(cross) / (sine * sine);
        const double t = w.cross(core.axis).dot(cross) / (sine * sine);
        if (std::abs(s) >= core.half_length || t < -slack || t > edge.length + slack) continue;
        const Vec3 &n0 = b.normals[at(ends.face[0])], &n1 = b.normals[at(ends.face[1])];
        const Vec3 n = cross / (cross.dot(n0 + n1) < 0 ? -sine : sine);
        // A core that lies on a face crosses its outline twice, at any inclination.
        const double tilt = n0.dot(n1) < kOpposed ? kInclined : kStrict;
        if (n.dot(edge.into[0]) > tilt || n.dot(edge.into[1]) > tilt) continue;
        const double gap = -n.dot(w) - core.radius;
        if (!(gap <= pair.reach)) continue;
        const Vec3 x = core.centre + s * core.axis;
        if (beyond(-n.dot(w), x)) continue;
        out.push_back({x - core.radius * n, from + t * edge.along, n, gap,
                       contact_id(Feature::face, 2, Feature::edge, i)});
    }
    for (std::size_t v = 0; v < b.vertices.size(); ++v) {
        const Vec3& y = b.vertices[v];
        const double s = core.axis.dot(y - core.centre);
        if (std::abs(s) >= core.half_length) continue;
        const Vec3 w = core.centre + s * core.axis - y;
        const double distance = w.norm(), gap = distance - core.radius;
        if (!(gap <= pair.reach) || distance < kTouching * core.radius) continue;
        const Vec3 n = w / distance;
        if (!rises(b, number(v), -n, kStrict, core.axis)) continue;
        out.push_back({y + gap * n, y, n, gap, contact_id(Feature::face, 2, Feature::vertex, v)});
    }
}

Way way_out(const Core& core, const PolyhedronView& b)
{
    Way way;
    for (std::size_t f = 0; f < b.normals.size(); ++f)
        if (const double d = core.lowest(b.normals[f]) - b.offsets[f]; d > way.distance)
            way = {d, b.normals[f]};
    const auto highest = [&](const Vec3& n) {
        double high = -kInfinity;
        for (const Vec3& v : b.vertices)
            high = std::max(high, n.dot(v));
        return high;
    };
    for (const PolyhedronEdge& edge : b.edges)
        way.take(core, core.axis.cross(edge.along), highest);
    // Where the cores are apart: towards what is nearest.
    for (const Vec3& v : b.vertices) {
        const double s =
            std::clamp(core.axis.dot(v - core.centre), -core.half_length, core.half_length);
        way.take(core, core.centre + s * core.axis - v, highest);
    }
    for (const PolyhedronEdge& edge : b.edges)
        for (std::size_t end = 0; end < 2; ++end) {
            const std::size_t i = std::size_t(&edge - b.edges.data());
            const Vec3 w = core.end(end) - b.vertices[at(b.topology->edges[i].vertex[0])];
            way.take(core, w - w.dot(edge.along) * edge.along, highest);
        }
    return way;
}

} // namespace

void touch(const PairFrame& pair, const Ball& a, const Capsule& b, RigidContacts& out)
{
    const NearestPlace near = nearest_on(b, pair.shift);
    const double gap = near.distance - a.radius;
    if (gap > pair.reach) return;
    out.push_back({pair.shift - a.radius * near.normal, near.point, near.normal, gap,
                   contact_id(Feature::whole, 0, Feature::whole, 0) | near.feature});
}

void touch(const PairFrame& pair, const Capsule& a, const Plane& b, RigidContacts& out)
{
    touch_ends(pair, Core(a, pair.turn, pair.shift), b, out);
}

void touch(const PairFrame& pair, const Capsule& a, const Box& b, RigidContacts& out)
{
    const BoxPolyhedron own(b.half_extents);
    const PolyhedronSide side{own.view(), nullptr, &b, Mat3::Identity(), Vec3::Zero()};
    const Core core(a, pair.turn, pair.shift);
    const Way way = way_out(core, side.view);
    if (way.distance - core.radius > pair.reach) return;
    const std::size_t begin = out.size();
    touch_ends(pair, core, b, out);
    touch_polyhedron(pair, core, side, true, way, out);
    keep_agreeing(way, core, pair.size, begin, out);
}

void touch(const PairFrame& pair, const Capsule& a, const TriangleShape& b, RigidContacts& out)
{
    const PolyhedronTopology topology = b.polyhedron.topology();
    const PolyhedronSide side{b.polyhedron.view(topology), &b, nullptr, Mat3::Identity(),
                              Vec3::Zero()};
    const Core core(a, pair.turn, pair.shift);
    std::vector<std::int32_t> near;
    b.tree.within(core.centre, core.half_length + core.radius + pair.reach, near);
    const bool convex = convex_and_small(b.polyhedron);
    if (near.empty() && nearest_on(b, core.centre).distance > 0) return;
    Way way;
    if (convex) way = way_out(core, side.view);
    if (convex && way.distance - core.radius > pair.reach) return;
    const std::size_t begin = out.size();
    touch_ends(pair, core, b, out);
    touch_polyhedron(pair, core, side, convex, way, out);
    if (convex) keep_agreeing(way, core, pair.size, begin, out);
}

void touch(const PairFrame& pair, const Capsule& a, const Cylinder& b, RigidContacts& out)
{
    const Core core(a, pair.turn, pair.shift);
    const TurnedCylinder other(b, Mat3::Identity(), Vec3::Zero());
    const auto highest = [&](const Vec3& n) { return other.highest(n); };
    Way way;
    way.take(core, other.axis, highest);
    way.take(core, core.axis.cross(other.axis), highest);
    for (std::size_t end = 0; end < 2; ++end) {
        way.take(core, nearest_on(b, core.end(end)).normal, highest);
        way.take(core, other.across(core.end(end)), highest);
    }
    const std::size_t begin = out.size();
    touch_ends(pair, core, b, out);
    // Side on side.
    const Vec3 cross = core.axis.cross(other.axis), w = other.centre - core.centre;
    const double square = cross.squaredNorm();
    if (square > kParallel * kParallel) {
        const double s = w.cross(other.axis).dot(cross) / square,
                     t = w.cross(core.axis).dot(cross) / square;
        const double height = -w.dot(cross) / std::sqrt(square);
        const Vec3 n = cross / (height < 0 ? -std::sqrt(square) : std::sqrt(square));
        const double gap = std::abs(height) - core.radius - other.radius;
        if (std::abs(s) < core.half_length && std::abs(t) <= other.half_length && gap <= pair.reach)
            out.push_back({core.centre + s * core.axis - core.radius * n,
                           other.centre + t * other.axis + other.radius * n, n, gap,
                           contact_id(Feature::face, 2, Feature::face, 2)});
    }
    // The core over a rim.
    for (std::size_t end = 0; end < 2; ++end) {
        const Vec3 m = other.side(end) * other.axis;
        double starts[2];
        const int count = crossing_starts(other, core.centre, core.axis, starts);
        for (int k = 0; k < count; ++k) {
            const auto c = rim_crossing(other, end, core.centre, core.axis, starts[k]);
            if (!c || std::abs(c->t) >= core.half_length) continue;
            const Vec3 radial = (c->on_rim - other.end_centre(end)) / other.radius;
            const Vec3 up = c->on_line - c->on_rim;
            const bool inside = up.dot(m + radial) < 0;
            // Past the far side of the end, where the core is not in the cylinder.
            if (inside && nearest_on(b, c->on_line).distance > 0) continue;
            const double distance = inside ? -up.norm() : up.norm();
            if (std::abs(distance) < kTouching * pair.size) continue;
            const Vec3 n = up / distance;
            if (n.dot(m) < -kStrict) continue;
            if (n.dot(radial) < -(n.dot(m) > kOpposed ? kInclined : kStrict)) continue;
            const double gap = distance - core.radius;
            if (gap > pair.reach) continue;
            if (gap > 0) way.take(core, n, highest);
            out.push_back({c->on_line - core.radius * n, c->on_rim, n, gap,
                           contact_id(Feature::face, 2, Feature::rim,
                                      2 * end + static_cast<std::size_t>(k) + 32)});
        }
    }
    if (out.size() > begin || way.distance - core.radius < -kTouching * pair.size)
        keep_agreeing(way, core, pair.size, begin, out);
}

void touch(const PairFrame& pair, const Capsule& own_a, const Capsule& own_b, RigidContacts& out)
{
    const Core a(own_a, pair.turn, pair.shift), b(own_b, Mat3::Identity(), Vec3::Zero());
    struct Place {
        double on_a = 0, on_b = 0, distance = kInfinity;
    };
    const auto id_of = [](const Core& core, double s) {
        return std::abs(s) < core.half_length
                   ? std::pair(Feature::face, std::size_t(2))
                   : std::pair(Feature::vertex, std::size_t(s < 0 ? 0 : 1));
    };
    const auto place = [&](double s, double t) {
        return Place{s, t, (a.centre + s * a.axis - b.centre - t * b.axis).norm()};
    };
    const std::size_t begin = out.size();
    const auto add = [&](const Place& p) {
        const double gap = p.distance - a.radius - b.radius;
        if (!(gap <= pair.reach)) return;
        const Vec3 x = a.centre + p.on_a * a.axis, y = b.centre + p.on_b * b.axis;
        // Cores that cross may part along their common normal.
        Vec3 n = x - y;
        if (p.distance > 1e-12 * pair.size) {
            n /= p.distance;
        } else {
            n = a.axis.cross(b.axis);
            n = n.norm() > kParallel ? Vec3(n.normalized()) : Vec3(a.axis.unitOrthogonal());
        }
        const auto [kind_a, i] = id_of(a, p.on_a);
        const auto [kind_b, j] = id_of(b, p.on_b);
        const std::uint64_t id = contact_id(kind_a, i, kind_b, j);
        for (std::size_t k = begin; k < out.size(); ++k)
            if (out[k].id == id) return;
        out.push_back({x - a.radius * n, y + b.radius * n, n, gap, id});
    };
    Place nearest;
    const auto consider = [&](const Place& p) {
        if (p.distance < nearest.distance) nearest = p;
    };
    const Vec3 cross = a.axis.cross(b.axis), w = b.centre - a.centre;
    const double square = cross.squaredNorm();
    if (square > kParallel * kParallel) {
        const double s = w.cross(b.axis).dot(cross) / square,
                     t = w.cross(a.axis).dot(cross) / square;
        if (std::abs(s) < a.half_length && std::abs(t) < b.half_length) consider(place(s, t));
    }
    Place ends[4];
    for (std::size_t end = 0; end < 2; ++end) {
        const double s = a.side(end) * a.half_length, t = b.side(end) * b.half_length;
        ends[end] =
            place(s, std::clamp(b.axis.dot(a.end(end) - b.centre), -b.half_length, b.half_length));
        ends[2 + end] =
            place(std::clamp(a.axis.dot(b.end(end) - a.centre), -a.half_length, a.half_length), t);
    }
    for (const Place& p : ends)
        consider(p);
    add(nearest);
    if (std::abs(a.axis.dot(b.axis)) < kOpposed) return;
    for (const Place& p : ends)
        if (std::abs(p.on_a) < a.half_length || std::abs(p.on_b) < b.half_length) add(p);
}

} // namespace amontons
