#pragma once

#include "mesh/box_tree.hpp"
#include "mesh/closest_point.hpp"
#include "mesh/surface_mesh.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace amontons {

/// Least direction . x of the points of a box, or a little less: no rounding of it is below [m].
inline double lowest_along(const BoundingBox& box, const Vec3& direction)
{
    constexpr double kRounding = 1e-14;
    const Eigen::Array3d low = direction.array() * box.low, high = direction.array() * box.high;
    return low.min(high).sum() - kRounding * low.abs().max(high.abs()).sum();
}

/// The nearest place on a surface.
struct NearestTriangle {
    /// Number of the triangle; -1: none.
    std::int32_t triangle = -1;
    /// Nearest place on it.
    TrianglePoint at;
    double squared = 0; ///< squared distance [m^2]
};

/// A tree of axis-aligned boxes over the triangles of a surface, for nearest points.
class BoundingTree {
public:
    /// The corners of a triangle [m].
    struct Corners {
        Vec3 a, b, c; ///< places
    };

    /// @param mesh  at least one triangle; its corners are copied
    explicit BoundingTree(const SurfaceMesh& mesh);
    /// @param triangles  at least one
    explicit BoundingTree(std::vector<Corners> triangles);

    /// The triangle nearest to x and the point of it; among triangles that share that point,
    /// any of them.
    /// @param near   a triangle that is probably near, or -1: makes it fast
    /// @param slack  what is found may be farther than the nearest by this part of the distance,
    /// @param band   but not when it is nearer than this [m]
    /// Cost: 0.2-0.5 us with a good `near`, logarithmic in the number of triangles.
    NearestTriangle nearest(const Vec3& x, std::int32_t near, double slack = 0,
                            double band = 0) const;

    /// What nearest(x, -1) finds, the same triangle among equally near ones, in the time that a
    /// good `near` takes: what is farther than that triangle is left out from the start.
    NearestTriangle nearest_within(const Vec3& x, std::int32_t near) const;

    /// The triangles that a ball touches, and possibly some others near it, replacing `triangles`.
    /// @param centre, radius  [m]
    void within(const Vec3& centre, double radius, std::vector<std::int32_t>& triangles) const;

    /// Calls visit(std::int32_t) for each triangle whose box touches this one, in no certain order.
    template <class Visit> void visit(const BoundingBox& box, Visit visit) const
    {
        visit_where([&](const BoundingBox& own) { return own.touches(box); }, visit);
    }

    /// Calls visit(std::int32_t) for each triangle whose box passes a test, as do all boxes around
    /// it in the tree, in no certain order.
    /// @param test  of a BoundingBox
    template <class Test, class Visit> void visit_where(Test test, Visit visit) const
    {
        // Depth is at most 31 + 2, each level leaves one node waiting.
        std::int32_t stack[72];
        int count = 0;
        stack[count++] = 0;
        while (count > 0) {
            const Node& node = nodes_[static_cast<std::size_t>(stack[--count])];
            if (!test(BoundingBox{node.low, node.high})) continue;
            if (node.count == 0) {
                stack[count++] = node.first + 1;
                stack[count++] = node.first;
                continue;
            }
            for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
                const auto& [a, b, c] = corners_[static_cast<std::size_t>(i)];
                if (test(BoundingBox{a.array().min(b.array()).min(c.array()),
                                     a.array().max(b.array()).max(c.array())}))
                    visit(order_[static_cast<std::size_t>(i)]);
            }
        }
    }

    /// Searches the least value(std::int32_t) of all triangles, the lower halves of the tree first:
    /// what lies in boxes whose bound is above the least value so far is left out.
    /// @param bound  of a BoundingBox: no value in it is below
    template <class Bound, class Value> double least(Bound bound, Value value) const
    {
        double best = std::numeric_limits<double>::infinity();
        struct Waiting {
            std::int32_t node;
            double bound;
        };
        const auto waiting = [&](std::int32_t k) {
            const Node& node = nodes_[static_cast<std::size_t>(k)];
            return Waiting{k, bound(BoundingBox{node.low, node.high})};
        };
        Waiting stack[72];
        int count = 0;
        stack[count++] = waiting(0);
        while (count > 0) {
            const Waiting next = stack[--count];
            if (next.bound > best) continue;
            const Node& node = nodes_[static_cast<std::size_t>(next.node)];
            if (node.count > 0) {
                for (std::int32_t i = node.first; i < node.first + node.count; ++i)
                    best = std::min(best, double(value(order_[static_cast<std::size_t>(i)])));
                continue;
            }
            Waiting low = waiting(node.first), high = waiting(node.first + 1);
            if (high.bound < low.bound) std::swap(low, high);
            stack[count++] = high;
            stack[count++] = low;
        }
        return best;
    }

private:
    struct Node {
        Eigen::Array3d low, high;
        std::int32_t first = 0; ///< leaf: position in order_; else left child, right is the next
        std::int32_t count = 0; ///< of triangles in a leaf; 0: inner node
    };

    void split_(std::int32_t node, std::int32_t first, std::int32_t count,
                std::vector<Vec3>& centres);
    /// Takes what is nearer than `best`, first come first served.
    void search_(const Vec3& x, double slack, double band, NearestTriangle& best) const;
    TrianglePoint closest_(const Vec3& x, std::int32_t place) const;

    std::vector<Node> nodes_;
    std::vector<std::int32_t> order_; ///< triangles, leaf by leaf
    std::vector<Corners> corners_;    ///< in that order
    std::vector<std::int32_t> place_; ///< of a triangle in that order
};

} // namespace amontons
