#include "mesh/small_features.hpp"

#include "mesh/orient_surface.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <tuple>

namespace amontons {
namespace {

constexpr double kOpposite = -0.95;        // cosine between normals that face each other
constexpr double kMostSamples = 2'000'000; // of all triangles together
constexpr double kTurn = 0.5; // cosine below which a chain of sharp edges has a corner: 60 degrees

struct Rays {
    const SurfaceMesh& surface;
    std::vector<Vec3> normals; ///< of length 1
    std::vector<BoundingBox> boxes;
    BoxTree tree;

    explicit Rays(const SurfaceMesh& s) : surface(s), boxes(boxes_of(s)), tree(boxes)
    {
        for (const auto& t : s.triangles)
            normals.push_back(unit_normal(s, t));
    }
    const Vec3& corner(const std::array<std::int32_t, 3>& t, std::size_t k) const
    {
        return surface.points[static_cast<std::size_t>(t[k])];
    }
    static std::vector<BoundingBox> boxes_of(const SurfaceMesh& s)
    {
        std::vector<BoundingBox> all;
        for (const auto& t : s.triangles) {
            BoundingBox box;
            for (const std::int32_t i : t)
                box.add(s.points[static_cast<std::size_t>(i)]);
            all.push_back(box);
        }
        return all;
    }

    /// Distance to the first triangle on a ray that faces against `normal`, or `longest`.
    double first(const Vec3& from, const Vec3& direction, const Vec3& normal, double longest,
                 std::int32_t own) const
    {
        BoundingBox box;
        box.add(from);
        box.add(Vec3(from + longest * direction));
        double nearest = longest;
        tree.visit(box, [&](std::int32_t i) {
            const auto k = static_cast<std::size_t>(i);
            if (i == own || normals[k].dot(normal) > kOpposite) return;
            const auto& t0 = surface.triangles[static_cast<std::size_t>(own)];
            for (const std::int32_t corner_of_own : t0) // neighbours are a sharp edge, no wall
                for (const std::int32_t other : surface.triangles[k])
                    if (other == corner_of_own) return;
            // Moeller and Trumbore's equations.
            const auto& t = surface.triangles[k];
            const Vec3 e1 = corner(t, 1) - corner(t, 0), e2 = corner(t, 2) - corner(t, 0),
                       p = direction.cross(e2), s = from - corner(t, 0), q = s.cross(e1);
            const double d = e1.dot(p);
            if (d == 0) return;
            const double u = s.dot(p) / d, v = direction.dot(q) / d, x = e2.dot(q) / d;
            if (u >= 0 && v >= 0 && u + v <= 1 && x >= 0) nearest = std::min(nearest, x);
        });
        return nearest;
    }
};

/// Searches from the middles of pieces of triangles that are cut until they are no longer than
/// twice what is to be distinguished there: the size, or what was found to be thinner.
class ThinParts {
public:
    ThinParts(const SurfaceMesh& surface, const SizeField& size, std::vector<SmallFeature>& found)
        : surface_(surface)
        , size_(size)
        , rays_(surface)
        , found_(found)
    {
        // A triangle of length L and area A makes about 1 + L / s + A / s^2 pieces no longer than
        // s.
        double area = 0, length = 0;
        for (const auto& t : surface.triangles) {
            const Vec3 &a = rays_.corner(t, 0), &b = rays_.corner(t, 1), &c = rays_.corner(t, 2);
            area += 0.5 * (b - a).cross(c - a).norm();
            length += std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        }
        finest_ = std::max(std::sqrt(area / kMostSamples), length / kMostSamples);
    }

    void find()
    {
        for (std::size_t k = 0; k < surface_.triangles.size(); ++k) {
            const auto& t = surface_.triangles[k];
            search_from(static_cast<std::int32_t>(k), whole(t));
        }
    }

private:
    /// Four corners around a piece of a triangle; two of them may be one.
    using Piece = std::array<Vec3, 4>;

    /// A triangle as a piece: from its shortest edge to the corner opposite.
    Piece whole(const std::array<std::int32_t, 3>& t) const
    {
        const auto length = [&](std::size_t k) {
            return (rays_.corner(t, (k + 1) % 3) - rays_.corner(t, k)).norm();
        };
        std::size_t k = 0;
        for (const std::size_t other : {1u, 2u})
            if (length(other) < length(k)) k = other;
        const Vec3& top = rays_.corner(t, (k + 2) % 3);
        return {rays_.corner(t, k), rays_.corner(t, (k + 1) % 3), top, top};
    }

    void search_from(std::int32_t k, const Piece& p)
    {
        const Vec3 n = rays_.normals[static_cast<std::size_t>(k)],
                   x = (p[0] + p[1] + p[2] + p[3]) / 4;
        const double here = size_.at(x), wall = rays_.first(x, -n, n, here, k),
                     gap = rays_.first(x, n, n, here, k);
        // A part in a million: a wall of the very size is none.
        if (wall < (1 - 1e-6) * here) found_.push_back({"a wall", x - 0.5 * wall * n, wall, here});
        if (gap < (1 - 1e-6) * here) found_.push_back({"a gap", x + 0.5 * gap * n, gap, here});
        // Halved where it is long only: a slender one cut into triangles, or into four, would be
        // examined far more often than its length requires.
        const double across = std::max((p[1] - p[0]).norm(), (p[3] - p[2]).norm()),
                     along = std::max((p[2] - p[1]).norm(), (p[0] - p[3]).norm());
        if (std::max(across, along) <= 2 * std::max(std::min({here, wall, gap}), finest_)) return;
        const std::size_t i = across > along ? 1 : 0;
        const Vec3 u = 0.5 * (p[1 + i] + p[(2 + i) % 4]), v = 0.5 * (p[(3 + i) % 4] + p[i]);
        search_from(k, {p[i], p[1 + i], u, v});
        search_from(k, {v, u, p[(2 + i) % 4], p[(3 + i) % 4]});
    }

    const SurfaceMesh& surface_;
    const SizeField& size_;
    Rays rays_;
    std::vector<SmallFeature>& found_;
    double finest_ = 0;
};

/// Sharp edges, walked from corner to corner.
class SharpChains {
public:
    SharpChains(const SurfaceMesh& surface, double feature_angle) : surface_(surface)
    {
        std::vector<Vec3> normals;
        for (const auto& t : surface.triangles)
            normals.push_back(unit_normal(surface, t));
        const double sharp = std::cos(feature_angle);
        for_each_edge(sorted_half_edges(surface), [&](std::span<const HalfEdge> sides) {
            if (sides.size() != 2) return;
            const double cosine = normals[static_cast<std::size_t>(sides[0].triangle)].dot(
                normals[static_cast<std::size_t>(sides[1].triangle)]);
            if (cosine >= sharp) return;
            beside_[sides[0].begin].push_back(sides[0].end);
            beside_[sides[0].end].push_back(sides[0].begin);
        });
    }

    /// Calls visit(vertices of a chain, its length [m]).
    template <class Visit> void visit(Visit visit)
    {
        for (const bool loops : {false, true}) // first what begins at corners, then the rest
            for (const auto& [start, ends] : beside_)
                for (const std::int32_t end : ends)
                    if ((loops || is_corner(start)) && !walked_.count(key(start, end)))
                        walk(start, end, visit);
    }

private:
    const Vec3& at(std::int32_t i) const { return surface_.points[static_cast<std::size_t>(i)]; }
    static std::pair<std::int32_t, std::int32_t> key(std::int32_t a, std::int32_t b)
    {
        return {std::min(a, b), std::max(a, b)};
    }
    bool is_corner(std::int32_t v) const
    {
        const std::vector<std::int32_t>& ends = beside_.at(v);
        if (ends.size() != 2) return true;
        return (at(ends[0]) - at(v)).normalized().dot((at(v) - at(ends[1])).normalized()) < kTurn;
    }
    template <class Visit> void walk(std::int32_t start, std::int32_t end, Visit& visit)
    {
        std::vector<std::int32_t> vertices{start};
        double length = 0;
        for (std::int32_t here = start, next = end;;) {
            if (!walked_.insert(key(here, next)).second) break; // around
            length += (at(next) - at(here)).norm();
            vertices.push_back(next);
            if (is_corner(next)) break;
            const std::vector<std::int32_t>& ends = beside_.at(next);
            const std::int32_t onward = ends[0] == here ? ends[1] : ends[0];
            here = next;
            next = onward;
        }
        visit(vertices, length);
    }

    const SurfaceMesh& surface_;
    std::map<std::int32_t, std::vector<std::int32_t>> beside_;
    std::set<std::pair<std::int32_t, std::int32_t>> walked_;
};

} // namespace

std::vector<SmallFeature> find_small_features(const SurfaceMesh& surface, const SizeField& size,
                                              double feature_angle)
{
    std::vector<SmallFeature> found;
    ThinParts(surface, size, found).find();
    SharpChains(surface, feature_angle)
        .visit([&](const std::vector<std::int32_t>& vertices, double length) {
            const Vec3& x = surface.points[static_cast<std::size_t>(vertices[vertices.size() / 2])];
            if (const double here = size.at(x); length < (1 - 1e-6) * here)
                found.push_back({"a sharp edge", x, length, here});
        });
    return found;
}

std::vector<SizeSource> sources_of(const std::vector<SmallFeature>& features)
{
    std::map<std::tuple<int, double, double, double>, SizeSource> cubes;
    for (const SmallFeature& f : features) {
        int exponent = 0;
        std::frexp(f.extent, &exponent);
        const double width = std::ldexp(1.0, exponent - 1); // extent/2 .. extent
        const Eigen::Array3d cube = (f.at.array() / width).floor();
        SizeSource& s =
            cubes.try_emplace({exponent, cube[0], cube[1], cube[2]}, SizeSource{f.at, f.extent})
                .first->second;
        if (f.extent < s.size) s = {f.at, f.extent};
    }
    std::vector<SizeSource> all;
    for (const auto& [cube, source] : cubes)
        all.push_back(source);
    return all;
}

} // namespace amontons
