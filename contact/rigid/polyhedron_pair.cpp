#include "contact/rigid/polyhedron_pair.hpp"

#include "mesh/base/index.hpp"

#include <algorithm>
#include <cmath>

// Which pairs of features make a contact.
//
// Between convex bodies that are apart there is one nearest pair of features. A solver needs more:
// all places of a face that will touch next. A contact is valid as long as what it forbids is
// truly forbidden, and that holds for
//   vertex, face     the vertex over the face: its distance from the other body is the height;
//   edge, edge       both convex, crossing seen along a normal that both bodies lie behind;
//   vertex, edge     the vertex in the region whose nearest place is the edge, and
//   vertex, vertex   the same, both only where the body at the vertex lies behind it: a corner
//                    that hangs over the rim of a table must not block its sliding back on.
// Edges around opposed faces (kOpposed) cross too where the outlines overlap, although there one
// body rises a little over the plane through the crossing: without them a face that is inclined
// very little would rest on one point.

namespace amontons {

namespace {

// Is x near an edge of the face's outline that is not convex?
bool in_hollow(const PolyhedronView& body, std::int32_t face, const Vec3& x, double near)
{
    const PolyhedronTopology& topology = *body.topology;
    for (std::int32_t i = topology.face_begin[at(face)]; i < topology.face_begin[at(face) + 1];
         ++i) {
        const auto e = at(topology.face_edges[at(i)]);
        if (topology.edges[e].convex) continue;
        const Vec3 from = x - body.vertex(topology.edges[e].vertex[0]),
                   along = body.along(number(e));
        const double s = std::clamp(from.dot(along), 0.0, body.edges[e].length);
        if ((from - s * along).squaredNorm() <= near * near) return true;
    }
    return false;
}

// The interval of angles about a convex edge in which normals point away from its body.
struct Fan {
    Vec3 middle, across; // unit; angle 0 and 90 degrees
    double half = 0;     // [rad]
};

Fan fan_of(const PolyhedronView& body, std::int32_t edge)
{
    const auto& ends = body.topology->edges[at(edge)];
    const Vec3 n0 = body.normal(ends.face[0]), n1 = body.normal(ends.face[1]);
    Fan fan;
    fan.middle = (n0 + n1).normalized();
    fan.across = body.along(edge).cross(fan.middle);
    fan.half = std::acos(std::clamp(fan.middle.dot(n0), -1.0, 1.0));
    return fan;
}

// A corner and an edge at the same place have no direction between them. If an edge of the
// corner runs along this edge, the normal comes from the interval that suits the faces of both:
// its middle where they touch, the true direction as they part.
std::optional<Vec3> touching_normal(const PolyhedronPair& pair, const PolyhedronView& x,
                                    std::int32_t vertex, const PolyhedronView& y, std::int32_t edge,
                                    const Vec3& w)
{
    const PolyhedronTopology& topology = *x.topology;
    const Fan fan = fan_of(y, edge);
    for (std::int32_t i = topology.vertex_begin[at(vertex)];
         i < topology.vertex_begin[at(vertex) + 1]; ++i) {
        const std::int32_t e = topology.vertex_edges[at(i)];
        const auto& ends = topology.edges[at(e)];
        if (!ends.convex || std::abs(x.along(e).dot(y.along(edge))) < kOpposed) continue;
        double low = -fan.half, high = fan.half;
        double angle[2];
        for (std::size_t k = 0; k < 2; ++k) {
            const Vec3 n = -x.normal(ends.face[k]);
            angle[k] = std::atan2(n.dot(fan.across), n.dot(fan.middle));
        }
        low = std::max(low, std::min(angle[0], angle[1]));
        high = std::min(high, std::max(angle[0], angle[1]));
        // No room: a side is along a face of the other body, and the contact is one of these faces.
        if (high - low < 1e-3 || std::abs(angle[0] - angle[1]) >= 3.1415) continue;
        const double middle = (low + high) / 2;
        const auto direction = [&](double t) -> Vec3 {
            return std::cos(t) * fan.middle + std::sin(t) * fan.across;
        };
        const double apart =
            std::clamp(w.dot(direction(middle)) / (kTouching * pair.size), 0.0, 1.0);
        if (apart == 0) return direction(middle);
        const double true_angle =
            std::clamp(std::atan2(w.dot(fan.across), w.dot(fan.middle)), low, high);
        return direction(middle + apart * (true_angle - middle));
    }
    return {};
}

void add_contact_of_pair(const PolyhedronPair& pair, bool on_a, const Vec3& x, const Vec3& y,
                         const Vec3& n, double gap, std::uint64_t id_if_on_a,
                         std::uint64_t id_if_on_b)
{
    if (on_a)
        pair.out->push_back({x, y, n, gap, id_if_on_a});
    else
        pair.out->push_back({y, x, -n, gap, id_if_on_b});
}

} // namespace

bool rises(const PolyhedronView& body, std::int32_t vertex, const Vec3& n, double overhang,
           const Vec3& free)
{
    const PolyhedronTopology& topology = *body.topology;
    for (std::int32_t i = topology.vertex_begin[at(vertex)];
         i < topology.vertex_begin[at(vertex) + 1]; ++i) {
        const std::int32_t e = topology.vertex_edges[at(i)];
        const Vec3 along = body.along(e);
        const double rise =
            topology.edges[at(e)].vertex[0] == vertex ? along.dot(n) : -along.dot(n);
        if (rise < -overhang && std::abs(along.dot(free)) < kOpposed) return false;
    }
    return true;
}

bool on_face(const PolyhedronSide& side, std::int32_t face, const Vec3& x, double slack)
{
    const PolyhedronTopology& topology = *side.view.topology;
    if (topology.face_convex[at(face)] != 0) {
        for (std::int32_t i = topology.face_begin[at(face)]; i < topology.face_begin[at(face) + 1];
             ++i) {
            const std::int32_t e = topology.face_edges[at(i)];
            const auto& ends = topology.edges[at(e)];
            const Vec3 into = side.view.into(e, ends.face[0] == face ? 0 : 1);
            if ((x - side.view.vertex(ends.vertex[0])).dot(into) < -slack) return false;
        }
        return true;
    }
    const Vec3 y = side.own(x);
    for (std::int32_t t = topology.triangle_begin[at(face)];
         t < topology.triangle_begin[at(face) + 1]; ++t) {
        const auto& [a, b, c] = side.view.triangles[at(t)];
        const Vec3 foot = closest_on_triangle(y, a, b, c).point;
        // The face is flat to kFlat only.
        if ((foot - y).norm() <= slack + 2 * kFlat * side.mesh->polyhedron.size) return true;
    }
    return false;
}

TurnedPolyhedron::TurnedPolyhedron(const PolyhedronView& own, const Mat3& turn, const Vec3& shift)
    : own_(own)
    , vertices_(own.vertices.size())
    , normals_(own.normals.size())
    , offsets_(own.normals.size())
    , edges_(own.edges.size())
{
    for (std::size_t i = 0; i < own.vertices.size(); ++i)
        vertices_[i] = turn * own.vertices[i] + shift;
    for (std::size_t i = 0; i < own.normals.size(); ++i) {
        normals_[i] = turn * own.normals[i];
        offsets_[i] = own.offsets[i] + normals_[i].dot(shift);
    }
    for (std::size_t i = 0; i < own.edges.size(); ++i)
        edges_[i] = {turn * own.edges[i].along,
                     {turn * own.edges[i].into[0], turn * own.edges[i].into[1]},
                     own.edges[i].length};
}

PolyhedronView TurnedPolyhedron::view()
{
    return {own_.topology, vertices_.all(), normals_.all(), offsets_.all(),
            edges_.all(),  own_.triangles,  nullptr,        nullptr};
}

std::optional<double> height_over_face(const PolyhedronPair& pair, bool on_a, std::int32_t vertex,
                                       std::int32_t face, double beyond)
{
    const PolyhedronSide &x = on_a ? pair.a : pair.b, &y = on_a ? pair.b : pair.a;
    const Vec3 n = y.view.normal(face), place = x.view.vertex(vertex);
    const double height = n.dot(place) - y.view.offset(face);
    if (height > pair.reach || height < pair.least || !pair.agrees(on_a ? n : Vec3{-n})) return {};
    if (!rises(x.view, vertex, n, kInclined)) return {};
    const Vec3 foot = place - height * n;
    if (!on_face(y, face, foot, kSamePlace * pair.size) &&
        !(beyond > 0 && in_hollow(y.view, face, foot, beyond)))
        return {};
    return height;
}

void add_vertex_face(const PolyhedronPair& pair, bool on_a, std::int32_t vertex, std::int32_t face,
                     double height)
{
    const PolyhedronSide &x = on_a ? pair.a : pair.b, &y = on_a ? pair.b : pair.a;
    const Vec3 n = y.view.normal(face), place = x.view.vertex(vertex);
    add_contact_of_pair(pair, on_a, place, place - height * n, n, height,
                        contact_id(Feature::vertex, at(vertex), Feature::face, at(face)),
                        contact_id(Feature::face, at(face), Feature::vertex, at(vertex)));
}

std::optional<Vec3> crossing_normal(const EdgeWithFaces& a, const EdgeWithFaces& b)
{
    const Vec3 &along_a = a.edge.along, &along_b = b.edge.along;
    // On the sphere of directions the arcs of outward normals of the one edge and of inward
    // normals of the other must cross: the ends of each lie on both sides of the other's circle.
    const Vec3 &b0 = b.normal_0, &b1 = b.normal_1;
    const double p = b0.dot(along_a), q = b1.dot(along_a);
    if ((p > kStrict && q > kStrict) || (p < -kStrict && q < -kStrict)) return {};
    const Vec3 &a0 = a.normal_0, &a1 = a.normal_1;
    const double r = a0.dot(along_b), s = a1.dot(along_b);
    if ((r > kStrict && s > kStrict) || (r < -kStrict && s < -kStrict)) return {};
    Vec3 n = along_a.cross(along_b);
    const double sine = n.norm();
    if (sine < kParallel) return {};
    n /= n.dot(b0 + b1) < 0 ? -sine : sine;
    if (n.dot(b.edge.into[0]) > kStrict || n.dot(b.edge.into[1]) > kStrict) return {};
    if (n.dot(a.edge.into[0]) < -kStrict || n.dot(a.edge.into[1]) < -kStrict) return {};
    if (n.dot(a0 + a1) > 0) return {};
    return n;
}

std::optional<Vec3> crossing_normal(const PolyhedronPair& pair, std::int32_t edge_a,
                                    std::int32_t edge_b)
{
    const auto edge_of = [](const PolyhedronView& view, std::int32_t e) {
        return PolyhedronEdge{view.along(e), {view.into(e, 0), view.into(e, 1)}, view.length(e)};
    };
    const PolyhedronView &a = pair.a.view, &b = pair.b.view;
    const PolyhedronEdge own = edge_of(a, edge_a), other = edge_of(b, edge_b);
    const auto &faces_a = a.topology->edges[at(edge_a)].face,
               &faces_b = b.topology->edges[at(edge_b)].face;
    const Vec3 a0 = a.normal(faces_a[0]), a1 = a.normal(faces_a[1]), b0 = b.normal(faces_b[0]),
               b1 = b.normal(faces_b[1]);
    return crossing_normal({own, a0, a1}, {other, b0, b1});
}

void add_edge_edge(const PolyhedronPair& pair, std::int32_t edge_a, std::int32_t edge_b)
{
    const PolyhedronView &va = pair.a.view, &vb = pair.b.view;
    const auto &ends_a = va.topology->edges[at(edge_a)], &ends_b = vb.topology->edges[at(edge_b)];
    if (!ends_a.convex || !ends_b.convex) return;
    const Vec3 along_a = va.along(edge_a), along_b = vb.along(edge_b);
    const Vec3 from_a = va.vertex(ends_a.vertex[0]), from_b = vb.vertex(ends_b.vertex[0]);
    const Vec3 w = from_b - from_a;
    const Vec3 cross = along_a.cross(along_b);
    const double sine = cross.norm();
    if (sine < kParallel) return;
    // Whichever way their normal points: most pairs cross far away or beyond an end.
    const Vec3 either = cross / sine;
    const double determinant = either.dot(cross);
    const double s = either.dot(w.cross(along_b)) / determinant;
    const double t = either.dot(w.cross(along_a)) / determinant;
    const double slack = kSamePlace * pair.size;
    if (s < -slack || s > va.length(edge_a) + slack || t < -slack || t > vb.length(edge_b) + slack)
        return;
    const Vec3 x = from_a + s * along_a, y = from_b + t * along_b;
    const double apart = std::abs(either.dot(x - y));
    const bool too_deep = -apart < pair.least ||
                          (!pair.convex && apart > kTouching * pair.size && apart > pair.deepest);
    if (apart > pair.reach && too_deep) return;
    std::optional<Vec3> normal = crossing_normal(pair, edge_a, edge_b);
    if (!normal) {
        // Outlines of opposed faces.
        const Vec3& n = either;
        double best = kOpposed;
        for (const std::int32_t f : ends_a.face)
            for (const std::int32_t g : ends_b.face) {
                const Vec3 na = va.normal(f), nb = vb.normal(g);
                if (na.dot(nb) > -kOpposed) continue;
                // Edges that are more parallel than the faces cross at a normal of their own,
                // and the place of the crossing is undetermined.
                const Vec3 middle = (nb - na).normalized();
                const double along = n.dot(middle);
                if (std::abs(along) < best) continue;
                if (n.cross(middle).norm() > 2 * (na + nb).norm() + kStrict) continue;
                best = std::abs(along);
                normal = along < 0 ? Vec3{-n} : n;
            }
        if (!normal) return;
    }
    const Vec3& n = *normal;
    if (!pair.agrees(n)) return;
    const double gap = n.dot(x - y);
    if (gap > pair.reach || gap < pair.least) return;
    // Deep inside bodies that are not convex, edges of far sides cross as well.
    if (!pair.convex && gap < -kTouching * pair.size) {
        if (gap < -pair.deepest) return;
        if (std::max(signed_distance(pair.b, x), signed_distance(pair.a, y)) > gap / 4) return;
    }
    pair.out->push_back(
        {x, y, n, gap, contact_id(Feature::edge, at(edge_a), Feature::edge, at(edge_b))});
}

void add_vertex_edge(const PolyhedronPair& pair, bool on_a, std::int32_t vertex, std::int32_t edge)
{
    const PolyhedronSide &x = on_a ? pair.a : pair.b, &y = on_a ? pair.b : pair.a;
    const auto& ends = y.view.topology->edges[at(edge)];
    const Vec3 along = y.view.along(edge), place = x.view.vertex(vertex);
    const Vec3 from = place - y.view.vertex(ends.vertex[0]);
    const double s = from.dot(along);
    const double slack = kSamePlace * pair.size;
    if (s < -slack || s > y.view.length(edge) + slack) return;
    const Vec3 w = from - s * along;
    const double square = w.squaredNorm();
    if (square > pair.reach * pair.reach && square > kTouching * kTouching * pair.size * pair.size)
        return;
    if (!ends.convex) return;
    const double distance = std::sqrt(square);
    if (distance < kTouching * pair.size) {
        const std::optional<Vec3> n = touching_normal(pair, x.view, vertex, y.view, edge, w);
        if (!n || !pair.agrees(on_a ? *n : Vec3{-*n}) || n->dot(w) > pair.reach) return;
        add_contact_of_pair(pair, on_a, place, place - w, *n, n->dot(w),
                            contact_id(Feature::corner, at(vertex), Feature::edge, at(edge)),
                            contact_id(Feature::edge, at(edge), Feature::corner, at(vertex)));
        return;
    }
    if (w.dot(y.view.into(edge, 0)) > slack || w.dot(y.view.into(edge, 1)) > slack) return;
    const Vec3 n = w / distance;
    if (!pair.agrees(on_a ? n : Vec3{-n})) return;
    // Edges of the vertex that run along this edge may incline either way: they will touch both
    // ends.
    if (!rises(x.view, vertex, n, kStrict, along)) return;
    add_contact_of_pair(pair, on_a, place, place - w, n, distance,
                        contact_id(Feature::vertex, at(vertex), Feature::edge, at(edge)),
                        contact_id(Feature::edge, at(edge), Feature::vertex, at(vertex)));
}

void add_vertex_vertex(const PolyhedronPair& pair, std::int32_t vertex_a, std::int32_t vertex_b)
{
    const Vec3 x = pair.a.view.vertex(vertex_a), y = pair.b.view.vertex(vertex_b);
    const Vec3 w = x - y;
    const double distance = w.norm();
    if (distance > pair.reach || distance < kTouching * pair.size) return;
    const Vec3 n = w / distance;
    if (!pair.agrees(n)) return;
    if (!rises(pair.a.view, vertex_a, n, kStrict) || !rises(pair.b.view, vertex_b, -n, kStrict))
        return;
    pair.out->push_back({x, y, n, distance,
                         contact_id(Feature::vertex, at(vertex_a), Feature::vertex, at(vertex_b))});
}

double signed_distance(const PolyhedronSide& side, const Vec3& x, std::int32_t* close)
{
    const Vec3 y = side.own(x);
    return side.mesh != nullptr ? nearest_on(*side.mesh, y, close ? *close : -1, close).distance
                                : nearest_on(*side.box, y).distance;
}

} // namespace amontons
