#include "contact/surface/facets.hpp"
#include "contact/surface/overlap.hpp"
#include "mesh/base/dense.hpp"

#include <algorithm>
#include <array>
#include <cmath>

// How far faces stand in exact shapes.

namespace amontons {
namespace {

constexpr double kLeftOut = 1e-3; // of a face: depths that may be left out

/// The deepest place of a flat triangle in a convex shape: parts of it whose tangent plane shows
/// that they may be deeper than the deepest so far are cut in four.
struct DeepestPlace {
    const FaceInPlane& face;
    const std::function<WallSample(const Vec3&)>& distance;
    double least; ///< distance of the deepest so far
    Vec3 place;
    Vec2 xi = Vec2::Zero();
    Mat3 hessian = Mat3::Zero();
    double size = 0;   ///< of the face [m]
    double bulges = 0; ///< of it: its sides leave straight ones by this [m]
    int samples = 0;

    static constexpr int kMostSamples = 400, kMostLevels = 12, kBentLevels = 2;
    /// Of the face: under a cylinder's side many places are as deep, and round-off must not choose.
    static constexpr double kDeeper = 1e-9;

    bool is_deeper(double d) const { return d < least - kDeeper * size; }

    void search(const std::array<Vec2, 3>& corner, double tolerance, int level)
    {
        const Vec2 centre = (corner[0] + corner[1] + corner[2]) / 3;
        const FaceSpot at = spot(face, centre);
        const WallSample s = distance(at.place);
        ++samples;
        if (is_deeper(s.distance)) {
            least = s.distance;
            place = at.place;
            xi = centre;
            hessian = s.hessian;
        }
        double below = s.distance, radius = 0;
        for (const Vec2& c : corner) {
            const Vec3 way = spot(face, c).place - at.place;
            below = std::min(below, s.distance + s.normal.dot(way));
            radius = std::max(radius, way.norm());
        }
        const double goal = std::min(least, 0.0) + std::min(0.05 * least, -tolerance);
        // Quadratic faces leave the planes of their corners: of near ones parts are examined
        // anyway, but where no place can be deeper than the deepest so far. A quarter leaves its
        // plane by a quarter of what the whole does: 4/3 of its sides' bulges at most.
        radius += 4.0 / 3 * bulges / std::pow(4, level + 1);
        const bool bent = face.nodes == 6 && level < kBentLevels && s.distance < size &&
                          s.distance - radius < std::min(least, 0.0);
        if ((below >= goal && !bent) || level >= kMostLevels || samples >= kMostSamples) return;
        const std::array<Vec2, 3> half{(corner[0] + corner[1]) / 2, (corner[1] + corner[2]) / 2,
                                       (corner[2] + corner[0]) / 2};
        search(half, tolerance, level + 1);
        search({corner[0], half[0], half[2]}, tolerance, level + 1);
        search({half[0], corner[1], half[1]}, tolerance, level + 1);
        search({half[2], half[1], corner[2]}, tolerance, level + 1);
    }
};

/// Distances at nodes, of which faces share most: the last ones are kept.
class NodeSamples {
public:
    NodeSamples(const std::function<WallSample(const Vec3&)>& distance,
                std::span<const Vec3> places)
        : distance_(distance)
        , places_(places)
    {
        node_.fill(-1);
    }
    const WallSample& at(std::int32_t node)
    {
        const std::size_t slot = std::size_t(node) % kKept;
        if (node_[slot] != node) {
            sample_[slot] = distance_(places_[std::size_t(node)]);
            node_[slot] = node;
        }
        return sample_[slot];
    }

private:
    static constexpr std::size_t kKept = 64;
    const std::function<WallSample(const Vec3&)>& distance_;
    std::span<const Vec3> places_;
    std::array<std::int32_t, kKept> node_;
    std::array<WallSample, kKept> sample_;
};

} // namespace

double least_by_tangents(std::span<const Vec3> points, std::span<const WallSample> at)
{
    double least = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < points.size(); ++k) {
        double below = 0;
        for (const Vec3& x : points)
            below = std::min(below, at[k].normal.dot(x - points[k]));
        least = std::max(least, at[k].distance + below);
    }
    return least;
}

void overlap_spots(const PlacedSurface& a, const std::function<WallSample(const Vec3&)>& distance,
                   const BoundingBox& near, std::vector<OverlapSpot>& spots, const Shallow& shallow,
                   Inside inside)
{
    const ExternalSurface& surface = a.facets.surface();
    std::vector<std::int32_t> faces;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        BoundingBox box;
        for (const std::int32_t n : surface.face(f))
            box.add(a.places[std::size_t(n)]);
        if (box.touches(near)) faces.push_back(std::int32_t(f));
    }
    overlap_spots(a, distance, faces, spots, shallow, inside);
}

void overlap_spots(const PlacedSurface& a, const std::function<WallSample(const Vec3&)>& distance,
                   std::span<const std::int32_t> faces, std::vector<OverlapSpot>& spots,
                   const Shallow& shallow, Inside inside)
{
    const ExternalSurface& surface = a.facets.surface();
    NodeSamples sampled{distance, a.places};
    for (const std::int32_t number : faces) {
        const auto f = std::size_t(number);
        const std::span<const std::int32_t> nodes = surface.face(f);
        BoundingBox box;
        for (const std::int32_t n : nodes)
            box.add(a.places[std::size_t(n)]);
        const Vec3 middle = 0.5 * (box.low + box.high).matrix();
        if (distance(middle).distance > 0.5 * (box.high - box.low).matrix().norm()) continue;
        const FaceInPlane face(nodes, a.places);
        const FlatParts parts = flat_parts(nodes.size());
        DeepestPlace deepest{face, distance, std::numeric_limits<double>::infinity(), {}};
        deepest.size = longest_edge(surface, f, a.places);
        double node_gap = std::numeric_limits<double>::infinity();
        std::array<WallSample, kMostSolidFaceNodes> at_node;
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const WallSample& s = at_node[k] = sampled.at(nodes[k]);
            if (nodes.size() != 6 || k >= 3) node_gap = std::min(node_gap, s.distance);
            if (!deepest.is_deeper(s.distance)) continue;
            deepest.least = s.distance;
            deepest.place = face.node[k];
            deepest.xi = parts.xi[k];
            deepest.hessian = s.hessian;
        }
        for (std::size_t k = 0; k < 3 && nodes.size() == 6; ++k)
            deepest.bulges =
                std::max(deepest.bulges,
                         (face.node[3 + k] - 0.5 * (face.node[k] + face.node[(k + 1) % 3])).norm());
        // Quadratic faces leave the hull of their nodes.
        const bool known = inside == Inside::convex && nodes.size() != 6 &&
                           least_by_tangents(std::span(face.node).first(nodes.size()),
                                             std::span(at_node).first(nodes.size())) >=
                               std::min(deepest.least, 0.0) - kNoDeeper * deepest.size;
        if (!known)
            for (const FacetedSurface::Triangle& t : a.facets.of_face(f))
                deepest.search(t.xi, kLeftOut * deepest.size, 0);
        if (!(deepest.least < 0)) continue;
        OverlapSpot s;
        s.depth = -deepest.least;
        s.point = deepest.place;
        s.own = place_on_face(nodes, spot(face, deepest.xi).values);
        s.node_gap = node_gap;
        s.face = deepest.size;
        if (!shallow(s)) {
            s.bulge = bulge_of_face(a, f, s.face);
            s.bulge_at_rest = bulge_of_face(a.without_strain(), f, s.face);
            if (!deepest.hessian.isZero(0)) {
                const Vec3 bends = symmetric_eigenvalues(deepest.hessian); // 0 along the normal
                const double per_bend = s.face * s.face / 8;
                const double of_shape = per_bend * std::max(std::abs(bends[0]), std::abs(bends[2]));
                s.bulge += of_shape;
                s.bulge_at_rest += of_shape;
                s.round = per_bend * std::max(bends[1], 0.0);
            }
        }
        spots.push_back(s);
    }
}

} // namespace amontons
