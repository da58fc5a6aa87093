#include "contact/surface/passage.hpp"

#include "contact/surface/faceted_surface.hpp"
#include "mesh/box_tree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

struct Triangle {
    std::array<std::int32_t, 3> nodes;
};

std::vector<Triangle> triangles_of_surface(const ExternalSurface& surface)
{
    std::vector<Triangle> all;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const auto n = surface.face(f);
        for (const std::array<int, 3>& t : flat_parts(n.size()).triangles)
            all.push_back({{n[std::size_t(t[0])], n[std::size_t(t[1])], n[std::size_t(t[2])]}});
    }
    return all;
}

/// A node and a triangle at a share of the step.
struct Moment {
    Vec3 x;
    std::array<Vec3, 3> corner;

    Vec3 normal() const { return (corner[1] - corner[0]).cross(corner[2] - corner[0]); }
    /// Over the plane; its sign is that of the distance.
    double height() const { return normal().dot(x - corner[0]); }
    bool inside() const
    {
        const Vec3 n = normal();
        for (std::size_t k = 0; k < 3; ++k)
            if (n.dot((corner[(k + 1) % 3] - corner[k]).cross(x - corner[k])) < 0) return false;
        return true;
    }
};

/// Whether a node that is above a triangle before and below it after passes through it.
template <class At> bool passes_through(At at)
{
    // The height is a cubic of the share: the first change of sign among a few pieces, bisected.
    constexpr int kPieces = 8, kHalvings = 40;
    double low = 0;
    for (int k = 1; k <= kPieces; ++k) {
        double high = double(k) / kPieces;
        if (at(high).height() > 0) {
            low = high;
            continue;
        }
        for (int i = 0; i < kHalvings; ++i) {
            const double middle = 0.5 * (low + high);
            (at(middle).height() > 0 ? low : high) = middle;
        }
        return at(high).inside();
    }
    return false;
}

std::optional<Vec3> nodes_through_faces(const MovedSurface& of_nodes, const MovedSurface& of_faces,
                                        double depth)
{
    const auto both = [](const MovedSurface& s, std::span<const std::int32_t> nodes) {
        BoundingBox box;
        for (const std::int32_t n : nodes) {
            box.add(s.before[std::size_t(n)]);
            box.add(s.after[std::size_t(n)]);
        }
        return box;
    };
    const BoundingBox near = both(of_nodes, of_nodes.surface.used_nodes);
    std::vector<Triangle> triangles;
    std::vector<BoundingBox> boxes;
    if (!near.touches(both(of_faces, of_faces.surface.used_nodes))) return {};
    for (const Triangle& t : triangles_of_surface(of_faces.surface)) {
        const BoundingBox box = both(of_faces, t.nodes);
        if (!near.touches(box)) continue;
        triangles.push_back(t);
        boxes.push_back(box);
    }
    if (triangles.empty()) return {};
    const BoxTree tree(boxes);
    std::optional<Vec3> found;
    for (const std::int32_t node : of_nodes.surface.used_nodes) {
        const Vec3 &x0 = of_nodes.before[std::size_t(node)],
                   &x1 = of_nodes.after[std::size_t(node)];
        tree.visit(both(of_nodes, std::span(&node, 1)), [&](std::int32_t k) {
            const Triangle& t = triangles[std::size_t(k)];
            const auto at = [&](double share) {
                Moment m{x0 + share * (x1 - x0), {}};
                for (std::size_t i = 0; i < 3; ++i) {
                    const auto corner = std::size_t(t.nodes[i]);
                    const Vec3 &a = of_faces.before[corner], &b = of_faces.after[corner];
                    m.corner[i] = a + share * (b - a);
                }
                return m;
            };
            if (found) return;
            const Moment end = at(1);
            if (!(at(0).height() > 0) || !(end.height() < -depth * end.normal().norm())) return;
            if (passes_through(at)) found = x1;
        });
        if (found) break;
    }
    return found;
}

} // namespace

std::optional<Vec3> passage(const MovedSurface& a, const MovedSurface& b, double depth)
{
    if (const auto x = nodes_through_faces(a, b, depth)) return x;
    return nodes_through_faces(b, a, depth);
}

namespace {

/// @param bound   what is returned where nothing is thinner; 0: half the longest edge
/// @param facing  cosine from which on faces are two sides of a body, not of a corner
double thickness_below(const ExternalSurface& surface, std::span<const Vec3> places, double bound,
                       double facing)
{
    constexpr double kFlat =
        1e-9; // of a triangle: it has no normal, or the ray passes through its edge
    struct Corners {
        Vec3 a, b, c, normal;
    };
    std::vector<Corners> all;
    std::vector<BoundingBox> boxes;
    double longest = 0;
    for (const Triangle& t : triangles_of_surface(surface)) {
        const Vec3 &a = places[std::size_t(t.nodes[0])], &b = places[std::size_t(t.nodes[1])],
                   &c = places[std::size_t(t.nodes[2])];
        const double edge = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        const Vec3 n = (b - a).cross(c - a);
        longest = std::max(longest, edge);
        if (!(n.norm() > kFlat * edge * edge)) continue;
        all.push_back({a, b, c, n.normalized()});
        BoundingBox box;
        for (const Vec3* x : {&a, &b, &c})
            box.add(*x);
        boxes.push_back(box);
    }
    const BoxTree tree(boxes);
    double least = bound > 0 ? bound : 0.5 * longest;
    for (const Corners& own : all) {
        const Vec3 from = (own.a + own.b + own.c) / 3;
        BoundingBox way;
        way.add(from);
        way.add(Vec3(from - least * own.normal));
        tree.visit(way, [&](std::int32_t k) {
            const Corners& t = all[std::size_t(k)];
            const double towards = -t.normal.dot(own.normal);
            if (!(towards > facing)) return;
            const double depth = t.normal.dot(t.a - from) / towards;
            if (!(depth > 0 && depth < least)) return;
            const Vec3 x = from - depth * own.normal;
            const double size = kFlat * (t.b - t.a).cross(t.c - t.a).norm();
            const auto beside = [&](const Vec3& p, const Vec3& q) {
                return t.normal.dot((q - p).cross(x - p)) < -size;
            };
            if (!beside(t.a, t.b) && !beside(t.b, t.c) && !beside(t.c, t.a)) least = depth;
        });
    }
    return least;
}

} // namespace

double least_thickness(const ExternalSurface& surface, std::span<const Vec3> places)
{
    return thickness_below(surface, places, 0, 0);
}

double least_thickness(const ExternalSurface& surface, std::span<const Vec3> places, double most)
{
    // Long rays cross many boxes: a short one first.
    constexpr double kTwoSides = 0.7;
    const double first = thickness_below(surface, places, 0, kTwoSides);
    for (double bound = first;; bound *= 2) {
        const double found = thickness_below(surface, places, std::min(bound, most), kTwoSides);
        if (found < bound || bound >= most) return std::min(found, most);
    }
}

} // namespace amontons
