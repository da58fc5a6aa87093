#include "contact/rigid/extent.hpp"
#include "contact/rigid/pair_contacts.hpp"
#include "contact/rigid/spread.hpp"
#include "mesh/base/index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

// Balls against everything, and everything against a plane.

namespace amontons {

namespace {

std::uint32_t feature(Feature kind, std::size_t i)
{
    return static_cast<std::uint32_t>(contact_id(Feature::whole, 0, kind, i));
}

// A ball's contact with the place nearest to its centre.
void add_ball_contact(const PairFrame& pair, const Ball& a, const NearestPlace& b,
                      RigidContacts& out)
{
    const double gap = b.distance - a.radius;
    if (gap > pair.reach) return;
    out.push_back({pair.shift - a.radius * b.normal, b.point, b.normal, gap,
                   contact_id(Feature::whole, 0, Feature::whole, 0) | b.feature});
}

} // namespace

void touch(const PairFrame& pair, const Ball& a, const Ball& b, RigidContacts& out)
{
    const double distance = pair.shift.norm();
    const double gap = distance - a.radius - b.radius;
    if (gap > pair.reach) return;
    // Balls with one centre may part in any direction.
    const bool apart = distance > 1e-12 * pair.size;
    const Vec3 n = apart ? Vec3{pair.shift / distance} : Vec3{Vec3::UnitZ()};
    out.push_back({pair.shift - a.radius * n, b.radius * n, n, gap, 0});
}

NearestPlace nearest_on(const Box& box, const Vec3& x)
{
    const Vec3 q = x.cwiseMax(-box.half_extents).cwiseMin(box.half_extents);
    const double distance = (x - q).norm();
    NearestPlace near;
    if (distance > 1e-12 * box.half_extents.norm()) {
        // The number of the place: 0, 1, 2 for below, within, above along each axis.
        std::size_t which = 0;
        for (int k = 2; k >= 0; --k)
            which = 3 * which + (x[k] < q[k] ? 0u : x[k] > q[k] ? 2u : 1u);
        return {q, (x - q) / distance, distance, feature(Feature::face, which)};
    }
    Eigen::Index k = 0;
    const double depth = (box.half_extents - x.cwiseAbs()).minCoeff(&k);
    near.normal = signed_axis(static_cast<int>(k), x[k] >= 0);
    near.distance = -depth;
    near.point = x + depth * near.normal;
    constexpr std::size_t middle = 13, step[3] = {1, 3, 9};
    const std::size_t s = step[k];
    near.feature = feature(Feature::face, x[k] < 0 ? middle - s : middle + s);
    return near;
}

NearestPlace nearest_on(const Cylinder& cylinder, const Vec3& x)
{
    const double r = std::hypot(x[0], x[1]);
    // On the axis any direction serves.
    const Vec3 radial = r > 1e-12 * cylinder.radius ? Vec3{x[0] / r, x[1] / r, 0} : Vec3{1, 0, 0};
    const Vec3 end = signed_axis(2, x[2] >= 0);
    const std::size_t side = x[2] < 0 ? 0 : 1;
    const double beyond_side = r - cylinder.radius;
    const double beyond_end = std::abs(x[2]) - cylinder.half_length;
    if (beyond_side > 0 && beyond_end > 0) {
        const double distance = std::hypot(beyond_side, beyond_end);
        return {cylinder.radius * radial + cylinder.half_length * end,
                (beyond_side * radial + beyond_end * end) / distance, distance,
                feature(Feature::rim, side)};
    }
    if (beyond_side > beyond_end)
        return {cylinder.radius * radial + x[2] * Vec3::UnitZ(), radial, beyond_side,
                feature(Feature::face, 2)};
    return {Vec3{x[0], x[1], cylinder.half_length * end[2]}, end, beyond_end,
            feature(Feature::face, side)};
}

NearestPlace nearest_on(const TriangleShape& body, const Vec3& x, std::int32_t close,
                        std::int32_t* triangle)
{
    const Polyhedron& p = body.polyhedron;
    const NearestTriangle found = body.tree.nearest_within(x, close);
    const auto t = at(found.triangle);
    if (triangle) *triangle = found.triangle;
    const std::size_t part = static_cast<std::size_t>(found.at.feature);
    NearestPlace near;
    near.point = found.at.point;
    // The normal that distinguishes inside from outside.
    Vec3 outwards = p.triangle_normals[t];
    near.feature = feature(Feature::face, at(p.face_of[t]));
    if (part >= 4) {
        const auto v = at(body.mesh.triangles[t][part - 4]);
        outwards = p.point_normals[v];
        if (p.corner_of[v] >= 0) near.feature = feature(Feature::vertex, at(p.corner_of[v]));
    } else if (part >= 1) {
        const std::int32_t other = p.neighbours[t][part - 1], e = p.edge_of[t][part - 1];
        if (other >= 0) outwards = (outwards + p.triangle_normals[at(other)]).normalized();
        if (e >= 0) near.feature = feature(Feature::edge, at(e));
    }
    const Vec3 w = x - near.point;
    const double distance = std::sqrt(found.squared);
    const bool inside = w.dot(outwards) < 0;
    near.distance = inside ? -distance : distance;
    near.normal = distance > 1e-12 * p.size ? Vec3{w / near.distance} : outwards;
    return near;
}

void touch(const PairFrame& pair, const Ball& a, const Box& b, RigidContacts& out)
{
    add_ball_contact(pair, a, nearest_on(b, pair.shift), out);
}

void touch(const PairFrame& pair, const Ball& a, const Cylinder& b, RigidContacts& out)
{
    add_ball_contact(pair, a, nearest_on(b, pair.shift), out);
}

// Every place whose distance from the centre is a minimum along the surface: a ball in a groove
// or a corner of a room has several.
void touch(const PairFrame& pair, const Ball& a, const TriangleShape& b, RigidContacts& out)
{
    const Polyhedron& p = b.polyhedron;
    const Vec3& x = pair.shift;
    const NearestPlace nearest = nearest_on(b, x);
    if (nearest.distance - a.radius > pair.reach) return;
    // From inside, the way out is the shortest; so close to the surface no other place has a
    // direction.
    if (nearest.distance <= kTouching * pair.size || p.convex) {
        add_ball_contact(pair, a, nearest, out);
        return;
    }
    std::vector<std::int32_t> near;
    b.tree.within(x, (a.radius + pair.reach) * (1 + 1e-9), near);
    std::vector<std::pair<Feature, std::int32_t>> seen;
    const auto first = [&](Feature kind, std::int32_t i) {
        const std::pair<Feature, std::int32_t> one{kind, i};
        if (std::find(seen.begin(), seen.end(), one) != seen.end()) return false;
        seen.push_back(one);
        return true;
    };
    const auto place = [&](const Vec3& point, Feature kind, std::int32_t i) {
        const Vec3 w = x - point;
        const double distance = w.norm();
        if (first(kind, i))
            add_ball_contact(pair, a, {point, w / distance, distance, feature(kind, at(i))}, out);
    };
    // Of a face, the foot must lie on it; of an edge or corner, the faces around must fall away.
    constexpr double slack = 1e-9;
    const PolyhedronTopology topology = p.topology();
    std::sort(near.begin(), near.end());
    for (const std::int32_t t : near) {
        const auto& corner = b.mesh.triangles[at(t)];
        const TrianglePoint foot =
            closest_on_triangle(x, b.mesh.points[at(corner[0])], b.mesh.points[at(corner[1])],
                                b.mesh.points[at(corner[2])]);
        const std::int32_t f = p.face_of[at(t)];
        const Vec3& n = p.normals[at(f)];
        const double height = n.dot(x) - p.offsets[at(f)];
        // Compared by points: a foot on the line between two triangles of a face counts too.
        if (height > 0 && (x - height * n - foot.point).norm() <= slack * p.size)
            place(x - height * n, Feature::face, f);
        for (const std::int32_t e : p.edge_of[at(t)]) {
            if (e < 0) continue;
            const auto& ends = p.edge_ends[at(e)];
            const PolyhedronEdge& edge = p.edges[at(e)];
            if (!ends.convex) continue;
            const Vec3& origin = p.vertices[at(ends.vertex[0])];
            const double s = (x - origin).dot(edge.along);
            if (s <= 0 || s >= edge.length) continue;
            const Vec3 w = x - origin - s * edge.along;
            if (w.dot(edge.into[0]) > slack * p.size || w.dot(edge.into[1]) > slack * p.size)
                continue;
            place(origin + s * edge.along, Feature::edge, e);
        }
        for (const std::int32_t v : corner) {
            const std::int32_t c = p.corner_of[at(v)];
            if (c < 0) continue;
            const Vec3 w = x - b.mesh.points[at(v)];
            bool falls = true;
            for (std::int32_t i = topology.vertex_begin[at(c)];
                 i < topology.vertex_begin[at(c) + 1] && falls; ++i) {
                const std::int32_t e = topology.vertex_edges[at(i)];
                const double sign = p.edge_ends[at(e)].vertex[0] == c ? 1 : -1;
                falls = sign * p.edges[at(e)].along.dot(w) <= slack * p.size;
            }
            if (falls) place(b.mesh.points[at(v)], Feature::vertex, c);
        }
    }
    if (seen.empty()) add_ball_contact(pair, a, nearest, out);
}

// ---- on a plane

void touch(const PairFrame& pair, const Ball& a, const Plane&, RigidContacts& out)
{
    const Vec3& x = pair.shift;
    add_ball_contact(pair, a, {Vec3{x[0], x[1], 0}, Vec3::UnitZ(), x[2], 0}, out);
}

namespace {

constexpr std::size_t kFewOnPlane = 48; // vertices: a tree takes as long

// The vertices of a convex body up to a height, and possibly a few above it; ascending. From each
// of them edges descend to the lowest.
void vertices_below(const TriangleShape& body, const Vec3& up, double highest,
                    std::vector<std::int32_t>& vertices)
{
    constexpr double kAbove = 1e-6; // of the size: more than a convex body is off (kFlat)
    const Polyhedron& p = body.polyhedron;
    const double most = highest + kAbove * p.size;
    const std::int32_t lowest = lowest_vertex(body, up);
    vertices.clear();
    if (up.dot(p.vertices[at(lowest)]) > most) return;
    std::vector<char> reached(p.vertices.size(), 0);
    reached[at(lowest)] = 1;
    vertices.push_back(lowest);
    for (std::size_t k = 0; k < vertices.size(); ++k)
        for (std::int32_t i = p.vertex_begin[at(vertices[k])];
             i < p.vertex_begin[at(vertices[k]) + 1]; ++i)
            for (const std::int32_t v : p.edge_ends[at(p.vertex_edges[at(i)])].vertex)
                if (reached[at(v)] == 0) {
                    reached[at(v)] = 1;
                    if (up.dot(p.vertices[at(v)]) <= most) vertices.push_back(v);
                }
    std::sort(vertices.begin(), vertices.end());
}

// A point of a body above the plane z = 0.
void add_above(const PairFrame& pair, const Vec3& x, Feature kind, std::size_t i,
               RigidContacts& out)
{
    if (x[2] > pair.reach) return;
    out.push_back(
        {x, Vec3{x[0], x[1], 0}, Vec3::UnitZ(), x[2], contact_id(kind, i, Feature::whole, 0)});
}

} // namespace

void touch(const PairFrame& pair, const Box& a, const Plane&, RigidContacts& out)
{
    const Vec3& h = a.half_extents;
    if (a.spread > 0) {
        Eigen::Index k = 0;
        const double fall = pair.turn.row(2).cwiseAbs().maxCoeff(&k);
        if (std::sqrt(std::max(0.0, 1 - fall * fall)) < kFlatOn) {
            const int face = 2 * static_cast<int>(k) + (pair.turn(2, k) < 0 ? 1 : 0);
            spread_over(a, face, [&](const Vec3& x, std::size_t i) {
                add_above(pair, pair.turn * x + pair.shift, Feature::spread, i, out);
            });
            return;
        }
    }
    for (std::size_t v = 0; v < 8; ++v) {
        const Vec3 corner{(v & 1) != 0 ? h[0] : -h[0], (v & 2) != 0 ? h[1] : -h[1],
                          (v & 4) != 0 ? h[2] : -h[2]};
        add_above(pair, pair.turn * corner + pair.shift, Feature::vertex, v, out);
    }
}

void touch(const PairFrame& pair, const TriangleShape& a, const Plane&, RigidContacts& out)
{
    const Vec3 up = pair.turn.row(2);
    const double highest = pair.reach - pair.shift[2] + kSamePlace * pair.size;
    std::vector<std::int32_t> near;
    if (a.polyhedron.convex && a.polyhedron.vertices.size() > kFewOnPlane)
        vertices_below(a, up, highest, near);
    else
        vertices_where(
            a, [&](const BoundingBox& box) { return lowest_along(box, up) <= highest; }, near);
    for (const std::int32_t v : near)
        add_above(pair, pair.turn * a.polyhedron.vertices[at(v)] + pair.shift, Feature::vertex,
                  at(v), out);
}

} // namespace amontons
