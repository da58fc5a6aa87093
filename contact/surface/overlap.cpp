#include "contact/surface/overlap.hpp"

#include "contact/surface/facets.hpp"
#include "mesh/base/dense.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kShallow = 1e-3;     // of a face: depths that may be left out
constexpr double kNearFace = 0.1;     // of a face: nearer places take the surface's normal
constexpr double kSharpEdge = 0.7071; // cosine of the angle between faces of one bent surface

Vec3 middle_of(const FacetedSurface::Triangle& t, std::span<const Vec3> x)
{
    return (x[std::size_t(t.nodes[0])] + x[std::size_t(t.nodes[1])] + x[std::size_t(t.nodes[2])]) /
           3;
}

Vec3 area_vector(const FacetedSurface::Triangle& t, std::span<const Vec3> x)
{
    const Vec3& a = x[std::size_t(t.nodes[0])];
    return (x[std::size_t(t.nodes[1])] - a).cross(x[std::size_t(t.nodes[2])] - a);
}

/// @param values  shape functions of a face's nodes
template <class Values>
SurfacePlace place_of(std::span<const std::int32_t> nodes, const Values& values)
{
    SurfacePlace p;
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (std::abs(values[Eigen::Index(k)]) > 1e-14)
            p.node[std::size_t(p.count++)] = {nodes[k], values[Eigen::Index(k)]};
    std::sort(p.node.begin(), p.node.begin() + p.count,
              [](const StencilEntry& a, const StencilEntry& b) { return a.node < b.node; });
    return p;
}

SurfacePlace place_on(const ExternalSurface& surface, const FacetedSurface::Triangle& t,
                      const Vec3& weights)
{
    const std::span<const std::int32_t> nodes = surface.face(std::size_t(t.face));
    const Vec2 xi = weights[0] * t.xi[0] + weights[1] * t.xi[1] + weights[2] * t.xi[2];
    return place_of(nodes, face_shape_values(int(nodes.size()), Vec3(xi.x(), xi.y(), 0)));
}

BoundingBox box_of_triangle(const FacetedSurface::Triangle& t, std::span<const Vec3> x)
{
    BoundingBox box;
    for (const std::int32_t n : t.nodes)
        box.add(x[std::size_t(n)]);
    return box;
}

} // namespace

double longest_edge(const ExternalSurface& surface, std::size_t face, std::span<const Vec3> places)
{
    const std::span<const std::int32_t> nodes = surface.face(face);
    const std::size_t corners = surface.corners[face];
    double longest = 0;
    for (std::size_t k = 0; k < corners; ++k)
        longest = std::max(
            longest,
            (places[std::size_t(nodes[(k + 1) % corners])] - places[std::size_t(nodes[k])]).norm());
    return longest;
}

double curvature_of_face(const PlacedSurface& s, std::size_t face)
{
    double most = 0;
    for (const FacetedSurface::Triangle& t : s.facets.of_face(face))
        for (const std::int32_t beside : t.beside) {
            if (beside < 0) continue;
            const FacetedSurface::Triangle& other = s.facets.triangles()[std::size_t(beside)];
            const Vec3 n = area_vector(t, s.places).normalized(),
                       m = area_vector(other, s.places).normalized();
            if (!(n.dot(m) > kSharpEdge)) continue;
            const Vec3 way = middle_of(other, s.places) - middle_of(t, s.places);
            if (way.norm() > 0) most = std::max(most, n.cross(m).norm() / way.norm());
        }
    return most;
}

double bulge_of_face(const PlacedSurface& s, std::size_t face, double widest)
{
    const ExternalSurface& surface = s.facets.surface();
    const auto corners_of = [&](std::size_t f) {
        return surface.face(f).first(std::size_t(surface.corners[f]));
    };
    const auto middle_of_face = [&](std::size_t f) {
        Vec3 sum = Vec3::Zero();
        for (const std::int32_t n : corners_of(f))
            sum += s.places[std::size_t(n)] / double(corners_of(f).size());
        return sum;
    };
    double most = 0;
    for (const FacetedSurface::Triangle& t : s.facets.of_face(face))
        for (std::size_t k = 0; k < 3; ++k) {
            if (t.beside[k] < 0) continue;
            const FacetedSurface::Triangle& other = s.facets.triangles()[std::size_t(t.beside[k])];
            const Vec3 n = area_vector(t, s.places).normalized(),
                       m = area_vector(other, s.places).normalized();
            if (!(n.dot(m) > kSharpEdge)) continue;
            const Vec3 along =
                s.places[std::size_t(t.nodes[(k + 1) % 3])] - s.places[std::size_t(t.nodes[k])];
            const Vec3 across = along.cross(n + m).normalized();
            const bool faces = other.face != t.face && corners_of(face).size() == 4;
            const double way = std::abs(
                across.dot(faces ? middle_of_face(std::size_t(other.face)) - middle_of_face(face)
                                 : middle_of(other, s.places) - middle_of(t, s.places)));
            if (!(way > 0)) continue;
            double low = std::numeric_limits<double>::infinity(), high = -low;
            for (const std::int32_t c : corners_of(face)) {
                const double at = across.dot(s.places[std::size_t(c)]);
                low = std::min(low, at);
                high = std::max(high, at);
            }
            const double width = std::min(high - low, widest);
            most = std::max(most, width * width / 8 * n.cross(m).norm() / way);
        }
    return most;
}

FaceDistance::FaceDistance(const PlacedSurface& surface, const BoundingBox& near)
    : surface_(surface)
{
    SurfaceMesh mesh;
    std::vector<BoundingBox> boxes;
    const std::vector<FacetedSurface::Triangle>& all = surface.facets.triangles();
    for (std::size_t t = 0; t < all.size(); ++t) {
        const BoundingBox box = box_of_triangle(all[t], surface.places);
        if (!box.touches(near)) continue;
        std::array<int, 3> corners{};
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = int(mesh.points.size());
            mesh.points.push_back(surface.places[std::size_t(all[t].nodes[k])]);
        }
        mesh.triangles.push_back(corners);
        number_.push_back(std::int32_t(t));
        boxes.push_back(box);
    }
    if (number_.empty()) return;
    tree_.emplace(mesh);
    boxes_.emplace(boxes);
}

Vec3 FaceDistance::normal_(std::int32_t triangle) const
{
    return area_vector(surface_.facets.triangles()[std::size_t(triangle)], surface_.places)
        .normalized();
}

// The sign is that of the pseudo-normal at the nearest place: of the face, of both faces of an edge
// or of all around a corner, by their angles (Baerentzen & Aanaes 2005, IEEE TVCG 11, 243-253).
std::optional<FaceDistance::Foot> FaceDistance::at(const Vec3& x, std::int32_t& hint) const
{
    const NearestTriangle found = tree_->nearest(x, hint);
    hint = found.triangle;
    Foot foot;
    foot.triangle = number_[std::size_t(found.triangle)];
    const FacetedSurface::Triangle& t = surface_.facets.triangles()[std::size_t(foot.triangle)];
    foot.point = found.at.point;
    Vec3 side = normal_(foot.triangle);
    const Vec3 own = side;
    const int feature = int(found.at.feature);
    if (feature >= int(TriangleFeature::vertex0)) {
        const std::int32_t node = t.nodes[std::size_t(feature - int(TriangleFeature::vertex0))];
        side.setZero();
        for (const std::int32_t k : surface_.facets.around(node)) {
            const FacetedSurface::Triangle& other = surface_.facets.triangles()[std::size_t(k)];
            std::size_t local = 0;
            while (other.nodes[local] != node)
                ++local;
            // A border on either side of the corner.
            if (other.beside[local] < 0 || other.beside[(local + 2) % 3] < 0) return {};
            const Vec3& corner = surface_.places[std::size_t(node)];
            const Vec3 p =
                (surface_.places[std::size_t(other.nodes[(local + 1) % 3])] - corner).normalized();
            const Vec3 q =
                (surface_.places[std::size_t(other.nodes[(local + 2) % 3])] - corner).normalized();
            side += std::atan2(p.cross(q).norm(), p.dot(q)) * normal_(k);
        }
    } else if (feature >= int(TriangleFeature::edge0)) {
        const std::int32_t beside = t.beside[std::size_t(feature - int(TriangleFeature::edge0))];
        if (beside < 0) return {};
        side += normal_(beside);
    }
    const Vec3 way = x - foot.point;
    const double length = way.norm();
    foot.distance = way.dot(side) < 0 ? -length : length;
    const double size =
        longest_edge(surface_.facets.surface(), std::size_t(t.face), surface_.places);
    foot.normal = length > kNearFace * size ? Vec3(way / foot.distance)
                  : side.norm() > 0         ? Vec3(side.normalized())
                                            : own;
    foot.place = place_on(surface_.facets.surface(), t, found.at.weights);
    return foot;
}

void FaceDistance::crossings(const Vec3& a, const Vec3& b, std::vector<double>& shares) const
{
    shares.clear();
    BoundingBox way;
    way.add(a);
    way.add(b);
    boxes_->visit(way, [&](std::int32_t k) {
        const FacetedSurface::Triangle& t =
            surface_.facets.triangles()[std::size_t(number_[std::size_t(k)])];
        const auto corner = [&](std::size_t i) -> const Vec3& {
            return surface_.places[std::size_t(t.nodes[i % 3])];
        };
        const Vec3 n = area_vector(t, surface_.places);
        const double from = n.dot(a - corner(0)), to = n.dot(b - corner(0));
        if ((from > 0) == (to > 0)) return;
        const double share = from / (from - to);
        const Vec3 x = a + share * (b - a);
        for (std::size_t i = 0; i < 3; ++i)
            if (n.dot((corner(i + 1) - corner(i)).cross(x - corner(i))) < 0) return;
        shares.push_back(share);
    });
    std::sort(shares.begin(), shares.end());
}

Vec3 outward_normal_at(const PlacedSurface& surface, const SurfacePlace& place)
{
    const std::span<const StencilEntry> nodes = place.nodes();
    if (nodes.empty()) return Vec3::Zero();
    Vec3 sum = Vec3::Zero();
    for (const std::int32_t t : surface.facets.around(nodes[0].node)) {
        const FacetedSurface::Triangle& triangle = surface.facets.triangles()[std::size_t(t)];
        const auto face = surface.facets.surface().face(std::size_t(triangle.face));
        const bool on_it = std::ranges::all_of(nodes, [&](const StencilEntry& e) {
            return std::ranges::find(face, e.node) != face.end();
        });
        if (!on_it) continue;
        const auto x = [&](int k) -> const Vec3& {
            return surface.places[std::size_t(triangle.nodes[std::size_t(k)])];
        };
        sum += (x(1) - x(0)).cross(x(2) - x(0));
    }
    return sum.norm() > 0 ? Vec3(sum.normalized()) : Vec3(Vec3::Zero());
}

BoundingBox box_around(const PlacedSurface& surface)
{
    BoundingBox box;
    for (const std::int32_t n : surface.facets.surface().used_nodes)
        box.add(surface.places[std::size_t(n)]);
    return box;
}

void overlap_spots(const PlacedSurface& a, const PlacedSurface& b, std::vector<OverlapSpot>& spots)
{
    const BoundingBox box_a = box_around(a);
    BoundingBox box_b = box_around(b);
    box_b.low -= b.thickness;
    box_b.high += b.thickness;
    if (!box_a.touches(box_b)) return;
    // Of b, what may be nearest to a place of a within both boxes.
    BoundingBox shared;
    shared.low = box_a.low.max(box_b.low);
    shared.high = box_a.high.min(box_b.high);
    // A place there that is in b leaves b's box, along an axis, within `room`: so deep it is at
    // most.
    const double leaves = (box_b.high - shared.low).min(shared.high - box_b.low).minCoeff();
    const double room = (1 + 1e-9) * (b.thickness > 0 ? b.thickness : leaves);
    BoundingBox near{shared.low - room, shared.high + room};
    const FaceDistance distance(b, near);
    if (distance.empty()) return;
    const ExternalSurface& surface = a.facets.surface();
    std::int32_t hint = -1;
    const auto note = [&](const SurfacePlace& own, const Vec3& x, std::int32_t own_face) {
        const std::optional<FaceDistance::Foot> foot = distance.at(x, hint);
        // Deeper places may be nearer to a triangle that was left out.
        if (!foot || !(foot->distance < 0) || -foot->distance > room) return;
        const auto other = std::size_t(b.facets.triangles()[std::size_t(foot->triangle)].face);
        OverlapSpot s;
        s.depth = -foot->distance;
        s.point = x;
        s.own = own;
        s.face = std::min(longest_edge(surface, std::size_t(own_face), a.places),
                          longest_edge(b.facets.surface(), other, b.places));
        s.bulge = bulge_of_face(a, std::size_t(own_face), s.face) + bulge_of_face(b, other, s.face);
        spots.push_back(s);
    };
    const auto inside = [&](const Vec3& x) {
        return (x.array() >= shared.low).all() && (x.array() <= shared.high).all();
    };
    for (const std::int32_t n : surface.used_nodes) {
        const Vec3& x = a.places[std::size_t(n)];
        if (!inside(x)) continue;
        SurfacePlace own;
        own.count = 1;
        own.node[0] = {n, 1};
        note(own, x, a.facets.triangles()[std::size_t(a.facets.around(n).front())].face);
    }
    std::vector<double> shares;
    for (const FacetedSurface::Edge& e : a.facets.edges()) {
        const Vec3 &x0 = a.places[std::size_t(e.nodes[0])], &x1 = a.places[std::size_t(e.nodes[1])];
        BoundingBox way;
        way.add(x0);
        way.add(x1);
        if (!way.touches(shared)) continue;
        distance.crossings(x0, x1, shares);
        for (std::size_t k = 0; k + 1 < shares.size(); ++k) {
            if (!(shares[k + 1] - shares[k] > 1e-9)) continue;
            const double share = 0.5 * (shares[k] + shares[k + 1]);
            SurfacePlace own;
            own.count = 2;
            own.node[0] = {e.nodes[0], 1 - share};
            own.node[1] = {e.nodes[1], share};
            note(own, x0 + share * (x1 - x0), e.face);
        }
    }
}

namespace {

/// The deepest place of a flat triangle in a convex shape: parts of it whose tangent plane says
/// that they may be deeper than the deepest so far are cut in four.
struct DeepestPlace {
    const FaceInPlane& face;
    const std::function<WallSample(const Vec3&)>& distance;
    double least; ///< distance of the deepest so far
    Vec3 place;
    Vec2 xi = Vec2::Zero();
    Mat3 hessian = Mat3::Zero();
    double size = 0; ///< of the face [m]
    int samples = 0;

    static constexpr int kMostSamples = 400, kMostLevels = 12, kBentLevels = 2;

    void look(const std::array<Vec2, 3>& corner, double tolerance, int level)
    {
        const Vec2 centre = (corner[0] + corner[1] + corner[2]) / 3;
        const FaceSpot at = spot(face, centre);
        const WallSample s = distance(at.place);
        ++samples;
        if (s.distance < least) {
            least = s.distance;
            place = at.place;
            xi = centre;
            hessian = s.hessian;
        }
        double below = s.distance;
        for (const Vec2& c : corner)
            below = std::min(below, s.distance + s.normal.dot(spot(face, c).place - at.place));
        const double goal = std::min(least, 0.0) + std::min(0.05 * least, -tolerance);
        // Quadratic faces leave the planes of their corners: of near ones parts are looked at
        // anyway.
        const bool bent = face.nodes == 6 && level < kBentLevels && s.distance < size;
        if ((below >= goal && !bent) || level >= kMostLevels || samples >= kMostSamples) return;
        const std::array<Vec2, 3> half{(corner[0] + corner[1]) / 2, (corner[1] + corner[2]) / 2,
                                       (corner[2] + corner[0]) / 2};
        look(half, tolerance, level + 1);
        look({corner[0], half[0], half[2]}, tolerance, level + 1);
        look({half[0], corner[1], half[1]}, tolerance, level + 1);
        look({half[2], half[1], corner[2]}, tolerance, level + 1);
    }
};

} // namespace

void overlap_spots(const PlacedSurface& a, const std::function<WallSample(const Vec3&)>& distance,
                   const BoundingBox& near, std::vector<OverlapSpot>& spots)
{
    const ExternalSurface& surface = a.facets.surface();
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        BoundingBox box;
        for (const std::int32_t n : nodes)
            box.add(a.places[std::size_t(n)]);
        if (!box.touches(near)) continue;
        const Vec3 middle = 0.5 * (box.low + box.high).matrix();
        if (distance(middle).distance > 0.5 * (box.high - box.low).matrix().norm()) continue;
        const FaceInPlane face(nodes, a.places);
        const FlatParts parts = flat_parts(nodes.size());
        DeepestPlace deepest{face, distance, std::numeric_limits<double>::infinity(), {}};
        double node_gap = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const WallSample s = distance(face.node[k]);
            if (nodes.size() != 6 || k >= 3) node_gap = std::min(node_gap, s.distance);
            if (!(s.distance < deepest.least)) continue;
            deepest.least = s.distance;
            deepest.place = face.node[k];
            deepest.xi = parts.xi[k];
            deepest.hessian = s.hessian;
        }
        deepest.size = longest_edge(surface, f, a.places);
        for (const FacetedSurface::Triangle& t : a.facets.of_face(f))
            deepest.look(t.xi, kShallow * deepest.size, 0);
        if (!(deepest.least < 0)) continue;
        OverlapSpot s;
        s.depth = -deepest.least;
        s.point = deepest.place;
        s.own = place_of(nodes, spot(face, deepest.xi).values);
        s.node_gap = node_gap;
        s.face = deepest.size;
        const Vec3 bends = symmetric_eigenvalues(deepest.hessian);
        s.bulge = bulge_of_face(a, f, s.face) +
                  s.face * s.face / 8 * std::max(std::abs(bends[0]), std::abs(bends[2]));
        spots.push_back(s);
    }
}

} // namespace amontons
