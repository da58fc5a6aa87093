#include "contact/rigid/polyhedron_pair.hpp"

#include "mesh/base/index.hpp"
#include "mesh/base/limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// Boxes and triangle bodies against each other: which features to compare.

namespace amontons {

namespace {

// ---- convex bodies

// How far two convex bodies are apart along the best direction, or how little they overlap.
// Source: separating axes of polyhedra; Gregorius 2013 (GDC), edges by arcs on the sphere.
struct Separation {
    double distance = -kInfinity; // [m]
    Vec3 normal = Vec3::UnitZ();  // from b into a
    std::int32_t face_a = -1, face_b = -1, edge_a = -1, edge_b = -1;
};

Separation polyhedron_separation(const PolyhedronPair& pair)
{
    const PolyhedronView &a = pair.a.view, &b = pair.b.view;
    Separation best;
    const auto faces = [&](const PolyhedronView& x, const PolyhedronView& y, bool on_b) {
        for (std::size_t f = 0; f < y.normals.size(); ++f) {
            double low = kInfinity;
            for (const Vec3& v : x.vertices)
                low = std::min(low, y.normals[f].dot(v));
            const double distance = low - y.offsets[f];
            // Of equals the first is taken, so that round-off does not choose.
            if (distance <= best.distance + kSamePlace * pair.size) continue;
            best = {distance, on_b ? y.normals[f] : Vec3{-y.normals[f]}, -1, -1, -1, -1};
            (on_b ? best.face_b : best.face_a) = number(f);
        }
    };
    faces(a, b, true);
    if (best.distance > pair.reach) return best;
    faces(b, a, false);
    if (best.distance > pair.reach) return best;
    for (std::size_t i = 0; i < a.edges.size(); ++i)
        for (std::size_t j = 0; j < b.edges.size(); ++j) {
            const std::optional<Vec3> n = crossing_normal(pair, number(i), number(j));
            if (!n) continue;
            const Vec3& x = a.vertices[at(a.topology->edges[i].vertex[0])];
            const Vec3& y = b.vertices[at(b.topology->edges[j].vertex[0])];
            const double distance = n->dot(x - y);
            if (distance > best.distance + kSamePlace * pair.size)
                best = {distance, *n, -1, -1, number(i), number(j)};
        }
    return best;
}

// Which features come within reach along the direction of separation: no others can touch.
struct Near {
    Buffer<char, 16> vertex;
    Buffer<char, 24> edge;
    Near(const PolyhedronView& body, const Vec3& n, double highest)
        : vertex(body.vertices.size())
        , edge(body.edges.size())
    {
        for (std::size_t v = 0; v < body.vertices.size(); ++v)
            vertex[v] = n.dot(body.vertices[v]) <= highest ? 1 : 0;
        for (std::size_t e = 0; e < body.edges.size(); ++e) {
            const auto& ends = body.topology->edges[e].vertex;
            edge[e] = vertex[at(ends[0])] != 0 || vertex[at(ends[1])] != 0 ? 1 : 0;
        }
    }
};

// The overlap of bodies that pierce each other so that no feature touches another: one contact at
// the features of least penetration.
void add_least_penetration(const PolyhedronPair& pair, const Separation& best)
{
    const PolyhedronView &a = pair.a.view, &b = pair.b.view;
    const Vec3& n = best.normal;
    if (best.edge_a >= 0) {
        const auto middle = [](const PolyhedronView& body, std::int32_t edge) -> Vec3 {
            const auto& ends = body.topology->edges[at(edge)].vertex;
            return (body.vertices[at(ends[0])] + body.vertices[at(ends[1])]) / 2;
        };
        const Vec3 x = (middle(a, best.edge_a) + middle(b, best.edge_b)) / 2;
        pair.out->push_back(
            {x + best.distance / 2 * n, x - best.distance / 2 * n, n, best.distance,
             contact_id(Feature::edge, at(best.edge_a), Feature::edge, at(best.edge_b))});
        return;
    }
    // The lowest corners, as one.
    const bool on_a = best.face_b >= 0;
    const PolyhedronView& x = on_a ? a : b;
    const Vec3 up = on_a ? n : Vec3{-n};
    double low = kInfinity;
    for (const Vec3& v : x.vertices)
        low = std::min(low, up.dot(v));
    Vec3 sum = Vec3::Zero();
    double count = 0;
    for (const Vec3& v : x.vertices)
        if (up.dot(v) <= low + kSamePlace * pair.size) {
            sum += v;
            ++count;
        }
    const Vec3 lowest = sum / count, foot = lowest - best.distance * up;
    if (on_a)
        pair.out->push_back({lowest, foot, n, best.distance,
                             contact_id(Feature::whole, 0, Feature::face, at(best.face_b))});
    else
        pair.out->push_back({foot, lowest, n, best.distance,
                             contact_id(Feature::face, at(best.face_a), Feature::whole, 0)});
}

void touch_convex(PolyhedronPair& pair)
{
    const Separation best = polyhedron_separation(pair);
    if (best.distance > pair.reach) return;
    const double slack = kTouching * pair.size;
    pair.convex = true;
    if (best.distance <= slack)
        pair.away = best.normal;
    else
        pair.least = -kSamePlace * pair.size;
    const PolyhedronView &a = pair.a.view, &b = pair.b.view;
    const Vec3& n = best.normal;
    double top_b = -kInfinity, low_a = kInfinity;
    for (const Vec3& v : b.vertices)
        top_b = std::max(top_b, n.dot(v));
    for (const Vec3& v : a.vertices)
        low_a = std::min(low_a, n.dot(v));
    Near near_a(a, n, top_b + pair.reach + slack), near_b(b, -n, -low_a + pair.reach + slack);

    const std::size_t begin = pair.out->size();
    const auto vertex_edges = [&](const PolyhedronView& x, Near& near_x, const PolyhedronView& y,
                                  Near& near_y, bool on_a) {
        for (std::size_t v = 0; v < x.vertices.size(); ++v)
            if (near_x.vertex[v] != 0)
                for (std::size_t e = 0; e < y.edges.size(); ++e)
                    if (near_y.edge[e] != 0) add_vertex_edge(pair, on_a, number(v), number(e));
    };
    const auto vertex_faces = [&](const PolyhedronView& x, Near& near_x, const PolyhedronView& y,
                                  bool on_a) {
        for (std::size_t f = 0; f < y.normals.size(); ++f) {
            for (std::size_t v = 0; v < x.vertices.size(); ++v)
                if (near_x.vertex[v] != 0)
                    if (const auto h = height_over_face(pair, on_a, number(v), number(f)))
                        add_vertex_face(pair, on_a, number(v), number(f), *h);
        }
    };
    // Corners on edges come first: they replace those with faces at the same place.
    if (best.distance > -slack) {
        vertex_edges(a, near_a, b, near_b, true);
        vertex_edges(b, near_b, a, near_a, false);
    }
    vertex_faces(a, near_a, b, true);
    vertex_faces(b, near_b, a, false);
    for (std::size_t i = 0; i < a.edges.size(); ++i)
        if (near_a.edge[i] != 0)
            for (std::size_t j = 0; j < b.edges.size(); ++j)
                if (near_b.edge[j] != 0) add_edge_edge(pair, number(i), number(j));
    if (best.distance > 0)
        for (std::size_t i = 0; i < a.vertices.size(); ++i)
            if (near_a.vertex[i] != 0)
                for (std::size_t j = 0; j < b.vertices.size(); ++j)
                    if (near_b.vertex[j] != 0) add_vertex_vertex(pair, number(i), number(j));
    if (pair.out->size() == begin && best.distance <= slack) add_least_penetration(pair, best);
}

// ---- others

// The features of a side near a place, each once a query.
class NearFeatures {
public:
    explicit NearFeatures(const PolyhedronSide& side) : side_(side)
    {
        const PolyhedronView& view = side.view;
        face_seen_.resize(view.normals.size(), 0);
        edge_seen_.resize(view.edges.size(), 0);
        vertex_seen_.resize(view.vertices.size(), 0);
        if (side.mesh != nullptr) return;
        for (std::size_t i = 0; i < view.normals.size(); ++i)
            faces.push_back(number(i));
        for (std::size_t i = 0; i < view.edges.size(); ++i)
            edges.push_back(number(i));
        for (std::size_t i = 0; i < view.vertices.size(); ++i)
            vertices.push_back(number(i));
    }

    // All that lie within the radius of x, and some others. A box always gives all it has.
    void find(const Vec3& x, double radius)
    {
        if (side_.mesh == nullptr) return;
        ++query_;
        faces.clear();
        edges.clear();
        vertices.clear();
        const Polyhedron& p = side_.mesh->polyhedron;
        side_.mesh->tree.within(side_.own(x), radius, triangles_);
        for (const std::int32_t t : triangles_) {
            see(p.face_of[at(t)], face_seen_, faces);
            for (const std::int32_t e : p.edge_of[at(t)])
                see(e, edge_seen_, edges);
            for (const std::int32_t v : side_.mesh->mesh.triangles[at(t)])
                see(p.corner_of[at(v)], vertex_seen_, vertices);
        }
        std::sort(faces.begin(), faces.end());
        std::sort(edges.begin(), edges.end());
        std::sort(vertices.begin(), vertices.end());
    }

    std::vector<std::int32_t> faces, edges, vertices;

private:
    void see(std::int32_t i, std::vector<std::int32_t>& seen, std::vector<std::int32_t>& list) const
    {
        if (i < 0 || seen[at(i)] == query_) return;
        seen[at(i)] = query_;
        list.push_back(i);
    }

    const PolyhedronSide& side_;
    std::vector<std::int32_t> face_seen_, edge_seen_, vertex_seen_, triangles_;
    std::int32_t query_ = 0;
};

AxisBox view_box(const PolyhedronView& view)
{
    AxisBox box{Vec3::Constant(kInfinity), Vec3::Constant(-kInfinity)};
    for (const Vec3& v : view.vertices) {
        box.low = box.low.cwiseMin(v);
        box.high = box.high.cwiseMax(v);
    }
    return box;
}

bool touch_in_hollow(const PolyhedronView& body, std::int32_t f, std::int32_t g)
{
    const PolyhedronTopology& topology = *body.topology;
    for (std::int32_t i = topology.face_begin[at(f)]; i < topology.face_begin[at(f) + 1]; ++i) {
        const auto& edge = topology.edges[at(topology.face_edges[at(i)])];
        if (!edge.convex && (edge.face[0] == g || edge.face[1] == g)) return true;
    }
    return false;
}

// Faces that a vertex is over, and of those that it is below the nearest one. In a hollow it may
// be below both faces, and beyond the edge between them.
void vertex_on_faces(const PolyhedronPair& pair, bool on_a, std::int32_t v, NearFeatures& features)
{
    const PolyhedronSide& x = on_a ? pair.a : pair.b;
    const PolyhedronSide& y = on_a ? pair.b : pair.a;
    const Vec3& place = x.view.vertices[at(v)];
    const double distance = signed_distance(y, place);
    if (distance > pair.reach) return;
    const double slack = kTouching * pair.size;
    // Deep inside, the nearest face may be one that the vertex cannot have crossed.
    const double depth = std::max(0.0, -distance);
    features.find(place, std::max(pair.reach, slack) + 3 * depth);
    std::vector<std::pair<double, std::int32_t>> below;
    for (const std::int32_t f : features.faces) {
        const std::optional<double> h = height_over_face(pair, on_a, v, f, 1.5 * depth);
        if (!h) continue;
        if (*h < -slack) {
            if (distance < 0) below.emplace_back(-*h, f);
        } else if (distance >= -slack || *h <= slack) {
            add_vertex_face(pair, on_a, v, f, *h);
        }
    }
    std::sort(below.begin(), below.end());
    for (std::size_t i = 0; i < below.size(); ++i)
        if (i == 0 || touch_in_hollow(y.view, below[0].second, below[i].second))
            add_vertex_face(pair, on_a, v, below[i].second, -below[i].first);
}

// Of bodies with more pairs of edges than this, edges overlap by no more than reach.
constexpr std::size_t kMany = 1'000'000;

void touch_any(PolyhedronPair& pair)
{
    const double slack = kTouching * pair.size, radius = std::max(pair.reach, slack);
    const std::size_t edges = pair.a.view.edges.size() * pair.b.view.edges.size();
    pair.deepest = edges <= kMany ? std::max(radius, 0.3 * pair.size) : radius;
    NearFeatures near_a(pair.a), near_b(pair.b);
    const AxisBox box_a = view_box(pair.a.view), box_b = view_box(pair.b.view);
    const Vec3 low = box_a.low.cwiseMax(box_b.low).array() - radius;
    const Vec3 high = box_a.high.cwiseMin(box_b.high).array() + radius;
    if ((low.array() > high.array()).any()) return;
    const auto inside = [&](const Vec3& x) {
        return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
    };
    const auto vertices = [&](const PolyhedronSide& x, NearFeatures& features, bool on_a,
                              auto&& act) {
        for (std::size_t v = 0; v < x.view.vertices.size(); ++v)
            if (inside(x.view.vertices[v])) act(on_a, number(v), features);
    };
    const auto on_edges = [&](bool on_a, std::int32_t v, NearFeatures& features) {
        features.find((on_a ? pair.a : pair.b).view.vertices[at(v)], radius);
        for (const std::int32_t e : features.edges)
            add_vertex_edge(pair, on_a, v, e);
        if (on_a)
            for (const std::int32_t w : features.vertices)
                add_vertex_vertex(pair, v, w);
    };
    const auto on_faces = [&](bool on_a, std::int32_t v, NearFeatures& features) {
        vertex_on_faces(pair, on_a, v, features);
    };
    vertices(pair.a, near_b, true, on_edges);
    vertices(pair.b, near_a, false, on_edges);
    vertices(pair.a, near_b, true, on_faces);
    vertices(pair.b, near_a, false, on_faces);
    for (std::size_t i = 0; i < pair.a.view.edges.size(); ++i) {
        const auto& ends = pair.a.view.topology->edges[i];
        if (!ends.convex) continue;
        const Vec3 &x = pair.a.view.vertices[at(ends.vertex[0])],
                   &y = pair.a.view.vertices[at(ends.vertex[1])];
        if ((x.cwiseMax(y) - low).minCoeff() < 0 || (high - x.cwiseMin(y)).minCoeff() < 0) continue;
        near_b.find((x + y) / 2, (x - y).norm() / 2 + pair.deepest);
        for (const std::int32_t j : near_b.edges)
            add_edge_edge(pair, number(i), j);
    }
}

// Pairs with fewer features are compared all with all.
constexpr std::size_t kFew = 20'000;

void touch_polyhedra(PolyhedronPair& pair, bool convex)
{
    const std::size_t edges = pair.a.view.edges.size() * pair.b.view.edges.size();
    if (convex && edges <= kFew)
        touch_convex(pair);
    else
        touch_any(pair);
}

} // namespace

void touch(const PairFrame& frame, const Box& a, const Box& b, RigidContacts& out)
{
    const BoxPolyhedron own_a(a.half_extents), own_b(b.half_extents);
    const PolyhedronView view = own_a.view();
    TurnedPolyhedron turned(view, frame.turn, frame.shift);
    PolyhedronPair pair{{turned.view(), nullptr, &a, frame.turn, frame.shift},
                        {own_b.view(), nullptr, &b, Mat3::Identity(), Vec3::Zero()},
                        frame.reach,
                        frame.size,
                        &out};
    touch_polyhedra(pair, true);
}

void touch(const PairFrame& frame, const TriangleShape& a, const Box& b, RigidContacts& out)
{
    const PolyhedronTopology topology = a.polyhedron.topology();
    const PolyhedronView view = a.polyhedron.view(topology);
    TurnedPolyhedron turned(view, frame.turn, frame.shift);
    const BoxPolyhedron own_b(b.half_extents);
    PolyhedronPair pair{{turned.view(), &a, nullptr, frame.turn, frame.shift},
                        {own_b.view(), nullptr, &b, Mat3::Identity(), Vec3::Zero()},
                        frame.reach,
                        frame.size,
                        &out};
    touch_polyhedra(pair, a.polyhedron.convex);
}

void touch(const PairFrame& frame, const TriangleShape& a, const TriangleShape& b,
           RigidContacts& out)
{
    const PolyhedronTopology topology_a = a.polyhedron.topology();
    const PolyhedronView view = a.polyhedron.view(topology_a);
    TurnedPolyhedron turned(view, frame.turn, frame.shift);
    const PolyhedronTopology topology_b = b.polyhedron.topology();
    PolyhedronPair pair{
        {turned.view(), &a, nullptr, frame.turn, frame.shift},
        {b.polyhedron.view(topology_b), &b, nullptr, Mat3::Identity(), Vec3::Zero()},
        frame.reach,
        frame.size,
        &out};
    touch_polyhedra(pair, a.polyhedron.convex && b.polyhedron.convex);
}

} // namespace amontons
