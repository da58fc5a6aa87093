#include "solver/step/body_contacts.hpp"

#include "contact/rigid/detect.hpp"
#include "contact/rigid/first_touch.hpp"
#include "contact/rigid/shape_distance.hpp"
#include "contact/rigid/shape_surface.hpp"
#include "contact/surface/collocation.hpp"
#include "contact/surface/mortar.hpp"
#include "contact/surface/passage.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

Pose pose_of(const RigidBody& body)
{
    const Placement p = body.placement();
    return {p.shift, p.turn};
}

/// Where the body would be at the end of the step without contact.
Pose pose_after(const RigidBody& body, const StepInput& step)
{
    const Placement free = body.free_placement(step);
    return {free.shift, free.turn};
}

std::vector<Vec3> moved_points(const SurfaceMesh& mesh, const Placement& at)
{
    std::vector<Vec3> x;
    for (const Vec3& point : mesh.points)
        x.push_back(at * point);
    return x;
}

ExternalSurface surface_of_triangles(const SurfaceMesh& mesh)
{
    ExternalSurface s;
    s.starts.push_back(0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const int p : mesh.triangles[i])
            s.nodes.push_back(p);
        s.starts.push_back(std::int64_t(s.nodes.size()));
        s.corners.push_back(3);
        s.faces.push_back({std::int32_t(i), 0});
    }
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        s.used_nodes.push_back(std::int32_t(i));
        s.surface_nodes.push_back(std::int32_t(i));
    }
    return s;
}

/// Numbers of contacts of sharp features begin here, those of nodes are below.
constexpr std::int64_t kSharp = std::int64_t(1) << 40;

/// @param first_id  added to the contacts' own
void add(const SurfaceContacts& found, int pair, int a, int b, bool master_has_nodes,
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

} // namespace

Mat3 contact_frame(const Vec3& normal)
{
    SurfaceContact c;
    c.normal = normal;
    set_tangents(c);
    Mat3 frame;
    frame << c.normal, c.t1, c.t2;
    return frame;
}

ContactFinder::ContactFinder(std::vector<ContactPair> pairs, std::vector<const Wall*> walls)
    : pairs_(std::move(pairs))
    , walls_(std::move(walls))
    , kept_(pairs_.size())
    , made_(pairs_.size(), false)
    , sharp_(pairs_.size())
{
}

bool ContactFinder::all_small() const
{
    return std::all_of(pairs_.begin(), pairs_.end(), [](const ContactPair& p) { return p.small; });
}

void ContactFinder::begin_step(const std::vector<BodyRef>& bodies)
{
    for (std::vector<std::int64_t>& ids : sharp_)
        ids.clear();
    speed_.clear();
    for (const BodyRef& b : bodies)
        speed_.push_back(b.body->speed());
}

void ContactFinder::find(const std::vector<BodyRef>& bodies, const StepInput& step,
                         BodyContacts& out)
{
    out.contact.clear();
    out.stencil.clear();
    boxes_.clear();
    for (const BodyRef& b : bodies) {
        if (b.rigid) {
            boxes_.push_back(axis_box(b.rigid->shape(), pose_of(*b.rigid)));
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
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
        const ContactPair& pair = pairs_[p];
        step_ = step;
        double closed = 0; // at most, during the step
        for (const int i : {pair.a, pair.b})
            if (step.dynamic && i >= 0)
                closed += step.h * (speed_[std::size_t(i)] + step.h * step.gravity.norm());
        reach_ = pair.reach + closed;
        if (!pair.small) {
            const auto first = std::ptrdiff_t(out.contact.size());
            find_pair(bodies, int(p), out);
            if (step.dynamic)
                out.contact.erase(std::remove_if(out.contact.begin() + first, out.contact.end(),
                                                 [&](const BodyContact& c) {
                                                     return c.gap > pair.margin + closed;
                                                 }),
                                  out.contact.end());
            continue;
        }
        BodyContacts& kept = kept_[p];
        if (!made_[p]) {
            find_pair(bodies, int(p), kept);
            made_[p] = true;
        }
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
    if (p.b >= 0) {
        const AxisBox &a = boxes_[std::size_t(p.a)], &b = boxes_[std::size_t(p.b)];
        if (((a.low.array() - b.high.array()) > reach_).any() ||
            ((b.low.array() - a.high.array()) > reach_).any())
            return;
    }
    if (bodies[std::size_t(p.a)].rod) return rod_on_any(bodies, pair, out);
    const bool solid_a = bodies[std::size_t(p.a)].solid != nullptr;
    if (p.b < 0)
        return solid_a ? solid_on_wall(bodies, pair, out) : rigid_on_wall(bodies, pair, out);
    const bool solid_b = bodies[std::size_t(p.b)].solid != nullptr;
    if (solid_a)
        return solid_b ? solid_on_solid(bodies, pair, out) : solid_on_rigid(bodies, pair, out);
    rigid_on_rigid(bodies, pair, out);
}

void ContactFinder::solid_on_wall(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const Wall& wall = *walls_[std::size_t(p.obstacle)];
    WallHint hint;
    const SolidBody& s = *bodies[std::size_t(p.a)].solid;
    const auto sample = [&](const Vec3& x) { return wall.sample(x, hint); };
    const std::span<const Vec3> x = p.small ? s.first_places() : s.places();
    add(wall_contacts(p.surface_a->outside, x, sample, reach_), pair, p.a, -1, false, out);
    add(sharp_wall_contacts({p.surface_a->outside, p.surface_a->sharp, x}, sample, reach_), pair,
        p.a, -1, false, out, kSharp);
}

void ContactFinder::solid_on_solid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const SolidBody& a = *bodies[std::size_t(p.a)].solid;
    const SolidBody& b = *bodies[std::size_t(p.b)].solid;
    const std::span<const Vec3> x_a = p.small ? a.first_places() : a.places(),
                                x_b = p.small ? b.first_places() : b.places();
    MortarOptions options;
    options.reach = reach_;
    options.nodal = p.nodal;
    // Integrals see no jump of the normal at an edge of faces, a node that rests on one does.
    options.smooth_normals = p.nodal;
    if (p.a == p.b) options.at_rest = a.mesh().nodes;
    add(mortar_contacts(p.surface_a->outside, x_a, p.surface_b->outside, x_b, options), pair, p.a,
        p.b, true, out);
    if (p.a != p.b) // every body lies beside its own sharp edges
        add_sharp({p.surface_a->outside, p.surface_a->sharp, x_a},
                  {p.surface_b->outside, p.surface_b->sharp, x_b}, pair, true, out);
}

std::function<WallSample(const Vec3&)> distance_from(const RigidBody& body, const Placement& at)
{
    return [&body, at, near = std::int32_t(-1)](const Vec3& x) mutable {
        WallSample s = shape_distance(body.shape(), at.turn.conjugate() * (x - at.shift), near);
        const Mat3 R = at.turn.toRotationMatrix();
        s.normal = R * s.normal;
        s.hessian = R * s.hessian * R.transpose();
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
        add(wall_contacts(p.surface_a->outside, a.places(), sample, reach_), pair, p.a, p.b, false,
            out);
        add(sharp_wall_contacts({p.surface_a->outside, p.surface_a->sharp, a.places()}, sample,
                                reach_),
            pair, p.a, p.b, false, out, kSharp);
    };
    if (std::holds_alternative<Ball>(b.shape()) || std::holds_alternative<Cylinder>(b.shape()))
        return round();
    const Facets& facets = facets_of(bodies, p.b);
    const std::vector<Vec3> x = moved_points(facets.mesh, at);
    MortarOptions options;
    options.reach = reach_;
    options.master_normals = true;
    options.smooth_normals = true; // the facets stand for a curved surface, but at its edges
    add(mortar_contacts(p.surface_a->outside, a.places(), facets.surface, x, options), pair, p.a,
        p.b, false, out);
    add_sharp({p.surface_a->outside, p.surface_a->sharp, a.places()},
              {facets.surface, facets.sharp, x}, pair, false, out);
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
    }
    return *facets;
}

void ContactFinder::add_sharp(const SharpSurface& slave, const SharpSurface& master, int pair,
                              bool master_has_nodes, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    std::vector<std::int64_t>& known = sharp_[std::size_t(pair)];
    const SurfaceContacts found = sharp_contacts(slave, master, reach_, known);
    for (const SurfaceContact& c : found.contact)
        known.push_back(c.id);
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    add(found, pair, p.a, p.b, master_has_nodes, out, kSharp);
}

void ContactFinder::rigid_on_wall(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const Wall& wall = *walls_[std::size_t(p.obstacle)];
    const RigidBody& a = *bodies[std::size_t(p.a)].rigid;
    WallHint hint;
    found_.clear();
    if (p.plane) {
        detect(a.shape(), pose_of(a), Plane{}, *p.plane, reach_, found_);
        return add_rigid(pair, out);
    }
    detect_wall(
        a.shape(), pose_of(a), [&](const Vec3& x) { return wall.sample(x, hint); }, reach_, found_);
    add_rigid(pair, out);
}

void ContactFinder::rigid_on_rigid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const RigidBody& a = *bodies[std::size_t(p.a)].rigid;
    const RigidBody& b = *bodies[std::size_t(p.b)].rigid;
    found_.clear();
    detect(a.shape(), pose_of(a), b.shape(), pose_of(b), reach_, found_);
    // Far bodies are here only for their speed: those that will pass each other do not touch.
    const auto near = [&](const RigidContact& c) { return c.gap <= p.reach; };
    if (!found_.empty() && std::none_of(found_.begin(), found_.end(), near) &&
        first_touch(a.shape(), pose_of(a), pose_after(a, step_), b.shape(), pose_of(b),
                    pose_after(b, step_)) >= 1)
        return;
    add_rigid(pair, out);
}

void ContactFinder::add_rigid(int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    for (const RigidContact& c : found_) {
        BodyContact k;
        k.pair = pair;
        k.id = std::int64_t(c.id);
        k.a = p.a;
        k.b = p.b;
        k.frame = contact_frame(c.normal);
        k.gap = c.gap;
        k.point = 0.5 * (c.point_a + c.point_b); // one place for both: no moment is left over
        k.a_begin = k.a_end = k.b_begin = k.b_end = std::int32_t(out.stencil.size());
        out.contact.push_back(k);
    }
}

std::string ContactFinder::passed(const std::vector<BodyRef>& bodies)
{
    sweep_rods(bodies);
    for (const ContactPair& p : pairs_)
        if (!p.small &&
            (bodies[std::size_t(p.a)].rod ? rod_passed(bodies, p) : p.b >= 0 && passed(bodies, p)))
            return fmt::format("{} passes through {}", bodies[std::size_t(p.a)].name,
                               p.b < 0      ? "an obstacle"
                               : p.b == p.a ? "itself"
                                            : bodies[std::size_t(p.b)].name);
    return "";
}

bool ContactFinder::passed(const std::vector<BodyRef>& bodies, const ContactPair& pair)
{
    // Motions of less than half the thinner body leave it on the right side of contacts.
    thinnest_.resize(bodies.size(), 0);
    double thinnest = std::numeric_limits<double>::infinity(), longest = 0;
    for (const int i : {pair.a, pair.b}) {
        const BodyRef& b = bodies[std::size_t(i)];
        double& own = thinnest_[std::size_t(i)];
        if (b.solid) {
            if (own == 0) own = b.solid->thinnest();
            double motion = 0;
            for (const std::int32_t node : b.solid->touching())
                motion = std::max(motion, (b.solid->places()[std::size_t(node)] -
                                           b.solid->places_before()[std::size_t(node)])
                                              .norm());
            longest += motion;
        } else {
            const AxisBox box = axis_box(b.rigid->shape(), {});
            own = (box.high - box.low).minCoeff();
            const Placement before = b.rigid->start_placement(), now = b.rigid->placement();
            longest += (now.shift - before.shift).norm() +
                       now.turn.angularDistance(before.turn) * 2 * b.rigid->size();
        }
        thinnest = std::min(thinnest, own);
    }
    if (longest <= 0.5 * thinnest) return false;

    const BodyRef &a = bodies[std::size_t(pair.a)], &b = bodies[std::size_t(pair.b)];
    if (a.rigid && b.rigid) {
        const auto before = [](const RigidBody& body) {
            const Placement p = body.start_placement();
            return Pose{p.shift, p.turn};
        };
        std::vector<RigidContact> now;
        detect(a.rigid->shape(), pose_of(*a.rigid), b.rigid->shape(), pose_of(*b.rigid), pair.reach,
               now);
        return now.empty() &&
               first_touch(a.rigid->shape(), before(*a.rigid), pose_of(*a.rigid), b.rigid->shape(),
                           before(*b.rigid), pose_of(*b.rigid)) < 1;
    }
    std::vector<Vec3> before_a, after_a, before_b, after_b; // of rigid bodies
    const auto moved = [&](int i, const ContactSurface* surface, std::vector<Vec3>& before,
                           std::vector<Vec3>& after) -> MovedSurface {
        const BodyRef& body = bodies[std::size_t(i)];
        if (body.solid)
            return {surface->outside, body.solid->places_before(), body.solid->places()};
        const Facets& facets = facets_of(bodies, i);
        before = moved_points(facets.mesh, body.rigid->start_placement());
        after = moved_points(facets.mesh, body.rigid->placement());
        return {facets.surface, before, after};
    };
    return passage(moved(pair.a, pair.surface_a, before_a, after_a),
                   moved(pair.b, pair.surface_b, before_b, after_b), 0.5 * thinnest)
        .has_value();
}

} // namespace amontons
