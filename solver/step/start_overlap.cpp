#include "solver/step/start_overlap.hpp"

#include "contact/surface/overlap.hpp"
#include "mesh/box_tree.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/obstacle/build.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <limits>
#include <map>

namespace amontons {
namespace {

BoundingBox touching_box(const SolidBody& solid)
{
    BoundingBox box;
    for (const Vec3& x : solid.places())
        box.add(x);
    return box;
}

/// Places within a body: of a solid middles of its elements, of a rigid body that of its shape.
std::vector<Vec3> places_inside(const BodyRef& body)
{
    constexpr std::size_t kMost = 500; // of more elements a part is examined
    if (body.rigid) return {body.rigid->placement() * Vec3(Vec3::Zero())};
    std::vector<Vec3> middles;
    const std::span<const Vec3> x = body.solid->places();
    for_each_element(body.solid->mesh(), [&](std::int32_t, ElementKind, auto nodes) {
        Vec3 sum = Vec3::Zero();
        for (const std::int32_t n : nodes)
            sum += x[std::size_t(n)] / double(nodes.size());
        middles.push_back(sum);
    });
    std::vector<Vec3> some;
    for (std::size_t i = 0; i < middles.size(); i += 1 + middles.size() / kMost)
        some.push_back(middles[i]);
    return some;
}

/// True if the overlap can be pressed out or taken as a fit: not of rods, nor where contacts
/// between meshes do not distinguish their near sides from their far ones.
bool can_resolve(BodySystem& system, const BodyOverlap& o, bool dynamic)
{
    constexpr double kOfThickness = 0.5;
    if (system.refs[std::size_t(o.a)].rod) return false;
    if (dynamic && std::ranges::any_of(system.refs, [](const BodyRef& b) { return b.rod; }))
        return false; // a rod in motion would continue while others are pressed apart
    if (o.b < 0) return true;
    return o.depth < kOfThickness * std::min(system.finder.thickness(system.refs, o.a),
                                             system.finder.thickness(system.refs, o.b));
}

} // namespace

namespace {

/// Ends of rods with no free space around them: in a vessel, those outside of it. Of a rod that a
/// sheath feeds also the tip that has not left it yet.
std::vector<Issue> ends_outside(const BodySystem& system, const Scene& scene,
                                const std::vector<Obstacle>& obstacles)
{
    std::vector<Issue> found;
    for (const ContactPair& p : system.finder.pairs()) {
        const BodyRef& body = system.refs[std::size_t(p.a)];
        if (!body.rod || p.b >= 0 || p.obstacle < 0) continue;
        const RodInput* input = body_named(scene.rods, body.name);
        if (!input || input->shape.closed) continue;
        const std::vector<BeamNode>& nodes = body.rod->nodes();
        const double radius = body.rod->least_radius();
        const Obstacle& obstacle = obstacles[std::size_t(p.obstacle)];
        for (const bool tip : {false, true}) {
            const bool fed = !input->fed.empty();
            if (fed && !tip) continue; // in the sheath
            const Vec3 x = (tip ? nodes.back() : nodes.front()).position();
            WallHint hint;
            const double away = obstacle.model.wall.distance(x, hint);
            if (!(away < (fed ? 0.99 * radius : -radius))) continue;
            found.push_back(
                {scene.file, "/bodies/" + body.name + "/shape",
                 fmt::format("its {} at ({:.4g}, {:.4g}, {:.4g}), {:.3g} m {}",
                             tip ? "tip" : "start", x.x(), x.y(), x.z(), std::abs(away),
                             away < 0
                                 ? "outside of the free space of " + obstacle.name
                                 : "from the wall of " + obstacle.name + ", within its radius"),
                 "a place in the free space when the run begins" + side_hint(scene, obstacle)});
        }
    }
    return found;
}

} // namespace

std::vector<Issue> start_overlaps(BodySystem& system, const Scene& scene,
                                  const std::vector<Obstacle>& obstacles)
{
    const bool dynamic = scene.time.kind == "dynamic";
    const std::string& file = scene.file;
    if (std::vector<Issue> outside = ends_outside(system, scene, obstacles); !outside.empty())
        return outside;
    constexpr double kRounded = 1 + 1e-6; // a limit that a scene reaches exactly
    std::vector<BodyOverlap> overlaps;
    system.finder.overlaps(system.refs, overlaps, true);
    const std::vector<ContactPair>& pairs = system.finder.pairs();
    // What is entirely inside of a solid, or fills the place of one like it, touches none of its
    // faces.
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const ContactPair& p = pairs[k];
        if (p.b < 0 || p.a == p.b) continue;
        for (const bool of_b : {false, true}) {
            const BodyRef &inner = system.refs[std::size_t(of_b ? p.b : p.a)],
                          &outer = system.refs[std::size_t(of_b ? p.a : p.b)];
            const ContactSurface* surface = of_b ? p.surface_a : p.surface_b;
            if (!outer.solid || !surface || inner.rod) continue;
            const BoundingBox box = touching_box(*outer.solid);
            std::optional<FaceDistance> distance;
            BodyOverlap o;
            std::int32_t hint = -1;
            for (const Vec3& x : places_inside(inner)) {
                if ((x.array() < box.low).any() || (x.array() > box.high).any()) continue;
                if (!distance)
                    distance.emplace(PlacedSurface{*surface->facets, outer.solid->places()}, box);
                if (distance->empty()) break;
                const auto foot = distance->at(x, hint);
                if (!foot || !(-foot->distance > o.depth)) continue;
                o.depth = -foot->distance;
                o.point = x;
            }
            if (!(o.depth > 0)) continue;
            o.a = p.a;
            o.b = p.b;
            o.pair = int(k);
            overlaps.push_back(o);
        }
    }
    std::map<std::array<int, 3>, const BodyOverlap*> worst; // of each pair of bodies
    std::vector<double> inside(pairs.size(), 0);
    std::vector<Issue> found;
    bool some = false;
    for (const BodyOverlap& o : overlaps) {
        const StartOverlap how = o.pair >= 0 ? pairs[std::size_t(o.pair)].start_overlap
                                             : system.finder.default_start_overlap();
        // The first step presses small pairs out of each other at once.
        if (how != StartOverlap::refuse && o.pair >= 0 && pairs[std::size_t(o.pair)].small)
            continue;
        if (how != StartOverlap::refuse && o.pair >= 0 && can_resolve(system, o, dynamic)) {
            inside[std::size_t(o.pair)] = std::max(inside[std::size_t(o.pair)], o.depth);
            continue;
        }
        if (!(o.depth > kRounded * o.allowed)) continue;
        const BodyOverlap*& known = worst[{o.a, o.b, o.obstacle}];
        if (!known || o.depth > known->depth) known = &o;
    }
    for (const ContactPair& p : pairs)
        some |= p.start_overlap != StartOverlap::refuse;
    if (some && worst.empty()) system.finder.set_start_overlaps(system.refs, dynamic, inside);
    for (const auto& [bodies, o] : worst)
        found.push_back({file, "/contact", describe(*o, system) + " when the run begins",
                         fmt::format("<= {:.3g} m{}{}", o->allowed,
                                     o->pair >= 0 && can_resolve(system, *o, dynamic)
                                         ? "; \"start_overlap\": \"resolve\" presses them out of "
                                           "each other, \"close\" takes gaps and overlaps of "
                                           "surfaces that should fit for none"
                                         : "",
                                     o->obstacle >= 0 && o->b < 0
                                         ? side_hint(scene, obstacles[std::size_t(o->obstacle)])
                                         : "")});
    return found;
}

BodyStepReport separation_step(BodySystem& system, const BodyStepOptions& options, double time)
{
    StepInput input;
    input.start = -1;
    input.h = time - input.start;
    input.dynamic = true;
    input.load = 0;
    std::vector<std::vector<double>> velocities(system.bodies.size());
    for (std::size_t b = 0; b < velocities.size(); ++b)
        system.bodies[b]->swap_velocities(velocities[b]);
    BodyStepReport report = try_body_step(system, input, options);
    for (std::size_t b = 0; b < velocities.size(); ++b)
        system.bodies[b]->swap_velocities(velocities[b]);
    system.warm.clear(); // impulses of another length of time
    system.warm_sticks.clear();
    return report;
}

namespace {

/// How deep bodies are in each other at the end of a step: by their contacts, too, since small
/// depths may be left out where surfaces are measured [m].
double left_in(const BodyStepReport& report)
{
    double depth = report.overlap.depth;
    for (const BodyContact& c : report.contacts.contact)
        depth = std::max(depth, -c.gap);
    return depth;
}

} // namespace

double slight_overlap(BodySystem& system)
{
    constexpr double kSlight = 1e-6; // of the body: a step removes less than this at once
    const auto may_strain = [](const BodyRef& b) { return b.solid || b.rod; };
    if (std::ranges::any_of(system.refs, may_strain) || !system.couplings.empty()) return 0;
    BodyContacts found;
    StepInput at_rest;
    at_rest.dynamic = true;
    system.finder.begin_step(system.refs);
    system.finder.find(system.refs, at_rest, found);
    double depth = 0;
    for (const BodyContact& c : found.contact)
        if (-c.gap > kSlight * system.bodies[std::size_t(c.a)]->size())
            depth = std::max(depth, -c.gap);
    return depth;
}

bool undo_slight_overlaps(const std::atomic<bool>& stop,
                          const std::function<const BodyStepReport&()>& step)
{
    constexpr int kMost = 200;
    double left = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kMost && left > 0 && !stop; ++i) {
        const BodyStepReport& report = step();
        if (!report.accepted) return false;
        const double now = left_in(report);
        if (!(now < left)) break;
        left = now;
    }
    return true;
}

bool resolve_start_overlaps(ContactFinder& finder, bool dynamic, const std::atomic<bool>& stop,
                            const std::function<const BodyStepReport&()>& step)
{
    constexpr double kLeast = 1.0 / 256; // part of the depth
    const auto accepted = [&](double share) {
        finder.set_start_overlap_share(share);
        return step().accepted;
    };
    double share = 1;
    if (!dynamic && !accepted(share)) return false;
    for (double part = 0.25; share > 0 && !stop;) {
        const double next = std::max(0.0, share - part);
        if (accepted(next)) {
            share = next;
            part *= 2;
        } else if ((part /= 2) < kLeast) {
            break;
        }
    }
    if (share > 0) return false;
    // What is left then is little: a step that is not accepted is none of a start that is refused.
    if (dynamic) undo_slight_overlaps(stop, step);
    return true;
}

} // namespace amontons
