#include "mesh/self_intersection.hpp"

#include "mesh/predicates.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

// Broad phase: a tree of boxes, halved at the median of the longer side, walked against itself.
// Narrow phase: two triangles touch outside their shared vertices exactly if an edge of one that
// holds no shared vertex touches the other one. Why the edges opposite of a shared vertex suffice:
// both triangles are stars seen from it, so what they have in common is one too; a ray of it
// leaves one of the triangles first, and it leaves it through the edge opposite.

namespace amontons {
namespace {

using TriangleCorners = std::array<std::int32_t, 3>;
using CornerPlaces = std::array<Vec3, 3>;
using Box = Eigen::AlignedBox3d;

constexpr std::int32_t kTriangleLeaf = 4;        // triangles
constexpr std::int64_t kMostCounted = 1'000'000; // a surface folded onto itself has n^2 pairs

// ---- narrow phase ------------------------------------------------------------------------

/// The axis along which a triangle shows the largest area.
int widest_axis(const CornerPlaces& t)
{
    int axis = 0;
    (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs().maxCoeff(&axis);
    return axis;
}

bool between(double x, double a, double b)
{
    return std::min(a, b) <= x && x <= std::max(a, b);
}

/// Two closed segments in a plane, seen along axis k.
bool segments_intersect(int k, const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b)
{
    const int pa = orientation_along(k, p, q, a), pb = orientation_along(k, p, q, b);
    const int ap = orientation_along(k, a, b, p), aq = orientation_along(k, a, b, q);
    if (pa * pb < 0 && ap * aq < 0) return true;
    const auto on = [k](const Vec3& x, const Vec3& from, const Vec3& to) { // x is on their line
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        return between(x[i], from[i], to[i]) && between(x[j], from[j], to[j]);
    };
    return (pa == 0 && on(a, p, q)) || (pb == 0 && on(b, p, q)) || (ap == 0 && on(p, a, b)) ||
           (aq == 0 && on(q, a, b));
}

bool segment_intersects_in_plane(const Vec3& p, const Vec3& q, const CornerPlaces& t)
{
    const int k = widest_axis(t);
    for (std::size_t i = 0; i < 3; ++i)
        if (segments_intersect(k, p, q, t[i], t[(i + 1) % 3])) return true;
    const int s0 = orientation_along(k, t[0], t[1], p), s1 = orientation_along(k, t[1], t[2], p),
              s2 = orientation_along(k, t[2], t[0], p);
    return s0 == s1 && s1 == s2; // inside as a whole
}

/// @param side_p  orientation of the triangle and p; side_q of the triangle and q
bool segment_intersects(const Vec3& p, const Vec3& q, int side_p, int side_q, const CornerPlaces& t)
{
    if (side_p * side_q > 0) return false;
    if (side_p == 0 && side_q == 0) return segment_intersects_in_plane(p, q, t);
    const int s0 = orientation(p, q, t[0], t[1]), s1 = orientation(p, q, t[1], t[2]);
    if (s0 * s1 < 0) return false;
    const int s2 = orientation(p, q, t[2], t[0]);
    return s0 * s2 >= 0 && s1 * s2 >= 0;
}

std::array<int, 3> sides(const CornerPlaces& plane, const CornerPlaces& t)
{
    return {orientation(plane[0], plane[1], plane[2], t[0]),
            orientation(plane[0], plane[1], plane[2], t[1]),
            orientation(plane[0], plane[1], plane[2], t[2])};
}

bool one_side(const std::array<int, 3>& s)
{
    return s[0] != 0 && s[0] == s[1] && s[1] == s[2];
}

bool any_edge_intersects(const CornerPlaces& edges_of, const std::array<int, 3>& side,
                         const CornerPlaces& t)
{
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        if (segment_intersects(edges_of[i], edges_of[j], side[i], side[j], t)) return true;
    }
    return false;
}

bool separate_parts_touch(const CornerPlaces& a, const CornerPlaces& b)
{
    const std::array<int, 3> sa = sides(b, a);
    if (one_side(sa)) return false;
    const std::array<int, 3> sb = sides(a, b);
    if (one_side(sb)) return false;
    return any_edge_intersects(a, sa, b) || any_edge_intersects(b, sb, a);
}

/// The edge of a opposite of its corner i, against b.
bool opposite_edge_intersects(const CornerPlaces& a, std::size_t i, const CornerPlaces& b)
{
    const Vec3 &p = a[(i + 1) % 3], &q = a[(i + 2) % 3];
    const int side_p = orientation(b[0], b[1], b[2], p), side_q = orientation(b[0], b[1], b[2], q);
    return segment_intersects(p, q, side_p, side_q, b);
}

/// Both share the edge p, q: they touch elsewhere only if folded flat onto each other.
bool folded(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b)
{
    if (orientation(p, q, a, b) != 0) return false;
    const int k = widest_axis({p, q, a});
    return orientation_along(k, p, q, a) == orientation_along(k, p, q, b);
}

class Pairs {
public:
    explicit Pairs(const SurfaceMesh& mesh) : mesh_(mesh) {}

    CornerPlaces corners(std::int32_t t) const
    {
        const TriangleCorners& v = mesh_.triangles[static_cast<std::size_t>(t)];
        return {point(v[0]), point(v[1]), point(v[2])};
    }

    bool touch(std::int32_t t, std::int32_t u) const
    {
        const TriangleCorners& a = mesh_.triangles[static_cast<std::size_t>(t)];
        const TriangleCorners& b = mesh_.triangles[static_cast<std::size_t>(u)];
        std::array<std::size_t, 3> in_a{}, in_b{};
        std::size_t shared = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t j =
                static_cast<std::size_t>(std::find(b.begin(), b.end(), a[i]) - b.begin());
            if (j == 3) continue;
            in_a[shared] = i;
            in_b[shared++] = j;
        }
        const CornerPlaces ca = corners(t), cb = corners(u);
        if (shared == 0) return separate_parts_touch(ca, cb);
        if (shared == 1)
            return opposite_edge_intersects(ca, in_a[0], cb) ||
                   opposite_edge_intersects(cb, in_b[0], ca);
        if (shared == 2)
            return folded(ca[in_a[0]], ca[in_a[1]], ca[3 - in_a[0] - in_a[1]],
                          cb[3 - in_b[0] - in_b[1]]);
        return true; // the same triangle twice
    }

private:
    const Vec3& point(std::int32_t i) const { return mesh_.points[static_cast<std::size_t>(i)]; }
    const SurfaceMesh& mesh_;
};

// ---- broad phase -------------------------------------------------------------------------

struct Node {
    Box box;
    std::int32_t begin = 0, end = 0; // of the triangles in order
    std::int32_t left = -1;          // its children are left and left + 1; -1 for a leaf
};

class Tree {
public:
    Tree(const Pairs& pairs, std::vector<std::int32_t> triangles) : order_(std::move(triangles))
    {
        boxes_.resize(
            order_.empty()
                ? 0
                : static_cast<std::size_t>(*std::max_element(order_.begin(), order_.end())) + 1);
        for (const std::int32_t t : order_)
            for (const Vec3& x : pairs.corners(t))
                box(t).extend(x);
        nodes_.push_back({{}, 0, static_cast<std::int32_t>(order_.size()), -1});
        for (std::size_t n = 0; n < nodes_.size(); ++n) // children are appended behind
            split(n);
    }

    /// Calls visit(t, u), t < u, for all pairs of triangles whose boxes overlap, until it returns
    /// false.
    /// @return  how many pairs of boxes were examined
    template <class Visit> std::int64_t for_each_pair(Visit visit) const
    {
        std::int64_t visited = 0;
        std::vector<std::array<std::int32_t, 2>> todo = {{0, 0}};
        while (!todo.empty()) {
            const auto [m, n] = todo.back();
            todo.pop_back();
            ++visited;
            const Node &a = node(m), &b = node(n);
            if (m != n && !a.box.intersects(b.box)) continue;
            if (a.left < 0 && b.left < 0) {
                if (!leaf_pairs(a, b, visit, visited)) break;
            } else if (m == n) {
                todo.push_back({a.left, a.left});
                todo.push_back({a.left + 1, a.left + 1});
                todo.push_back({a.left, a.left + 1});
            } else if (b.left < 0 || (a.left >= 0 && a.end - a.begin >= b.end - b.begin)) {
                todo.push_back({a.left, n});
                todo.push_back({a.left + 1, n});
            } else {
                todo.push_back({m, b.left});
                todo.push_back({m, b.left + 1});
            }
        }
        return visited;
    }

private:
    const Node& node(std::int32_t n) const { return nodes_[static_cast<std::size_t>(n)]; }
    Box& box(std::int32_t t) { return boxes_[static_cast<std::size_t>(t)]; }
    const Box& box(std::int32_t t) const { return boxes_[static_cast<std::size_t>(t)]; }

    void split(std::size_t n)
    {
        const std::int32_t begin = nodes_[n].begin, end = nodes_[n].end;
        Box all, centres;
        for (std::int32_t i = begin; i < end; ++i) {
            const Box& b = box(order_[static_cast<std::size_t>(i)]);
            all.extend(b);
            centres.extend(b.center());
        }
        nodes_[n].box = all;
        if (end - begin <= kTriangleLeaf) return;
        int axis = 0;
        centres.sizes().maxCoeff(&axis);
        const std::int32_t middle = begin + (end - begin) / 2;
        std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                         [&](std::int32_t t, std::int32_t u) {
                             const double x = box(t).min()[axis] + box(t).max()[axis];
                             const double y = box(u).min()[axis] + box(u).max()[axis];
                             return x < y || (x == y && t < u);
                         });
        nodes_[n].left = static_cast<std::int32_t>(nodes_.size());
        nodes_.push_back({{}, begin, middle, -1});
        nodes_.push_back({{}, middle, end, -1});
    }

    template <class Visit>
    bool leaf_pairs(const Node& a, const Node& b, Visit& visit, std::int64_t& visited) const
    {
        for (std::int32_t i = a.begin; i < a.end; ++i) {
            const std::int32_t t = order_[static_cast<std::size_t>(i)];
            for (std::int32_t j = &a == &b ? i + 1 : b.begin; j < b.end; ++j) {
                const std::int32_t u = order_[static_cast<std::size_t>(j)];
                ++visited;
                if (box(t).intersects(box(u)) && !visit(std::min(t, u), std::max(t, u)))
                    return false;
            }
        }
        return true;
    }

    std::vector<std::int32_t> order_;
    std::vector<Box> boxes_; // of each triangle
    std::vector<Node> nodes_;
};

bool has_area(const CornerPlaces& t)
{
    for (int k = 0; k < 3; ++k)
        if (orientation_along(k, t[0], t[1], t[2]) != 0) return true;
    return false;
}

} // namespace

SelfIntersections find_self_intersections(const SurfaceMesh& mesh, std::size_t most)
{
    const Pairs pairs(mesh);
    std::vector<std::int32_t> triangles(mesh.triangles.size());
    std::iota(triangles.begin(), triangles.end(), 0);
    std::erase_if(triangles, [&](std::int32_t t) { return !has_area(pairs.corners(t)); });
    const Tree tree(pairs, std::move(triangles));

    SelfIntersections found;
    found.compared = tree.for_each_pair([&](std::int32_t t, std::int32_t u) {
        if (!pairs.touch(t, u)) return true;
        ++found.count;
        // A heap of the smallest ones: what is shown does not depend on the walk.
        found.pairs.push_back({t, u});
        std::push_heap(found.pairs.begin(), found.pairs.end());
        if (found.pairs.size() > most) {
            std::pop_heap(found.pairs.begin(), found.pairs.end());
            found.pairs.pop_back();
        }
        return found.count < kMostCounted;
    });
    std::sort_heap(found.pairs.begin(), found.pairs.end());
    return found;
}

} // namespace amontons
