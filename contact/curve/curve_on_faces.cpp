#include "contact/curve/curve_on_faces.hpp"

#include "contact/curve/edge_curves.hpp"
#include "contact/surface/collocation.hpp"
#include "contact/surface/feet_on_faces.hpp"
#include "contact/surface/passage.hpp"
#include "mesh/base/limits.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace amontons {
namespace {

constexpr double kFine = 0.7;   // of the radius: between two rows of nodes it sinks by 1/16 of it
constexpr double kLonger = 1.2; // than a face: a way between stations that is not halved
constexpr int kMostParts = 1 << 10; // of a piece
constexpr double kFineStays = 1.2;  // a node that was found is fine that much longer
// Kinds of contact within a pair: stations by their number, crossings as those of two curves.
constexpr std::int64_t kChains = std::int64_t(1) << 48; // number of an edge's curve in a crossing's
constexpr std::int64_t kNodes = std::int64_t(4) << 60, kCorners = kNodes + (std::int64_t(1) << 40),
                       kPoints = kNodes + (std::int64_t(2) << 40);

BoundingBox curve_box(const Curve& c, double more)
{
    BoundingBox box;
    for (const CurvePiece& p : c.pieces) {
        const double around = p.radius + more;
        // Of Bézier's points.
        for (const Vec3& x : {p.x0, p.x1, Vec3(p.x0 + p.d0 / 3), Vec3(p.x1 - p.d1 / 3)}) {
            box.add(x + Vec3::Constant(around));
            box.add(x - Vec3::Constant(around));
        }
    }
    return box;
}

/// From one station to the next [m].
double longest_way(const Curve& a, std::span<const FaceStation> stations)
{
    double longest = 0;
    for (std::size_t i = 0; i + 1 < stations.size(); ++i)
        longest =
            std::max(longest, arc_at(a, stations[i + 1].place) - arc_at(a, stations[i].place));
    return longest;
}

/// The round surface of a curve, or of the ball at one of its places, for points nearby.
class RoundSurface {
public:
    RoundSurface(const Curve& curve, std::span<const FaceStation> stations, double reach)
        : curve_(curve)
    {
        std::vector<BoundingBox> boxes;
        if (stations.size() == 1) {
            only_ = stations[0].place;
            return;
        }
        for (const CurvePiece& p : curve.pieces)
            boxes.push_back(curve_box({{p}, false, {}}, reach));
        tree_.emplace(boxes);
    }

    struct Place {
        CurvePlace at;
        WallSample sample; ///< distance inf: none is near
    };
    Place operator()(const Vec3& x) const
    {
        Place best;
        best.sample.distance = kInfinity;
        const auto search = [&](int e, double t) {
            const CurvePiece& p = curve_.pieces[std::size_t(e)];
            const Vec3 d = x - p.at(t);
            const double length = d.norm();
            if (!(length - p.radius < best.sample.distance) || !(length > 0)) return;
            best.at = {e, t};
            best.sample.distance = length - p.radius;
            best.sample.normal = d / length;
        };
        if (only_) {
            search(only_->piece, only_->t);
            return best;
        }
        BoundingBox point;
        point.add(x);
        tree_->visit(point, [&](std::int32_t e) {
            search(e, 0);
            search(e, 1);
            const std::optional<double> t = foot(curve_.pieces[std::size_t(e)], x);
            if (t && *t > 0 && *t < 1) search(e, *t);
        });
        return best;
    }

    bool is_ball() const { return only_.has_value(); }

private:
    const Curve& curve_;
    std::optional<CurvePlace> only_;
    std::optional<BoxTree> tree_; ///< of the pieces
};

double thinnest(const Curve& a)
{
    double least = kInfinity;
    for (const CurvePiece& p : a.pieces)
        least = std::min(least, p.radius);
    return least;
}

/// Which nodes of a surface have fine faces around them, seen along the curve.
class FineNodes {
public:
    FineNodes(const Curve& a, const FeetOnFaces& feet, const RoundSurface& round,
              std::span<const std::int64_t> known)
        : a_(a)
        , feet_(feet)
        , round_(round)
        , known_(known)
        , fine_(kFine * thinnest(a))
    {
    }
    /// @param x  of the node [m]
    bool has(std::int32_t node, const Vec3& x) const
    {
        const bool known_before = std::binary_search(known_.begin(), known_.end(), kNodes + node) ||
                                  std::binary_search(known_.begin(), known_.end(), kCorners + node);
        const RoundSurface::Place near = round_(x);
        if (near.sample.distance == kInfinity) return false;
        const Vec3 along = a_.pieces[std::size_t(near.at.piece)].slope(near.at.t).normalized();
        const Vec3 across = near.sample.normal.cross(along);
        // Of a round end, all around.
        const bool end = round_.is_ball() || across.norm() < 0.5;
        const double width = feet_.width_at(node, end ? Vec3(Vec3::Zero()) : across.normalized());
        return width > 0 && width <= (known_before ? kFineStays : 1) * fine_;
    }
    bool has(const FaceFoot& foot, std::span<const Vec3> places) const
    {
        for (int k = 0; k < foot.nodes; ++k) {
            const std::int32_t node = foot.node[std::size_t(k)].node;
            if (!has(node, places[std::size_t(node)])) return false;
        }
        return true;
    }

private:
    const Curve& a_;
    const FeetOnFaces& feet_;
    const RoundSurface& round_;
    std::span<const std::int64_t> known_;
    double fine_; // [m]
};

/// Fine nodes on the curve's round surface.
void touch_nodes(const SharpSurface& b, const RoundSurface& round, const FineNodes& fine,
                 double reach, std::vector<CurveOnFaces>& out)
{
    const auto wall = [&](const Vec3& x) { return round(x).sample; };
    const auto add = [&](const SurfaceContacts& found, std::int64_t kind) {
        for (const SurfaceContact& s : found.contact) {
            const std::int32_t node = found.slave(s).front().node;
            const Vec3& x = b.places[std::size_t(node)];
            if (!fine.has(node, x)) continue;
            CurveOnFaces c;
            c.curve.a = round(x).at;
            c.curve.b.piece = -1;
            c.curve.normal = -s.normal;
            c.curve.gap = s.gap;
            c.curve.point = x - 0.5 * s.gap * s.normal;
            c.curve.id = kind + node;
            c.node[0] = {node, 1};
            c.nodes = 1;
            c.area = s.area;
            out.push_back(c);
        }
    };
    add(wall_contacts(b.surface, b.places, wall, reach), kNodes);
    add(sharp_wall_contacts(b, wall, reach), kCorners);
}

CurveContact contact_at(const CurvePiece& piece, const CurvePlace& place, const Vec3& normal,
                        double distance, std::int64_t id)
{
    CurveContact c;
    c.a = place;
    c.b.piece = -1;
    c.normal = normal;
    c.gap = distance - piece.radius;
    c.point = piece.at(place.t) - (piece.radius + 0.5 * c.gap) * normal;
    c.id = id;
    return c;
}

/// Places where the curve crosses sharp edges, its round ends are on them, or it is on their ends.
/// Wherever its middle line is outside, no edge may be in the curve.
void touch_edges(const Curve& a, const SharpSurface& b, const FineNodes& fine, double reach,
                 std::vector<CurveOnFaces>& out)
{
    std::set<std::int32_t> points; // corners that are contacts already
    const std::vector<EdgeCurve> edges = edge_curves(b);
    for (std::size_t k = 0; k < edges.size(); ++k) {
        const EdgeCurve& e = edges[k];
        const std::int64_t shift = std::int64_t(k) * kChains;
        std::vector<CurveContact> found;
        touch_curve(a, {}, e.curve, reach, found);
        for (CurveContact& c : found) {
            if (!(c.normal.dot(e.outwards[std::size_t(c.b.piece)]) > 0)) continue;
            const std::array<StencilEntry, 4> nodes = e.at(c.b);
            const auto is_fine = [&](const StencilEntry& n) {
                return fine.has(n.node, b.places[std::size_t(n.node)]);
            };
            if (is_fine(nodes[1]) && is_fine(nodes[2])) continue;
            c.id += shift;
            const std::int32_t point = e.end_at(c.b);
            if (point >= 0) {
                if (!points.insert(point).second) continue;
                c.id = kPoints + point;
            }
            out.push_back({c, nodes, 4, 0});
        }
    }
}

} // namespace

std::vector<FaceStation> face_stations(const Curve& a, const ExternalSurface& surface,
                                       std::span<const Vec3> places)
{
    std::vector<double> shortest;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f).first(surface.corners[f]);
        double least = kInfinity;
        for (std::size_t k = 0; k < nodes.size(); ++k)
            least = std::min(least, (places[std::size_t(nodes[k])] -
                                     places[std::size_t(nodes[(k + 1) % nodes.size()])])
                                        .norm());
        shortest.push_back(surface.face(f).size() == 6 ? 0.5 * least : least); // four faces
    }
    double spacing = 0.5 * thinnest(a);
    if (!shortest.empty()) {
        const auto middle = shortest.begin() + std::ptrdiff_t(shortest.size() / 2);
        std::nth_element(shortest.begin(), middle, shortest.end());
        spacing = std::max(spacing, *middle);
    }
    std::vector<FaceStation> out;
    for (std::size_t e = 0; e < a.pieces.size(); ++e) {
        const double length = a.start[e + 1] - a.start[e];
        int parts = 1;
        while (length > kLonger * spacing * parts && parts < kMostParts)
            parts *= 2;
        for (int k = 0; k < parts; ++k) {
            FaceStation s{{int(e), double(k) / parts}};
            if (k > 0) s.coarser = 2 * length * double(k & -k) / parts;
            out.push_back(s);
        }
    }
    if (!a.closed) out.push_back({{int(a.pieces.size()) - 1, 1}});
    return out;
}

std::vector<FaceStation> face_stations(std::span<const CurvePlace> places)
{
    std::vector<FaceStation> out;
    for (const CurvePlace& p : places)
        out.push_back({p});
    return out;
}

void touch_faces(const Curve& a, std::span<const FaceStation> stations, const SharpSurface& b,
                 std::span<const Vec3> at_rest, double reach, std::span<const std::int64_t> known,
                 std::vector<CurveOnFaces>& out)
{
    double thickest = 0;
    for (const CurvePiece& p : a.pieces)
        thickest = std::max(thickest, p.radius);
    const double within = reach + thickest;
    const FeetOnFaces feet(b.surface, b.places, at_rest, curve_box(a, within));
    if (feet.empty()) return;
    const RoundSurface round(a, stations, within);
    const FineNodes fine(a, feet, round, known);
    const std::size_t first = out.size();
    const bool whole = stations.size() > 1;
    if (whole) touch_edges(a, b, fine, reach, out);
    std::vector<double> crossed; // by arc length [m]
    for (std::size_t k = first; k < out.size(); ++k)
        crossed.push_back(arc_at(a, out[k].curve.a));
    std::sort(crossed.begin(), crossed.end());
    const double spacing = longest_way(a, stations);
    for (std::size_t i = 0; i < stations.size(); ++i) {
        const CurvePlace& p = stations[i].place;
        const CurvePiece& piece = a.pieces[std::size_t(p.piece)];
        const std::optional<FaceFoot> foot = feet.find(piece.at(p.t), reach + piece.radius);
        if (!foot || fine.has(*foot, b.places)) continue;
        if (stations[i].coarser <=
            kLonger * feet.length_along(*foot, piece.slope(p.t).normalized()))
            continue;
        // A crossing of that edge is nearer to it.
        if (foot->beyond) {
            const double s = arc_at(a, p);
            const auto near = std::lower_bound(crossed.begin(), crossed.end(), s - spacing);
            if (near != crossed.end() && *near <= s + spacing) continue;
        }
        const CurveContact c = contact_at(piece, p, foot->normal, foot->distance, std::int64_t(i));
        if (c.gap <= reach) out.push_back({c, foot->node, foot->nodes, 0});
    }
    touch_nodes(b, round, fine, reach, out);
}

bool pass_through_faces(const Curve& before, const Curve& now, std::span<const Vec3> places_before,
                        const SharpSurface& b)
{
    constexpr double kMost = 1e5; // places along the curve
    double way = 0, length = 0;
    const double least = thinnest(now);
    for (std::size_t e = 0; e < now.pieces.size(); ++e) {
        const CurvePiece &p0 = before.pieces[e], &p1 = now.pieces[e];
        way = std::max({way, (p1.x0 - p0.x0).norm(), (p1.x1 - p0.x1).norm(),
                        (p1.at(0.5) - p0.at(0.5)).norm()});
        length += (p1.x1 - p1.x0).norm();
    }
    double of_faces = 0;
    for (const std::int32_t node : b.surface.used_nodes)
        of_faces = std::max(
            of_faces, (b.places[std::size_t(node)] - places_before[std::size_t(node)]).norm());
    // Middle lines that touching surfaces keep a radius away are still outside.
    if (way + of_faces <= 0.5 * least) return false;
    std::vector<Vec3> from, to;
    const double spacing = std::max(0.5 * least, length / kMost);
    for (const CurvePlace& p : stations(now, spacing)) {
        from.push_back(before.pieces[std::size_t(p.piece)].at(p.t));
        to.push_back(now.pieces[std::size_t(p.piece)].at(p.t));
    }
    ExternalSurface line; // of places, without faces
    for (std::size_t i = 0; i < to.size(); ++i)
        line.used_nodes.push_back(std::int32_t(i));
    line.starts.push_back(0);
    if (passage({line, from, to}, {b.surface, places_before, b.places}, 1e-3 * least)) return true;
    if (b.features.sharp == 0) return false;
    const std::vector<EdgeCurve> edges_before = edge_curves({b.surface, b.features, places_before}),
                                 edges = edge_curves(b);
    for (std::size_t k = 0; k < edges.size(); ++k)
        if (pass_through(before, now, edges_before[k].curve, edges[k].curve)) return true;
    return false;
}

} // namespace amontons
