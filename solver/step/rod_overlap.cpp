#include "contact/curve/bore_contact.hpp"
#include "contact/surface/overlap.hpp"
#include "mesh/box_tree.hpp"
#include "mesh/wall.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// How far rods stand in other bodies: the surface around their middle lines, examined from place to
// place half a radius apart.

namespace amontons {
namespace {

// Of the thinner radius. Between stations a rod that bends leaves the arc over their chord; beyond
// half a radius nothing shows its sides apart.
constexpr double kAllowedOfRadius = 0.01, kNeverOfRadius = 0.5;
constexpr double kMostSamples = 20'000; // of a rod
constexpr double kBesides = 4;          // radii of arc: nearer places of one rod are neighbours

struct Sample {
    Vec3 x;
    double radius, arc;
    bool free; ///< not in its sheath
};

std::vector<Sample> samples_of(const RodBody& rod)
{
    const Curve curve = rod.curve();
    double spacing = curve.start.back() / kMostSamples;
    for (const CurvePiece& p : curve.pieces)
        spacing = std::max(spacing, 0.5 * p.radius);
    const std::vector<CurvePlace> places = stations(curve, spacing);
    std::vector<Sample> all;
    all.reserve(places.size());
    for (const CurvePlace& at : places) {
        const CurvePiece& p = curve.pieces[std::size_t(at.piece)];
        all.push_back({p.at(at.t), p.radius, arc_at(curve, at), !rod.in_sheath(at)});
    }
    return all;
}

/// The chords between samples, each with the larger radius of its ends.
BoxTree chords_of(const std::vector<Sample>& samples)
{
    std::vector<BoundingBox> boxes;
    for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
        BoundingBox box;
        for (const Sample* s : {&samples[i], &samples[i + 1]}) {
            box.add(Vec3(s->x.array() - s->radius));
            box.add(Vec3(s->x.array() + s->radius));
        }
        boxes.push_back(box);
    }
    return BoxTree(boxes);
}

double distance_to_chord(const Vec3& x, const Vec3& a, const Vec3& b)
{
    const double length = (b - a).squaredNorm();
    const double t = length > 0 ? std::clamp((x - a).dot(b - a) / length, 0.0, 1.0) : 0;
    return (x - a - t * (b - a)).norm();
}

} // namespace

void ContactFinder::overlaps_of_rod(const std::vector<BodyRef>& bodies, int pair,
                                    std::vector<BodyOverlap>& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const RodBody& rod = *bodies[std::size_t(p.a)].rod;
    if (!p.end_a.empty()) return; // that end alone, which its contact has
    const std::vector<Sample> own = samples_of(rod);
    BodyOverlap deepest;
    double radius = rod.least_radius();
    const auto keep_deepest = [&](const Vec3& x, double depth) {
        if (depth > deepest.depth) {
            deepest.depth = depth;
            deepest.point = x;
        }
    };
    // A sheath passes through walls, and not through what else can touch the rod in it. Where the
    // distance of an earlier sample shows that one is not deeper, it is not measured.
    const auto in_shape = [&](const auto& distance) {
        Vec3 at = Vec3::Zero();
        double clear = -std::numeric_limits<double>::infinity();
        for (const Sample& s : own) {
            if (!s.free && p.b < 0) continue;
            if (clear - kSteepestWall * (s.x - at).norm() >= s.radius - deepest.depth) continue;
            at = s.x;
            clear = distance(at).distance;
            keep_deepest(at, s.radius - clear);
        }
    };
    if (p.b < 0 && !p.plane) {
        const Wall& wall = *walls_[std::size_t(p.obstacle)];
        WallHint hint;
        Vec3 at = Vec3::Zero();
        double clear = -std::numeric_limits<double>::infinity(); // at least, there
        for (const Sample& s : own) {
            if (!s.free || clear - kSteepestWall * (s.x - at).norm() >= s.radius) continue;
            at = s.x;
            clear = wall.clearance(at, hint);
            if (clear >= s.radius) continue;
            clear = wall.distance(at, hint);
            keep_deepest(at, s.radius - clear);
        }
    } else if (p.b < 0) {
        in_shape(distance_from_obstacle(p));
    } else if (const RigidBody* rigid = bodies[std::size_t(p.b)].rigid) {
        in_shape(distance_from(*rigid, rigid->placement()));
    } else if (const SolidBody* solid = bodies[std::size_t(p.b)].solid) {
        BoundingBox near;
        for (const Sample& s : own) {
            near.add(Vec3(s.x.array() - 2 * s.radius));
            near.add(Vec3(s.x.array() + 2 * s.radius));
        }
        const PlacedSurface surface{*p.surface_b->facets, solid->places()};
        std::optional<FaceDistance> distance(std::in_place, surface, near);
        // A rod that is nowhere near the surface may lie inside as a whole.
        const bool all = distance->empty();
        if (all) distance.emplace(surface, box_around(surface));
        std::int32_t hint = -1;
        for (const Sample& s : own) {
            if (!s.free) continue;
            const auto foot = distance->at(s.x, hint);
            // Beyond, the nearest triangle may have been left out.
            if (foot && (all || std::abs(foot->distance) <= 2 * s.radius))
                keep_deepest(s.x, s.radius - foot->distance);
        }
    } else if (const RodBody* second = bodies[std::size_t(p.b)].rod; second->lies_in(rod)) {
        radius = std::min(radius, second->least_radius());
        const Curve outer = rod.curve(), inner = second->curve();
        const std::vector<double> bore = rod.bore();
        const BoreOverlap in_wall =
            bore_overlap({outer, inner, bore, rod.first_outside(), second->first_outside()});
        keep_deepest(in_wall.point, in_wall.depth);
    } else {
        const bool itself = p.a == p.b;
        const std::vector<Sample> others = itself ? own : samples_of(*second);
        radius = std::min(radius, second->least_radius());
        const BoxTree tree = chords_of(others);
        const double closed = second->curve().closed ? others.back().arc : 0;
        for (const Sample& s : own) {
            BoundingBox box;
            box.add(Vec3(s.x.array() - s.radius));
            box.add(Vec3(s.x.array() + s.radius));
            tree.visit(box, [&](std::int32_t k) {
                const Sample &a = others[std::size_t(k)], &b = others[std::size_t(k) + 1];
                if (itself && !(s.free && a.free && b.free)) return;
                if (itself) {
                    double between = std::min(std::abs(s.arc - a.arc), std::abs(s.arc - b.arc));
                    if (closed > 0) between = std::min(between, closed - between);
                    if (between <= kBesides * s.radius) return;
                }
                keep_deepest(s.x, s.radius + std::max(a.radius, b.radius) -
                                      distance_to_chord(s.x, a.x, b.x));
            });
        }
    }
    if (!(deepest.depth > 0)) return;
    deepest.a = p.a;
    deepest.b = p.b;
    deepest.obstacle = p.obstacle;
    deepest.pair = pair;
    deepest.allowed = deepest.silent = kAllowedOfRadius * radius;
    deepest.most = kNeverOfRadius * radius;
    out.push_back(deepest);
}

} // namespace amontons
