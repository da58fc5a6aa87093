#include "mesh/nearby_triangles.hpp"

#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

// A triangle lies in a disc of its plane: a place at height h over the plane, and aside from the
// disc's centre by a, is at least sqrt(h^2 + max(a - radius, 0)^2) from it. Eight such bounds are
// computed at once, in single precision and parts of the region's size.

namespace amontons {
namespace {
constexpr float kFloatRounding = 2e-6F; // of a squared bound: ten times what its terms round
constexpr float kNowhere = 1e15F;       // the middle of a disc that no query reaches
constexpr double kNeedle = 1e-6;        // of a triangle's area per squared size

typedef float Eight __attribute__((vector_size(32)));
typedef std::int32_t EightNumbers __attribute__((vector_size(32)));
typedef long long FourMasks __attribute__((vector_size(32)));

Eight lanes_of(const Eigen::Array<float, 8, 1>& values)
{
    Eight lanes;
    std::memcpy(&lanes, values.data(), sizeof lanes);
    return lanes;
}

bool any_at_most(const Eigen::Array<float, 8, 1>& values, float limit)
{
    const auto mask = FourMasks(lanes_of(values) <= limit);
    return ((mask[0] | mask[1]) | (mask[2] | mask[3])) != 0;
}
} // namespace

/// What a squared distance is compared with, in parts of the scale.
float NearbyTriangles::limit_(double squared) const
{
    return float(squared / (scale_ * scale_)) + margin_;
}

void NearbyTriangles::add_(std::int32_t triangle, const std::array<float, 7>& disc)
{
    const int lane = int(triangles_.size() % kAtOnce);
    if (lane == 0) {
        Discs& d = discs_.emplace_back();
        d.x.setConstant(kNowhere);
        d.y = d.z = d.radius = d.nx = d.ny = d.nz = Many::Zero();
    }
    triangles_.push_back(triangle);
    Discs& d = discs_.back();
    Many* to[] = {&d.x, &d.y, &d.z, &d.radius, &d.nx, &d.ny, &d.nz};
    for (std::size_t i = 0; i < disc.size(); ++i)
        (*to[i])[lane] = disc[i];
}

double NearbyTriangles::gather(const BoundingTree& tree, const Vec3& centre, double radius,
                               std::int32_t close)
{
    tree_ = &tree;
    origin_ = centre;
    triangles_.clear();
    discs_.clear();
    const double away = std::sqrt(tree.nearest(centre, close).squared);
    // A point of the region is within radius + away of the surface, its nearest triangle
    // within another radius of the centre.
    const double reach = (away + 2 * radius) * (1 + 1e-9);
    scale_ = std::max(reach, std::numeric_limits<double>::min());
    double farthest = 1;
    tree.within(centre, reach, near_);
    for (const std::int32_t triangle : near_) {
        const BoundingTree::Corners& t = tree.corners_[at(tree.place_[at(triangle)])];
        const Vec3 a = t.a - centre, b = t.b - centre, c = t.c - centre;
        const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(),
                     ca = (a - c).squaredNorm();
        // Of a triangle with a right angle or more, the longest side is the disc's diameter.
        Vec3 middle = (a + b + c) / 3;
        double size2 = std::max(
            {(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()});
        if (ab >= bc + ca)
            middle = (a + b) / 2, size2 = ab / 4;
        else if (bc >= ca + ab)
            middle = (b + c) / 2, size2 = bc / 4;
        else if (ca >= ab + bc)
            middle = (c + a) / 2, size2 = ca / 4;
        const double size = std::sqrt(size2), limit = reach + size;
        if (middle.squaredNorm() > limit * limit * (1 + 1e-9)) continue;
        const Vec3 area = (b - a).cross(c - a);
        const double twice = area.norm();
        // Of a needle the plane is not known.
        const Vec3 normal = twice > kNeedle * size2 ? Vec3(area / twice) : Vec3(Vec3::Zero());
        farthest = std::max(farthest, (middle.norm() + size) / scale_);
        add_(triangle,
             {float(middle[0] / scale_), float(middle[1] / scale_), float(middle[2] / scale_),
              float(size / scale_), float(normal[0]), float(normal[1]), float(normal[2])});
    }
    margin_ = kFloatRounding * float((1 + farthest) * (1 + farthest));
    all_.resize(discs_.size());
    std::iota(all_.begin(), all_.end(), 0);
    selected_ = all_;
    bounds_.resize(discs_.size());
    return away;
}

void NearbyTriangles::select(const Vec3& centre, double radius)
{
    const double reach = std::sqrt(nearest_(centre, all_).squared) + 2 * radius;
    const float limit = limit_(reach * reach);
    selected_.clear();
    for (const std::int32_t k : all_) // their bounds are those of the centre
        if (any_at_most(bounds_[at(k)], limit)) selected_.push_back(k);
}

NearestTriangle NearbyTriangles::nearest(const Vec3& x) const
{
    return nearest_(x, selected_);
}

NearestTriangle NearbyTriangles::nearest_(const Vec3& x, std::span<const std::int32_t> blocks) const
{
    // ---- Bounds, and the triangle with the least one
    const Eigen::Vector3f p = ((x - origin_) / scale_).cast<float>();
    Eight least = Eight{} + std::numeric_limits<float>::max();
    EightNumbers of_block{};
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const Discs& d = discs_[at(blocks[k])];
        const Many dx = p[0] - d.x, dy = p[1] - d.y, dz = p[2] - d.z;
        const Many height = d.nx * dx + d.ny * dy + d.nz * dz, height2 = height * height;
        const Many aside = (dx * dx + dy * dy + dz * dz - height2).max(0.0F).sqrt();
        const Many beyond = (aside - d.radius).max(0.0F);
        bounds_[k] = height2 + beyond * beyond;
        const Eight bound = lanes_of(bounds_[k]);
        const EightNumbers less = bound < least;
        least = less ? bound : least;
        of_block = less ? EightNumbers{} + static_cast<std::int32_t>(k) : of_block;
    }
    int lane = 0;
    for (int j = 1; j < kAtOnce; ++j)
        if (least[j] < least[lane]) lane = j;

    // ---- The triangles themselves, that one first
    NearestTriangle best;
    float limit = std::numeric_limits<float>::max();
    const auto visit = [&](std::size_t k, int j) {
        const auto i = at(triangles_[kAtOnce * at(blocks[k]) + std::size_t(j)]);
        const auto& t = tree_->corners_[at(tree_->place_[i])];
        const TrianglePoint at_t = closest_on_triangle(x, t.a, t.b, t.c);
        const double squared = (x - at_t.point).squaredNorm();
        if (best.triangle >= 0 && squared >= best.squared) return;
        best = {static_cast<std::int32_t>(i), at_t, squared};
        limit = limit_(squared);
    };
    const std::size_t first = at(of_block[lane]);
    visit(first, lane);
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (!any_at_most(bounds_[k], limit)) continue;
        for (int j = 0; j < kAtOnce; ++j)
            if (bounds_[k][j] <= limit && (k != first || j != lane)) visit(k, j);
    }
    return best;
}

} // namespace amontons
