#include "contact/surface/self_overlap.hpp"

#include "mesh/face_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kSameSide = 0.5; // cosine: a far side has the normal of the place itself
constexpr double kOnFaces = 1e-3; // of a face: depths of faces that lie on one another

double squared_distance(const BoundingBox& box, const Vec3& x)
{
    return (box.low - x.array()).max(x.array() - box.high).max(0.0).matrix().squaredNorm();
}

/// What is nearest of the places of a surface that face a place.
struct FacingPlaces {
    const PlacedSurface& surface;
    std::optional<BoundingTree> tree;

    explicit FacingPlaces(const PlacedSurface& s) : surface(s)
    {
        std::vector<BoundingTree::Corners> corners;
        for (const FacetedSurface::Triangle& t : s.facets.triangles()) {
            const auto [a, b, c] = t.nodes;
            corners.push_back(
                {s.places[std::size_t(a)], s.places[std::size_t(b)], s.places[std::size_t(c)]});
        }
        if (!corners.empty()) tree.emplace(std::move(corners));
    }

    /// Fills depth, other and normal. @return  whether there is one
    /// @param outward  normal of the spot's own surface
    /// @param own      nodes of the faces that the spot lies on
    bool find(const Vec3& outward, std::span<const std::int32_t> own, OverlapSpot& spot) const
    {
        if (!tree) return false;
        double least = surface.thickness > 0 ? surface.thickness * surface.thickness
                                             : std::numeric_limits<double>::infinity();
        bool found = false;
        const auto value = [&](std::int32_t k) {
            const FacetedSurface::Triangle& t = surface.facets.triangles()[std::size_t(k)];
            const Vec3 &a = surface.places[std::size_t(t.nodes[0])],
                       &b = surface.places[std::size_t(t.nodes[1])],
                       &c = surface.places[std::size_t(t.nodes[2])];
            constexpr double kNone = std::numeric_limits<double>::infinity();
            const Vec3 area = (b - a).cross(c - a), normal = area.normalized();
            if (!(normal.dot(outward) < kSameSide)) return kNone;
            const TrianglePoint at = closest_on_triangle(spot.point, a, b, c);
            const Vec3 way = spot.point - at.point;
            // What lies on a face is not behind another one because of round-off.
            const bool behind = way.dot(normal) < kOnFaces * std::sqrt(area.norm());
            if (!behind || !(way.squaredNorm() < least)) return kNone;
            for (const std::int32_t n : surface.facets.surface().face(std::size_t(t.face)))
                if (std::ranges::binary_search(own, n)) return kNone;
            least = way.squaredNorm();
            found = true;
            spot.depth = std::sqrt(least);
            spot.normal = normal;
            spot.other = place_on_face(t.nodes, at.weights);
            return least;
        };
        tree->least([&](const BoundingBox& box) { return squared_distance(box, spot.point); },
                    value);
        return found;
    }
};

} // namespace

void self_overlap_spots(const PlacedSurface& a, const PlacedSurface& b, const InOtherPart& inside,
                        std::vector<OverlapSpot>& spots, const Shallow& shallow)
{
    const ExternalSurface& surface = a.facets.surface();
    std::optional<FacingPlaces> facing; // where some place is inside
    std::vector<std::int32_t> own;
    const auto note = [&](const SurfacePlace& place, const Vec3& x,
                          std::span<const FacetedSurface::Triangle> on) {
        if (!inside(x, place)) return;
        if (!facing) facing.emplace(b);
        OverlapSpot s;
        s.point = x;
        s.own = place;
        own.clear();
        const auto take = [&](const FacetedSurface::Triangle& t) {
            const auto nodes = surface.face(std::size_t(t.face));
            own.insert(own.end(), nodes.begin(), nodes.end());
        };
        std::ranges::for_each(on, take);
        for (const StencilEntry& e : place.nodes())
            if (on.empty())
                for (const std::int32_t t : a.facets.around(e.node))
                    take(a.facets.triangles()[std::size_t(t)]);
        std::ranges::sort(own);
        if (!facing->find(outward_normal_at(a, place), own, s)) return;
        measure_faces(a, b, shallow, s);
        if (s.depth > kOnFaces * s.face) spots.push_back(s);
    };
    for (const std::int32_t n : surface.used_nodes) {
        SurfacePlace place;
        place.count = 1;
        place.node[0] = {n, 1};
        note(place, a.places[std::size_t(n)], {});
    }
    // Between its middle and its ends an edge may pass through a part that is thinner than it is
    // long.
    const FaceDistance passed(b, box_around(a));
    std::vector<double> shares;
    for (const FacetedSurface::Edge& e : a.facets.edges()) {
        const auto [first, last] = std::minmax(e.nodes[0], e.nodes[1]);
        const Vec3 &x0 = a.places[std::size_t(first)], &x1 = a.places[std::size_t(last)];
        const auto note_at = [&](double share) {
            SurfacePlace place;
            place.count = 2;
            place.node[0] = {first, 1 - share};
            place.node[1] = {last, share};
            note(place, x0 + share * (x1 - x0), {});
        };
        note_at(0.5);
        if (!passed.empty()) passed.crossings(x0, x1, shares);
        for (std::size_t k = 0; k + 1 < shares.size(); ++k)
            if (shares[k + 1] - shares[k] > kOnFaces) note_at(0.5 * (shares[k] + shares[k + 1]));
    }
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        const bool four = nodes.size() == 4;
        const Vec3 xi = four ? Vec3(Vec3::Zero()) : Vec3(1.0 / 3, 1.0 / 3, 0);
        const auto values = face_shape_values(int(nodes.size()), xi);
        Vec3 x = Vec3::Zero();
        for (std::size_t k = 0; k < nodes.size(); ++k)
            x += values[Eigen::Index(k)] * a.places[std::size_t(nodes[k])];
        note(place_on_face(nodes, values), x, a.facets.of_face(f));
    }
}

} // namespace amontons
