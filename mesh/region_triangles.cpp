#include "mesh/region_triangles.hpp"

#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

// A triangle lies in a disc of its plane: a place at height h over the plane, and aside from the
// disc's centre by a, is at least sqrt(h^2 + max(a - radius, 0)^2) from it. Eight such bounds are
// computed at once, in single precision and parts of the region's size; where one is small enough,
// so are the distances of the eight triangles themselves.

namespace amontons {
namespace {
constexpr float kFloatRounding = 2e-6F; // of a squared bound: ten times what its terms round
constexpr float kNowhere = 1e15F;       // the middle of a disc that no query reaches
constexpr double kNeedle = 1e-3;        // of a triangle's area per squared size

typedef float Eight __attribute__((vector_size(32)));
typedef std::int32_t EightNumbers __attribute__((vector_size(32)));
typedef long long FourMasks __attribute__((vector_size(32)));

Eight lanes_of(const Eigen::Array<float, 8, 1>& values)
{
    Eight lanes;
    std::memcpy(&lanes, values.data(), sizeof lanes);
    return lanes;
}

Eight min_of(Eight a, Eight b)
{
    return a < b ? a : b;
}
Eight max_of(Eight a, Eight b)
{
    return a > b ? a : b;
}

/// Vectors of eight.
struct Eight3 {
    Eight x, y, z;
};
Eight3 lanes_of(const Eigen::Array<float, 8, 1>* v)
{
    return {lanes_of(v[0]), lanes_of(v[1]), lanes_of(v[2])};
}
Eight dot(const Eight3& a, const Eight3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Eight3 minus(const Eight3& a, const Eight3& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
/// Squared distance of q from the segment from 0 to b, with q . b and b . b.
Eight to_segment(const Eight3& q, const Eight3& b, Eight qb, Eight bb)
{
    const Eight t = min_of(max_of(qb / bb, Eight{}), Eight{} + 1);
    const Eight3 off{q.x - t * b.x, q.y - t * b.y, q.z - t * b.z};
    return dot(off, off);
}

/// Squared distances of a place, from each triangle's corner a, from the triangles with those
/// sides; 0 for needles, whose normal is 0.
Eight squared_from(const Eight3& q, const Eight3& ab, const Eight3& ac, const Eight3& normal)
{
    const Eight3 bc = minus(ac, ab), from_b = minus(q, ab);
    const Eight d1 = dot(q, ab), d2 = dot(q, ac), g11 = dot(ab, ab), g22 = dot(ac, ac),
                g12 = dot(ab, ac), height = dot(q, normal);
    const Eight v = g22 * d1 - g12 * d2, w = g11 * d2 - g12 * d1;
    const Eight on_border = min_of(
        to_segment(q, ab, d1, g11),
        min_of(to_segment(q, ac, d2, g22), to_segment(from_b, bc, dot(from_b, bc), dot(bc, bc))));
    const EightNumbers over = (v >= 0) & (w >= 0) & (v + w <= g11 * g22 - g12 * g12);
    const EightNumbers needle = dot(normal, normal) < 0.5F;
    return (over | needle) ? height * height : on_border;
}

bool any_at_most(const Eigen::Array<float, 8, 1>& values, float limit)
{
    const auto mask = FourMasks(lanes_of(values) <= limit);
    return ((mask[0] | mask[1]) | (mask[2] | mask[3])) != 0;
}
} // namespace

/// What a squared distance is compared with, in parts of the scale.
float RegionTriangles::limit_(double squared) const
{
    return float(squared / (scale_ * scale_)) + margin_;
}

void RegionTriangles::add_(std::int32_t triangle, const std::array<float, 7>& disc, const Vec3& a,
                           const Vec3& ab, const Vec3& ac)
{
    const int lane = int(triangles_.size() % kAtOnce);
    if (lane == 0) {
        Discs& d = discs_.emplace_back();
        d.x.setConstant(kNowhere);
        d.y = d.z = d.radius = d.nx = d.ny = d.nz = Many::Zero();
        Corners& c = corners_.emplace_back();
        for (int k = 0; k < 3; ++k)
            c.a[k] = c.ab[k] = c.ac[k] = Many::Zero();
    }
    triangles_.push_back(triangle);
    Discs& d = discs_.back();
    Many* to[] = {&d.x, &d.y, &d.z, &d.radius, &d.nx, &d.ny, &d.nz};
    for (std::size_t i = 0; i < disc.size(); ++i)
        (*to[i])[lane] = disc[i];
    Corners& c = corners_.back();
    for (int k = 0; k < 3; ++k) {
        c.a[k][lane] = float(a[k]);
        c.ab[k][lane] = float(ab[k]);
        c.ac[k][lane] = float(ac[k]);
    }
}

std::array<const Vec3*, 3> RegionTriangles::corners_at_(std::int32_t triangle) const
{
    const auto& [a, b, c] = mesh_->triangles[at(triangle)];
    return {&mesh_->points[at(a)], &mesh_->points[at(b)], &mesh_->points[at(c)]};
}

double RegionTriangles::gather(const SurfaceMesh& mesh, const BoundingTree& tree,
                               const Vec3& centre, double radius, std::int32_t close)
{
    mesh_ = &mesh;
    tree_ = &tree;
    origin_ = centre;
    triangles_.clear();
    discs_.clear();
    corners_.clear();
    const double away = std::sqrt(tree.nearest(centre, close).squared);
    // A point of the region is within radius + away of the surface, its nearest triangle
    // within another radius of the centre.
    const double reach = (away + 2 * radius) * (1 + 1e-9);
    scale_ = std::max(reach, std::numeric_limits<double>::min());
    double farthest = 1;
    tree.within(centre, reach, near_);
    for (const std::int32_t triangle : near_) {
        const auto corner = corners_at_(triangle);
        const Vec3 a = *corner[0] - centre, b = *corner[1] - centre, c = *corner[2] - centre;
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
              float(size / scale_), float(normal[0]), float(normal[1]), float(normal[2])},
             a / scale_, (b - a) / scale_, (c - a) / scale_);
    }
    margin_ = kFloatRounding * float((1 + farthest) * (1 + farthest));
    all_.resize(discs_.size());
    std::iota(all_.begin(), all_.end(), 0);
    selected_ = all_;
    bounds_.resize(discs_.size());
    return away;
}

void RegionTriangles::select(const Vec3& centre, double radius)
{
    const double reach = std::sqrt(nearest_(centre, all_).squared) + 2 * radius;
    const float limit = limit_(reach * reach);
    selected_.clear();
    for (const std::int32_t k : all_) // their bounds are those of the centre
        if (any_at_most(bounds_[at(k)], limit)) selected_.push_back(k);
}

NearestTriangle RegionTriangles::nearest(const Vec3& x) const
{
    return nearest_(x, selected_);
}

NearestTriangle RegionTriangles::nearest_(const Vec3& x, std::span<const std::int32_t> blocks) const
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
    const auto least_of = [](const Eight& values) {
        int lane = 0;
        for (int j = 1; j < kAtOnce; ++j)
            if (values[j] < values[lane]) lane = j;
        return lane;
    };
    const std::size_t first = at(of_block[least_of(least)]);

    // ---- The triangles themselves, from the least bound on
    NearestTriangle best;
    float limit = std::numeric_limits<float>::max();
    const auto visit = [&](std::size_t k) {
        const Discs& d = discs_[at(blocks[k])];
        const Corners& c = corners_[at(blocks[k])];
        const Eight3 a = lanes_of(c.a), from_a{p[0] - a.x, p[1] - a.y, p[2] - a.z},
                     normal{lanes_of(d.nx), lanes_of(d.ny), lanes_of(d.nz)};
        Eight bound = max_of(lanes_of(bounds_[k]),
                             squared_from(from_a, lanes_of(c.ab), lanes_of(c.ac), normal));
        for (int lane = least_of(bound); bound[lane] <= limit; lane = least_of(bound)) {
            bound[lane] = std::numeric_limits<float>::infinity();
            const std::int32_t i = triangles_[kAtOnce * at(blocks[k]) + std::size_t(lane)];
            const auto corner = corners_at_(i);
            const TrianglePoint place = closest_on_triangle(x, *corner[0], *corner[1], *corner[2]);
            const double squared = (x - place.point).squaredNorm();
            if (best.triangle >= 0 && squared >= best.squared) continue;
            best = {i, place, squared};
            limit = limit_(squared);
        }
    };
    visit(first);
    for (std::size_t k = 0; k < blocks.size(); ++k)
        if (k != first && any_at_most(bounds_[k], limit)) visit(k);
    return best.triangle >= 0 ? best : tree_->nearest(x, -1); // beyond what floats hold
}

} // namespace amontons
