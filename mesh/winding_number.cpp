#include "mesh/winding_number.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace amontons {
namespace {

constexpr std::int32_t kGroupLeaf = 8;
// Distance / radius from which a group is one: the sum errs by < 0.1.
constexpr double kFarGroup = 3;

Vec3 middle(const Vec3& a, const Vec3& b, const Vec3& c)
{
    return (a + b + c) / 3;
}

/// Of a triangle seen from the origin, > 0 where its normal points away.
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c)
{
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    return 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

} // namespace

WindingNumber::WindingNumber(const SurfaceMesh& mesh)
{
    for (const auto& t : mesh.triangles)
        corners_.push_back({mesh.points[static_cast<std::size_t>(t[0])],
                            mesh.points[static_cast<std::size_t>(t[1])],
                            mesh.points[static_cast<std::size_t>(t[2])]});
    nodes_.emplace_back();
    split_(0, 0, static_cast<std::int32_t>(corners_.size()));
}

void WindingNumber::split_(std::int32_t node, std::int32_t first, std::int32_t count)
{
    Node n;
    const auto begin = corners_.begin() + first, end = begin + count;
    double weight = 0;
    Eigen::AlignedBox3d box;
    for (auto t = begin; t != end; ++t) {
        const Vec3 area = 0.5 * (t->b - t->a).cross(t->c - t->a);
        n.area += area;
        n.centre += area.norm() * middle(t->a, t->b, t->c);
        weight += area.norm();
        box.extend(t->a).extend(t->b).extend(t->c);
    }
    n.centre = weight > 0 ? Vec3(n.centre / weight) : Vec3(box.center());
    for (auto t = begin; t != end; ++t)
        for (const Vec3* p : {&t->a, &t->b, &t->c})
            n.radius = std::max(n.radius, (*p - n.centre).norm());
    if (count <= kGroupLeaf) {
        n.first = first;
        n.count = count;
        nodes_[static_cast<std::size_t>(node)] = n;
        return;
    }
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    std::nth_element(begin, begin + count / 2, end, [axis](const Corners& s, const Corners& t) {
        return middle(s.a, s.b, s.c)[axis] < middle(t.a, t.b, t.c)[axis];
    });
    n.first = static_cast<std::int32_t>(nodes_.size());
    nodes_[static_cast<std::size_t>(node)] = n;
    nodes_.resize(nodes_.size() + 2);
    split_(n.first, first, count / 2);
    split_(n.first + 1, first + count / 2, count - count / 2);
}

double WindingNumber::at(const Vec3& x) const
{
    double sum = 0; // of solid angles
    std::int32_t open[128];
    int last = 0;
    open[0] = 0;
    while (last >= 0) {
        const Node& n = nodes_[static_cast<std::size_t>(open[last--])];
        const Vec3 to = n.centre - x;
        const double squared = to.squaredNorm();
        if (squared > kFarGroup * kFarGroup * n.radius * n.radius) {
            sum += to.dot(n.area) / (squared * std::sqrt(squared));
            continue;
        }
        for (std::int32_t i = n.first; i < n.first + n.count; ++i) {
            const Corners& t = corners_[static_cast<std::size_t>(i)];
            sum += solid_angle(t.a - x, t.b - x, t.c - x);
        }
        if (n.count == 0) {
            open[++last] = n.first;
            open[++last] = n.first + 1;
        }
    }
    return sum / (4 * std::numbers::pi);
}

} // namespace amontons
