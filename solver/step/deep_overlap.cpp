#include "solver/step/deep_overlap.hpp"

#include "mesh/box_tree.hpp"
#include "mesh/closest_point.hpp"
#include "mesh/split_elements.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <Eigen/LU>
#include <array>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr std::size_t kMostNodes = 500;     // of a solid: of more a part is asked
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

    Vec3 middle(const Corners& t) const
    {
        Vec3 sum = Vec3::Zero();
        for (const std::int32_t n : t)
            sum += x_[std::size_t(n)] / 4;
        return sum;
    }
    const std::vector<Corners>& tetrahedra() const { return tetrahedra_; }
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

/// From x to the faces of a surface, by their corners [m].
double distance(const Vec3& x, const ExternalSurface& surface, std::span<const Vec3> places)
{
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        const int corners = nodes.size() == 6 ? 3 : int(nodes.size());
        const auto at = [&](int k) { return places[std::size_t(nodes[std::size_t(k)])]; };
        for (int k = 1; k + 1 < corners; ++k)
            least =
                std::min(least, (closest_on_triangle(x, at(0), at(k), at(k + 1)).point - x).norm());
    }
    return least;
}

struct Deepest {
    double depth = 0;
    Vec3 place = Vec3::Zero();
};

/// The deepest of some places in something. @param depth_of  > 0 inside [m]
template <class Place, class Depth> Deepest deepest(std::size_t count, Place place, Depth depth_of)
{
    Deepest d;
    for (std::size_t i = 0; i < count; i += 1 + count / kMostNodes) {
        const Vec3 x = place(i);
        if (const double depth = depth_of(x); depth > d.depth) d = {depth, x};
    }
    return d;
}

/// The same of a surface's nodes.
template <class Depth>
Deepest deepest(const ExternalSurface& surface, std::span<const Vec3> places, Depth depth_of)
{
    const auto node = [&](std::size_t i) { return places[std::size_t(surface.used_nodes[i])]; };
    return deepest(surface.used_nodes.size(), node, depth_of);
}

BoundingBox box_of(const SolidBody& solid)
{
    BoundingBox box;
    for (const Vec3& x : solid.places())
        box.add(x);
    return box;
}

} // namespace

std::vector<Issue> deep_overlaps(const std::vector<BodyRef>& bodies,
                                 const std::vector<ContactPair>& pairs,
                                 const std::vector<const Wall*>& walls, const std::string& file)
{
    std::vector<Issue> found;
    for (const ContactPair& p : pairs) {
        if (p.a == p.b) continue; // a body and itself
        const BodyRef& a = bodies[std::size_t(p.a)];
        if (!a.solid || (p.b >= 0 && !bodies[std::size_t(p.b)].solid)) continue;
        Deepest d;
        std::string in = "an obstacle";
        if (p.b < 0) {
            WallHint hint;
            d = deepest(p.surface_a->outside, a.solid->places(), [&](const Vec3& x) {
                return -walls[std::size_t(p.obstacle)]->sample(x, hint).distance;
            });
        } else {
            const BodyRef& b = bodies[std::size_t(p.b)];
            in = b.name;
            if (!box_of(*a.solid).touches(box_of(*b.solid))) continue;
            const Inside in_a(*a.solid), in_b(*b.solid);
            const auto depth_in = [](const Inside& inside, const ExternalSurface& surface,
                                     const SolidBody& solid) {
                return [&](const Vec3& x) {
                    return inside.has(x) ? distance(x, surface, solid.places()) : 0;
                };
            };
            const auto depth_a = depth_in(in_a, p.surface_a->outside, *a.solid),
                       depth_b = depth_in(in_b, p.surface_b->outside, *b.solid);
            // Elements too: of two solids in one place no node of a surface is inside the other.
            const auto middle = [&](std::size_t i) { return in_a.middle(in_a.tetrahedra()[i]); };
            for (const Deepest& found_here :
                 {deepest(p.surface_a->outside, a.solid->places(), depth_b),
                  deepest(p.surface_b->outside, b.solid->places(), depth_a),
                  deepest(in_a.tetrahedra().size(), middle, depth_b)})
                if (found_here.depth > d.depth) d = found_here;
        }
        if (d.depth > p.reach)
            found.push_back(
                {file, "/contact",
                 fmt::format("{} and {} overlap by {:.4g} m at ({:.4g}, {:.4g}, {:.4g}), deeper "
                             "than contacts are looked for",
                             a.name, in, d.depth, d.place.x(), d.place.y(), d.place.z()),
                 fmt::format("<= {:.4g} m, or a \"reach\" of more than {:.4g} m", p.reach,
                             d.depth)});
    }
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
