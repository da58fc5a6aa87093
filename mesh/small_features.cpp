#include "mesh/small_features.hpp"

#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <tuple>

namespace amontons {
namespace {

using Index = std::int32_t;

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
        for (const auto& t : s.triangles) {
            const Vec3 &a = corner(t, 0), &b = corner(t, 1), &c = corner(t, 2);
            normals.push_back((b - a).cross(c - a).normalized());
        }
    }
    const Vec3& corner(const std::array<Index, 3>& t, std::size_t k) const
    {
        return surface.points[static_cast<std::size_t>(t[k])];
    }
    static std::vector<BoundingBox> boxes_of(const SurfaceMesh& s)
    {
        std::vector<BoundingBox> all;
        for (const auto& t : s.triangles) {
            BoundingBox box;
            for (const Index i : t)
                box.add(s.points[static_cast<std::size_t>(i)]);
            all.push_back(box);
        }
        return all;
    }

    /// Distance to the first triangle on a ray that faces against `normal`, or `longest`.
    double first(const Vec3& from, const Vec3& direction, const Vec3& normal, double longest,
                 Index own) const
    {
        BoundingBox box;
        box.add(from);
        box.add(Vec3(from + longest * direction));
        double nearest = longest;
        tree.visit(box, [&](Index i) {
            const auto k = static_cast<std::size_t>(i);
            if (i == own || normals[k].dot(normal) > kOpposite) return;
            const auto& t0 = surface.triangles[static_cast<std::size_t>(own)];
            for (const Index corner_of_own : t0) // neighbours are a sharp edge, no wall
                for (const Index other : surface.triangles[k])
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

/// Looks from the middles of triangles that are cut until they are no longer than twice what is to
/// be told apart there: the size, or what was found to be thinner.
class ThinParts {
public:
    ThinParts(const SurfaceMesh& surface, const SizeField& size, std::vector<SmallFeature>& found)
        : surface_(surface)
        , size_(size)
        , rays_(surface)
        , found_(found)
    {
        double area = 0;
        for (const auto& t : surface.triangles)
            area += 0.5 * (rays_.corner(t, 1) - rays_.corner(t, 0))
                              .cross(rays_.corner(t, 2) - rays_.corner(t, 0))
                              .norm();
        finest_ = std::sqrt(area / kMostSamples);
    }

    void find()
    {
        for (std::size_t k = 0; k < surface_.triangles.size(); ++k) {
            const auto& t = surface_.triangles[k];
            if (rays_.normals[k].allFinite())
                look(static_cast<Index>(k), rays_.corner(t, 0), rays_.corner(t, 1),
                     rays_.corner(t, 2));
        }
    }

private:
    void look(Index k, const Vec3& a, const Vec3& b, const Vec3& c)
    {
        const Vec3 n = rays_.normals[static_cast<std::size_t>(k)], x = (a + b + c) / 3;
        const double here = size_.at(x), wall = rays_.first(x, -n, n, here, k),
                     gap = rays_.first(x, n, n, here, k);
        // A part in a million: a wall of the very size is none.
        if (wall < (1 - 1e-6) * here) found_.push_back({"a wall", x - 0.5 * wall * n, wall, here});
        if (gap < (1 - 1e-6) * here) found_.push_back({"a gap", x + 0.5 * gap * n, gap, here});
        const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        if (longest <= 2 * std::max(std::min({here, wall, gap}), finest_)) return;
        const Vec3 p = 0.5 * (a + b), q = 0.5 * (b + c), r = 0.5 * (c + a);
        look(k, a, p, r);
        look(k, p, b, q);
        look(k, r, q, c);
        look(k, p, q, r);
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
            normals.push_back((at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).normalized());
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
                for (const Index end : ends)
                    if ((loops || is_corner(start)) && !walked_.count(key(start, end)))
                        walk(start, end, visit);
    }

private:
    const Vec3& at(Index i) const { return surface_.points[static_cast<std::size_t>(i)]; }
    static std::pair<Index, Index> key(Index a, Index b)
    {
        return {std::min(a, b), std::max(a, b)};
    }
    bool is_corner(Index v) const
    {
        const std::vector<Index>& ends = beside_.at(v);
        if (ends.size() != 2) return true;
        return (at(ends[0]) - at(v)).normalized().dot((at(v) - at(ends[1])).normalized()) < kTurn;
    }
    template <class Visit> void walk(Index start, Index end, Visit& visit)
    {
        std::vector<Index> vertices{start};
        double length = 0;
        for (Index here = start, next = end;;) {
            if (!walked_.insert(key(here, next)).second) break; // around
            length += (at(next) - at(here)).norm();
            vertices.push_back(next);
            if (is_corner(next)) break;
            const std::vector<Index>& ends = beside_.at(next);
            const Index onward = ends[0] == here ? ends[1] : ends[0];
            here = next;
            next = onward;
        }
        visit(vertices, length);
    }

    const SurfaceMesh& surface_;
    std::map<Index, std::vector<Index>> beside_;
    std::set<std::pair<Index, Index>> walked_;
};

} // namespace

std::vector<SmallFeature> find_small_features(const SurfaceMesh& surface, const SizeField& size,
                                              double feature_angle)
{
    std::vector<SmallFeature> found;
    ThinParts(surface, size, found).find();
    SharpChains(surface, feature_angle)
        .visit([&](const std::vector<Index>& vertices, double length) {
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
