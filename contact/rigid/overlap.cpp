#include "contact/rigid/overlap.hpp"

#include "contact/rigid/extent.hpp"
#include "contact/rigid/shape_surface.hpp"
#include "mesh/base/index.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

namespace amontons {
namespace {

using Distance = std::function<WallSample(const Vec3&)>;

/// No limit here depends on bulges.
constexpr Shallow kDepthsAlone{std::numeric_limits<double>::infinity()};
constexpr std::size_t kFewTriangles = 64;
constexpr double kRoundedPlace = 1e-9; // of a body's size
constexpr int kRimPlaces = 48, kAxisPlaces = 17, kGoldenSteps = 30;

/// Least of f on [low, high] around the best of some places, by the golden section.
template <class F> double least_near(F f, double low, double high)
{
    constexpr double kGolden = 0.6180339887498949;
    double p = high - kGolden * (high - low), q = low + kGolden * (high - low);
    double at_p = f(p), at_q = f(q);
    for (int i = 0; i < kGoldenSteps; ++i) {
        if (at_p < at_q) {
            high = q;
            q = p;
            at_q = at_p;
            at_p = f(p = high - kGolden * (high - low));
        } else {
            low = p;
            p = q;
            at_p = at_q;
            at_q = f(q = low + kGolden * (high - low));
        }
    }
    return at_p < at_q ? p : q;
}

void keep_deepest(ShapeOverlap& deepest, const Vec3& x, double distance)
{
    if (-distance > deepest.depth) deepest = {-distance, x};
}

ShapeOverlap of_ball(const Ball& ball, const Pose& pose, const Distance& distance)
{
    ShapeOverlap o;
    const WallSample s = distance(pose.place);
    keep_deepest(o, pose.place - ball.radius * s.normal, s.distance - ball.radius);
    return o;
}

ShapeOverlap of_cylinder(const Cylinder& c, const Pose& pose, const Distance& distance)
{
    ShapeOverlap o;
    const Vec3 axis = pose.turn * Vec3::UnitZ(), x = pose.turn * Vec3::UnitX(),
               y = pose.turn * Vec3::UnitY();
    const auto least_of = [&](const auto& at, double low, double high, int places) {
        const double spacing = (high - low) / places;
        double best = 0, least = std::numeric_limits<double>::infinity();
        for (int k = 0; k <= places; ++k)
            if (const double d = at(low + k * spacing).second; d < least) {
                least = d;
                best = low + k * spacing;
            }
        const auto value = [&](double t) { return at(t).second; };
        const double t =
            least_near(value, std::max(low, best - spacing), std::min(high, best + spacing));
        for (const double place : {best, t}) {
            const auto [where, d] = at(place);
            keep_deepest(o, where, d);
        }
    };
    for (const double end : {-c.half_length, c.half_length}) {
        const Vec3 middle = pose.place + end * axis;
        if (distance(middle).distance > c.radius) continue;
        keep_deepest(o, middle, distance(middle).distance);
        least_of(
            [&](double angle) {
                const Vec3 p = middle + c.radius * (std::cos(angle) * x + std::sin(angle) * y);
                return std::pair(p, distance(p).distance);
            },
            0, 2 * std::numbers::pi, kRimPlaces);
    }
    least_of(
        [&](double z) {
            const Vec3 middle = pose.place + z * axis;
            const Vec3 n = distance(middle).normal;
            const Vec3 across = n - n.dot(axis) * axis;
            if (!(across.norm() > 1e-9)) return std::pair(middle, distance(middle).distance);
            const Vec3 p = middle - c.radius * across.normalized();
            return std::pair(p, distance(p).distance);
        },
        -c.half_length, c.half_length, kAxisPlaces);
    return o;
}

ShapeOverlap of_capsule(const Capsule& c, const Pose& pose, const Distance& distance)
{
    ShapeOverlap o;
    const Vec3 axis = pose.turn * Vec3::UnitZ();
    const auto on_axis = [&](double z) -> Vec3 { return pose.place + z * axis; };
    const auto value = [&](double z) { return distance(on_axis(z)).distance; };
    const double spacing = 2 * c.half_length / (kAxisPlaces - 1);
    double best = 0, least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kAxisPlaces; ++k)
        if (const double d = value(-c.half_length + k * spacing); d < least) {
            least = d;
            best = -c.half_length + k * spacing;
        }
    const double between = least_near(value, std::max(-c.half_length, best - spacing),
                                      std::min(c.half_length, best + spacing));
    for (const double z : {best, between}) {
        const WallSample s = distance(on_axis(z));
        keep_deepest(o, on_axis(z) - c.radius * s.normal, s.distance - c.radius);
    }
    return o;
}

ShapeOverlap of_ellipsoid(const Ellipsoid& e, const Pose& pose, const Distance& distance)
{
    ShapeOverlap o;
    const double least = e.radii.minCoeff(), most = e.radii.maxCoeff();
    const WallSample middle = distance(pose.place);
    if (middle.distance > 1.5 * most) return o;
    // Its deepest place by a search on its surface that narrows; from the side that faces the wall,
    // and from the ends of its axes.
    const auto place = [&](const Vec3& m) -> Vec3 {
        return pose.place + pose.turn * e.radii.cwiseProduct(m);
    };
    const Vec3 facing = e.radii.cwiseProduct(pose.turn.conjugate() * -middle.normal);
    for (int start = 0; start < 7; ++start) {
        if (start == 0 && !(facing.norm() > 0)) continue;
        Vec3 m =
            start == 0 ? Vec3(facing.normalized()) : signed_axis((start - 1) / 2, start % 2 == 0);
        double d = distance(place(m)).distance;
        // What is farther than its own size from the wall has nothing inside around it.
        if (start > 0 && d > 2 * most) continue;
        for (double step = 0.5; step > 1e-7;) {
            const Vec3 u = m.unitOrthogonal(), v = m.cross(u);
            bool moved = false;
            for (const Vec3& way : {u, Vec3(-u), v, Vec3(-v)}) {
                const Vec3 next = (m + step * way).normalized();
                const double there = distance(place(next)).distance;
                if (there >= d - 1e-15 * least) continue;
                d = there;
                m = next;
                moved = true;
                break;
            }
            if (!moved) step /= 2;
        }
        keep_deepest(o, place(m), d);
    }
    return o;
}

ShapeOverlap of_faces(const PlacedSurface& surface, const Distance& distance,
                      const BoundingBox& near, Inside inside)
{
    std::vector<OverlapSpot> spots;
    overlap_spots(surface, distance, near, spots, kDepthsAlone, inside);
    ShapeOverlap o;
    for (const OverlapSpot& s : spots)
        keep_deepest(o, s.point, -s.depth);
    return o;
}

/// Triangles that may be inside of what a distance is from, ascending, and some others: in cubes
/// that are halved where by the distance it may reach into them.
/// @param near  around what it is, in space
std::vector<std::int32_t> triangles_inside(const TriangleShape& shape, const Pose& pose,
                                           const Distance& distance, const Surroundings& near)
{
    struct Cube {
        Vec3 centre;
        double half;
    };
    std::vector<std::int32_t> inside, touched;
    // Few near it are taken as they are: cubes would need as many distances.
    BoundingBox own;
    for (int k = 0; k < 8; ++k)
        own.add(pose.turn.conjugate() * (Vec3(k & 1 ? near.box.low[0] : near.box.high[0],
                                              k & 2 ? near.box.low[1] : near.box.high[1],
                                              k & 4 ? near.box.low[2] : near.box.high[2]) -
                                         pose.place));
    const bool bounded = own.low.isFinite().all() && own.high.isFinite().all();
    const double rounding = kRoundedPlace * shape.polyhedron.size;
    const Vec3 way = pose.turn.conjugate() * near.way;
    const double most = near.most - near.way.dot(pose.place) + rounding;
    const std::vector<Vec3>& points = shape.mesh.points;
    // Boxes across the way are larger than what is in them.
    const auto reaches = [&](std::int32_t t) {
        return !std::isfinite(most) ||
               std::ranges::any_of(shape.mesh.triangles[at(t)],
                                   [&](std::int32_t p) { return way.dot(points[at(p)]) <= most; });
    };
    shape.tree.visit_where(
        [&](const BoundingBox& box) {
            return inside.size() <= kFewTriangles && (!bounded || box.touches(own)) &&
                   lowest_along(box, way) <= most;
        },
        [&](std::int32_t t) {
            if (reaches(t)) inside.push_back(t);
        });
    if (inside.size() <= kFewTriangles) {
        std::sort(inside.begin(), inside.end());
        return inside;
    }
    inside.clear();
    Vec3 low = points.front(), high = low;
    for (const Vec3& p : points) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    const double whole = 0.5 * (high - low).maxCoeff();
    // As small as some triangles are wide, on average.
    const double least = 4 * whole / std::sqrt(double(shape.mesh.triangles.size()));
    std::vector<Cube> cubes{{0.5 * (low + high), whole}};
    while (!cubes.empty()) {
        const Cube c = cubes.back();
        cubes.pop_back();
        const double radius = std::numbers::sqrt3 * c.half;
        const Eigen::Array3d place = (pose.place + pose.turn * c.centre).array();
        if ((place < near.box.low - radius).any() || (place > near.box.high + radius).any() ||
            way.dot(c.centre) - radius > most || distance(c.centre).distance > radius)
            continue;
        if (c.half <= least) {
            shape.tree.within(c.centre, radius, touched);
            std::ranges::copy_if(touched, std::back_inserter(inside), reaches);
            continue;
        }
        for (int k = 0; k < 8; ++k)
            cubes.push_back(
                {c.centre + 0.5 * c.half * Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1),
                 0.5 * c.half});
    }
    std::sort(inside.begin(), inside.end());
    inside.erase(std::unique(inside.begin(), inside.end()), inside.end());
    return inside;
}

/// The faces of a box of any size.
struct BoxFaces {
    ExternalSurface surface;
    FacetedSurface facets;

    BoxFaces() : surface(surface_of_triangles(surface_of(Box{}))), facets(surface) {}
};

std::array<Vec3, 8> corners_of(const Box& box, const Pose& pose)
{
    std::array<Vec3, 8> corners;
    for (int i = 0; i < 8; ++i)
        corners[std::size_t(i)] =
            pose.place + pose.turn * Vec3((i & 1 ? 1 : -1) * box.half_extents.x(),
                                          (i & 2 ? 1 : -1) * box.half_extents.y(),
                                          (i & 4 ? 1 : -1) * box.half_extents.z());
    return corners;
}

ShapeOverlap of_box(const Box& box, const Pose& pose, const Distance& distance,
                    const BoundingBox& near, Inside inside)
{
    static const BoxFaces faces;
    const std::array<Vec3, 8> corners = corners_of(box, pose);
    if (inside == Inside::convex) {
        // Of boxes that rest on something flat a tangent plane at a corner excludes all the rest.
        std::array<WallSample, 8> at;
        for (std::size_t i = 0; i < 8; ++i)
            at[i] = distance(corners[i]);
        ShapeOverlap o;
        for (const FacetedSurface::Triangle& t : faces.facets.triangles())
            for (const std::int32_t n : t.nodes)
                keep_deepest(o, corners[std::size_t(n)], at[std::size_t(n)].distance);
        if (least_by_tangents(corners, at) >= -o.depth - kNoDeeper * box.half_extents.maxCoeff())
            return o;
    }
    return of_faces({faces.facets, corners}, distance, near, inside);
}

} // namespace

std::optional<Vec3> lowest_place(const RigidShape& shape, const Pose& pose, const Vec3& direction)
{
    std::optional<Vec3> lowest;
    const auto keep = [&](const Vec3& x) {
        if (!lowest || direction.dot(x) < direction.dot(*lowest)) lowest = x;
    };
    const Vec3 down = pose.turn.conjugate() * -direction; // in the shape's frame
    const auto in_space = [&](const Vec3& x) -> Vec3 { return pose.place + pose.turn * x; };
    if (const auto* ball = std::get_if<Ball>(&shape)) {
        keep(pose.place - ball->radius * direction);
    } else if (const auto* box = std::get_if<Box>(&shape)) {
        for (const Vec3& x : corners_of(*box, pose))
            keep(x);
    } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
        const double across = std::hypot(down.x(), down.y());
        const double r = across > 0 ? cylinder->radius / across : 0;
        for (const double end : {-cylinder->half_length, cylinder->half_length})
            keep(in_space({r * down.x(), r * down.y(), end}));
    } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
        for (const double end : {-capsule->half_length, capsule->half_length})
            keep(in_space(Vec3(0, 0, end)) - capsule->radius * direction);
    } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) {
        keep(in_space(ellipsoid->support(down)));
    } else if (const auto* triangles = std::get_if<TriangleShape>(&shape)) {
        keep(in_space(triangles->polyhedron.vertices[at(lowest_vertex(*triangles, -down))]));
    }
    return lowest;
}

ShapeOverlap deepest_below(const RigidShape& shape, const Pose& pose, const Vec3& place,
                           const Vec3& normal)
{
    ShapeOverlap o;
    if (const auto lowest = lowest_place(shape, pose, normal))
        keep_deepest(o, *lowest, normal.dot(*lowest - place));
    return o;
}

ShapeOverlap deepest_in(const RigidShape& shape, const Pose& pose, const FacetedSurface* facets,
                        const Distance& distance, const Surroundings& near, Inside inside)
{
    if (const auto* ball = std::get_if<Ball>(&shape)) return of_ball(*ball, pose, distance);
    if (const auto* cylinder = std::get_if<Cylinder>(&shape))
        return of_cylinder(*cylinder, pose, distance);
    if (const auto* capsule = std::get_if<Capsule>(&shape))
        return of_capsule(*capsule, pose, distance);
    if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape))
        return of_ellipsoid(*ellipsoid, pose, distance);
    if (const auto* box = std::get_if<Box>(&shape))
        return of_box(*box, pose, distance, near.box, inside);
    const auto* triangles = std::get_if<TriangleShape>(&shape);
    if (!triangles || !facets) return {};
    // In the body's own frame, where its triangles are known.
    const Distance own = [&](const Vec3& x) {
        WallSample s = distance(pose.place + pose.turn * x);
        const Mat3 back = pose.turn.conjugate().toRotationMatrix();
        s.normal = back * s.normal;
        s.hessian = back * s.hessian * back.transpose();
        return s;
    };
    std::vector<OverlapSpot> spots;
    overlap_spots({*facets, triangles->mesh.points}, own,
                  triangles_inside(*triangles, pose, own, near), spots, kDepthsAlone, inside);
    ShapeOverlap o;
    for (const OverlapSpot& s : spots)
        keep_deepest(o, pose.place + pose.turn * s.point, -s.depth);
    return o;
}

} // namespace amontons
