#include "contact/rigid/overlap.hpp"
#include "contact/rigid/shape_distance.hpp"
#include "contact/surface/facets.hpp"
#include "contact/surface/passage.hpp"
#include "contact/surface/self_overlap.hpp"
#include "mesh/box_tree.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/solid/place_in.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/byte_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

// How far bodies stand in each other, measured on their surfaces, and what rows there would leave
// (body_place_rows.cpp).

namespace amontons {
namespace {

// Limits of docs/theory/certificate.md.
constexpr double kAllowedOfFace = 0.01;  // of the smaller face, without a warning
constexpr double kAllowedOfBody = 1e-3;  // of the smaller body, where neither side has faces
constexpr double kNever = 0.1;           // of the thinner body, of the smaller face
constexpr double kMeanBulge = 2.0 / 3;   // of h^2/8 times the curvature: a chord's mean distance
constexpr double kLoose = 0.3;           // of the depth: nodes of a face are off what enters it
constexpr double kRowsOfRound = 1e-3;    // of a face: from here on rows may hold round shapes
constexpr double kLeftOfSmall = 1.0 / 3; // of the indentation, where a round shape is small
/// Share of the indentation that is pressed out: less counts as negligible.
constexpr double kCarried = 0.1;
constexpr double kThinnest = 1e-3;   // of a rigid body's length: thinner ones count as lines
constexpr double kLeastReach = 0.02; // of the smaller body: what a given reach is raised to
// Deeper places get rows whatever the curvature: less than kNever, since places slide on within a
// step.
constexpr double kRowsOfThickness = 0.05, kRowsOfFace = 0.08;

BoundingBox everywhere()
{
    constexpr double kFar = std::numeric_limits<double>::infinity();
    return {Eigen::Array3d::Constant(-kFar), Eigen::Array3d::Constant(kFar)};
}

BoundingBox as_bounding(const AxisBox& box)
{
    return {box.low.array(), box.high.array()};
}

/// The faces that a plane may cut. Of a face in the hull of its nodes (not T6) these are known to
/// be the deepest: of all those that are deep in neither way of `shallow` the deepest alone.
/// @param limits  gives `shallow`, once some face is below the plane
template <class Limits>
std::vector<std::int32_t> faces_below(const Pose& plane, const PlacedSurface& own, Limits limits)
{
    std::optional<Shallow> shallow;
    const ExternalSurface& surface = own.facets.surface();
    const Vec3 normal = plane.turn * Vec3::UnitZ();
    std::vector<double> depth(own.places.size());
    for (const std::int32_t n : surface.used_nodes)
        depth[std::size_t(n)] = normal.dot(plane.place - own.places[std::size_t(n)]);
    std::vector<std::int32_t> faces;
    std::int32_t deepest = -1;
    double most = 0;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const auto nodes = surface.face(f);
        OverlapSpot s;
        for (const std::int32_t n : nodes)
            s.depth = std::max(s.depth, depth[std::size_t(n)]);
        const bool flat = nodes.size() != 6;
        if (flat && !(s.depth > 0)) continue;
        s.face = flat ? longest_edge(surface, f, own.places) : 0;
        if (flat && !shallow) shallow = limits();
        if (!flat || !(*shallow)(s)) {
            faces.push_back(std::int32_t(f));
        } else if (s.depth > most) {
            most = s.depth;
            deepest = std::int32_t(f);
        }
    }
    if (deepest >= 0) faces.push_back(deepest);
    return faces;
}

struct RowLimits {
    double tolerance = 0; ///< what a row leaves [m]
    double beyond = 0;    ///< depth from which on there is one [m]
};

/// Between meshes rows leave what integrals over the faces leave on average, and less of a place
/// that almost nothing presses out, as between the nodes of coarse faces: there would be no force.
/// There they leave what is allowed of any face, so that the force begins at zero.
/// @param pressed  how far strain has pressed both sides apart [m]; none: enough
RowLimits between_meshes(const OverlapSpot& s, double allowed, std::optional<double> pressed)
{
    const double mean = kMeanBulge * std::min(s.bulge, allowed);
    if (!pressed) return {mean, allowed};
    const double least = std::min(kAllowedOfFace * s.face, allowed);
    const double carried = std::min(*pressed / (s.depth + *pressed) / kCarried, 1.0);
    return {least + carried * (mean - least), least + carried * (allowed - least)};
}

/// Of a place in an exact shape. Rows leave what the face's nodes leave on average: as these come
/// to the shape, the rows come to that, so that its force does not fall. Round shapes (balls) may
/// be smaller than a face: then rows alone press out the indentation, and leave a share of it, from
/// the first touch on. Their force is in proportion to it, whatever the steps.
/// @param pressed  how far the place has been pressed out by strain [m]
RowLimits beside_shape(const OverlapSpot& s, double allowed, double pressed)
{
    const double node_gap = std::max(s.node_gap, 0.0);
    const bool loose = s.node_gap > kLoose * s.depth;
    double left = std::max(kMeanBulge * std::min(s.bulge, allowed) - node_gap, 0.0),
           beyond = loose ? kAllowedOfFace * s.face : allowed;
    if (s.round > kAllowedOfFace * s.face) {
        left = std::min(left, kLeftOfSmall * (s.depth + pressed));
        const double least = kRowsOfRound * s.face;
        beyond = loose ? least : std::min(allowed, std::max(least, left));
    }
    return {left, beyond};
}

/// How far strain has moved a place of a solid's surface against its outward normal [m].
double pressed_in(const SolidBody& solid, const SolidBody::Unstrained& unstrained,
                  const SurfacePlace& place, const Vec3& outward)
{
    double d = 0;
    for (const StencilEntry& e : place.nodes())
        d += e.weight * outward.dot(unstrained.place(solid.mesh().nodes[std::size_t(e.node)]) -
                                    solid.places()[std::size_t(e.node)]);
    return d;
}

Inside inside_of(const RigidBody& body)
{
    return std::holds_alternative<TriangleShape>(body.shape()) ? Inside::any : Inside::convex;
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

/// 0 until it is first needed: a search in shapes takes less time.
double ContactFinder::thinner_if_known(const ContactPair& p) const
{
    const auto known = [&](int body) {
        return std::size_t(body) < thickness_.size() ? thickness_[std::size_t(body)] : 0.0;
    };
    return p.b >= 0 ? std::min(known(p.a), known(p.b)) : known(p.a);
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
            // At rest what is pressed in one step may be seen all the way: a small reach would only
            // divide it into more, and leave out gaps of coarse faces that are larger.
            ContactPair usual;
            set_reach(usual, 0, size);
            const double least = dynamic ? kLeastReach * size : usual.reach;
            p.reach = std::clamp(p.reach, std::min(least, most), most);
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
            for (double* limit :
                 {&out[i].allowed, &out[i].silent, &out[i].most, &out[i].rows_beyond})
                *limit += left;
    }
    if (!rest_) return;
    for (const BoxPair& p :
         default_pairs_in_reach(bodies, [&](int b) { return boxes_[std::size_t(b)]; }))
        if (const auto o = rigid_overlap(bodies, p.a, p.b)) out.push_back(*o);
}

std::vector<std::string> ContactFinder::not_measured(const std::vector<BodyRef>& bodies) const
{
    std::vector<std::string> sentences;
    for (std::size_t k = 0; k < given_; ++k) {
        const ContactPair& p = pairs_[k];
        const char* why = p.small            ? "\"sliding\" is \"small\""
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
    const bool meshes = p.b >= 0 && bodies[std::size_t(p.b)].solid;
    std::vector<OverlapSpot> spots;
    std::optional<SolidBody::Unstrained> unstrained, unstrained_b;
    const auto pressed_apart = [&](const OverlapSpot& s, bool of_b) -> std::optional<double> {
        if (step_.dynamic || s.depth <= kAllowedOfFace * s.face) return {};
        const SolidBody& b = *bodies[std::size_t(p.b)].solid;
        if (!unstrained) unstrained = a.solid->unstrained();
        if (!unstrained_b) unstrained_b = b.unstrained();
        return std::max(
            pressed_in(*a.solid, *unstrained, of_b ? s.other : s.own, of_b ? s.normal : -s.normal) +
                pressed_in(b, *unstrained_b, of_b ? s.own : s.other, of_b ? -s.normal : s.normal),
            0.0);
    };
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
            o.silent = std::min(o.allowed, std::max(kAllowedOfFace * s.face, s.bulge_at_rest));
            RowLimits rows;
            // Whatever else they depend on, no limit of a shape is less than this.
            const bool round = s.round > kAllowedOfFace * s.face;
            const double least = std::min((round ? kRowsOfRound : kAllowedOfFace) * s.face,
                                          kRowsOfThickness * thinner);
            if (meshes) {
                rows = between_meshes(s, o.allowed, pressed_apart(s, of_b));
            } else if (s.depth <= kRowsAhead * least) {
                rows = {0, least};
            } else {
                if (!unstrained) unstrained = a.solid->unstrained();
                const Vec3 outward =
                    outward_normal_at({*p.surface_a->facets, a.solid->places()}, s.own);
                const double pressed = pressed_in(*a.solid, *unstrained, s.own, outward);
                rows = beside_shape(s, o.allowed, std::max(pressed, 0.0));
            }
            o.tolerance = rows.tolerance;
            o.rows_beyond =
                std::min({rows.beyond, kRowsOfThickness * thinner, kRowsOfFace * s.face});
            // Rows hold two bodies apart.
            if (p.a == p.b) o.rows_beyond = std::numeric_limits<double>::infinity();
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
    const PlacedSurface own{*p.surface_a->facets, a.solid->places(), below_a,
                            a.solid->mesh().nodes};
    // Whatever the bulge, no limit is less than this.
    Shallow shallow;
    if (!p.small)
        shallow = {kRowsAhead * (meshes ? kAllowedOfFace : kRowsOfRound),
                   kRowsAhead * kRowsOfThickness *
                       (meshes ? thinner_of(bodies, p) : thinner_if_known(p))};
    if (p.b < 0) {
        const auto distance = distance_from_obstacle(p);
        if (p.plane)
            // With the thickness, known or not: a resumed run measures the same faces.
            overlap_spots(own, distance,
                          faces_below(*p.plane, own,
                                      [&] {
                                          return Shallow{shallow.of_face,
                                                         kRowsAhead * kRowsOfThickness *
                                                             thinner_of(bodies, p)};
                                      }),
                          spots, shallow, Inside::convex);
        else
            overlap_spots(own, distance, everywhere(), spots, shallow);
        return keep(false);
    }
    const BodyRef& b = bodies[std::size_t(p.b)];
    if (b.rigid) {
        const AxisBox box = boxes_[std::size_t(p.b)];
        overlap_spots(own, distance_from(*b.rigid, b.rigid->placement()), as_bounding(box), spots,
                      shallow, inside_of(*b.rigid));
        return keep(false);
    }
    const PlacedSurface other{*p.surface_b->facets, b.solid->places(), below_b,
                              b.solid->mesh().nodes};
    if (p.a == p.b) {
        const PlacedElements elements(a.solid->mesh(), a.solid->places());
        const auto inside = [&](const Vec3& x, const SurfacePlace& place) {
            std::array<std::int32_t, kMostSolidFaceNodes> nodes;
            for (std::size_t k = 0; k < place.nodes().size(); ++k)
                nodes[k] = place.nodes()[k].node;
            return elements.hold_without(x, std::span(nodes).first(place.nodes().size()));
        };
        self_overlap_spots(own, other, inside, spots, shallow);
        keep(false);
        if (p.surface_a == p.surface_b) return;
        self_overlap_spots(other, own, inside, spots, shallow);
        return keep(true);
    }
    overlap_spots(own, other, spots, shallow);
    keep(false);
    overlap_spots(other, own, spots, shallow);
    keep(true);
}

std::function<WallSample(const Vec3&)>
ContactFinder::distance_from_obstacle(const ContactPair& p) const
{
    if (p.plane)
        return
            [place = p.plane->place, normal = Vec3(p.plane->turn * Vec3::UnitZ())](const Vec3& x) {
                WallSample s;
                s.normal = normal;
                s.distance = normal.dot(x - place);
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
    o.allowed = o.silent = kAllowedOfBody * thinner;
    o.most = kNever * thinner;
    return o;
}

} // namespace

std::optional<BodyOverlap> ContactFinder::overlap_with_obstacle(const std::vector<BodyRef>& bodies,
                                                                const ContactPair& p)
{
    const RigidBody& rigid = *bodies[std::size_t(p.a)].rigid;
    const Pose pose = pose_of(rigid.placement());
    ShapeOverlap deepest;
    if (p.plane) {
        deepest = deepest_below(rigid.shape(), pose, p.plane->place, p.plane->turn * Vec3::UnitZ());
    } else {
        const auto distance = distance_from_obstacle(p);
        if (distance(pose.place).distance > bounding_radius(rigid.shape())) return {};
        deepest = deepest_in(rigid.shape(), pose, facets_if_triangles(bodies, p.a), distance,
                             {everywhere()});
    }
    auto o = overlap_of_shapes(deepest, [&] { return thickness(bodies, p.a); });
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
    // Triangles are many: of them those alone that reach into the half-space around the other.
    const auto around = [&](const RigidBody& own, int from, const RigidBody& other, int to) {
        const AxisBox &box = boxes_[std::size_t(to)], &own_box = boxes_[std::size_t(from)];
        Surroundings near{as_bounding(box)};
        if (!std::holds_alternative<TriangleShape>(own.shape())) return near;
        const Vec3 way = (own_box.low + own_box.high) - (box.low + box.high);
        if (!(way.allFinite() && way.norm() > 0)) return near;
        const auto highest =
            lowest_place(other.shape(), pose_of(other.placement()), -way.normalized());
        if (!highest) return near;
        near.way = way.normalized();
        near.most = near.way.dot(*highest);
        return near;
    };
    ShapeOverlap deepest;
    const auto measure = [&](int from, const RigidBody& own, int to, const RigidBody& other) {
        const ShapeOverlap found =
            deepest_in(own.shape(), pose_of(own.placement()), facets_if_triangles(bodies, from),
                       distance_from(other, other.placement()), around(own, from, other, to),
                       inside_of(other));
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

void ContactFinder::set_start_overlaps(const std::vector<BodyRef>& bodies, bool dynamic,
                                       std::span<const double> depths)
{
    limit_reach(bodies, dynamic);   // what is pressed out is searched for farther
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
            find_cached(bodies, int(k));
        else
            find_updated(bodies, int(k), found);
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

double ContactFinder::prescribed_over_reach(const std::vector<BodyRef>& bodies, double from,
                                            double to)
{
    limit_reach(bodies, false);
    double share = 0;
    for (std::size_t k = 0; k < given_; ++k) {
        const ContactPair& p = pairs_[k];
        double way = bodies[std::size_t(p.a)].body->prescribed_motion(from, to);
        if (p.b >= 0) way += bodies[std::size_t(p.b)].body->prescribed_motion(from, to);
        if (!p.small) share = std::max(share, way / p.reach);
    }
    return share;
}

double ContactFinder::motion_over_reach(const std::vector<BodyRef>& bodies, double from, double to)
{
    const auto counts = [&](const ContactPair& p) {
        return !p.small && !bodies[std::size_t(p.a)].rod;
    };
    if (std::ranges::none_of(std::span(pairs_).first(given_), counts)) return 0;
    std::vector<double> motion;
    for (const BodyRef& b : bodies)
        motion.push_back(b.body->prescribed_motion(from, to));
    if (std::ranges::all_of(motion, [](double m) { return m == 0; })) return 0;
    limit_reach(bodies, false);
    find_boxes(bodies);
    double share = 0;
    for (std::size_t k = 0; k < given_; ++k) {
        const ContactPair& p = pairs_[k];
        if (!counts(p)) continue;
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

} // namespace amontons
