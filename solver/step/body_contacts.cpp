#include "solver/step/body_contacts.hpp"

#include "contact/rigid/detect.hpp"
#include "contact/rigid/first_touch.hpp"
#include "contact/rigid/shape_surface.hpp"
#include "contact/surface/collocation.hpp"
#include "contact/surface/mortar.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>

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

/// Signed distance to a ball or a cylinder that moves.
WallSample distance_to(const Ball& ball, const Vec3& x)
{
    WallSample s;
    const double r = x.norm();
    s.distance = r - ball.radius;
    s.normal = r > 0 ? Vec3(x / r) : Vec3::UnitZ();
    return s;
}

WallSample distance_to(const Cylinder& cylinder, const Vec3& x)
{
    WallSample s;
    const Vec3 across(x.x(), x.y(), 0);
    const double r = across.norm();
    const Vec3 out = r > 0 ? Vec3(across / r) : Vec3::UnitX();
    const Vec3 up(0, 0, x.z() < 0 ? -1 : 1);
    const double side = r - cylinder.radius, end = std::abs(x.z()) - cylinder.half_length;
    if (side > 0 && end > 0) { // beyond the rim
        const Vec3 d = side * out + end * up;
        s.distance = d.norm();
        s.normal = d / s.distance;
    } else {
        s.distance = std::max(side, end);
        s.normal = side > end ? out : up;
    }
    return s;
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

void ContactFinder::begin_step()
{
    for (std::vector<std::int64_t>& ids : sharp_)
        ids.clear();
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
        for (const std::int32_t node : b.solid->touching()) {
            const Vec3& x = b.solid->places()[std::size_t(node)];
            box.low = box.low.cwiseMin(x);
            box.high = box.high.cwiseMax(x);
        }
        boxes_.push_back(box);
    }
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
        const ContactPair& pair = pairs_[p];
        // What may come within reach during the step.
        step_ = step;
        reach_ = pair.reach;
        if (step.dynamic)
            for (const int b : {pair.a, pair.b})
                if (b >= 0)
                    reach_ += step.h *
                              (bodies[std::size_t(b)].body->speed() + step.h * step.gravity.norm());
        if (!pair.small) {
            find_pair(bodies, int(p), out);
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
        const SolidBody& s = *bodies[std::size_t(body)].solid;
        for (const StencilEntry& e : nodes)
            d += sign * e.weight *
                 (s.places()[std::size_t(e.node)] - s.first_places()[std::size_t(e.node)]);
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
    add(wall_contacts(p.surface_a, x, sample, reach_), pair, p.a, -1, false, out);
    add(sharp_wall_contacts({p.surface_a, p.sharp_a, x}, sample, reach_), pair, p.a, -1, false, out,
        kSharp);
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
    add(mortar_contacts(p.surface_a, x_a, p.surface_b, x_b, options), pair, p.a, p.b, true, out);
    add_sharp({p.surface_a, p.sharp_a, x_a}, {p.surface_b, p.sharp_b, x_b}, pair, true, out);
}

void ContactFinder::solid_on_rigid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const SolidBody& a = *bodies[std::size_t(p.a)].solid;
    const RigidBody& b = *bodies[std::size_t(p.b)].rigid;
    const Placement at = b.placement();
    const auto round = [&](const auto& shape) {
        const auto sample = [&](const Vec3& x) {
            WallSample s = distance_to(shape, at.turn.conjugate() * (x - at.shift));
            s.normal = at.turn * s.normal;
            return s;
        };
        add(wall_contacts(p.surface_a, a.places(), sample, reach_), pair, p.a, p.b, false, out);
        add(sharp_wall_contacts({p.surface_a, p.sharp_a, a.places()}, sample, reach_), pair, p.a,
            p.b, false, out, kSharp);
    };
    if (const auto* ball = std::get_if<Ball>(&b.shape())) return round(*ball);
    if (const auto* cylinder = std::get_if<Cylinder>(&b.shape())) return round(*cylinder);
    facets_.resize(bodies.size());
    std::unique_ptr<Facets>& facets = facets_[std::size_t(p.b)];
    if (!facets) {
        facets = std::make_unique<Facets>();
        facets->mesh = surface_of(b.shape());
        facets->surface = surface_of_triangles(facets->mesh);
        facets->sharp = sharp_features(facets->surface, facets->mesh.points);
    }
    std::vector<Vec3> x = facets->mesh.points;
    for (Vec3& point : x)
        point = at * point;
    MortarOptions options;
    options.reach = reach_;
    options.smooth_normals = true; // the facets stand for a curved surface, but at its edges
    add(mortar_contacts(p.surface_a, a.places(), facets->surface, x, options), pair, p.a, p.b,
        false, out);
    add_sharp({p.surface_a, p.sharp_a, a.places()}, {facets->surface, facets->sharp, x}, pair,
              false, out);
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

} // namespace amontons
