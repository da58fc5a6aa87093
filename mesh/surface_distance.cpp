#include "mesh/surface_distance.hpp"

#include "mesh/base/index.hpp"
#include "mesh/region_triangles.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace amontons {

namespace {

/// Triangles around a brick, from which on those around parts of it are selected first, of so many
/// samples along an edge.
constexpr std::size_t kManyNearby = 64;
constexpr int kPart = 2;
/// What a search for a bound may be off the least distance, in parts of it: at places that are
/// equally far from many triangles the least one takes a search among all of them.
constexpr double kSlack = 0.05;
constexpr double kExactBound = 1.0 / 3; // of the band: what is nearer has no slack
constexpr double kBoundRounding = 1e-9;

} // namespace

SurfaceDistance::SurfaceDistance(SmoothSurface smooth, int cuts, double band)
    : smooth_{std::move(smooth)}
    , cuts_{cuts}
    , band_{band}
    , refined_{smooth_.refined(cuts)}
    , tree_{refined_}
{
    const auto& triangles = refined_.triangles;
    const auto& points = refined_.points;
    face_normals_.resize(triangles.size());
    vertex_normals_.assign(points.size(), Vec3::Zero());
    neighbours_.assign(triangles.size(), {-1, -1, -1});
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& t = triangles[i];
        const Vec3 area =
            (points[at(t[1])] - points[at(t[0])]).cross(points[at(t[2])] - points[at(t[0])]);
        face_normals_[i] = area.norm() > 0 ? area.normalized() : Vec3{Vec3::Zero()};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 a = points[at(t[(k + 1) % 3])] - points[at(t[k])],
                       b = points[at(t[(k + 2) % 3])] - points[at(t[k])];
            vertex_normals_[at(t[k])] += std::atan2(a.cross(b).norm(), a.dot(b)) * face_normals_[i];
        }
    }
    chord_error_ = chord_error(triangles.size());
    for_each_edge(sorted_half_edges(refined_), [&](std::span<const HalfEdge> sides) {
        if (sides.size() != 2) return;
        for (std::size_t s = 0; s < 2; ++s) {
            const auto& t = triangles[at(sides[s].triangle)];
            const auto k =
                static_cast<std::size_t>(std::find(t.begin(), t.end(), sides[s].begin) - t.begin());
            neighbours_[at(sides[s].triangle)][k] = sides[1 - s].triangle;
        }
    });
}

double SurfaceDistance::chord_error(std::size_t patches) const
{
    double worst = 0;
    const auto pieces = static_cast<std::size_t>(cuts_ * cuts_);
    for (std::size_t i = 0; i < std::min(patches * pieces, refined_.triangles.size()); ++i) {
        const auto& [a, b, c] = refined_.triangles[i];
        const Vec3 flat =
            (refined_.points[at(a)] + refined_.points[at(b)] + refined_.points[at(c)]) / 3;
        const auto number = static_cast<std::int32_t>(i);
        const Vec3 curved =
            smooth_.point(number / (cuts_ * cuts_),
                          smooth_.weights_in_patch(number, cuts_, Vec3::Constant(1.0 / 3)));
        // The middle of an edge is off by up to 4/3 of what the centre is.
        worst = std::max(worst, 4.0 / 3 * (flat - curved).norm());
    }
    return worst;
}

Vec3 SurfaceDistance::pseudo_normal_(const NearestTriangle& place) const
{
    const auto& t = refined_.triangles[at(place.triangle)];
    const Vec3& own = face_normals_[at(place.triangle)];
    const auto across = [&](std::size_t edge) -> Vec3 {
        const std::int32_t other = neighbours_[at(place.triangle)][edge];
        return other < 0 ? own : Vec3{own + face_normals_[at(other)]};
    };
    switch (place.at.feature) {
    case TriangleFeature::face:
        return own;
    case TriangleFeature::edge0:
        return across(0);
    case TriangleFeature::edge1:
        return across(1);
    case TriangleFeature::edge2:
        return across(2);
    case TriangleFeature::vertex0:
        return vertex_normals_[at(t[0])];
    case TriangleFeature::vertex1:
        return vertex_normals_[at(t[1])];
    case TriangleFeature::vertex2:
        return vertex_normals_[at(t[2])];
    }
    return own;
}

double SurfaceDistance::distance(const Vec3& x, std::int32_t& near) const
{
    const NearestTriangle place = tree_.nearest(x, near);
    near = place.triangle;
    SmoothSurface::Patch last;
    return from_place_(x, place, last);
}

double SurfaceDistance::clearance(const Vec3& x, std::int32_t& near) const
{
    const double exact = kExactBound * band_;
    const NearestTriangle place = tree_.nearest(x, near, kSlack, exact);
    near = place.triangle;
    const double found = std::sqrt(place.squared);
    // What was left out is no nearer than that, or than what was found.
    const double least = std::max(found, exact) / (1 + kSlack);
    const double flat = std::min(found, least) - 2 * chord_error_;
    // Behind the surface there is none; close to it the curved triangle determines the side.
    return flat > 0 && (x - place.at.point).dot(pseudo_normal_(place)) > 0 ? flat : 0;
}

Hash128 SurfaceDistance::fingerprint() const
{
    const SurfaceMesh& mesh = smooth_.coarse();
    std::string bytes;
    const auto add = [&](const void* from, std::size_t size) {
        bytes.append(static_cast<const char*>(from), size);
    };
    const std::uint64_t count = mesh.points.size();
    const double crease = smooth_.crease();
    add(&count, sizeof count);
    add(&crease, sizeof crease);
    add(&cuts_, sizeof cuts_);
    add(&band_, sizeof band_);
    add(mesh.points.data(), count * sizeof(Vec3));
    add(mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]);
    return hash128_bytes(bytes);
}

double SurfaceDistance::from_place_(const Vec3& x, const NearestTriangle& place,
                                    SmoothSurface::Patch& last) const
{
    const double flat = std::sqrt(place.squared);
    const PatchPoint curved =
        smooth_.nearest(x, place.triangle / (cuts_ * cuts_),
                        smooth_.weights_in_patch(place.triangle, cuts_, place.at.weights), last);
    const double found = (x - curved.position).norm();
    // Newton's method may have diverged at a fold; the two differ by no more than the chord error.
    const bool good = found <= flat + 2 * chord_error_;
    const double size = good ? found : flat;
    // Between the flat piece and the curved one the curved one determines the side.
    const double side = good && flat <= 2 * chord_error_
                            ? (x - curved.position).dot(curved.normal)
                            : (x - place.at.point).dot(pseudo_normal_(place));
    return side < 0 ? -size : size;
}

void SurfaceDistance::sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const
{
    const Mat3 across = (n - 1) * edges;
    const Vec3 half = 0.5 * across.rowwise().sum(), centre = corner + half;
    const double radius = half.norm();
    std::int32_t near = -1;
    // The nearest triangle, where a bound of its distance does not suffice.
    const double far = (band_ + radius) * (band_ + radius);
    NearestTriangle middle = tree_.nearest(centre, -1, kSlack);
    if (middle.squared > far &&
        middle.squared <= far * (1 + kSlack) * (1 + kSlack) * (1 + kBoundRounding))
        middle = tree_.nearest(centre, middle.triangle);
    if (middle.squared > far) {
        // No contact depends on these: the corners' distances, and linear between them.
        double c[8];
        for (int i = 0; i < 8; ++i)
            c[i] = distance(
                corner + across * Vec3{1.0 * (i >> 2), 1.0 * (i >> 1 & 1), 1.0 * (i & 1)}, near);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                for (int k = 0; k < n; ++k) {
                    const double u = 1.0 * i / (n - 1), v = 1.0 * j / (n - 1),
                                 w = 1.0 * k / (n - 1);
                    const auto along = [&](int from) {
                        return (1 - w) * c[from] + w * c[from + 1];
                    };
                    *out++ = (1 - u) * ((1 - v) * along(0) + v * along(2)) +
                             u * ((1 - v) * along(4) + v * along(6));
                }
        return;
    }
    RegionTriangles nearby;
    nearby.gather(refined_, tree_, centre, radius, middle.triangle);
    const bool in_parts = nearby.count() > kManyNearby;
    const int part = in_parts ? kPart : n;
    std::array<SmoothSurface::Patch, 8> last; // of neighbours: they take turns
    for (int i0 = 0; i0 < n; i0 += part)
        for (int j0 = 0; j0 < n; j0 += part)
            for (int k0 = 0; k0 < n; k0 += part) {
                const int begin[3] = {i0, j0, k0};
                int end[3];
                for (int a = 0; a < 3; ++a)
                    end[a] = std::min(begin[a] + part, n);
                if (in_parts) {
                    Vec3 low, high;
                    for (int a = 0; a < 3; ++a) {
                        low[a] = begin[a];
                        high[a] = end[a] - 1;
                    }
                    nearby.select(corner + edges * (0.5 * (low + high)),
                                  0.5 * (edges * (high - low)).norm());
                }
                for (int i = i0; i < end[0]; ++i)
                    for (int j = j0; j < end[1]; ++j)
                        for (int k = k0; k < end[2]; ++k) {
                            const Vec3 x = corner + edges * Vec3{1.0 * i, 1.0 * j, 1.0 * k};
                            const NearestTriangle place = nearby.nearest(x);
                            const std::size_t patch = at(place.triangle / (cuts_ * cuts_));
                            out[(i * n + j) * n + k] =
                                from_place_(x, place, last[patch % last.size()]);
                        }
            }
}

} // namespace amontons
