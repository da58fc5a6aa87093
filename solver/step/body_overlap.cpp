#include "contact/rigid/overlap.hpp"
#include "contact/rigid/shape_distance.hpp"
#include "contact/surface/facets.hpp"
#include "contact/surface/passage.hpp"
#include "mesh/box_tree.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/byte_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

// How far bodies stand in each other, measured on their surfaces, and rows at the places that do:
// multipliers of a coarse side see means only, and nothing of what enters its faces between them.

namespace amontons {
namespace {

// Limits of docs/theory/certificate.md.
constexpr double kAllowedOfFace = 0.01; // of the smaller face, without a warning
constexpr double kAllowedOfBody = 1e-3; // of the smaller body, where neither side has faces
constexpr double kNever = 0.1;          // of the thinner body, of the smaller face
constexpr double kMeanBulge = 2.0 / 3;  // of h^2/8 times the curvature: a chord's mean distance
constexpr double kLoose = 0.3;          // of the depth: nodes of a face are off what enters it
constexpr double kThinnest = 1e-3;      // of a rigid body's length: thinner ones count as lines
constexpr double kLeastReach = 0.02;    // of the smaller body: what a given reach is raised to
// Deeper places get rows whatever the curvature: less than kNever, since places slide on within a
// step.
constexpr double kRowsOfThickness = 0.05, kRowsOfFace = 0.08;
constexpr double kSameRow = 0.05; // of weights

BoundingBox everywhere()
{
    constexpr double kFar = std::numeric_limits<double>::infinity();
    return {Eigen::Array3d::Constant(-kFar), Eigen::Array3d::Constant(kFar)};
}

BoundingBox as_bounding(const AxisBox& box)
{
    return {box.low.array(), box.high.array()};
}

bool same_place(const SurfacePlace& a, const SurfacePlace& b)
{
    if (a.count != b.count) return false;
    for (std::size_t k = 0; k < std::size_t(a.count); ++k)
        if (a.node[k].node != b.node[k].node ||
            std::abs(a.node[k].weight - b.node[k].weight) > kSameRow)
            return false;
    return true;
}

} // namespace

double thickness_of(const BodyRef& b)
{
    if (b.solid) return b.solid->thickness();
    if (b.rod) return 2 * b.rod->least_radius();
    const AxisBox box = axis_box(b.rigid->shape(), {});
    const Vec3 extent = box.high - box.low;
    return std::max(extent.minCoeff(), kThinnest * extent.maxCoeff());
}

double ContactFinder::thickness(const std::vector<BodyRef>& bodies, int body)
{
    thickness_.resize(bodies.size(), 0);
    double& own = thickness_[std::size_t(body)];
    if (!(own > 0)) own = thickness_of(bodies[std::size_t(body)]);
    return own;
}

double ContactFinder::thinner_of(const std::vector<BodyRef>& bodies, const ContactPair& p)
{
    const double own = thickness(bodies, p.a);
    return p.b >= 0 ? std::min(own, thickness(bodies, p.b)) : own;
}

void ContactFinder::limit_reach(const std::vector<BodyRef>& bodies, bool dynamic)
{
    if (std::exchange(reach_limited_, true)) return;
    for (std::size_t k = 0; k < given_; ++k) {
        ContactPair& p = pairs_[k];
        const BodyRef& a = bodies[std::size_t(p.a)];
        if (a.rod) continue;
        double size = a.body->size();
        if (p.b >= 0) size = std::min(size, bodies[std::size_t(p.b)].body->size());
        if (a.solid && p.b >= 0 && p.a != p.b && !p.small) {
            // Between meshes the far side of a body is an overlap, too.
            const RigidBody* rigid = bodies[std::size_t(p.b)].rigid;
            const double most = rigid && is_round(rigid->shape())
                                    ? std::numeric_limits<double>::infinity()
                                    : kReachOfThickness * thinner_of(bodies, p);
            p.reach = std::clamp(p.reach, std::min(kLeastReach * size, most), most);
            p.margin = std::min(p.margin, p.reach);
        } else if (!dynamic) {
            p.reach = std::max(p.reach, kLeastReach * size);
        }
    }
}

void ContactFinder::overlaps(const std::vector<BodyRef>& bodies, std::vector<BodyOverlap>& out,
                             bool small_too)
{
    out.clear();
    find_boxes(bodies);
    for (std::size_t p = 0; p < given_; ++p) {
        if (pairs_[p].small && !small_too) continue;
        const std::size_t first = out.size();
        overlaps_of_pair(bodies, int(p), out);
        const double left =
            start_overlap_left(int(p)) + (start_tolerance_.empty() ? 0 : start_tolerance_[p]);
        for (std::size_t i = first; left > 0 && i < out.size(); ++i)
            for (double* limit : {&out[i].allowed, &out[i].most, &out[i].rows_beyond})
                *limit += left;
    }
    if (!rest_) return;
    for (const BoxPair& p : rest_meeting(bodies, [&](int b) { return boxes_[std::size_t(b)]; }))
        if (const auto o = rigid_overlap(bodies, p.a, p.b)) out.push_back(*o);
}

std::vector<std::string> ContactFinder::not_measured(const std::vector<BodyRef>& bodies) const
{
    std::vector<std::string> sentences;
    for (std::size_t k = 0; k < given_; ++k) {
        const ContactPair& p = pairs_[k];
        const char* why = p.small ? "\"sliding\" is \"small\""
                          : p.a == p.b && bodies[std::size_t(p.a)].solid ? "a body and itself"
                          : !p.end_a.empty() ? "an end of a rod alone touches"
                                             : nullptr;
        if (!why) continue;
        sentences.push_back(bodies[std::size_t(p.a)].name + " and " +
                            (p.b >= 0 ? bodies[std::size_t(p.b)].name : "an obstacle") + ": " +
                            why);
    }
    return sentences;
}

void ContactFinder::overlaps_of_pair(const std::vector<BodyRef>& bodies, int pair,
                                     std::vector<BodyOverlap>& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const BodyRef& a = bodies[std::size_t(p.a)];
    const auto below = [&](const ContactSurface* surface, int body) {
        return surface && !surface->whole ? thickness(bodies, body) : 0.0;
    };
    const double below_a = below(p.surface_a, p.a), below_b = below(p.surface_b, p.b);
    if (p.b >= 0 && apart(p, std::max(below_a, below_b))) return;
    if (a.rod) return overlaps_of_rod(bodies, pair, out);
    if (p.a == p.b) return;
    const bool meshes = p.b >= 0 && bodies[std::size_t(p.b)].solid;
    std::vector<OverlapSpot> spots;
    const auto keep = [&](bool of_b) {
        const double thinner = spots.empty() ? 0 : thinner_of(bodies, p);
        for (const OverlapSpot& s : spots) {
            BodyOverlap o;
            o.a = p.a;
            o.b = p.b;
            o.obstacle = p.obstacle;
            o.pair = pair;
            o.depth = s.depth;
            o.point = s.point;
            o.of_b = of_b;
            o.own = s.own;
            o.most = kNever * std::min(thinner, s.face);
            o.allowed = std::min(std::max(kAllowedOfFace * s.face, s.bulge), o.most);
            o.rows_beyond = o.allowed;
            // What is smaller than a face touches none of its nodes: nothing is left of it. Else
            // rows leave what integrals over the faces, or their nodes, leave on average.
            const bool loose = !meshes && s.node_gap > kLoose * s.depth;
            if (loose)
                o.rows_beyond = kAllowedOfFace * s.face;
            else
                o.tolerance = kMeanBulge * std::min(s.bulge, o.allowed);
            o.rows_beyond =
                std::min({o.rows_beyond, kRowsOfThickness * thinner, kRowsOfFace * s.face});
            out.push_back(o);
        }
        spots.clear();
    };
    if (!a.solid) {
        if (auto found =
                p.b >= 0 ? rigid_overlap(bodies, p.a, p.b) : overlap_with_obstacle(bodies, p)) {
            found->pair = pair;
            out.push_back(*found);
        }
        return;
    }
    const PlacedSurface own{*p.surface_a->facets, a.solid->places(), below_a};
    if (p.b < 0) {
        overlap_spots(own, distance_from_obstacle(p), everywhere(), spots);
        return keep(false);
    }
    const BodyRef& b = bodies[std::size_t(p.b)];
    if (b.rigid) {
        const AxisBox box = boxes_[std::size_t(p.b)];
        overlap_spots(own, distance_from(*b.rigid, b.rigid->placement()), as_bounding(box), spots);
        return keep(false);
    }
    const PlacedSurface other{*p.surface_b->facets, b.solid->places(), below_b};
    overlap_spots(own, other, spots);
    keep(false);
    overlap_spots(other, own, spots);
    keep(true);
}

std::function<WallSample(const Vec3&)>
ContactFinder::distance_from_obstacle(const ContactPair& p) const
{
    if (p.plane)
        return [plane = *p.plane](const Vec3& x) {
            WallSample s;
            s.normal = plane.turn * Vec3::UnitZ();
            s.distance = s.normal.dot(x - plane.place);
            return s;
        };
    return [wall = walls_[std::size_t(p.obstacle)], hint = WallHint()](const Vec3& x) mutable {
        return wall->sample(x, hint);
    };
}

const FacetedSurface* ContactFinder::facets_if_triangles(const std::vector<BodyRef>& bodies,
                                                         int body)
{
    if (!std::holds_alternative<TriangleShape>(bodies[std::size_t(body)].rigid->shape()))
        return nullptr;
    return &*facets_of(bodies, body).flat;
}

namespace {

/// Limits where neither side has faces.
template <class Thinner>
std::optional<BodyOverlap> overlap_of_shapes(const ShapeOverlap& deepest, Thinner thinner_of_both)
{
    if (!(deepest.depth > 0)) return {};
    const double thinner = thinner_of_both();
    BodyOverlap o;
    o.depth = deepest.depth;
    o.point = deepest.place;
    o.allowed = kAllowedOfBody * thinner;
    o.most = kNever * thinner;
    return o;
}

} // namespace

std::optional<BodyOverlap> ContactFinder::overlap_with_obstacle(const std::vector<BodyRef>& bodies,
                                                                const ContactPair& p)
{
    const RigidBody& rigid = *bodies[std::size_t(p.a)].rigid;
    const Pose pose = pose_of(rigid.placement());
    const auto distance = distance_from_obstacle(p);
    if (distance(pose.place).distance > bounding_radius(rigid.shape())) return {};
    auto o = overlap_of_shapes(
        deepest_in(rigid.shape(), pose, facets_if_triangles(bodies, p.a), distance, everywhere()),
        [&] { return thickness(bodies, p.a); });
    if (!o) return {};
    o->a = p.a;
    o->obstacle = p.obstacle;
    return o;
}

std::optional<BodyOverlap> ContactFinder::rigid_overlap(const std::vector<BodyRef>& bodies, int a,
                                                        int b)
{
    const RigidBody *one = bodies[std::size_t(a)].rigid, *two = bodies[std::size_t(b)].rigid;
    if (!one || !two) return {};
    ShapeOverlap deepest;
    const auto measure = [&](int from, const RigidBody& own, int to, const RigidBody& other) {
        const ShapeOverlap found = deepest_in(
            own.shape(), pose_of(own.placement()), facets_if_triangles(bodies, from),
            distance_from(other, other.placement()), as_bounding(boxes_[std::size_t(to)]));
        if (found.depth > deepest.depth) deepest = found;
    };
    // The distance of a ball's centre is exact.
    const auto ball = [](const RigidBody* r) { return std::holds_alternative<Ball>(r->shape()); };
    if (ball(one) || !ball(two)) measure(a, *one, b, *two);
    if (!ball(one)) measure(b, *two, a, *one);
    auto o = overlap_of_shapes(
        deepest, [&] { return std::min(thickness(bodies, a), thickness(bodies, b)); });
    if (!o) return {};
    o->a = a;
    o->b = b;
    return o;
}

bool ContactFinder::add_rows(std::span<const BodyOverlap> overlaps)
{
    rows_.resize(given_);
    bool some = false;
    for (const BodyOverlap& o : overlaps) {
        if (o.own.count == 0 || !(o.depth > o.rows_beyond)) continue;
        std::vector<PlaceRow>& rows = rows_[std::size_t(o.pair)];
        const auto known = [&](const PlaceRow& r) {
            return r.of_b == o.of_b && same_place(r.own, o.own);
        };
        if (std::ranges::any_of(rows, known)) continue;
        rows.push_back(
            {rows.empty() ? kFirstPlaceRow : rows.back().id + 1, o.of_b, o.own, o.tolerance});
        some = true;
    }
    return some;
}

namespace {

/// How a place inside a shape comes out of it: against its own surface's normal, into which it was
/// pressed. The nearest way out changes at once where two are equally long, as beside the edge of a
/// punch, and a place under it would be pushed sideways.
/// @param way  unit, or zero: the nearest
WallSample exit_from(const std::function<WallSample(const Vec3&)>& shape, const Vec3& x,
                     const Vec3& way, double longest)
{
    constexpr int kMost = 60;
    constexpr double kOut = 1e-12; // of the depth
    const WallSample nearest = shape(x);
    if (!(nearest.distance < 0) || way.isZero(0)) return nearest;
    double t = 0;
    WallSample s = nearest;
    // No step of the depth goes too far.
    for (int i = 0; i < kMost && t <= longest && s.distance < kOut * nearest.distance; ++i) {
        const double along = s.normal.dot(way);
        // On a flat side the first step along its normal is the whole way.
        const double whole = along > kFacing ? -s.distance / along : 0;
        if (whole > 0 && shape(x + (t + whole) * way).distance <= -kOut * nearest.distance)
            t += whole;
        else
            t -= s.distance;
        s = shape(x + t * way);
    }
    if (t > longest || s.normal.dot(way) < kFacing) return nearest;
    s.distance -= t * s.normal.dot(way);
    return s;
}

std::optional<FaceDistance::Foot> exit_from(const FaceDistance& surface, const Vec3& x,
                                            const Vec3& way, double longest, std::int32_t& hint)
{
    const std::optional<FaceDistance::Foot> nearest = surface.at(x, hint);
    if (!nearest || !(nearest->distance < 0) || way.isZero(0)) return nearest;
    std::vector<double> shares;
    surface.crossings(x, x + longest * way, shares);
    if (shares.empty()) return nearest;
    const Vec3 out = x + shares.front() * longest * way;
    std::int32_t near = hint;
    std::optional<FaceDistance::Foot> foot = surface.at(out, near);
    if (!foot || foot->normal.dot(way) < kFacing) return nearest;
    foot->distance = foot->normal.dot(x - foot->point);
    return foot;
}

} // namespace

void ContactFinder::add_place_rows(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    if (std::size_t(pair) >= rows_.size() || rows_[std::size_t(pair)].empty()) return;
    const ContactPair& p = pairs_[std::size_t(pair)];
    const BodyRef& a = bodies[std::size_t(p.a)];
    const SolidBody* b = p.b >= 0 ? bodies[std::size_t(p.b)].solid : nullptr;
    std::function<WallSample(const Vec3&)> exact;
    if (p.b < 0)
        exact = distance_from_obstacle(p);
    else if (const RigidBody* rigid = bodies[std::size_t(p.b)].rigid)
        exact = distance_from(*rigid, rigid->placement());
    for (const bool of_b : {false, true}) {
        const SolidBody* own = of_b ? b : a.solid;
        if (!own) continue;
        BoundingBox near;
        for (const PlaceRow& r : rows_[std::size_t(pair)])
            if (r.of_b == of_b) near.add(weighted(r.own.nodes(), own->places()));
        if (!(near.low <= near.high).all()) continue;
        std::optional<FaceDistance> faces;
        if (!exact) {
            // The nearest face is no farther than this, or out of reach.
            near.low -= 2 * reach_;
            near.high += 2 * reach_;
            faces.emplace(of_b ? PlacedSurface{*p.surface_a->facets, a.solid->places()}
                               : PlacedSurface{*p.surface_b->facets, b->places()},
                          near);
            if (faces->empty()) continue;
        }
        std::int32_t hint = -1;
        for (const PlaceRow& r : rows_[std::size_t(pair)]) {
            if (r.of_b != of_b) continue;
            BodyContact k;
            k.pair = pair;
            k.id = r.id;
            k.a = p.a;
            k.b = p.b;
            k.point = weighted(r.own.nodes(), own->places());
            const Vec3 out_of = outward_normal_at(
                {of_b ? *p.surface_b->facets : *p.surface_a->facets, own->places()}, r.own);
            Vec3 normal;
            SurfacePlace foot_place;
            if (exact) {
                const WallSample s = exit_from(exact, k.point, -out_of, reach_);
                k.gap = s.distance;
                normal = s.normal;
            } else {
                const auto foot = exit_from(*faces, k.point, -out_of, 2 * reach_, hint);
                if (!foot || std::abs(foot->distance) > 2 * reach_) continue;
                k.gap = foot->distance;
                normal = foot->normal;
                foot_place = foot->place;
            }
            if (out_of.dot(normal) > -kFacing) continue; // a side, which this face does not press
            k.gap += r.tolerance;
            if (k.gap > reach_) continue;
            k.frame = contact_frame(of_b ? Vec3(-normal) : normal);
            const auto add_side = [&](const SurfacePlace& place, std::int32_t& begin,
                                      std::int32_t& end) {
                begin = std::int32_t(out.stencil.size());
                for (const StencilEntry& e : place.nodes())
                    out.stencil.push_back(e);
                end = std::int32_t(out.stencil.size());
            };
            add_side(of_b ? foot_place : r.own, k.a_begin, k.a_end);
            add_side(of_b ? r.own : foot_place, k.b_begin, k.b_end);
            out.contact.push_back(k);
        }
    }
}

void ContactFinder::set_start_overlaps(const std::vector<BodyRef>& bodies, bool dynamic,
                                       std::span<const double> depths)
{
    limit_reach(bodies, dynamic);   // what is pressed out is looked for farther
    constexpr double kBeyond = 1.2; // of the depth: what is pressed out is seen all the way
    constexpr double kFit = 0.1;    // of the width that a contact stands for: gaps that fit
    start_depth_.assign(depths.begin(), depths.end());
    gap_offset_.resize(given_);
    find_boxes(bodies);
    for (std::size_t k = 0; k < given_; ++k) {
        ContactPair& p = pairs_[k];
        if (p.start_overlap == StartOverlap::refuse) continue;
        p.reach = std::max(p.reach, kBeyond * start_depth_[k]);
        if (p.start_overlap != StartOverlap::close) continue;
        const double depth = std::exchange(start_depth_[k], 0);
        BodyContacts found;
        if (p.small)
            find_kept(bodies, int(k));
        else
            find_large(bodies, int(k), found);
        for (const BodyContact& c : p.small ? kept_[k].contact : found.contact) {
            const double fits = std::max(kBeyond * depth, kFit * std::sqrt(c.area));
            if (std::abs(c.gap) <= fits) gap_offset_[k][c.id] = -c.gap;
        }
        for (BodyContact& c : kept_[k].contact)
            if (const auto known = gap_offset_[k].find(c.id); known != gap_offset_[k].end())
                c.gap += known->second;
        start_tolerance_.resize(given_, 0);
        start_tolerance_[k] = kBeyond * depth;
    }
}

/// What the gaps of a pair leave of the depth at its start.
double ContactFinder::start_overlap_left(int pair) const
{
    return start_depth_.empty() ? 0 : start_share_ * start_depth_[std::size_t(pair)];
}

double ContactFinder::motion_over_reach(const std::vector<BodyRef>& bodies, double from, double to)
{
    std::vector<double> motion;
    for (const BodyRef& b : bodies)
        motion.push_back(b.body->prescribed_motion(from, to));
    if (std::ranges::all_of(motion, [](double m) { return m == 0; })) return 0;
    limit_reach(bodies, false);
    find_boxes(bodies);
    double share = 0;
    for (std::size_t k = 0; k < given_; ++k) {
        const ContactPair& p = pairs_[k];
        if (p.small || bodies[std::size_t(p.a)].rod) continue;
        const double way = motion[std::size_t(p.a)] + (p.b >= 0 ? motion[std::size_t(p.b)] : 0.0);
        if (way <= p.reach || (p.b >= 0 && apart(p, way + p.reach))) continue;
        if (p.b < 0) {
            const AxisBox& box = boxes_[std::size_t(p.a)];
            const double far = distance_from_obstacle(p)(0.5 * (box.low + box.high)).distance -
                               0.5 * (box.high - box.low).norm();
            if (far > way + p.reach) continue;
        }
        share = std::max(share, way / (p.reach));
    }
    return share;
}

void ContactFinder::find_rows(const std::vector<BodyRef>& bodies, const StepInput& step,
                              BodyContacts& out)
{
    step_ = step;
    for (std::size_t p = 0; p < rows_.size(); ++p) {
        reach_ = pairs_[p].reach + most_closed(pairs_[p].a) + most_closed(pairs_[p].b);
        add_place_rows(bodies, int(p), out);
    }
}

void ContactFinder::begin_rows(bool dynamic)
{
    if (dynamic) return;
    for (std::size_t p = 0; p < rows_.size(); ++p)
        if (!(pairs_[p].friction > 0)) rows_[p].clear();
}

void ContactFinder::keep_rows(const std::function<bool(int pair, std::int64_t id)>& acts)
{
    for (std::size_t p = 0; p < rows_.size(); ++p)
        std::erase_if(rows_[p], [&](const PlaceRow& r) { return !acts(int(p), r.id); });
}

void ContactFinder::save_rows(ByteWriter& out) const
{
    for (std::size_t p = 0; p < given_; ++p) {
        const std::vector<PlaceRow> none;
        const std::vector<PlaceRow>& rows = p < rows_.size() ? rows_[p] : none;
        out.value(std::uint64_t(rows.size()));
        for (const PlaceRow& r : rows) {
            out.value(r.id);
            out.value(r.of_b);
            out.value(r.tolerance);
            out.value(r.own.count);
            for (const StencilEntry& e : r.own.nodes()) {
                out.value(e.node);
                out.value(e.weight);
            }
        }
    }
}

std::vector<std::vector<PlaceRow>> ContactFinder::read_rows(ByteReader& in) const
{
    constexpr std::uint64_t kMost = 1u << 24;
    std::vector<std::vector<PlaceRow>> rows(given_);
    for (std::size_t p = 0; p < given_; ++p) {
        const auto count = in.value<std::uint64_t>();
        if (count > kMost) ByteReader::refuse("an impossible size");
        for (std::uint64_t i = 0; i < count; ++i) {
            PlaceRow r;
            r.id = in.value<std::int64_t>();
            r.of_b = in.value<bool>();
            r.tolerance = in.value<double>();
            r.own.count = in.value<int>();
            const ContactSurface* s = r.of_b ? pairs_[p].surface_b : pairs_[p].surface_a;
            if (!s || r.own.count < 1 || r.own.count > int(r.own.node.size()))
                ByteReader::refuse("a contact of another mesh");
            for (std::size_t k = 0; k < std::size_t(r.own.count); ++k) {
                StencilEntry& e = r.own.node[k];
                e.node = in.value<std::int32_t>();
                e.weight = in.value<double>();
                if (!std::ranges::binary_search(s->outside.used_nodes, e.node))
                    ByteReader::refuse("a contact of another mesh");
            }
            rows[p].push_back(r);
        }
    }
    return rows;
}

} // namespace amontons
