#include "mesh/bounding_tree.hpp"

#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numeric>

namespace amontons {

namespace {

constexpr std::int32_t kTreeLeaf = 4;

double squared_to_box(const Eigen::Array3d& x, const Eigen::Array3d& low,
                      const Eigen::Array3d& high)
{
    double sum = 0;
    for (int a = 0; a < 3; ++a) {
        const double off = std::max(std::max(low[a] - x[a], x[a] - high[a]), 0.0);
        sum += off * off;
    }
    return sum;
}

// The same for a search, which takes most of the time of many detections: three axes at once, the
// fourth lane unused.
typedef double Lanes __attribute__((vector_size(32)));
typedef long long LaneBits __attribute__((vector_size(32)));

Lanes larger(Lanes a, Lanes b)
{
    return a > b ? a : b;
}
/// Three numbers, and a fourth that stands behind them.
Lanes three_from(const void* from)
{
    Lanes lanes;
    std::memcpy(&lanes, from, sizeof lanes);
    return lanes;
}
double squared_to_box(Lanes x, Lanes low, Lanes high)
{
    constexpr LaneBits kThree{-1, -1, -1, 0};
    const auto off = Lanes(LaneBits(larger(larger(low - x, x - high), Lanes{})) & kThree);
    const Lanes square = off * off;
    return square[0] + square[1] + square[2];
}

} // namespace

namespace {

std::vector<BoundingTree::Corners> tree_corners(const SurfaceMesh& mesh)
{
    std::vector<BoundingTree::Corners> corners;
    corners.reserve(mesh.triangles.size());
    for (const auto& [a, b, c] : mesh.triangles)
        corners.push_back({mesh.points[at(a)], mesh.points[at(b)], mesh.points[at(c)]});
    return corners;
}

} // namespace

BoundingTree::BoundingTree(const SurfaceMesh& mesh) : BoundingTree(tree_corners(mesh)) {}

BoundingTree::BoundingTree(std::vector<Corners> triangles) : corners_(std::move(triangles))
{
    const auto count = static_cast<std::int32_t>(corners_.size());
    std::vector<Vec3> centres(corners_.size());
    for (std::size_t i = 0; i < corners_.size(); ++i)
        centres[i] = (corners_[i].a + corners_[i].b + corners_[i].c) / 3;
    order_.resize(corners_.size());
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.reserve(corners_.size());
    nodes_.emplace_back();
    split_(0, 0, count, centres);
    std::vector<Corners> sorted;
    sorted.reserve(corners_.size());
    place_.resize(order_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) {
        sorted.push_back(corners_[at(order_[i])]);
        place_[at(order_[i])] = static_cast<std::int32_t>(i);
    }
    corners_ = std::move(sorted);
}

void BoundingTree::split_(std::int32_t node, std::int32_t first, std::int32_t count,
                          std::vector<Vec3>& centres)
{
    Node box;
    box.low.setConstant(std::numeric_limits<double>::infinity());
    box.high = -box.low;
    Eigen::Array3d low = box.low, high = box.high;
    for (std::int32_t i = first; i < first + count; ++i) {
        const Corners& t = corners_[at(order_[at(i)])];
        box.low = box.low.min(t.a.array()).min(t.b.array()).min(t.c.array());
        box.high = box.high.max(t.a.array()).max(t.b.array()).max(t.c.array());
        low = low.min(centres[at(order_[at(i)])].array());
        high = high.max(centres[at(order_[at(i)])].array());
    }
    if (count <= kTreeLeaf) {
        box.first = first;
        box.count = count;
        nodes_[at(node)] = box;
        return;
    }
    Eigen::Index axis = 0;
    (high - low).maxCoeff(&axis);
    const std::int32_t half = count / 2;
    std::nth_element(order_.begin() + first, order_.begin() + first + half,
                     order_.begin() + first + count, [&](std::int32_t i, std::int32_t j) {
                         const double u = centres[at(i)][axis], v = centres[at(j)][axis];
                         return u != v ? u < v : i < j;
                     });
    box.first = static_cast<std::int32_t>(nodes_.size());
    nodes_[at(node)] = box;
    nodes_.resize(nodes_.size() + 2);
    split_(box.first, first, half, centres);
    split_(box.first + 1, first + half, count - half, centres);
}

TrianglePoint BoundingTree::closest_(const Vec3& x, std::int32_t place) const
{
    const Corners& t = corners_[at(place)];
    return closest_on_triangle(x, t.a, t.b, t.c);
}

NearestTriangle BoundingTree::nearest(const Vec3& x, std::int32_t near, double slack,
                                      double band) const
{
    NearestTriangle best;
    best.squared = std::numeric_limits<double>::infinity();
    if (near >= 0 && at(near) < place_.size()) {
        const TrianglePoint p = closest_(x, place_[at(near)]);
        best = {near, p, (x - p.point).squaredNorm()};
    }
    search_(x, slack, band, best);
    if (best.triangle < 0) { // x is no number: any
        const TrianglePoint p = closest_(x, 0);
        best = {order_[0], p, (x - p.point).squaredNorm()};
    }
    return best;
}

NearestTriangle BoundingTree::nearest_within(const Vec3& x, std::int32_t near) const
{
    if (near < 0 || at(near) >= place_.size()) return nearest(x, -1);
    // A little more than that distance: `near` itself is found again, in its turn, and boxes and
    // triangles round differently.
    constexpr double kMore = 1 + 1e-9;
    NearestTriangle best;
    best.squared = (x - closest_(x, place_[at(near)]).point).squaredNorm() * kMore +
                   std::numeric_limits<double>::min();
    search_(x, 0, 0, best);
    return best.triangle < 0 ? nearest(x, -1) : best;
}

void BoundingTree::search_(const Vec3& x, double slack, double band, NearestTriangle& best) const
{
    const double worth = 1 / ((1 + slack) * (1 + slack)), band2 = band * band;
    // Depth is at most 31 + 2, each level leaves one node waiting.
    struct Waiting {
        std::int32_t node;
        double squared;
    };
    Waiting stack[72];
    int top = 0;
    const Lanes q{x[0], x[1], x[2], 0};
    const auto to_box = [&](std::int32_t node) {
        // Behind low stands high, behind that the numbers of the node.
        static_assert(sizeof(Node) >= offsetof(Node, high) + sizeof(Lanes));
        const auto* bytes = reinterpret_cast<const std::byte*>(&nodes_[at(node)]);
        return squared_to_box(q, three_from(bytes + offsetof(Node, low)),
                              three_from(bytes + offsetof(Node, high)));
    };
    stack[top++] = {0, to_box(0)};
    while (top > 0) {
        const Waiting next = stack[--top];
        if (next.squared >= (best.squared > band2 ? worth : 1.0) * best.squared) continue;
        const Node& node = nodes_[at(next.node)];
        if (node.count > 0) {
            for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
                const TrianglePoint p = closest_(x, i);
                const double squared = (x - p.point).squaredNorm();
                if (squared < best.squared) best = {order_[at(i)], p, squared};
            }
            continue;
        }
        Waiting a{node.first, to_box(node.first)}, b{node.first + 1, to_box(node.first + 1)};
        if (a.squared < b.squared) std::swap(a, b); // the nearer one is taken first
        stack[top++] = a;
        stack[top++] = b;
    }
}

void BoundingTree::within(const Vec3& centre, double radius,
                          std::vector<std::int32_t>& triangles) const
{
    triangles.clear();
    std::int32_t stack[72];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const Node& node = nodes_[at(stack[--top])];
        if (squared_to_box(centre.array(), node.low, node.high) > radius * radius) continue;
        if (node.count > 0) {
            for (std::int32_t i = node.first; i < node.first + node.count; ++i)
                triangles.push_back(order_[at(i)]);
        } else {
            stack[top++] = node.first + 1;
            stack[top++] = node.first;
        }
    }
}

} // namespace amontons
