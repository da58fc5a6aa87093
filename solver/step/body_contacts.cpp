#include "solver/step/body_contacts.hpp"

#include "contact/rigid/detect.hpp"
#include "contact/rigid/first_touch.hpp"
#include "contact/rigid/overlap.hpp"
#include "contact/rigid/shape_distance.hpp"
#include "contact/rigid/shape_surface.hpp"
#include "contact/surface/bulge_contacts.hpp"
#include "contact/surface/collocation.hpp"
#include "contact/surface/mortar.hpp"
#include "mesh/base/threads.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

Pose pose_now(const RigidBody& body)
{
    return pose_of(body.placement());
}

/// Where the body would be at the end of the step without contact.
Pose pose_after(const RigidBody& body, const StepInput& step)
{
    const Placement free = body.free_placement(step);
    return {free.shift, free.turn};
}

/// Numbers of contacts of sharp features begin here, those of nodes are below.
constexpr std::int64_t kSharp = kNodeNumbers;
constexpr std::int64_t kCaps = std::int64_t(1) << 50;
constexpr std::int64_t kBulge = std::int64_t(1) << 60;

constexpr double kMargin = 0.002; // of the smaller body: see ContactPair
constexpr double kReach = 0.2;    // of it: gaps that are examined, unless it is reported
/// Of that, how far rigid bodies of triangles are searched in motion: what lies farther apart than
/// the margin is left out anyway, and their triangles are many.
constexpr double kReachInMotion = 0.25;
/// Least number of pairs for several threads: starting these takes as long as ten pairs.
constexpr std::size_t kManyPairs = 500;

/// @param first_id  added to the contacts' own
void append(const SurfaceContacts& found, int pair, int a, int b, bool master_has_nodes,
            BodyContacts& out, std::int64_t first_id = 0)
{
    for (const SurfaceContact& c : found.contact) {
        BodyContact k;
        k.pair = pair;
        k.id = first_id + c.id;
        k.a = a;
        k.b = b;
        k.frame << c.normal, c.t1, c.t2;
        k.gap = c.gap;
        k.area = c.area;
        k.point = c.point;
        const auto copy = [&](std::int32_t begin, std::int32_t end, std::int32_t& to_begin,
                              std::int32_t& to_end) {
            to_begin = std::int32_t(out.stencil.size());
            for (std::int32_t i = begin; i < end; ++i)
                out.stencil.push_back(found.stencil[std::size_t(i)]);
            to_end = std::int32_t(out.stencil.size());
        };
        copy(c.slave_begin, c.slave_end, k.a_begin, k.a_end);
        if (master_has_nodes) copy(c.master_begin, c.master_end, k.b_begin, k.b_end);
        out.contact.push_back(k);
    }
}

std::vector<BodyContact> as_body_contacts(const std::vector<RigidContact>& found,
                                          const ContactPair& p, int pair)
{
    std::vector<BodyContact> out;
    out.reserve(found.size());
    for (const RigidContact& c : found) {
        BodyContact k;
        k.pair = pair;
        k.id = std::int64_t(c.id);
        k.a = p.a;
        k.b = p.b;
        k.frame = contact_frame(c.normal);
        k.gap = c.gap;
        k.point = 0.5 * (c.point_a + c.point_b); // one place for both: no moment is left over
        out.push_back(k);
    }
    return out;
}

/// Contacts that no nodes carry.
void append(const std::vector<BodyContact>& found, BodyContacts& out)
{
    for (BodyContact c : found) {
        c.a_begin = c.a_end = c.b_begin = c.b_end = std::int32_t(out.stencil.size());
        out.contact.push_back(c);
    }
}

/// How far a pair is searched, beyond what its bodies close in the step.
double search_reach(const std::vector<BodyRef>& bodies, const ContactPair& p, bool dynamic)
{
    const auto shape = [&](int b) -> const RigidShape* {
        const RigidBody* rigid = b >= 0 ? bodies[std::size_t(b)].rigid : nullptr;
        return rigid ? &rigid->shape() : nullptr;
    };
    const auto triangles = [&](int b) {
        return shape(b) && std::holds_alternative<TriangleShape>(*shape(b));
    };
    // Each contact of corners, edges and faces, and of a ball, is one whatever the reach.
    const auto alone = [&](int b) {
        return triangles(b) || (shape(b) && (std::holds_alternative<Box>(*shape(b)) ||
                                             std::holds_alternative<Ball>(*shape(b))));
    };
    const bool rigid = shape(p.a) && (p.b < 0 || shape(p.b));
    if (!dynamic || !rigid || !(triangles(p.a) || triangles(p.b))) return p.reach;
    const double least = std::min(p.margin, p.reach);
    if (alone(p.a) && (p.b < 0 ? p.plane.has_value() : alone(p.b))) return least;
    return std::max(least, kReachInMotion * p.reach);
}

} // namespace

Pose pose_of(const Placement& p)
{
    return {p.shift, p.turn};
}

std::vector<Vec3> moved_points(const SurfaceMesh& mesh, const Placement& at)
{
    std::vector<Vec3> x;
    for (const Vec3& point : mesh.points)
        x.push_back(at * point);
    return x;
}

AxisBox swept_box(const RigidBody& body)
{
    return swept_box(body.shape(), pose_of(body.start_placement()), pose_now(body), 0);
}

Mat3 contact_frame(const Vec3& normal)
{
    SurfaceContact c;
    c.normal = normal;
    set_tangents(c);
    Mat3 frame;
    frame << c.normal, c.t1, c.t2;
    return frame;
}

void set_reach(ContactPair& pair, double given, double size)
{
    pair.reach = given > 0 ? given : kReach * size;
    pair.margin = given > 0 ? given : kMargin * size;
}

ContactFinder::ContactFinder(std::vector<ContactPair> pairs, std::vector<const Wall*> walls,
                             std::optional<DefaultLaw> rest)
    : pairs_(std::move(pairs))
    , given_(pairs_.size())
    , rest_(std::move(rest))
    , walls_(std::move(walls))
    , kept_(pairs_.size())
    , made_(pairs_.size(), false)
    , seen_(pairs_.size())
    , sharp_(pairs_.size())
{
}

bool ContactFinder::all_small() const
{
    return !rest_ &&
           std::all_of(pairs_.begin(), pairs_.end(), [](const ContactPair& p) { return p.small; });
}

void ContactFinder::search_farther(const std::vector<BodyRef>& bodies, int body, double reach)
{
    const auto round = [&](int b) {
        const RigidBody* rigid = b >= 0 ? bodies[std::size_t(b)].rigid : nullptr;
        return rigid && is_round(rigid->shape());
    };
    for (ContactPair& p : pairs_) {
        if (p.small || (p.a != body && p.b != body)) continue;
        const bool meshes = bodies[std::size_t(p.a)].solid && p.b >= 0 && !round(p.b);
        if (!meshes) p.reach = std::max(p.reach, reach);
    }
}

std::vector<std::int64_t> ContactFinder::known_pairs() const
{
    std::vector<std::int64_t> bodies;
    for (std::size_t p = given_; p < pairs_.size(); ++p)
        bodies.insert(bodies.end(), {pairs_[p].a, pairs_[p].b});
    return bodies;
}

bool ContactFinder::restore_pairs(std::span<const std::int64_t> bodies_of_pairs,
                                  const std::vector<BodyRef>& bodies)
{
    const auto free_rigid = [&](std::int64_t i) {
        return i >= 0 && i < std::int64_t(bodies.size()) && bodies[std::size_t(i)].rigid &&
               !bodies[std::size_t(i)].rigid->driven();
    };
    if (bodies_of_pairs.size() % 2 != 0 || (!rest_ && !bodies_of_pairs.empty()) ||
        !std::all_of(bodies_of_pairs.begin(), bodies_of_pairs.end(), free_rigid))
        return false;
    pairs_.resize(given_);
    number_.clear();
    for (std::size_t i = 0; i < bodies_of_pairs.size(); i += 2)
        default_pair(int(bodies_of_pairs[i]), int(bodies_of_pairs[i + 1]), bodies);
    return true;
}

int ContactFinder::default_pair(int a, int b, const std::vector<BodyRef>& bodies)
{
    const auto [at, is_new] = number_.try_emplace({a, b}, int(pairs_.size()));
    if (!is_new) return at->second;
    ContactPair p;
    p.a = a;
    p.b = b;
    p.friction = rest_->friction;
    p.restitution = rest_->restitution;
    p.named = false;
    set_reach(p, rest_->reach,
              std::min(bodies[std::size_t(a)].body->size(), bodies[std::size_t(b)].body->size()));
    pairs_.push_back(std::move(p));
    return at->second;
}

std::vector<BoxPair>
ContactFinder::default_pairs_in_reach(const std::vector<BodyRef>& bodies,
                                      const std::function<AxisBox(int)>& box) const
{
    std::vector<int> body;
    std::vector<AxisBox> boxes;
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (bodies[b].rigid && !bodies[b].rigid->driven()) {
            body.push_back(int(b));
            boxes.push_back(box(int(b)));
        }
    std::vector<BoxPair> meeting;
    overlapping_pairs(boxes, meeting);
    for (BoxPair& p : meeting)
        p = {body[std::size_t(p.a)], body[std::size_t(p.b)]};
    std::erase_if(meeting, [&](const BoxPair& p) { return rest_->others.count({p.a, p.b}) > 0; });
    return meeting;
}

/// What a body can close of a gap during the step [m].
double ContactFinder::most_closed(int body) const
{
    if (!step_.dynamic || body < 0) return 0;
    return step_.h * (speed_[std::size_t(body)] + step_.h * step_.gravity.norm());
}

void ContactFinder::begin_step(const std::vector<BodyRef>& bodies)
{
    for (std::vector<std::int64_t>& ids : sharp_)
        ids.clear();
    speed_.clear();
    for (const BodyRef& b : bodies)
        speed_.push_back(b.body->speed());
}

void ContactFinder::find_boxes(const std::vector<BodyRef>& bodies)
{
    boxes_.clear();
    for (const BodyRef& b : bodies) {
        if (b.rigid) {
            boxes_.push_back(axis_box(b.rigid->shape(), pose_now(*b.rigid)));
            continue;
        }
        constexpr double kFar = std::numeric_limits<double>::infinity();
        AxisBox box{Vec3::Constant(kFar), Vec3::Constant(-kFar)};
        if (b.rod) {
            boxes_.push_back(b.rod->box());
            continue;
        }
        for (const std::int32_t node : b.solid->touching()) {
            const Vec3& x = b.solid->places()[std::size_t(node)];
            box.low = box.low.cwiseMin(x);
            box.high = box.high.cwiseMax(x);
        }
        boxes_.push_back(box);
    }
}

/// Contacts of a small pair, which stay.
void ContactFinder::find_cached(const std::vector<BodyRef>& bodies, int pair)
{
    const auto p = std::size_t(pair);
    if (made_[p]) return;
    reach_ = pairs_[p].reach + most_closed(pairs_[p].a) + most_closed(pairs_[p].b);
    find_pair(bodies, pair, kept_[p]);
    made_[p] = true;
}

void ContactFinder::keep_to_contacts(const std::vector<BodyRef>& bodies)
{
    std::vector<char> narrow(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b)
        narrow[b] = bodies[b].solid && bodies[b].solid->condensed();
    for (const ContactPair& p : pairs_)
        for (const int b : {p.a, p.b})
            if (b >= 0 && !p.small) narrow[std::size_t(b)] = 0;
    // Bodies that are alike share their matrices, and with them these nodes.
    using Nodes = std::vector<std::int32_t>;
    std::map<Nodes, std::vector<char>> named; // by the nodes of its surfaces
    const auto named_of = [&](const SolidBody& solid) -> std::vector<char>& {
        std::vector<char>& own = named[Nodes(solid.touching().begin(), solid.touching().end())];
        own.resize(std::max(own.size(), solid.mesh().nodes.size()), 0);
        return own;
    };
    find_boxes(bodies);
    for (std::size_t p = 0; p < given_; ++p) {
        if (!pairs_[p].small) continue;
        find_cached(bodies, int(p));
        const auto add = [&](int body, bool first) {
            if (body < 0 || !narrow[std::size_t(body)]) return;
            std::vector<char>& own = named_of(*bodies[std::size_t(body)].solid);
            for (const BodyContact& c : kept_[p].contact)
                for (const StencilEntry& e :
                     (first ? kept_[p].place_a(c) : kept_[p].place_b(c)).nodes)
                    own[std::size_t(e.node)] = 1;
        };
        add(pairs_[p].a, true);
        add(pairs_[p].b, false);
    }
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (!narrow[b]) continue;
        const std::vector<char>& own = named_of(*bodies[b].solid);
        if (std::ranges::count(own, char(1)) > 0)
            bodies[b].solid->may_touch(std::span(own).first(bodies[b].solid->mesh().nodes.size()));
    }
}

void ContactFinder::find(const std::vector<BodyRef>& bodies, const StepInput& step,
                         BodyContacts& out, int threads)
{
    out.contact.clear();
    out.stencil.clear();
    limit_reach(bodies, step.dynamic);
    find_boxes(bodies);
    step_ = step;
    for (std::size_t p = 0; p < given_; ++p) {
        if (!pairs_[p].small) {
            find_updated(bodies, int(p), out);
            continue;
        }
        find_cached(bodies, int(p));
        const BodyContacts& kept = kept_[p];
        const auto shift = std::int32_t(out.stencil.size());
        out.stencil.insert(out.stencil.end(), kept.stencil.begin(), kept.stencil.end());
        for (BodyContact c : kept.contact) {
            c.gap += c.frame.col(0).dot(moved(bodies, kept, c));
            c.a_begin += shift;
            c.a_end += shift;
            c.b_begin += shift;
            c.b_end += shift;
            out.contact.push_back(c);
        }
    }
    if (!rest_) return;
    // Boxes with half of the reach of a pair of two such bodies.
    const auto near_box = [&](int b) {
        ContactPair own;
        set_reach(own, rest_->reach, bodies[std::size_t(b)].body->size());
        const double room = own.reach / 2 + most_closed(b);
        const AxisBox& box = boxes_[std::size_t(b)];
        return AxisBox{box.low.array() - room, box.high.array() + room};
    };
    std::vector<int> in_reach;
    for (const BoxPair& p : default_pairs_in_reach(bodies, near_box))
        in_reach.push_back(default_pair(p.a, p.b, bodies));
    // Each pair is on its own; their contacts follow each other as the pairs do.
    std::vector<std::vector<BodyContact>> found(in_reach.size());
    share_out(in_reach.size() < kManyPairs ? 1 : threads, in_reach.size(),
              [&](std::size_t begin, std::size_t end) {
                  for (std::size_t k = begin; k < end; ++k)
                      found[k] = rest_contacts(bodies, in_reach[k]);
              });
    for (const std::vector<BodyContact>& of_pair : found)
        append(of_pair, out);
}

std::vector<BodyContact> ContactFinder::rest_contacts(const std::vector<BodyRef>& bodies,
                                                      int pair) const
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const double closed = most_closed(p.a) + most_closed(p.b);
    std::vector<BodyContact> found;
    if (apart(p, p.reach + closed)) return found;
    found = rigid_on_rigid(bodies, pair, search_reach(bodies, p, step_.dynamic) + closed);
    if (step_.dynamic)
        std::erase_if(found, [&](const BodyContact& c) { return c.gap > p.margin + closed; });
    return found;
}

/// Are the boxes of the two farther from each other than this?
bool ContactFinder::apart(const ContactPair& p, double reach) const
{
    const AxisBox &a = boxes_[std::size_t(p.a)], &b = boxes_[std::size_t(p.b)];
    return ((a.low.array() - b.high.array()) > reach).any() ||
           ((b.low.array() - a.high.array()) > reach).any();
}

/// Contacts of a pair that are found anew.
void ContactFinder::find_updated(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const double closed = most_closed(p.a) + most_closed(p.b);
    reach_ = search_reach(bodies, p, step_.dynamic) + closed;
    const auto first = std::ptrdiff_t(out.contact.size());
    find_pair(bodies, pair, out);
    if (step_.dynamic)
        out.contact.erase(
            std::remove_if(out.contact.begin() + first, out.contact.end(),
                           [&](const BodyContact& c) { return c.gap > p.margin + closed; }),
            out.contact.end());
    add_corner_rows(bodies, pair, std::size_t(first), out);
    add_place_rows(bodies, pair, out);
    add_start_gaps(pair, std::size_t(first), out);
}

/// Adds the overlap at the start that is left in the gaps of pairs.
void ContactFinder::add_start_gaps(int pair, std::size_t first, BodyContacts& out) const
{
    if (start_depth_.empty() || std::size_t(pair) >= given_) return;
    const auto& fitted = gap_offset_[std::size_t(pair)];
    for (std::size_t c = first; c < out.contact.size(); ++c) {
        BodyContact& contact = out.contact[c];
        contact.gap += start_overlap_left(pair);
        if (const auto known = fitted.find(contact.id); known != fitted.end())
            contact.gap += known->second;
    }
}

/// Of the two sides of a contact against each other since the run began.
Vec3 ContactFinder::moved(const std::vector<BodyRef>& bodies, const BodyContacts& list,
                          const BodyContact& c) const
{
    Vec3 d = Vec3::Zero();
    const auto side = [&](int body, std::span<const StencilEntry> nodes, double sign) {
        if (body < 0) return;
        d += sign * bodies[std::size_t(body)].solid->moved_from_first(nodes);
    };
    side(c.a, list.place_a(c).nodes, 1);
    side(c.b, list.place_b(c).nodes, -1);
    return d;
}

void ContactFinder::find_pair(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    if (p.b >= 0 && apart(p, reach_)) return;
    if (bodies[std::size_t(p.a)].rod) return rod_on_any(bodies, pair, out);
    const bool solid_a = bodies[std::size_t(p.a)].solid != nullptr;
    if (p.b < 0)
        return solid_a ? solid_on_wall(bodies, pair, out) : rigid_on_wall(bodies, pair, out);
    const bool solid_b = bodies[std::size_t(p.b)].solid != nullptr;
    if (solid_a)
        return solid_b ? solid_on_solid(bodies, pair, out) : solid_on_rigid(bodies, pair, out);
    append(rigid_on_rigid(bodies, pair, reach_), out);
}

void ContactFinder::find_rigid(const std::vector<BodyRef>& bodies, int pair, double reach,
                               BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    reach_ = std::min(reach, p.reach + most_closed(p.a) + most_closed(p.b));
    const auto first = out.contact.size();
    if (p.b < 0)
        rigid_on_wall(bodies, pair, out);
    else
        append(rigid_on_rigid(bodies, pair, reach_), out);
    add_start_gaps(pair, first, out);
}

void ContactFinder::solid_on_wall(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const Wall& wall = *walls_[std::size_t(p.obstacle)];
    WallHint hint;
    const SolidBody& s = *bodies[std::size_t(p.a)].solid;
    const auto sample = [&](const Vec3& x) { return wall.sample(x, hint); };
    const std::span<const Vec3> x = p.small ? s.first_places() : s.places();
    append(wall_contacts(p.surface_a->outside, x, sample, reach_), pair, p.a, -1, false, out);
    append(sharp_wall_contacts({p.surface_a->outside, p.surface_a->sharp, x}, sample, reach_), pair,
           p.a, -1, false, out, kSharp);
    append(bulge_contacts(p.surface_a->outside, x, s.mesh().nodes, sample, reach_), pair, p.a, -1,
           false, out, kBulge);
}

void ContactFinder::solid_on_solid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const SolidBody& a = *bodies[std::size_t(p.a)].solid;
    const SolidBody& b = *bodies[std::size_t(p.b)].solid;
    const std::span<const Vec3> x_a = p.small ? a.first_places() : a.places(),
                                x_b = p.small ? b.first_places() : b.places();
    if (p.a != p.b && !p.small) {
        // Boxes of round bodies touch long before they do.
        const AxisBox &box_a = boxes_[std::size_t(p.a)], &box_b = boxes_[std::size_t(p.b)];
        const Vec3 way = ((box_b.low + box_b.high) - (box_a.low + box_a.high)).normalized();
        if (extent_along(way, p.surface_b->outside, x_b).low -
                extent_along(way, p.surface_a->outside, x_a).high >
            reach_)
            return;
    }
    MortarOptions options;
    options.reach = reach_;
    options.nodal = p.nodal;
    // For integrals the normal does not jump at an edge of faces, for a node on the edge it does.
    options.smooth_normals = p.nodal;
    options.normals_of_gap = !step_.dynamic && !p.nodal && !p.small && p.a != p.b;
    if (p.a == p.b) options.at_rest = a.mesh().nodes;
    append(mortar_contacts(p.surface_a->outside, x_a, p.surface_b->outside, x_b, options), pair,
           p.a, p.b, true, out);
    if (p.a != p.b) // every body lies beside its own sharp edges
        add_sharp({p.surface_a->outside, p.surface_a->sharp, x_a},
                  {p.surface_b->outside, p.surface_b->sharp, x_b}, pair, true, out);
}

std::function<WallSample(const Vec3&)> distance_from(const RigidBody& body, const Placement& at)
{
    return [&body, at, R = at.turn.toRotationMatrix(),
            near = std::int32_t(-1)](const Vec3& x) mutable {
        WallSample s = shape_distance(body.shape(), at.turn.conjugate() * (x - at.shift), near);
        s.normal = R * s.normal;
        if (!s.hessian.isZero(0)) s.hessian = R * s.hessian * R.transpose();
        return s;
    };
}

void ContactFinder::solid_on_rigid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const SolidBody& a = *bodies[std::size_t(p.a)].solid;
    const RigidBody& b = *bodies[std::size_t(p.b)].rigid;
    const Placement at = b.placement();
    const auto round = [&] {
        const auto sample = distance_from(b, at);
        append(wall_contacts(p.surface_a->outside, a.places(), sample, reach_), pair, p.a, p.b,
               false, out);
        append(sharp_wall_contacts({p.surface_a->outside, p.surface_a->sharp, a.places()}, sample,
                                   reach_),
               pair, p.a, p.b, false, out, kSharp);
        append(bulge_contacts(p.surface_a->outside, a.places(), a.mesh().nodes, sample, reach_),
               pair, p.a, p.b, false, out, kBulge);
    };
    if (const auto* cylinder = std::get_if<Cylinder>(&b.shape())) {
        // Flat ends touch faces none of whose nodes is near: by integrals, as flat bodies do.
        caps_.resize(bodies.size());
        std::unique_ptr<Facets>& caps = caps_[std::size_t(p.b)];
        if (!caps) {
            caps = std::make_unique<Facets>();
            caps->mesh = flat_ends(*cylinder);
            caps->surface = surface_of_triangles(caps->mesh);
        }
        MortarOptions options;
        options.reach = std::min(
            reach_, kReachOfThickness * std::min(thickness(bodies, p.a), thickness(bodies, p.b)));
        options.master_normals = true;
        append(mortar_contacts(p.surface_a->outside, a.places(), caps->surface,
                               moved_points(caps->mesh, at), options),
               pair, p.a, p.b, false, out, kCaps);
    }
    if (is_round(b.shape())) return round();
    // In the rigid body's frame, where all that searches on it need is made once.
    const Facets& facets = facets_of(bodies, p.b);
    const FixedShape& shape = *facets.fixed;
    std::vector<Vec3> x(a.places().size());
    for (const std::int32_t node : p.surface_a->outside.used_nodes)
        x[std::size_t(node)] = at.turn.conjugate() * (a.places()[std::size_t(node)] - at.shift);
    MortarOptions options;
    options.reach = reach_;
    options.master_normals = true;
    options.smooth_normals = true; // the facets stand for a curved surface, but at its edges
    const auto first = std::ptrdiff_t(out.contact.size());
    append(mortar_contacts(p.surface_a->outside, x, shape, options), pair, p.a, p.b, false, out);
    add_sharp({p.surface_a->outside, p.surface_a->sharp, x},
              {facets.surface, facets.sharp, facets.mesh.points, &shape}, pair, false, out);
    for (auto c = out.contact.begin() + first; c != out.contact.end(); ++c) {
        c->frame = contact_frame(at.turn * c->frame.col(0));
        c->point = at * c->point;
    }
}

const ContactFinder::Facets& ContactFinder::facets_of(const std::vector<BodyRef>& bodies, int body)
{
    facets_.resize(bodies.size());
    std::unique_ptr<Facets>& facets = facets_[std::size_t(body)];
    if (!facets) {
        facets = std::make_unique<Facets>();
        facets->mesh = surface_of(bodies[std::size_t(body)].rigid->shape());
        facets->surface = surface_of_triangles(facets->mesh);
        facets->sharp = sharp_features(facets->surface, facets->mesh.points);
        facets->flat.emplace(facets->surface);
        facets->fixed.emplace(facets->surface, facets->sharp, facets->mesh.points);
    }
    return *facets;
}

void ContactFinder::add_sharp(const SharpSurface& slave, const SharpSurface& master, int pair,
                              bool master_has_nodes, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    if (!master_has_nodes) {
        append(sharp_contacts(slave, master, reach_, nullptr, true), pair, p.a, p.b, false, out,
               kSharp);
        return;
    }
    std::vector<std::int64_t>& known = sharp_[std::size_t(pair)];
    const SurfaceContacts found = sharp_contacts(slave, master, reach_, &known, false);
    for (const SurfaceContact& c : found.contact)
        known.push_back(c.id);
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    append(found, pair, p.a, p.b, true, out, kSharp);
}

void ContactFinder::rigid_on_wall(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const Wall& wall = *walls_[std::size_t(p.obstacle)];
    const RigidBody& a = *bodies[std::size_t(p.a)].rigid;
    WallHint hint;
    std::vector<RigidContact> found;
    if (p.plane)
        detect(a.shape(), pose_now(a), Plane{}, *p.plane, reach_, found);
    else
        detect_wall(
            a.shape(), pose_now(a), [&](const Vec3& x) { return wall.sample(x, hint); }, reach_,
            found);
    append(as_body_contacts(found, p, pair), out);
}

std::vector<BodyContact> ContactFinder::rigid_on_rigid(const std::vector<BodyRef>& bodies, int pair,
                                                       double reach) const
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const RigidBody& a = *bodies[std::size_t(p.a)].rigid;
    const RigidBody& b = *bodies[std::size_t(p.b)].rigid;
    std::vector<RigidContact> found;
    detect(a.shape(), pose_now(a), b.shape(), pose_now(b), reach, found);
    // Remote bodies are included only for their speed: those that pass by each other do not touch.
    const auto near = [&](const RigidContact& c) { return c.gap <= p.reach; };
    if (!found.empty() && std::none_of(found.begin(), found.end(), near) &&
        first_touch(a.shape(), pose_now(a), pose_after(a, step_), b.shape(), pose_now(b),
                    pose_after(b, step_)) >= 1)
        return {};
    return as_body_contacts(found, p, pair);
}

} // namespace amontons
