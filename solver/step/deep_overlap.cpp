#include "solver/step/deep_overlap.hpp"

#include "mesh/box_tree.hpp"
#include "mesh/split_elements.hpp"
#include "contact/surface/overlap.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <Eigen/LU>
#include <array>
#include <map>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr std::size_t kMostPlaces = 20'000; // of a rod

using Corners = std::array<std::int32_t, 4>;

/// What a solid fills, at its present places.
class Inside {
public:
    explicit Inside(const SolidBody& solid) : x_(solid.places())
    {
        for_each_element(solid.mesh(), [&](std::int32_t, ElementKind kind, auto nodes) {
            append_tetrahedra({kind, nodes}, tetrahedra_);
        });
        std::vector<BoundingBox> boxes(tetrahedra_.size());
        for (std::size_t i = 0; i < boxes.size(); ++i)
            for (const std::int32_t n : tetrahedra_[i])
                boxes[i].add(x_[std::size_t(n)]);
        tree_.emplace(boxes);
    }

    bool has(const Vec3& x) const
    {
        BoundingBox box;
        box.add(x);
        bool in = false;
        tree_->visit(box, [&](std::int32_t i) { in = in || has(tetrahedra_[std::size_t(i)], x); });
        return in;
    }

private:
    bool has(const Corners& t, const Vec3& x) const
    {
        const Vec3& a = x_[std::size_t(t[0])];
        Mat3 edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = x_[std::size_t(t[std::size_t(k + 1)])] - a;
        const Vec3 share = edges.inverse() * (x - a);
        return share.minCoeff() >= 0 && share.sum() <= 1;
    }

    std::span<const Vec3> x_;
    std::vector<Corners> tetrahedra_;
    std::optional<BoxTree> tree_;
};

BoundingBox box_of(const SolidBody& solid)
{
    BoundingBox box;
    for (const Vec3& x : solid.places())
        box.add(x);
    return box;
}

} // namespace

namespace {

/// Places within a body: of a solid middles of its elements, of a rigid body that of its shape.
std::vector<Vec3> places_inside(const BodyRef& body)
{
    constexpr std::size_t kMost = 500; // of more elements a part is asked
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

/// Whether a pair that begins inside can be pressed out or taken as fitting: of rods it cannot,
/// nor where contacts of meshes no longer tell their near sides from their far ones.
bool can_begin(BodySystem& system, const BodyOverlap& o)
{
    constexpr double kOfThickness = 0.5;
    if (system.refs[std::size_t(o.a)].rod) return false;
    if (o.b < 0) return true;
    return o.depth < kOfThickness * std::min(system.finder.thickness(system.refs, o.a),
                                             system.finder.thickness(system.refs, o.b));
}

} // namespace

std::vector<Issue> start_overlaps(BodySystem& system, const std::string& file)
{
    constexpr double kRounded = 1 + 1e-6; // a limit that a scene meets exactly
    std::vector<BodyOverlap> overlaps;
    system.finder.overlaps(system.refs, overlaps);
    const std::vector<ContactPair>& pairs = system.finder.pairs();
    // What is inside of a solid altogether, or fills the place of one like it, meets none of its faces.
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const ContactPair& p = pairs[k];
        if (p.b < 0 || p.a == p.b) continue;
        for (const bool of_b : {false, true}) {
            const BodyRef &inner = system.refs[std::size_t(of_b ? p.b : p.a)],
                          &outer = system.refs[std::size_t(of_b ? p.a : p.b)];
            const ContactSurface* surface = of_b ? p.surface_a : p.surface_b;
            if (!outer.solid || !surface || inner.rod) continue;
            const BoundingBox box = box_of(*outer.solid);
            std::optional<FaceDistance> distance;
            BodyOverlap o;
            std::int32_t hint = -1;
            for (const Vec3& x : places_inside(inner)) {
                if ((x.array() < box.low).any() || (x.array() > box.high).any()) continue;
                if (!distance) distance.emplace(PlacedSurface{*surface->facets, outer.solid->places()}, box);
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
                                             : system.finder.start_overlap_of_rest();
        if (how != StartOverlap::refuse && o.pair >= 0 && can_begin(system, o)) {
            inside[std::size_t(o.pair)] = std::max(inside[std::size_t(o.pair)], o.depth);
            continue;
        }
        if (!(o.depth > kRounded * o.allowed)) continue;
        const BodyOverlap*& known = worst[{o.a, o.b, o.obstacle}];
        if (!known || o.depth > known->depth) known = &o;
    }
    for (const ContactPair& p : pairs)
        some |= p.start_overlap != StartOverlap::refuse;
    if (some && worst.empty()) system.finder.begin_inside(system.refs, inside);
    for (const auto& [bodies, o] : worst)
        found.push_back({file, "/contact", says(*o, system) + " when the run begins",
                         fmt::format("<= {:.3g} m; \"start_overlap\": \"resolve\" presses them out "
                                     "of each other, \"close\" takes gaps and overlaps of surfaces "
                                     "that should fit for none",
                                     o->allowed)});
    return found;
}

namespace {

/// A place of a rod's middle line that a solid has inside.
std::optional<Vec3> within_solid(const RodBody& rod, const SolidBody& solid)
{
    const AxisBox around = rod.box();
    const BoundingBox box = box_of(solid);
    if ((around.low.array() > box.high).any() || (box.low > around.high.array()).any()) return {};
    const Inside inside(solid);
    const Curve curve = rod.curve();
    double spacing = curve.start.back() / double(kMostPlaces);
    for (const CurvePiece& p : curve.pieces)
        spacing = std::max(spacing, 0.5 * p.radius);
    for (const CurvePlace& p : stations(curve, spacing)) {
        const Vec3 x = curve.pieces[std::size_t(p.piece)].at(p.t);
        if (inside.has(x) && !rod.in_sheath(p)) return x;
    }
    return {};
}

} // namespace

std::vector<Issue> rods_in_each_other(const std::vector<BodyRef>& bodies,
                                      const std::vector<ContactPair>& pairs,
                                      const std::string& file)
{
    std::vector<Issue> found;
    for (const ContactPair& p : pairs) {
        const RodBody* a = bodies[std::size_t(p.a)].rod;
        const SolidBody* solid = p.b >= 0 ? bodies[std::size_t(p.b)].solid : nullptr;
        if (a && solid) {
            if (const std::optional<Vec3> at = within_solid(*a, *solid))
                found.push_back(
                    {file, "/contact",
                     fmt::format("{} lies in {} at ({:.4g}, {:.4g}, {:.4g})",
                                 bodies[std::size_t(p.a)].name, bodies[std::size_t(p.b)].name,
                                 at->x(), at->y(), at->z()),
                     "a middle line outside of what the rod touches"});
            continue;
        }
        const RodBody* b = p.b >= 0 ? bodies[std::size_t(p.b)].rod : nullptr;
        if (!a || !b || !p.end_a.empty()) continue;
        const Curve one = a->curve(), other = b->curve();
        const std::optional<Vec3> at = within_each_other(one, a == b ? one : other);
        if (!at) continue;
        const std::string& name = bodies[std::size_t(p.a)].name;
        found.push_back({file, "/contact",
                         fmt::format("{} at ({:.4g}, {:.4g}, {:.4g})",
                                     a == b ? name + " lies in itself"
                                            : name + " and " + bodies[std::size_t(p.b)].name +
                                                  " lie in each other",
                                     at->x(), at->y(), at->z()),
                         "middle lines at least half the sum of the radii apart: nearer they "
                         "have no sides"});
    }
    return found;
}

} // namespace amontons
