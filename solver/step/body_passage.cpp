#include "contact/rigid/detect.hpp"
#include "contact/rigid/first_touch.hpp"
#include "contact/surface/passage.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons {
namespace {

double longest_motion(const SolidBody& solid)
{
    double squared = 0;
    for (const std::int32_t node : solid.touching())
        squared = std::max(
            squared, (solid.places()[std::size_t(node)] - solid.places_before()[std::size_t(node)])
                         .squaredNorm());
    return std::sqrt(squared);
}

/// Whether the middle of a convex body has been in another on its way through the step: then the
/// body passes through it, or is on the wrong side of it.
/// @param way  of its place, past the other [m]
bool middle_enters(const RigidBody& body, const Vec3& from, const Vec3& way,
                   const std::function<WallSample(const Vec3&)>& distance)
{
    constexpr int kMost = 1000; // samples; with the shortest way between two, they are enough
    if (std::holds_alternative<TriangleShape>(body.shape())) return false;
    const AxisBox box = axis_box(body.shape(), {});
    const double length = way.norm();
    if (!(length > 0.5 * (box.high - box.low).minCoeff())) return false;
    if (distance(from).distance < 0) return false; // it begins there, and may come out
    double at = 0;
    for (int i = 0; i < kMost && at <= length; ++i) {
        const double free = distance(from + at / length * way).distance;
        if (free < 0) return true;
        at += std::max(free, length / kMost);
    }
    return false;
}

/// The same through another rigid body, as seen from that.
bool middle_enters(const RigidBody& body, const RigidBody& other)
{
    const auto seen = [](const Placement& place, const Placement& from) -> Vec3 {
        return from.turn.conjugate() * (place.shift - from.shift);
    };
    const Vec3 from = seen(body.start_placement(), other.start_placement()),
               to = seen(body.placement(), other.placement());
    return middle_enters(body, from, to - from, distance_from(other, Placement()));
}

} // namespace

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
            double& motion = motion_[std::size_t(i)];
            if (motion < 0) motion = longest_motion(*b.solid);
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
        const auto before = [](const RigidBody& body) { return pose_of(body.start_placement()); };
        std::vector<RigidContact> now;
        detect(a.rigid->shape(), pose_of(a.rigid->placement()), b.rigid->shape(),
               pose_of(b.rigid->placement()), pair.reach, now);
        // Contacts there may be those of the far side.
        if (!now.empty())
            return middle_enters(*a.rigid, *b.rigid) || middle_enters(*b.rigid, *a.rigid);
        return first_touch(a.rigid->shape(), before(*a.rigid), pose_of(a.rigid->placement()),
                           b.rigid->shape(), before(*b.rigid), pose_of(b.rigid->placement())) < 1;
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

std::string ContactFinder::passed(const std::vector<BodyRef>& bodies)
{
    sweep_rods(bodies);
    motion_.assign(bodies.size(), -1);
    for (std::size_t k = 0; k < given_; ++k) {
        const ContactPair& p = pairs_[k];
        const BodyRef& a = bodies[std::size_t(p.a)];
        if (!p.small &&
            (a.rod      ? rod_passed(bodies, p)
             : p.b >= 0 ? passed(bodies, p)
                        : a.rigid && middle_enters(*a.rigid, a.rigid->start_placement().shift,
                                                   a.rigid->placement().shift -
                                                       a.rigid->start_placement().shift,
                                                   distance_from_obstacle(p))))
            return fmt::format("{} passes through {}", bodies[std::size_t(p.a)].name,
                               p.b < 0      ? "an obstacle"
                               : p.b == p.a ? "itself"
                                            : bodies[std::size_t(p.b)].name);
    }
    if (!rest_) return "";
    const auto swept = [&](int b) { return swept_box(*bodies[std::size_t(b)].rigid); };
    for (const BoxPair& p : default_pairs_in_reach(bodies, swept))
        if (passed(bodies, pairs_[std::size_t(default_pair(p.a, p.b, bodies))]))
            return fmt::format("{} passes through {}", bodies[std::size_t(p.a)].name,
                               bodies[std::size_t(p.b)].name);
    return "";
}

} // namespace amontons
