#include "contact/surface/sharp_contacts.hpp"

#include "contact/surface/fixed_shape.hpp"
#include "contact/surface/nearest_face.hpp"
#include "contact/surface/overlap.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

namespace amontons {
namespace {

using Piece = SharpFeatures::Piece;

/// Sine by which faces beside a sharp feature rise from the other body: above the first there is no
/// contact of faces, below the second faces are in contact.
constexpr double kLeadsAway = 0.1, kLeastRise = -0.05;
/// In between it may be deeper by this share of a face, times the missing part of the rise.
constexpr double kDeeperWhereFlat = 0.1;
/// Edges that cross at less have no common normal (sine).
constexpr double kParallelEdges = 0.05;
/// Up to this sine they may overlap by this share of a face, times what the sine lacks: see
/// left_where_parallel().
constexpr double kNearlyParallel = 0.2, kDeeperWhereParallel = 0.05;
/// An edge that is inclined by more against a face (sine) touches it with its lower node.
constexpr double kSteepEdge = 0.7;
/// Within a chain a point may lie beyond its piece by this share: chains bend a little at nodes.
constexpr double kBeyondFace = 0.05;
/// Ids: nodes of the slave, of the master, then chains and what they cross, so many times at most.
constexpr std::int64_t kMasterNodes = std::int64_t(1) << 32, kCrossingIds = std::int64_t(1) << 34,
                       kMostCrossings = 8;

const Vec3& place_at(std::span<const Vec3> places, std::int32_t node)
{
    return places[static_cast<std::size_t>(node)];
}

Vec3 centre_of(const SharpSurface& s, std::int32_t face)
{
    const auto nodes = s.surface.face(std::size_t(face));
    const std::uint8_t corners = s.surface.corners[std::size_t(face)];
    Vec3 centre = Vec3::Zero();
    for (std::size_t i = 0; i < corners; ++i)
        centre += place_at(s.places, nodes[i]) / corners;
    return centre;
}

double size_of(const SharpSurface& s, std::int32_t face)
{
    return longest_edge(s.surface, std::size_t(face), s.places);
}

/// Of the mean plane of the corners.
Vec3 sharp_face_normal(const SharpSurface& s, std::int32_t face)
{
    const auto n = s.surface.face(std::size_t(face));
    const auto x = [&](std::size_t i) { return place_at(s.places, n[i]); };
    return s.surface.corners[std::size_t(face)] == 3
               ? (x(1) - x(0)).cross(x(2) - x(0)).normalized()
               : (x(2) - x(0)).cross(x(3) - x(1)).normalized();
}

BoundingBox around(std::span<const Vec3> places, std::span<const std::int32_t> nodes, double margin)
{
    BoundingBox box;
    for (const std::int32_t node : nodes)
        box.add(place_at(places, node));
    box.low -= margin;
    box.high += margin;
    return box;
}

/// The box around a surface.
BoundingBox box_with_margin(const SharpSurface& s, double margin)
{
    BoundingBox box = s.fixed ? s.fixed->box : around(s.places, s.surface.used_nodes, 0);
    box.low -= margin;
    box.high += margin;
    return box;
}

/// Numbers of the sharp nodes in a box, ascending.
std::vector<std::size_t> sharp_nodes_in(const SharpSurface& s, const BoundingBox& box)
{
    std::vector<std::size_t> in;
    if (s.fixed) {
        s.fixed->sharp_nodes.visit(box, [&](std::int32_t i) { in.push_back(std::size_t(i)); });
        std::sort(in.begin(), in.end());
        return in;
    }
    for (std::size_t i = 0; i < s.features.nodes.size(); ++i) {
        const Eigen::Array3d x = place_at(s.places, s.features.nodes[i]).array();
        if ((x >= box.low).all() && (x <= box.high).all()) in.push_back(i);
    }
    return in;
}

class Finder {
public:
    Finder(const SharpSurface& slave, const SharpSurface& master, double reach,
           const std::vector<std::int64_t>* known, bool bare_corners)
        : slave_(slave)
        , master_(master)
        , reach_(reach)
        , known_(known)
        , bare_corners_(bare_corners)
    {
    }

    SurfaceContacts run()
    {
        nodes_on_faces(slave_, master_, true);
        nodes_on_faces(master_, slave_, false);
        edges_across_edges();
        return std::move(out_);
    }

private:
    void nodes_on_faces(const SharpSurface& own, const SharpSurface& other, bool own_is_slave);
    void edges_across_edges();

    /// The normal of a face, which does not jump to the next; nothing where it has no area.
    std::optional<Vec3> smooth_normal(const SharpSurface& s, std::int32_t face,
                                      const PerNode& values)
    {
        if (s.fixed && !s.fixed->normals.has(face)) return {};
        if (s.fixed) return s.fixed->normals.normal(face, values);
        std::optional<SmoothNormalsOnDemand>& smooth = smooth_[&s == &master_];
        if (!smooth) smooth.emplace(s.surface, s.places, s.features.smooth);
        return smooth->normal(face, values);
    }
    Vec3 normal_on(const SharpSurface& s, const Piece& p, const SharpSurface& other,
                   const Piece& edge);

    /// What faces must rise by for this contact to be one.
    double least_rise(std::int64_t id) const
    {
        const bool begins = known_ && !std::binary_search(known_->begin(), known_->end(), id);
        return begins ? kLeadsAway : kLeastRise;
    }

    /// The gap of a contact whose faces rise by `rise`, with what may overlap there; nothing where
    /// it is none, or open by far.
    /// @param size  of the face there, called where faces are flat
    template <class Size>
    std::optional<double> gap_of(double gap, double rise, std::int64_t id, Size size) const
    {
        if (rise <= least_rise(id)) return {};
        if (known_ || rise > kLeadsAway) return gap;
        const double deeper = kDeeperWhereFlat * (kLeadsAway - rise) * size();
        if (gap > deeper) return {};
        return gap + deeper;
    }

    const SharpSurface &slave_, &master_;
    double reach_;
    const std::vector<std::int64_t>* known_;
    bool bare_corners_ = false;
    SurfaceContacts out_;
    std::optional<SmoothNormalsOnDemand> smooth_[2]; // of slave, of master, once they are needed
};

/// How far (sine) the faces around a sharp node lead away from a body whose normal is n, at least;
/// -1 where one of its neighbours is steeply below it.
double points_away(const SharpSurface& s, std::size_t sharp_node, const Vec3& n)
{
    double least = 1;
    const SharpFeatures& f = s.features;
    const Vec3& x = place_at(s.places, f.nodes[sharp_node]);
    const auto rise = [&](const Vec3& place) { return n.dot((place - x).normalized()); };
    for (std::size_t k = f.begin[sharp_node]; k < f.begin[sharp_node + 1]; ++k) {
        least = std::min(least, rise(centre_of(s, f.faces[k])));
        for (const std::int32_t node : s.surface.face(std::size_t(f.faces[k])))
            if (node != f.nodes[sharp_node] && rise(place_at(s.places, node)) < -kSteepEdge)
                return -1;
    }
    return least;
}

/// Whether one of the faces around a sharp node is directed at a face with normal n.
bool faces_towards(const SharpSurface& s, std::size_t sharp_node, const Vec3& n)
{
    const SharpFeatures& f = s.features;
    for (std::size_t k = f.begin[sharp_node]; k < f.begin[sharp_node + 1]; ++k)
        if (sharp_face_normal(s, f.faces[k]).dot(n) < -kFacing) return true;
    return false;
}

/// As for a node, of the two faces beside an edge, across it.
double points_away(const SharpSurface& s, const Piece& p, const Vec3& n)
{
    const Vec3& a = place_at(s.places, p.nodes[0]);
    const Vec3 tangent = (place_at(s.places, p.nodes[1]) - a).normalized();
    const auto away = [&](std::int32_t face) {
        const Vec3 d = centre_of(s, face) - a;
        return n.dot((d - tangent.dot(d) * tangent).normalized());
    };
    return std::min(away(p.faces[0]), away(p.faces[1]));
}

/// Whether a sharp node carries no multiplier: the corners of T6.
bool is_bare(const SharpSurface& s, std::size_t sharp_node)
{
    const SharpFeatures& f = s.features;
    const auto first = s.surface.face(std::size_t(f.faces[f.begin[sharp_node]]));
    return first.size() == 6 &&
           std::find(first.begin(), first.begin() + 3, f.nodes[sharp_node]) != first.begin() + 3;
}

void Finder::nodes_on_faces(const SharpSurface& own, const SharpSurface& other, bool own_is_slave)
{
    const SharpFeatures& f = own.features;
    if (f.nodes.empty()) return;
    const std::vector<std::size_t> near = sharp_nodes_in(own, box_with_margin(other, reach_));
    if (near.empty()) return;
    std::optional<FacetTree> now; // of a surface that bends
    if (!other.fixed) {
        BoundingBox within; // no node reaches farther
        for (const std::size_t i : near)
            within.add(place_at(own.places, f.nodes[i]));
        within.low -= reach_;
        within.high += reach_;
        now.emplace(facets_near(other.surface, other.places, within, 0));
    }
    const NearestFace faces(other.fixed ? other.fixed->faces : *now);
    for (const std::size_t i : near) {
        const Vec3& x = place_at(own.places, f.nodes[i]);
        const std::int64_t id = f.nodes[i] + (own_is_slave ? 0 : kMasterNodes);
        // Mean gaps do not contain the corner of a T6, however flat its faces lie: as a block rolls
        // onto its side, the contact of the corner would begin at once, with a large overlap.
        const bool bare = bare_corners_ && own_is_slave && is_bare(own, i);
        // A nearer face that is opposite to one of its own faces counts, too: then there is none.
        const double by = bare ? kLeastRise : least_rise(id);
        const NearestFace::Found hit = faces.find(x, reach_, [&](const Facet& facet) {
            return points_away(own, i, facet.normal) > by || faces_towards(own, i, facet.normal);
        });
        if (!hit.facet || !hit.on_this_side) continue;
        const auto nodes = other.surface.face(std::size_t(hit.facet->face));
        const FaceInPlane face(nodes, other.places);
        const FaceSpot foot = spot(face, nearest_xi(face, x, hit.point.xi));
        const Vec3 apart = x - foot.place;
        const Vec3 normal = smooth_normal(other, hit.facet->face, foot.values)
                                .value_or(foot.along[0].cross(foot.along[1]).normalized());
        SurfaceContact c;
        c.gap = normal.dot(apart);
        if (std::abs(c.gap) > reach_ || !NearestFace::is_over(apart, normal, *hit.facet)) continue;
        const auto gap = gap_of(c.gap, bare ? 1 : points_away(own, i, normal), id,
                                [&] { return size_of(other, hit.facet->face); });
        if (!gap) continue;
        c.gap = *gap;
        c.id = id;
        c.point = own_is_slave ? x : foot.place;
        c.normal = own_is_slave ? normal : Vec3(-normal);
        set_tangents(c);
        const auto node = [&] { out_.stencil.push_back({f.nodes[i], 1}); };
        const auto touched = [&] {
            for (std::size_t l = 0; l < nodes.size(); ++l)
                out_.stencil.push_back({nodes[l], foot.values[Eigen::Index(l)]});
        };
        c.slave_begin = std::int32_t(out_.stencil.size());
        own_is_slave ? node() : touched();
        c.slave_end = c.master_begin = std::int32_t(out_.stencil.size());
        own_is_slave ? touched() : node();
        c.master_end = std::int32_t(out_.stencil.size());
        out_.contact.push_back(c);
    }
}

} // namespace

std::vector<std::array<Vec3, 2>> chain_directions(const SharpSurface& s)
{
    const std::span<const Piece> pieces = std::span(s.features.pieces).first(s.features.sharp);
    std::map<std::pair<std::int32_t, std::int32_t>, Vec3> sum; // of a chain at a node
    for (const Piece& p : pieces)
        for (const std::int32_t node : p.nodes)
            sum.try_emplace({p.chain, node}, Vec3::Zero()).first->second +=
                (place_at(s.places, p.nodes[1]) - place_at(s.places, p.nodes[0])).normalized();
    std::vector<std::array<Vec3, 2>> out;
    for (const Piece& p : pieces)
        out.push_back({sum.at({p.chain, p.nodes[0]}).normalized(),
                       sum.at({p.chain, p.nodes[1]}).normalized()});
    return out;
}

BoundingBox piece_box(const SharpSurface& s, const Piece& p, double margin)
{
    const double length = (place_at(s.places, p.nodes[1]) - place_at(s.places, p.nodes[0])).norm();
    return around(s.places, p.nodes, margin + kBeyondFace * length);
}

namespace {

/// The normal of a surface on a piece that is not sharp, where an edge of the other passes.
Vec3 Finder::normal_on(const SharpSurface& s, const Piece& p, const SharpSurface& other,
                       const Piece& edge)
{
    const Vec3 mean =
        (sharp_face_normal(s, p.faces[0]) + sharp_face_normal(s, p.faces[1])).normalized();
    const Vec3 &a = place_at(s.places, p.nodes[0]), &b = place_at(other.places, edge.nodes[0]);
    Mat3 basis;
    basis << place_at(s.places, p.nodes[1]) - a, b - place_at(other.places, edge.nodes[1]), mean;
    const double t = std::clamp((basis.inverse() * (b - a))[0], 0.0, 1.0);
    PerNode values = PerNode::Zero();
    const auto nodes = s.surface.face(std::size_t(p.faces[0]));
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (nodes[k] == p.nodes[0]) values[Eigen::Index(k)] = 1 - t;
        if (nodes[k] == p.nodes[1]) values[Eigen::Index(k)] = t;
    }
    return smooth_normal(s, p.faces[0], values).value_or(mean);
}

/// Where two pieces are over each other, between their ends.
struct Crossing {
    std::int64_t id = 0;       ///< of what crosses
    std::size_t piece[2] = {}; ///< of slave and master
    double along[2] = {};      ///< places on them, 0 to 1
    Vec3 point = Vec3::Zero(), normal = Vec3::UnitZ();
    double gap = 0;

    double off_centre() const
    {
        return std::max(std::abs(along[0] - 0.5), std::abs(along[1] - 0.5));
    }
};

/// Overlap that a crossing leaves. Where edges are nearly parallel, their crossing moves along them
/// by far more than they do, and ceases at kParallelEdges; what touches there is held by the edges
/// beside it, on both sides. So the force ends gradually before the crossing does [m].
/// @param sine  of the angle of the edges
/// @param size  of the smaller face [m]
double left_where_parallel(double sine, double size)
{
    const double missing = (kNearlyParallel - sine) / (kNearlyParallel - kParallelEdges);
    return kDeeperWhereParallel * std::max(missing, 0.0) * size;
}

/// Overlap that a crossing beyond the end of a piece leaves, where the next piece of a bent surface
/// leads away from its line: as far as an angle of 45 degrees would.
/// @param s  place on the piece, 0 to 1 within it
double left_beyond(double s, double length)
{
    return std::max({-s, s - 1, 0.0}) * length;
}

bool on_piece(const Piece& p, double s)
{
    return s >= (p.ends[0] ? 0 : -kBeyondFace) && s <= (p.ends[1] ? 1 : 1 + kBeyondFace);
}

void Finder::edges_across_edges()
{
    const SharpFeatures &of_slave = slave_.features, &of_master = master_.features;
    if (of_slave.sharp == 0 && of_master.sharp == 0) return;
    const BoundingBox all = box_with_margin(slave_, reach_);
    // Pieces of the master: those of a surface that bends that come near, all that are sharp of
    // one that does not, and the others.
    std::vector<std::int32_t> near;
    std::optional<BoxTree> now;
    if (!master_.fixed) {
        std::vector<BoundingBox> boxes;
        for (std::size_t j = 0; j < of_master.pieces.size(); ++j) {
            if (j >= of_master.sharp && of_slave.sharp == 0) break;
            const BoundingBox box = piece_box(master_, of_master.pieces[j], 0);
            if (!all.touches(box)) continue;
            near.push_back(std::int32_t(j));
            boxes.push_back(box);
        }
        if (near.empty()) return;
        now.emplace(boxes);
    }
    const auto for_pieces_in = [&](const BoundingBox& box, bool others, auto&& visit) {
        if (now) return now->visit(box, [&](std::int32_t k) { visit(near[std::size_t(k)]); });
        master_.fixed->sharp_pieces.visit(box, visit);
        if (others)
            master_.fixed->other_pieces.visit(
                box, [&](std::int32_t k) { visit(std::int32_t(of_master.sharp) + k); });
    };

    std::vector<std::array<Vec3, 2>> of_chains[2]; // of bodies that bend, once they are needed
    const auto directions = [&](const SharpSurface& s,
                                bool master) -> const std::vector<std::array<Vec3, 2>>& {
        if (s.fixed) return s.fixed->directions;
        if (of_chains[master].empty()) of_chains[master] = chain_directions(s);
        return of_chains[master];
    };
    std::vector<Crossing> found;
    const auto add = [&](std::size_t i, std::size_t j, const Vec3& normal, std::int64_t id,
                         double rise) {
        const Piece &p = of_slave.pieces[i], &q = of_master.pieces[j];
        const Vec3 &a = place_at(slave_.places, p.nodes[0]),
                   &b = place_at(master_.places, q.nodes[0]);
        const Vec3 u = place_at(slave_.places, p.nodes[1]) - a,
                   v = place_at(master_.places, q.nodes[1]) - b;
        Mat3 basis; // a + s u - (b + t v) = gap normal
        basis << u, -v, -normal;
        const double sine = std::abs(basis.determinant()) / (u.norm() * v.norm());
        if (!(sine > kParallelEdges)) return;
        const Vec3 x = basis.inverse() * (b - a);
        if (!on_piece(p, x[0]) || !on_piece(q, x[1]) || std::abs(x[2]) > reach_) return;
        const auto size = [&] {
            return std::min(size_of(slave_, p.faces[0]), size_of(master_, q.faces[0]));
        };
        if (const auto gap = gap_of(x[2], rise, id, size))
            found.push_back(
                {id,
                 {i, j},
                 {x[0], x[1]},
                 a + x[0] * u,
                 normal,
                 *gap + (known_ ? 0
                                : left_where_parallel(sine, size()) + left_beyond(x[0], u.norm()) +
                                      left_beyond(x[1], v.norm()))});
    };
    const auto both_sharp = [&](std::size_t i, std::size_t j) {
        const Piece &p = of_slave.pieces[i], &q = of_master.pieces[j];
        const std::int64_t id =
            kCrossingIds + kMostCrossings * (std::int64_t(p.chain) * of_master.chains + q.chain);
        const std::vector<std::array<Vec3, 2>>&along_slave = directions(slave_, false),
                                           &along_master = directions(master_, true);
        const Vec3 u = place_at(slave_.places, p.nodes[1]) - place_at(slave_.places, p.nodes[0]);
        const Vec3 v = place_at(master_.places, q.nodes[1]) - place_at(master_.places, q.nodes[0]);
        const Vec3 across = u.cross(v);
        if (across.norm() <= kParallelEdges * u.norm() * v.norm()) return;
        Mat3 basis;
        basis << u, -v, -across;
        const Vec3 x = basis.inverse() *
                       (place_at(master_.places, q.nodes[0]) - place_at(slave_.places, p.nodes[0]));
        const auto direction = [](const std::array<Vec3, 2>& ends, double s) {
            const double share = std::clamp(s, 0.0, 1.0);
            return Vec3((1 - share) * ends[0] + share * ends[1]);
        };
        Vec3 n = direction(along_slave[i], x[0]).cross(direction(along_master[j], x[1]));
        n.normalize();
        // Or the other one lies on a face beside it.
        Vec3 normal = n;
        double rise = -1;
        const double enough = known_ ? least_rise(id) : kLeadsAway;
        const auto consider = [&](const Vec3& m, double by) {
            if (rise > enough || by <= rise) return;
            normal = m;
            rise = by;
        };
        for (const double sign : {1.0, -1.0})
            consider(sign * n, std::min(points_away(slave_, p, sign * n),
                                        points_away(master_, q, -sign * n)));
        for (const std::int32_t face : q.faces) {
            const Vec3 m = sharp_face_normal(master_, face);
            consider(m, points_away(slave_, p, m));
        }
        for (const std::int32_t face : p.faces) {
            const Vec3 m = -sharp_face_normal(slave_, face);
            consider(m, points_away(master_, q, -m));
        }
        add(i, j, normal, id, rise);
    };

    // ---- Pairs of pieces in each other's reach
    const std::int64_t pairs_of_chains = std::int64_t(of_slave.chains) * of_master.chains;
    const std::int64_t on_master =
        std::int64_t(of_slave.chains) * std::int64_t(of_master.pieces.size());
    for (std::size_t i = 0; i < of_slave.pieces.size(); ++i) {
        const Piece& p = of_slave.pieces[i];
        const bool sharp = i < of_slave.sharp;
        if (!sharp && of_master.sharp == 0) break;
        for_pieces_in(piece_box(slave_, p, reach_), sharp, [&](std::int32_t k) {
            const auto j = std::size_t(k);
            const Piece& q = of_master.pieces[j];
            const bool other_sharp = j < of_master.sharp;
            if (sharp && other_sharp) return both_sharp(i, j);
            if (!sharp && !other_sharp) return;
            // The sharp one lies on the faces that the other parts.
            const SharpSurface &edge = sharp ? slave_ : master_, &flat = sharp ? master_ : slave_;
            const Piece &e = sharp ? p : q, &f = sharp ? q : p;
            const Vec3 n = normal_on(flat, f, edge, e);
            const Vec3 along =
                (place_at(edge.places, e.nodes[1]) - place_at(edge.places, e.nodes[0]))
                    .normalized();
            const std::int64_t crossed =
                sharp
                    ? p.chain * std::int64_t(of_master.pieces.size()) + std::int64_t(j)
                    : on_master + q.chain * std::int64_t(of_slave.pieces.size()) + std::int64_t(i);
            const std::int64_t id = kCrossingIds + kMostCrossings * (pairs_of_chains + crossed);
            const double rise = points_away(edge, e, n);
            if (std::abs(along.dot(n)) > kSteepEdge || rise <= kLeastRise) return;
            add(i, j, sharp ? n : Vec3(-n), id, rise);
        });
    }

    // ---- One crossing for each place
    // Crossings near a node may be seen from both of its pieces: the one well within its own
    // counts.
    std::sort(found.begin(), found.end(), [](const Crossing& a, const Crossing& b) {
        return std::tuple(a.id, a.piece[0], a.piece[1]) < std::tuple(b.id, b.piece[0], b.piece[1]);
    });
    std::vector<Crossing> kept;
    for (const Crossing& c : found) {
        const Piece& p = of_slave.pieces[c.piece[0]];
        const double near_by =
            4 * kBeyondFace *
            (place_at(slave_.places, p.nodes[1]) - place_at(slave_.places, p.nodes[0])).norm();
        auto same = kept.rbegin();
        while (same != kept.rend() && same->id == c.id && (same->point - c.point).norm() >= near_by)
            ++same;
        if (same == kept.rend() || same->id != c.id)
            kept.push_back(c);
        else if (c.off_centre() < same->off_centre())
            *same = c;
    }
    for (std::size_t i = 0; i < kept.size(); ++i) {
        const Crossing& k = kept[i];
        std::int64_t number = 0;
        for (std::size_t l = i; l > 0 && kept[l - 1].id == k.id; --l)
            ++number;
        if (number >= kMostCrossings) continue;
        SurfaceContact c;
        c.id = k.id + number;
        c.point = k.point;
        c.normal = k.normal;
        set_tangents(c);
        c.gap = k.gap;
        const auto side = [&](const Piece& p, double s) {
            out_.stencil.push_back({p.nodes[0], 1 - s});
            out_.stencil.push_back({p.nodes[1], s});
            return std::int32_t(out_.stencil.size());
        };
        c.slave_begin = std::int32_t(out_.stencil.size());
        c.slave_end = c.master_begin = side(of_slave.pieces[k.piece[0]], k.along[0]);
        c.master_end = side(of_master.pieces[k.piece[1]], k.along[1]);
        out_.contact.push_back(c);
    }
}

} // namespace

SurfaceContacts sharp_contacts(const SharpSurface& slave, const SharpSurface& master, double reach,
                               const std::vector<std::int64_t>* known, bool bare_corners)
{
    return Finder(slave, master, reach, known, bare_corners).run();
}

SurfaceContacts sharp_wall_contacts(const SharpSurface& slave,
                                    const std::function<WallSample(const Vec3&)>& wall,
                                    double reach)
{
    SurfaceContacts out;
    const SharpFeatures& f = slave.features;
    for (std::size_t i = 0; i < f.nodes.size(); ++i) {
        if (!is_bare(slave, i)) continue;
        SurfaceContact c;
        c.point = place_at(slave.places, f.nodes[i]);
        const WallSample sample = wall(c.point);
        if (!(std::abs(sample.distance) <= reach)) continue;
        c.id = f.nodes[i];
        c.normal = sample.normal;
        c.gap = sample.distance;
        set_tangents(c);
        c.slave_begin = std::int32_t(out.stencil.size());
        out.stencil.push_back({f.nodes[i], 1});
        c.slave_end = c.master_begin = c.master_end = std::int32_t(out.stencil.size());
        out.contact.push_back(c);
    }
    return out;
}

} // namespace amontons
