#include "contact/rigid/polyhedron.hpp"

#include "mesh/base/index.hpp"

#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace amontons {

namespace {

Vec3 twice_triangle_area(const SurfaceMesh& mesh, std::size_t t)
{
    const auto& [a, b, c] = mesh.triangles[t];
    return (mesh.points[at(b)] - mesh.points[at(a)]).cross(mesh.points[at(c)] - mesh.points[at(a)]);
}

// Which side of a triangle begins at a vertex.
std::size_t side_at(const std::array<std::int32_t, 3>& triangle, std::int32_t begin)
{
    return triangle[0] == begin ? 0 : triangle[1] == begin ? 1 : 2;
}

double diagonal(const SurfaceMesh& mesh)
{
    Eigen::AlignedBox3d box;
    for (const auto& triangle : mesh.triangles)
        for (const std::int32_t v : triangle)
            box.extend(mesh.points[at(v)]);
    return box.isEmpty() ? 0 : box.diagonal().norm();
}

// Grows each face from its largest triangle over neighbours that lie in that triangle's plane. It
// is that plane which counts, not the neighbour's: a finely cut round surface is not flat.
void find_faces(const SurfaceMesh& mesh, Polyhedron& p)
{
    const std::size_t count = mesh.triangles.size();
    std::vector<Vec3> area(count);
    for (std::size_t t = 0; t < count; ++t)
        area[t] = twice_triangle_area(mesh, t);
    std::vector<std::int32_t> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::int32_t i, std::int32_t j) {
        return area[at(i)].squaredNorm() > area[at(j)].squaredNorm();
    });
    p.face_of.assign(count, -1);
    const double flat = kFlat * p.size;
    std::vector<std::int32_t> grown;
    std::int32_t faces = 0;
    for (const std::int32_t seed : order) {
        if (p.face_of[at(seed)] >= 0) continue;
        const Vec3 n = area[at(seed)].normalized();
        const double offset = n.dot(mesh.points[at(mesh.triangles[at(seed)][0])]);
        p.face_of[at(seed)] = faces;
        grown.assign(1, seed);
        while (!grown.empty()) {
            const std::int32_t t = grown.back();
            grown.pop_back();
            for (const std::int32_t next : p.neighbours[at(t)]) {
                if (next < 0 || p.face_of[at(next)] >= 0) continue;
                bool in_plane = area[at(next)].dot(n) >= 0.5 * area[at(next)].norm();
                for (const std::int32_t v : mesh.triangles[at(next)])
                    in_plane = in_plane && std::abs(n.dot(mesh.points[at(v)]) - offset) <= flat;
                if (!in_plane) continue;
                p.face_of[at(next)] = faces;
                grown.push_back(next);
            }
        }
        ++faces;
    }

    // Faces in the order of their first triangle, not of their size: numbers that last.
    std::vector<std::int32_t> renamed(at(faces), -1);
    std::int32_t named = 0;
    for (std::int32_t& f : p.face_of) {
        if (renamed[at(f)] < 0) renamed[at(f)] = named++;
        f = renamed[at(f)];
    }
    p.normals.assign(at(faces), Vec3::Zero());
    std::vector<Vec3> moment(at(faces), Vec3::Zero());
    std::vector<double> weight(at(faces), 0);
    p.triangle_begin.assign(at(faces) + 1, 0);
    for (std::size_t t = 0; t < count; ++t) {
        const std::size_t f = at(p.face_of[t]);
        const auto& [a, b, c] = mesh.triangles[t];
        const double size = area[t].norm();
        p.normals[f] += area[t];
        moment[f] += size * (mesh.points[at(a)] + mesh.points[at(b)] + mesh.points[at(c)]) / 3;
        weight[f] += size;
        ++p.triangle_begin[f + 1];
    }
    std::partial_sum(p.triangle_begin.begin(), p.triangle_begin.end(), p.triangle_begin.begin());
    p.offsets.resize(at(faces));
    for (std::size_t f = 0; f < at(faces); ++f) {
        p.normals[f].normalize();
        p.offsets[f] = p.normals[f].dot(moment[f] / weight[f]);
    }
    p.triangles.resize(count);
    std::vector<std::int32_t> next(p.triangle_begin.begin(), p.triangle_begin.end() - 1);
    for (std::size_t t = 0; t < count; ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        p.triangles[at(next[at(p.face_of[t])]++)] = {mesh.points[at(a)], mesh.points[at(b)],
                                                     mesh.points[at(c)]};
    }
}

struct Outline {
    std::array<std::int32_t, 2> vertex, face;
    std::int32_t joined = -1; // the edge that this one became a part of
};

std::int32_t whole(const std::vector<Outline>& edges, std::int32_t e)
{
    while (edges[at(e)].joined >= 0)
        e = edges[at(e)].joined;
    return e;
}

// Joins edges of the same two faces that continue straight through a vertex of no other edge.
void join_straight(const SurfaceMesh& mesh, double flat, std::vector<Outline>& edges)
{
    std::vector<std::vector<std::int32_t>> touching(mesh.points.size());
    for (std::size_t e = 0; e < edges.size(); ++e)
        for (const std::int32_t v : edges[e].vertex)
            touching[at(v)].push_back(number(e));
    for (std::size_t v = 0; v < touching.size(); ++v) {
        if (touching[v].size() != 2) continue;
        const std::int32_t i = whole(edges, touching[v][0]), j = whole(edges, touching[v][1]);
        if (i == j) continue;
        Outline &a = edges[at(i)], &b = edges[at(j)];
        // The same two faces in the same order: then one ends where the other begins.
        if (a.face != b.face) continue;
        const bool first = a.vertex[1] == number(v);
        const std::int32_t begin = first ? a.vertex[0] : b.vertex[0];
        const std::int32_t end = first ? b.vertex[1] : a.vertex[1];
        const Vec3 chord = mesh.points[at(end)] - mesh.points[at(begin)];
        const Vec3 part = mesh.points[v] - mesh.points[at(begin)];
        if (begin == end || part.cross(chord).norm() > flat * chord.norm() ||
            part.dot(chord) <= 0 || part.dot(chord) >= chord.squaredNorm())
            continue;
        a.vertex = {begin, end};
        b.joined = i;
    }
}

void find_polyhedron_edges(const SurfaceMesh& mesh, Polyhedron& p)
{
    std::vector<Outline> outlines;
    p.edge_of.assign(mesh.triangles.size(), {-1, -1, -1});
    for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> sides) {
        if (sides.size() != 2) return;
        HalfEdge one = sides[0], two = sides[1];
        std::int32_t f = p.face_of[at(one.triangle)], g = p.face_of[at(two.triangle)];
        if (f == g) return;
        if (f > g) { // always seen from the same face, so that straight parts join
            std::swap(f, g);
            std::swap(one, two);
        }
        for (const HalfEdge& side : {one, two})
            p.edge_of[at(side.triangle)][side_at(mesh.triangles[at(side.triangle)], side.begin)] =
                number(outlines.size());
        outlines.push_back({{one.begin, one.end}, {f, g}});
    });
    join_straight(mesh, kFlat * p.size, outlines);

    std::vector<std::int32_t> renamed(outlines.size(), -1);
    p.corner_of.assign(mesh.points.size(), -1);
    for (std::size_t e = 0; e < outlines.size(); ++e) {
        if (outlines[e].joined >= 0) continue;
        renamed[e] = number(p.edges.size());
        const auto& [v, f, joined] = outlines[e];
        const Vec3 &a = mesh.points[at(v[0])], &b = mesh.points[at(v[1])];
        PolyhedronEdge edge;
        edge.length = (b - a).norm();
        edge.along = (b - a) / edge.length;
        edge.into = {p.normals[at(f[0])].cross(edge.along).normalized(),
                     edge.along.cross(p.normals[at(f[1])]).normalized()};
        const bool convex = edge.into[1].dot(p.normals[at(f[0])]) < 0;
        p.edges.push_back(edge);
        p.edge_ends.push_back({v, f, convex});
        for (const std::int32_t end : v)
            p.corner_of[at(end)] = 0;
    }
    for (auto& sides : p.edge_of)
        for (std::int32_t& e : sides)
            if (e >= 0) e = renamed[at(whole(outlines, e))];
    for (std::size_t v = 0; v < mesh.points.size(); ++v)
        if (p.corner_of[v] == 0) {
            p.corner_of[v] = number(p.vertices.size());
            p.vertices.push_back(mesh.points[v]);
        }
    for (auto& edge : p.edge_ends)
        for (std::int32_t& v : edge.vertex)
            v = p.corner_of[at(v)];
}

// Lists the edges of each item: members(edge) gives the items of an edge.
template <class Members>
void list_edges(const Polyhedron& p, std::size_t count, Members members,
                std::vector<std::int32_t>& begin, std::vector<std::int32_t>& list)
{
    begin.assign(count + 1, 0);
    for (const auto& edge : p.edge_ends)
        for (const std::int32_t i : members(edge))
            ++begin[at(i) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    list.resize(at(begin.back()));
    std::vector<std::int32_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t e = 0; e < p.edge_ends.size(); ++e)
        for (const std::int32_t i : members(p.edge_ends[e]))
            list[at(next[at(i)]++)] = number(e);
}

// A face is convex if all its corners are on the inner side of every edge of its outline.
bool outline_is_convex(const Polyhedron& p, std::size_t f)
{
    const auto begin = at(p.face_begin[f]), end = at(p.face_begin[f + 1]);
    if (end - begin > 256) return false; // its triangles serve then
    for (std::size_t i = begin; i < end; ++i) {
        const auto e = at(p.face_edges[i]);
        const auto& ends = p.edge_ends[e];
        const Vec3& into = p.edges[e].into[ends.face[0] == number(f) ? 0 : 1];
        const Vec3& origin = p.vertices[at(ends.vertex[0])];
        for (std::size_t j = begin; j < end; ++j)
            for (const std::int32_t v : p.edge_ends[at(p.face_edges[j])].vertex)
                if (into.dot(p.vertices[at(v)] - origin) < -2 * kFlat * p.size) return false;
    }
    return true;
}

// Of one closed surface without a handle, that does not cross itself: it is convex if it is so at
// each edge. (Of few faces what is convex but for round-off counts, too.)
bool is_convex_polyhedron(const Polyhedron& p)
{
    if (p.vertices.size() * p.normals.size() > 4'000'000) {
        if (p.vertices.size() + p.normals.size() != p.edges.size() + 2) return false;
        if (std::any_of(p.edge_ends.begin(), p.edge_ends.end(),
                        [](const auto& edge) { return !edge.convex; }))
            return false;
        std::vector<char> reached(p.vertices.size(), 0);
        std::vector<std::int32_t> waiting{0};
        reached[0] = 1;
        std::size_t count = 1;
        while (!waiting.empty()) {
            const std::int32_t v = waiting.back();
            waiting.pop_back();
            for (std::int32_t i = p.vertex_begin[at(v)]; i < p.vertex_begin[at(v) + 1]; ++i)
                for (const std::int32_t w : p.edge_ends[at(p.vertex_edges[at(i)])].vertex)
                    if (reached[at(w)] == 0) {
                        reached[at(w)] = 1;
                        ++count;
                        waiting.push_back(w);
                    }
        }
        return count == p.vertices.size();
    }
    for (std::size_t f = 0; f < p.normals.size(); ++f)
        for (const Vec3& v : p.vertices)
            if (p.normals[f].dot(v) > p.offsets[f] + 2 * kFlat * p.size) return false;
    return true;
}

void find_point_normals(const SurfaceMesh& mesh, Polyhedron& p)
{
    p.triangle_normals.resize(mesh.triangles.size());
    p.point_normals.assign(mesh.points.size(), Vec3::Zero());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        p.triangle_normals[t] = twice_triangle_area(mesh, t).normalized();
        for (std::size_t k = 0; k < 3; ++k) {
            const auto& tri = mesh.triangles[t];
            const Vec3& o = mesh.points[at(tri[k])];
            const Vec3 u = mesh.points[at(tri[(k + 1) % 3])] - o;
            const Vec3 w = mesh.points[at(tri[(k + 2) % 3])] - o;
            p.point_normals[at(tri[k])] +=
                std::atan2(u.cross(w).norm(), u.dot(w)) * p.triangle_normals[t];
        }
    }
    for (Vec3& n : p.point_normals)
        n.normalize();
}

} // namespace

PolyhedronTopology Polyhedron::topology() const
{
    return {edge_ends,  vertex_begin, vertex_edges,  face_begin,
            face_edges, face_convex,  triangle_begin};
}

PolyhedronView Polyhedron::view(const PolyhedronTopology& topology) const
{
    return {&topology, vertices, normals, offsets, edges, triangles, nullptr, nullptr};
}

Polyhedron make_polyhedron(const SurfaceMesh& mesh)
{
    Polyhedron p;
    p.size = diagonal(mesh);
    p.neighbours.assign(mesh.triangles.size(), {-1, -1, -1});
    for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> sides) {
        if (sides.size() != 2) return;
        for (std::size_t k = 0; k < 2; ++k) {
            const std::int32_t t = sides[k].triangle;
            p.neighbours[at(t)][side_at(mesh.triangles[at(t)], sides[k].begin)] =
                sides[1 - k].triangle;
        }
    });
    find_faces(mesh, p);
    find_polyhedron_edges(mesh, p);
    list_edges(
        p, p.vertices.size(), [](const auto& edge) { return edge.vertex; }, p.vertex_begin,
        p.vertex_edges);
    list_edges(
        p, p.normals.size(), [](const auto& edge) { return edge.face; }, p.face_begin,
        p.face_edges);
    p.face_convex.resize(p.normals.size());
    for (std::size_t f = 0; f < p.normals.size(); ++f)
        p.face_convex[f] = outline_is_convex(p, f) ? 1 : 0;
    find_point_normals(mesh, p);
    p.convex = is_convex_polyhedron(p);
    return p;
}

// ---- boxes

namespace {

using Edge = PolyhedronTopology::Edge;

struct BoxTables {
    std::array<Edge, 12> edges{};
    std::array<std::int32_t, 9> vertex_begin{};
    std::array<std::int32_t, 24> vertex_edges{};
    std::array<std::int32_t, 7> face_begin{}, triangle_begin{};
    std::array<std::int32_t, 24> face_edges{};
    std::array<char, 6> face_convex{};
};

// Edge 4 k + i runs along axis k; bits of i: on the high side of axes k + 1 and k + 2.
constexpr BoxTables make_box_tables()
{
    BoxTables box;
    int vertex_fill[8] = {}, face_fill[6] = {};
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 4; ++i) {
            const int e = 4 * k + i, u = (k + 1) % 3, w = (k + 2) % 3, s = i & 1, r = i >> 1;
            const int low = (s << u) | (r << w), high = low | (1 << k);
            // The face at u has the edge counter-clockwise along k if normal x along, the way
            // into the face, is along -w where the edge is at the high w: n = +u gives
            // u x k = -w.
            const int fu = 2 * u + s, fw = 2 * w + r;
            const bool forward = (s == 1) == (r == 1);
            box.edges[static_cast<std::size_t>(e)] = {
                {forward ? low : high, forward ? high : low}, {fu, fw}, true};
            for (const int v : {low, high})
                box.vertex_edges[static_cast<std::size_t>(3 * v + vertex_fill[v]++)] = e;
            for (const int f : {fu, fw})
                box.face_edges[static_cast<std::size_t>(4 * f + face_fill[f]++)] = e;
        }
    for (int v = 0; v < 9; ++v)
        box.vertex_begin[static_cast<std::size_t>(v)] = 3 * v;
    for (int f = 0; f < 7; ++f)
        box.face_begin[static_cast<std::size_t>(f)] = 4 * f;
    for (char& convex : box.face_convex)
        convex = 1;
    return box;
}

constexpr BoxTables kBox = make_box_tables();

} // namespace

BoxPolyhedron::BoxPolyhedron(const Vec3& half_extents)
{
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k)
            vertices[static_cast<std::size_t>(v)][k] =
                (v >> k & 1) != 0 ? half_extents[k] : -half_extents[k];
    for (int f = 0; f < 6; ++f) {
        normals[static_cast<std::size_t>(f)] = signed_axis(f / 2, (f & 1) != 0);
        offsets[static_cast<std::size_t>(f)] = half_extents[f / 2];
    }
    for (std::size_t e = 0; e < 12; ++e) {
        const int k = static_cast<int>(e) / 4, u = (k + 1) % 3, w = (k + 2) % 3;
        const bool s = (e & 1) != 0, r = (e & 2) != 0;
        edges[e].along = signed_axis(k, s == r);
        edges[e].into = {signed_axis(w, !r), signed_axis(u, !s)};
        edges[e].length = 2 * half_extents[k];
    }
}

PolyhedronView BoxPolyhedron::view() const
{
    static const PolyhedronTopology topology{
        kBox.edges,      kBox.vertex_begin, kBox.vertex_edges,  kBox.face_begin,
        kBox.face_edges, kBox.face_convex,  kBox.triangle_begin};
    return {&topology, vertices, normals, offsets, edges, {}, nullptr, nullptr};
}

} // namespace amontons
