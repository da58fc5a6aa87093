#include "contact/surface/overlap.hpp"

#include "contact/surface/facets.hpp"
#include "mesh/base/dense.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kBesideCorner = 1e-3; // of a triangle: counts as on its edge or corner
constexpr double kNearFace = 0.1;      // of a face: nearer places take the surface's normal
constexpr double kSharpEdge = 0.7071;  // cosine of the angle between faces of one bent surface
constexpr double kFlatQuad = 1e-9;     // of its size: a quadrilateral that is bent by less is flat
constexpr double kAboveFace = 1e-6;    // sine: a place is over a face
constexpr double kTooFar = 1 + 1e-9;   // of an edge: beyond round-off
constexpr double kAlone = 0.9;         // cosine: a normal is that of one side, not of an edge

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

/// The sides of a box that a place lies beyond, a bit for each. What has all its corners beyond one
/// of them does not touch the box.
unsigned sides_beyond(const Vec3& x, const BoundingBox& box)
{
    unsigned sides = 0;
    for (int k = 0; k < 3; ++k)
        sides |= unsigned(x[k] < box.low[k]) << 2 * k | unsigned(x[k] > box.high[k]) << (2 * k + 1);
    return sides;
}
/// What of a triangle a place lies on: a little beside a corner or an edge counts as there.
TriangleFeature feature_near(const Vec3& weights)
{
    int small = 0, at = 0, of = 0; // number of them, the last of each
    for (int k = 0; k < 3; ++k)
        if (weights[k] < kBesideCorner) {
            ++small;
            at = k;
        } else {
            of = k;
        }
    if (small == 0) return TriangleFeature::face;
    return small == 1 ? TriangleFeature(int(TriangleFeature::edge0) + (at + 1) % 3)
                      : TriangleFeature(int(TriangleFeature::vertex0) + of);
}

constexpr unsigned kOutOfReach = 1u << 6; // beside those: it does not reach the other surface

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
    std::vector<unsigned char> beyond(surface.places.size());
    for (const std::int32_t n : surface.facets.surface().used_nodes)
        beyond[std::size_t(n)] = (unsigned char)sides_beyond(surface.places[std::size_t(n)], near);
    std::vector<BoundingTree::Corners> corners;
    const std::vector<FacetedSurface::Triangle>& all = surface.facets.triangles();
    for (std::size_t t = 0; t < all.size(); ++t) {
        const auto [a, b, c] = all[t].nodes;
        if (beyond[std::size_t(a)] & beyond[std::size_t(b)] & beyond[std::size_t(c)]) continue;
        corners.push_back({surface.places[std::size_t(a)], surface.places[std::size_t(b)],
                           surface.places[std::size_t(c)]});
        number_.push_back(std::int32_t(t));
    }
    if (!number_.empty()) tree_.emplace(std::move(corners));
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
    foot.feature = feature_near(found.at.weights);
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
    const Vec3& w = found.at.weights;
    foot.xi = w[0] * t.xi[0] + w[1] * t.xi[1] + w[2] * t.xi[2];
    touch_bent_face_(x, foot);
    return foot;
}

SurfacePlace FaceDistance::place_of(const Foot& foot) const
{
    const FacetedSurface::Triangle& t = surface_.facets.triangles()[std::size_t(foot.triangle)];
    const std::span<const std::int32_t> nodes = surface_.facets.surface().face(std::size_t(t.face));
    const Vec3 xi(foot.xi.x(), foot.xi.y(), 0);
    return place_on_face(nodes, face_shape_values(int(nodes.size()), xi));
}

/// Calls visit(triangle) for those that the point lies on, by its feature.
template <class Visit> void FaceDistance::for_triangles_under_(const Foot& foot, Visit visit) const
{
    const FacetedSurface::Triangle& t = surface_.facets.triangles()[std::size_t(foot.triangle)];
    const int feature = int(foot.feature);
    if (feature >= int(TriangleFeature::vertex0)) {
        for (const std::int32_t k :
             surface_.facets.around(t.nodes[std::size_t(feature - int(TriangleFeature::vertex0))]))
            visit(k);
        return;
    }
    visit(foot.triangle);
    if (feature < int(TriangleFeature::edge0)) return;
    const std::int32_t beside = t.beside[std::size_t(feature - int(TriangleFeature::edge0))];
    if (beside >= 0) visit(beside);
}

bool FaceDistance::on_one_side(const Foot& p, const Foot& q, double deepest) const
{
    const double far = std::max(std::abs(p.distance), std::abs(q.distance));
    const Vec3 way = q.point - p.point;
    bool found = false;
    for_triangles_under_(p, [&](std::int32_t i) {
        const Vec3 n = normal_(i);
        const bool along = std::abs(n.dot(way)) + far <= deepest;
        const bool alone = n.dot(p.normal) > kAlone;
        if (found || !along) return;
        for_triangles_under_(q, [&](std::int32_t j) {
            const Vec3 m = normal_(j);
            found |= n.dot(m) > kSharpEdge && (alone || m.dot(q.normal) > kAlone);
        });
    });
    return found;
}

/// Of a quadrilateral that is not flat the nearest place of its own, not of the two triangles that
/// a diagonal cuts it into: which one does is the mesh's accident.
void FaceDistance::touch_bent_face_(const Vec3& x, Foot& foot) const
{
    const FacetedSurface::Triangle& t = surface_.facets.triangles()[std::size_t(foot.triangle)];
    const std::span<const std::int32_t> nodes = surface_.facets.surface().face(std::size_t(t.face));
    if (nodes.size() != 4) return;
    const FaceInPlane face(nodes, surface_.places);
    const Vec3 p = face.node[2] - face.node[0], q = face.node[3] - face.node[1];
    const double volume = (face.node[1] - face.node[0]).dot(p.cross(q));
    if (!(std::abs(volume) > kFlatQuad * p.norm() * q.norm() * p.norm())) return;
    const Vec2 xi = nearest_xi(face, x, foot.xi);
    if (!(xi.lpNorm<Eigen::Infinity>() <= 1)) return; // beside it
    const FaceSpot at = spot(face, xi);
    const Vec3 normal = at.along[0].cross(at.along[1]).normalized(), way = x - at.place;
    // Beside the face it is the edge's, as above.
    if (!(way.cross(normal).norm() <= kAboveFace * way.norm() + kFlatQuad * p.norm())) return;
    foot.point = at.place;
    foot.distance = way.dot(normal);
    foot.normal = normal;
    foot.xi = xi;
}

void FaceDistance::crossings(const Vec3& a, const Vec3& b, std::vector<double>& shares) const
{
    shares.clear();
    BoundingBox way;
    way.add(a);
    way.add(b);
    tree_->visit(way, [&](std::int32_t k) {
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

namespace {

/// Calls visit(triangle) for those of all faces that a place lies on, around its first node.
template <class Visit>
void for_triangles_at(const PlacedSurface& surface, const SurfacePlace& place, Visit visit)
{
    const std::span<const StencilEntry> nodes = place.nodes();
    if (nodes.empty()) return;
    for (const std::int32_t t : surface.facets.around(nodes[0].node)) {
        const FacetedSurface::Triangle& triangle = surface.facets.triangles()[std::size_t(t)];
        const auto face = surface.facets.surface().face(std::size_t(triangle.face));
        if (std::ranges::all_of(nodes, [&](const StencilEntry& e) {
                return std::ranges::find(face, e.node) != face.end();
            }))
            visit(triangle);
    }
}

/// The faces that a place lies on and that point along a direction, all of them if none does.
void faces_at(const PlacedSurface& surface, const SurfacePlace& place, const Vec3& along,
              std::vector<std::size_t>& faces)
{
    faces.clear();
    for (const bool looking : {true, false}) {
        for_triangles_at(surface, place, [&](const FacetedSurface::Triangle& t) {
            const Vec3 n = area_vector(t, surface.places);
            if (looking && !(n.dot(along) > kFacing * n.norm())) return;
            if (std::ranges::find(faces, std::size_t(t.face)) == faces.end())
                faces.push_back(std::size_t(t.face));
        });
        if (!faces.empty()) return;
    }
}

} // namespace

Vec3 outward_normal_at(const PlacedSurface& surface, const SurfacePlace& place)
{
    Vec3 sum = Vec3::Zero();
    for_triangles_at(surface, place, [&](const FacetedSurface::Triangle& t) {
        sum += area_vector(t, surface.places);
    });
    return sum.norm() > 0 ? Vec3(sum.normalized()) : Vec3(Vec3::Zero());
}

BoundingBox box_around(const PlacedSurface& surface)
{
    BoundingBox box;
    for (const std::int32_t n : surface.facets.surface().used_nodes)
        box.add(surface.places[std::size_t(n)]);
    return box;
}

Extent extent_along(const Vec3& direction, const ExternalSurface& surface,
                    std::span<const Vec3> places)
{
    Extent e;
    for (const std::int32_t n : surface.used_nodes) {
        const double at = direction.dot(places[std::size_t(n)]);
        e.low = std::min(e.low, at);
        e.high = std::max(e.high, at);
    }
    return e;
}

void measure_faces(const PlacedSurface& a, const PlacedSurface& b, const Shallow& shallow,
                   OverlapSpot& s)
{
    // All faces that share either place count: which comes first is arbitrary.
    std::vector<std::size_t> own_faces, other_faces;
    faces_at(a, s.own, -s.normal, own_faces);
    faces_at(b, s.other, s.normal, other_faces);
    s.face = std::numeric_limits<double>::infinity();
    for (const std::size_t f : own_faces)
        s.face = std::min(s.face, longest_edge(a.facets.surface(), f, a.places));
    for (const std::size_t f : other_faces)
        s.face = std::min(s.face, longest_edge(b.facets.surface(), f, b.places));
    const auto least = [&](const PlacedSurface& of, const std::vector<std::size_t>& faces) {
        double bulge = s.face;
        for (const std::size_t f : faces)
            bulge = std::min(bulge, bulge_of_face(of, f, s.face));
        return bulge;
    };
    if (shallow(s)) return;
    s.bulge = least(a, own_faces) + least(b, other_faces);
    s.bulge_at_rest = least(a.without_strain(), own_faces) + least(b.without_strain(), other_faces);
}

void overlap_spots(const PlacedSurface& a, const PlacedSurface& b, std::vector<OverlapSpot>& spots,
                   const Shallow& shallow)
{
    // ---- Boxes and nodes that may overlap
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
    // most. So it does against the way from a to b, on which boxes give little information of round
    // bodies.
    double leaves = (box_b.high - shared.low).min(shared.high - box_b.low).minCoeff();
    Vec3 way = ((box_b.low + box_b.high) - (box_a.low + box_a.high)).matrix();
    double begins = -std::numeric_limits<double>::infinity(); // of b, on that way
    if (way.norm() > 0 && !(b.thickness > 0)) {
        way.normalize();
        begins = extent_along(way, b.facets.surface(), b.places).low;
        const double ends = extent_along(way, a.facets.surface(), a.places).high;
        if (ends < begins) return;
        leaves = std::min(leaves, ends - begins);
    }
    const ExternalSurface& surface = a.facets.surface();
    std::vector<unsigned char> beyond(a.places.size()); // of the nodes of a
    for (const std::int32_t n : surface.used_nodes)
        if (!(way.dot(a.places[std::size_t(n)]) >= begins)) beyond[std::size_t(n)] = kOutOfReach;
    BoundingBox touch_box;
    std::vector<const FacetedSurface::Edge*> edges;
    for (const FacetedSurface::Edge& e : a.facets.edges()) {
        if (beyond[std::size_t(e.nodes[0])] & beyond[std::size_t(e.nodes[1])] & kOutOfReach)
            continue;
        edges.push_back(&e);
        for (const std::int32_t n : e.nodes)
            touch_box.add(a.places[std::size_t(n)]);
    }
    shared.low = shared.low.max(touch_box.low);
    shared.high = shared.high.min(touch_box.high);
    if (!(shared.low <= shared.high).all()) return;
    for (const std::int32_t n : surface.used_nodes)
        beyond[std::size_t(n)] |= (unsigned char)sides_beyond(a.places[std::size_t(n)], shared);
    const double room = (1 + 1e-9) * (b.thickness > 0 ? b.thickness : leaves);
    BoundingBox near{shared.low - room, shared.high + room};
    const FaceDistance distance(b, near);

    // ---- Depth at a place; places of edges
    if (distance.empty()) return;
    std::int32_t hint = -1;
    const auto note = [&](const SurfacePlace& own, const Vec3& x) {
        const std::optional<FaceDistance::Foot> foot = distance.at(x, hint);
        // Deeper places may be nearer to a triangle that was left out.
        if (!foot || !(foot->distance < 0) || -foot->distance > room) return foot;
        OverlapSpot s;
        s.depth = -foot->distance;
        s.point = x;
        s.own = own;
        s.other = distance.place_of(*foot);
        s.normal = foot->normal;
        measure_faces(a, b, shallow, s);
        spots.push_back(s);
        return foot;
    };
    const auto note_on_edge = [&](const FacetedSurface::Edge& e, double share) {
        SurfacePlace own;
        own.count = 2;
        own.node[0] = {e.nodes[0], 1 - share};
        own.node[1] = {e.nodes[1], share};
        const Vec3 &x0 = a.places[std::size_t(e.nodes[0])], &x1 = a.places[std::size_t(e.nodes[1])];
        note(own, x0 + share * (x1 - x0));
    };
    struct TouchedNode {
        std::int32_t node;
        FaceDistance::Foot foot;
    };
    std::vector<TouchedNode> touched; // node by node

    // ---- Nodes inside, edges that enter and leave
    for (const std::int32_t n : surface.used_nodes) {
        if (beyond[std::size_t(n)]) continue;
        SurfacePlace own;
        own.count = 1;
        own.node[0] = {n, 1};
        if (const auto foot = note(own, a.places[std::size_t(n)])) touched.push_back({n, *foot});
    }
    const auto touched_by = [&](std::int32_t node) -> const FaceDistance::Foot* {
        if (beyond[std::size_t(node)]) return nullptr;
        const auto at = std::ranges::lower_bound(touched, node, {}, &TouchedNode::node);
        return at != touched.end() && at->node == node ? &at->foot : nullptr;
    };
    // Distance of a node from the flat triangles; of quadrilaterals not known.
    const auto clear_of = [&](const FaceDistance::Foot& foot) {
        const FacetedSurface::Triangle& t = b.facets.triangles()[std::size_t(foot.triangle)];
        const bool flat = b.facets.surface().face(std::size_t(t.face)).size() != 4;
        return flat ? std::abs(foot.distance) : 0.0;
    };
    std::vector<double> shares;
    for (const FacetedSurface::Edge* edge : edges) {
        const FacetedSurface::Edge& e = *edge;
        const Vec3 &x0 = a.places[std::size_t(e.nodes[0])], &x1 = a.places[std::size_t(e.nodes[1])];
        if (beyond[std::size_t(e.nodes[0])] & beyond[std::size_t(e.nodes[1])] & ~kOutOfReach)
            continue;
        const FaceDistance::Foot *p = touched_by(e.nodes[0]), *q = touched_by(e.nodes[1]);
        // No triangle is nearer to an end than its foot: where that leaves nothing of the edge,
        // none crosses it.
        if (p && q && clear_of(*p) + clear_of(*q) > kTooFar * (x1 - x0).norm())
            shares.clear();
        else
            distance.crossings(x0, x1, shares);
        for (std::size_t k = 0; k + 1 < shares.size(); ++k) {
            if (!(shares[k + 1] - shares[k] > 1e-9)) continue;
            note_on_edge(e, 0.5 * (shares[k] + shares[k + 1]));
        }
        // Ends that lie on two sides of b, of no depth, and between them its edge.
        if (p && q && p->normal.dot(q->normal) < kSharpEdge &&
            !distance.on_one_side(*p, *q,
                                  std::min(shallow.of_face * (x1 - x0).norm(), shallow.depth)))
            for (const double share : {0.125, 0.25, 0.5, 0.75, 0.875})
                note_on_edge(e, share);
    }
}

} // namespace amontons
