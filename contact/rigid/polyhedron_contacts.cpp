#include "contact/rigid/extent.hpp"
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
    const auto with_faces = [](const PolyhedronView& x, std::size_t e) {
        const auto& face = x.topology->edges[e].face;
        return EdgeWithFaces{x.edges[e], x.normals[at(face[0])], x.normals[at(face[1])]};
    };
    faces(a, b, true);
    if (best.distance > pair.reach) return best;
    faces(b, a, false);
    if (best.distance > pair.reach) return best;
    for (std::size_t i = 0; i < a.edges.size(); ++i)
        for (std::size_t j = 0; j < b.edges.size(); ++j) {
            const std::optional<Vec3> n = crossing_normal(with_faces(a, i), with_faces(b, j));
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

// The features of a side near a place, each once.
class NearFeatures {
public:
    explicit NearFeatures(const PolyhedronSide& side) : side_(side)
    {
        const PolyhedronView& view = side.view;
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
        faces.clear();
        edges.clear();
        vertices.clear();
        const Polyhedron& p = side_.mesh->polyhedron;
        side_.mesh->tree.within(side_.own(x), radius, triangles_);
        if (face_in_.empty()) {
            face_in_.assign(p.normals.size(), 0);
            edge_in_.assign(p.edges.size(), 0);
            vertex_in_.assign(p.vertices.size(), 0);
        }
        const auto add = [&](std::int32_t i, std::vector<std::int32_t>& list,
                             std::vector<char>& in) {
            if (i < 0 || in[at(i)] != 0) return;
            in[at(i)] = 1;
            list.push_back(i);
        };
        for (const std::int32_t t : triangles_) {
            add(p.face_of[at(t)], faces, face_in_);
            for (const std::int32_t e : p.edge_of[at(t)])
                add(e, edges, edge_in_);
            for (const std::int32_t v : side_.mesh->mesh.triangles[at(t)])
                add(p.corner_of[at(v)], vertices, vertex_in_);
        }
        const auto finish = [](std::vector<std::int32_t>& list, std::vector<char>& in) {
            for (const std::int32_t i : list)
                in[at(i)] = 0;
            std::sort(list.begin(), list.end());
        };
        finish(faces, face_in_);
        finish(edges, edge_in_);
        finish(vertices, vertex_in_);
    }
    // A triangle near the place of the last search for a nearest one, or -1.
    std::int32_t close = -1;

    std::vector<std::int32_t> faces, edges, vertices;

    static void sort_once(std::vector<std::int32_t>& list)
    {
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
    }

private:
    const PolyhedronSide& side_;
    std::vector<std::int32_t> triangles_;
    std::vector<char> face_in_, edge_in_, vertex_in_; // 1 while a list is made that has it
};

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
    const Vec3 place = x.view.vertex(v);
    const double distance = signed_distance(y, place, &features.close);
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

// Where the features of both lie that may touch: a box in the frame of b, and a layer across the
// way from one body to the other, on which boxes of round bodies give little information.
class Region {
public:
    // @param room  how far two features that touch are apart, at most [m]
    Region(const PolyhedronPair& pair, double room)
        : a_(pair.a)
        , b_(pair.b)
        , room_(room)
        , rounding_(kSamePlace * pair.size)
    {
        BoundingBox box_a, box_b;
        for (int k = 0; k < 3; ++k) {
            const Vec3 axis = Vec3::Unit(k);
            box_a.low[k] = lowest(a_, axis);
            box_a.high[k] = -lowest(a_, -axis);
            box_b.low[k] = lowest(b_, axis);
            box_b.high[k] = -lowest(b_, -axis);
        }
        box_.low = box_a.low.max(box_b.low) - room;
        box_.high = box_a.high.min(box_b.high) + room;
        const Vec3 way = ((box_a.low + box_a.high) - (box_b.low + box_b.high)).matrix();
        if (way.norm() > 0) way_ = way.normalized();
        low_a_ = lowest(a_, way_);
        high_b_ = -lowest(b_, -way_);
    }

    bool empty() const { return (box_.low > box_.high).any() || apart() > room_ + rounding_; }
    // Of the two bodies on the way: no place of one is deeper in the other than less this [m].
    double apart() const { return low_a_ - high_b_; }

    bool has(const Vec3& x) const
    {
        return (x.array() >= box_.low).all() && (x.array() <= box_.high).all();
    }

    // Calls act(v) for the vertices of one side that lie there, ascending.
    template <class Act> void vertices(bool of_a, Act act)
    {
        const PolyhedronSide& side = of_a ? a_ : b_;
        found_.clear();
        if (side.mesh == nullptr) {
            for (std::size_t v = 0; v < side.view.vertices.size(); ++v)
                found_.push_back(number(v));
        } else {
            vertices_where(*side.mesh, test_for_(of_a), found_);
        }
        for (const std::int32_t v : found_)
            if (has(side.view.vertex(v))) act(v);
    }

    // The same of the edges of a, which may be outside at both ends.
    template <class Act> void edges_of_a(Act act)
    {
        found_.clear();
        if (a_.mesh == nullptr) {
            for (std::size_t e = 0; e < a_.view.edges.size(); ++e)
                found_.push_back(number(e));
        } else {
            a_.mesh->tree.visit_where(test_for_(true), [&](std::int32_t t) {
                for (const std::int32_t e : a_.mesh->polyhedron.edge_of[at(t)])
                    if (e >= 0) found_.push_back(e);
            });
            NearFeatures::sort_once(found_);
        }
        for (const std::int32_t e : found_)
            act(e);
    }

private:
    static double lowest(const PolyhedronSide& side, const Vec3& direction)
    {
        double least = kInfinity;
        if (side.mesh == nullptr) {
            for (std::size_t v = 0; v < side.view.vertices.size(); ++v)
                least = std::min(least, direction.dot(side.view.vertex(number(v))));
            return least;
        }
        const Vec3 own = side.turn.transpose() * direction;
        return lowest_along(*side.mesh, own) + direction.dot(side.shift);
    }

    // Whether a box in a side's own frame touches the region; some others pass.
    auto test_for_(bool of_a) const
    {
        const PolyhedronSide& side = of_a ? a_ : b_;
        // Rows: the axes of the frame of b, and the way out of the other body.
        Eigen::Matrix<double, 4, 3> axes;
        Eigen::Array4d low, high;
        axes << Mat3::Identity(), (of_a ? 1 : -1) * way_.transpose();
        low << box_.low, -kInfinity;
        high << box_.high, (of_a ? high_b_ : -low_a_) + room_;
        const Eigen::Array4d shift = axes * side.shift;
        low -= shift + rounding_;
        high += rounding_ - shift;
        const Eigen::Matrix<double, 4, 3> own = axes * side.turn;
        return [own, low, high](const BoundingBox& box) {
            const Eigen::Array4d middle = own * (0.5 * (box.low + box.high)).matrix(),
                                 half = own.cwiseAbs() * (0.5 * (box.high - box.low)).matrix();
            return (middle - half <= high).all() && (middle + half >= low).all();
        };
    }

    const PolyhedronSide &a_, &b_;
    double room_ = 0, rounding_ = 0;
    BoundingBox box_;
    Vec3 way_ = Vec3::UnitZ(); // unit, from b to a
    double low_a_ = 0, high_b_ = 0;
    std::vector<std::int32_t> found_;
};

double distance_from_edge(const PolyhedronView& body, std::int32_t edge, const Vec3& x)
{
    const Vec3 from = x - body.vertex(body.topology->edges[at(edge)].vertex[0]),
               along = body.along(edge);
    return (from - std::clamp(from.dot(along), 0.0, body.length(edge)) * along).norm();
}

// Of bodies with more pairs of edges than this, edges overlap by no more than a part of the size.
constexpr std::size_t kMany = 1'000'000;
constexpr double kDeepEdges = 0.3, kDeepOfMany = 0.05;
// Edges count whose places are in the other body by a quarter of what they overlap by.
constexpr double kEdgesInside = 4;

void touch_any(PolyhedronPair& pair, bool convex)
{
    const double slack = kTouching * pair.size, radius = std::max(pair.reach, slack);
    const std::size_t edges = pair.a.view.edges.size() * pair.b.view.edges.size();
    pair.deepest = std::max(radius, (edges <= kMany ? kDeepEdges : kDeepOfMany) * pair.size);
    Region region(pair, radius);
    if (region.empty()) return;
    NearFeatures near_a(pair.a), near_b(pair.b);
    const auto on_edges = [&](bool on_a, std::int32_t v, NearFeatures& features) {
        features.find((on_a ? pair.a : pair.b).view.vertex(v), radius);
        for (const std::int32_t e : features.edges)
            add_vertex_edge(pair, on_a, v, e);
        if (on_a)
            for (const std::int32_t w : features.vertices)
                add_vertex_vertex(pair, v, w);
    };
    region.vertices(true, [&](std::int32_t v) { on_edges(true, v, near_b); });
    region.vertices(false, [&](std::int32_t v) { on_edges(false, v, near_a); });
    region.vertices(true, [&](std::int32_t v) { vertex_on_faces(pair, true, v, near_b); });
    region.vertices(false, [&](std::int32_t v) { vertex_on_faces(pair, false, v, near_a); });
    // No place of a convex body is deeper in another than both overlap along any way.
    if (convex)
        pair.deepest = std::min(
            pair.deepest, std::max(radius, slack + kEdgesInside * std::max(-region.apart(), 0.0)));
    region.edges_of_a([&](std::int32_t i) {
        const auto& ends = pair.a.view.topology->edges[at(i)];
        if (!ends.convex) return;
        const Vec3 x = pair.a.view.vertex(ends.vertex[0]), y = pair.a.view.vertex(ends.vertex[1]);
        const Vec3 middle = (x + y) / 2;
        const double room = (x - y).norm() / 2 + pair.deepest + 2 * kSamePlace * pair.size;
        near_b.find(middle, room);
        for (const std::int32_t j : near_b.edges)
            if (distance_from_edge(pair.b.view, j, middle) <= room) add_edge_edge(pair, i, j);
    });
}

// Pairs with fewer features are compared all with all.
constexpr std::size_t kFew = 20'000;

// @param convex  both bodies
void touch_polyhedra(PolyhedronPair& pair, bool convex)
{
    PolyhedronView& view = pair.a.view;
    if (convex && view.edges.size() * pair.b.view.edges.size() <= kFew) {
        const PolyhedronView own = view;
        TurnedPolyhedron turned(own, pair.a.turn, pair.a.shift);
        view = turned.view();
        touch_convex(pair);
    } else {
        view.turn = &pair.a.turn;
        view.shift = &pair.a.shift;
        touch_any(pair, convex);
    }
}

} // namespace

void touch(const PairFrame& frame, const Box& a, const Box& b, RigidContacts& out)
{
    const BoxPolyhedron own_a(a.half_extents), own_b(b.half_extents);
    PolyhedronPair pair{{own_a.view(), nullptr, &a, frame.turn, frame.shift},
                        {own_b.view(), nullptr, &b, Mat3::Identity(), Vec3::Zero()},
                        frame.reach,
                        frame.size,
                        &out};
    touch_polyhedra(pair, true);
}

void touch(const PairFrame& frame, const TriangleShape& a, const Box& b, RigidContacts& out)
{
    const PolyhedronTopology topology = a.polyhedron.topology();
    const BoxPolyhedron own_b(b.half_extents);
    PolyhedronPair pair{{a.polyhedron.view(topology), &a, nullptr, frame.turn, frame.shift},
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
    const PolyhedronTopology topology_b = b.polyhedron.topology();
    PolyhedronPair pair{
        {a.polyhedron.view(topology_a), &a, nullptr, frame.turn, frame.shift},
        {b.polyhedron.view(topology_b), &b, nullptr, Mat3::Identity(), Vec3::Zero()},
        frame.reach,
        frame.size,
        &out};
    touch_polyhedra(pair, a.polyhedron.convex && b.polyhedron.convex);
}

} // namespace amontons
