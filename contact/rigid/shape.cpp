#include "contact/rigid/shape.hpp"

#include "contact/rigid/extent.hpp"
#include "mesh/base/index.hpp"
#include "mesh/base/limits.hpp"
#include "mesh/surface_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace amontons {

namespace {

template <class... F> struct Overloaded : F... {
    using F::operator()...;
};
template <class... F> Overloaded(F...) -> Overloaded<F...>;

// Volume, first and second moments of the tetrahedra between the triangles and one of their
// points (near the body, so that nothing cancels).
MassProperties of_triangles(const SurfaceMesh& mesh, double density)
{
    const Vec3 origin = mesh.points[static_cast<std::size_t>(mesh.triangles[0][0])];
    double volume = 0;
    Vec3 first = Vec3::Zero();
    Mat3 second = Mat3::Zero();
    for (const auto& triangle : mesh.triangles) {
        Mat3 corners;
        for (int k = 0; k < 3; ++k)
            corners.col(k) =
                mesh.points[static_cast<std::size_t>(triangle[static_cast<std::size_t>(k)])] -
                origin;
        const double v = corners.determinant() / 6;
        const Vec3 sum = corners.rowwise().sum();
        volume += v;
        first += v / 4 * sum;
        // Integral of x x^T over a tetrahedron with a corner at 0.
        second += v / 20 * (corners * corners.transpose() + sum * sum.transpose());
    }
    const Vec3 centre = first / volume;
    const Mat3 about = second - volume * centre * centre.transpose();
    return {density * volume, origin + centre,
            density * (about.trace() * Mat3::Identity() - about)};
}

constexpr std::size_t kFewVertices = 48; // a tree takes longer

/// The least value of a body's vertices, and the first vertex that has it.
/// @param bound  of a box: no value in it is below
template <class Bound, class Value>
std::pair<double, std::int32_t> least_vertex(const TriangleShape& body, Bound bound, Value value)
{
    double least = std::numeric_limits<double>::infinity();
    std::int32_t first = 0;
    const std::vector<Vec3>& vertices = body.polyhedron.vertices;
    const auto take = [&](std::int32_t v) {
        const double own = value(vertices[at(v)]);
        if (own < least || (own == least && v < first)) first = v;
        least = std::min(least, own);
    };
    if (vertices.size() <= kFewVertices) {
        for (std::size_t v = 0; v < vertices.size(); ++v)
            take(number(v));
        return {least, first};
    }
    body.tree.least(bound, [&](std::int32_t t) {
        for (const std::int32_t p : body.mesh.triangles[at(t)])
            if (const std::int32_t v = body.polyhedron.corner_of[at(p)]; v >= 0) take(v);
        return least;
    });
    return {least, first};
}

// Of a convex body a vertex below all its neighbours is below all others: from the lowest of some
// along the edges down to it. -1 where a neighbour is about as low: what it is off (kFlat) may
// decide.
std::int32_t lowest_by_edges(const Polyhedron& p, const Vec3& direction)
{
    constexpr std::size_t kStarts = 64;
    constexpr double kLower = 1e-6; // of the size: more than a convex body is off (kFlat)
    const auto height = [&](std::size_t v) { return direction.dot(p.vertices[v]); };
    std::size_t lowest = 0;
    double least = height(0);
    const std::size_t stride = std::max<std::size_t>(1, p.vertices.size() / kStarts);
    for (std::size_t v = stride; v < p.vertices.size(); v += stride)
        if (const double own = height(v); own < least) {
            least = own;
            lowest = v;
        }
    for (std::size_t step = 0; step < p.vertices.size(); ++step) {
        double next = kInfinity;
        std::size_t to = lowest;
        for (std::int32_t i = p.vertex_begin[lowest]; i < p.vertex_begin[lowest + 1]; ++i) {
            const auto& ends = p.edge_ends[at(p.vertex_edges[at(i)])].vertex;
            const std::size_t v = at(at(ends[0]) == lowest ? ends[1] : ends[0]);
            if (const double own = height(v); own < next) {
                next = own;
                to = v;
            }
        }
        if (next > least + kLower * p.size) return number(lowest);
        if (!(next < least)) return -1;
        least = next;
        lowest = to;
    }
    return -1;
}

std::pair<double, std::int32_t> lowest(const TriangleShape& body, const Vec3& direction)
{
    const Polyhedron& p = body.polyhedron;
    if (p.convex && p.vertices.size() > kFewVertices)
        if (const std::int32_t v = lowest_by_edges(p, direction); v >= 0)
            return {direction.dot(p.vertices[at(v)]), v};
    return least_vertex(
        body, [&](const BoundingBox& box) { return lowest_along(box, direction); },
        [&](const Vec3& x) { return direction.dot(x); });
}

} // namespace

std::int32_t lowest_vertex(const TriangleShape& body, const Vec3& direction)
{
    return lowest(body, direction).second;
}

double lowest_along(const TriangleShape& body, const Vec3& direction)
{
    return lowest(body, direction).first;
}

double farthest_vertex(const TriangleShape& body)
{
    // Of a ball around the origin a tree would leave out nothing.
    double squared = 0;
    for (const Vec3& x : body.polyhedron.vertices)
        squared = std::max(squared, x.squaredNorm());
    return std::sqrt(squared);
}

Vec3 Ellipsoid::support(const Vec3& direction) const
{
    const Vec3 scaled = radii.cwiseProduct(direction);
    return radii.cwiseProduct(scaled) / scaled.norm();
}

TriangleShape make_triangle_shape(SurfaceMesh mesh, const std::string& file)
{
    if (mesh.triangles.empty())
        throw InputError({Issue{file, "", "no triangles", "a closed surface"}});
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        if (!mesh.points[i].allFinite())
            throw InputError(
                {Issue{file, "vertex " + std::to_string(i), "not finite", "a finite place [m]"}});
    const SurfaceReport report = check_surface(mesh);
    SurfaceRequirements required;
    required.closed = true;
    std::vector<Issue> found = amontons::issues(report, mesh, required, file);
    if (found.empty() && !(report.enclosed_volume > 0))
        found.push_back({file, "", "normals that point inwards", "normals that point outwards"});
    if (!found.empty()) throw InputError(std::move(found));
    BoundingTree tree(mesh);
    Polyhedron polyhedron = make_polyhedron(mesh);
    return {std::move(mesh), std::move(tree), std::move(polyhedron)};
}

std::vector<Issue> issues(const RigidShape& shape)
{
    std::vector<Issue> found;
    const auto size = [&](const char* place, double value) {
        if (!(value > 0) || !std::isfinite(value))
            found.push_back({"", place, std::to_string(value), "> 0 and finite [m]"});
    };
    const auto spread = [&](int value) {
        if (value < 0 || value > 100'000)
            found.push_back({"", "/spread", std::to_string(value), "0 to 100000"});
    };
    std::visit(Overloaded{[&](const Box& box) {
                              for (int k = 0; k < 3; ++k)
                                  size("/half_extents", box.half_extents[k]);
                              spread(box.spread);
                          },
                          [&](const Ball& ball) { size("/radius", ball.radius); },
                          [&](const Cylinder& cylinder) {
                              size("/radius", cylinder.radius);
                              size("/half_length", cylinder.half_length);
                              spread(cylinder.spread);
                          },
                          [&](const Ellipsoid& ellipsoid) {
                              for (int k = 0; k < 3; ++k)
                                  size("/radii", ellipsoid.radii[k]);
                          },
                          [&](const Capsule& capsule) {
                              size("/radius", capsule.radius);
                              size("/half_length", capsule.half_length);
                          },
                          [](const Plane&) {}, [](const TriangleShape&) {}},
               shape);
    return found;
}

MassProperties mass_properties(const RigidShape& shape, double density)
{
    using std::numbers::pi;
    return std::visit(
        Overloaded{
            [&](const Box& box) {
                const Vec3 square = box.half_extents.cwiseAbs2();
                const double mass = density * 8 * box.half_extents.prod();
                const Vec3 inertia = mass / 3 * (Vec3::Constant(square.sum()) - square);
                return MassProperties{mass, Vec3::Zero(), inertia.asDiagonal()};
            },
            [&](const Ball& ball) {
                const double r2 = ball.radius * ball.radius;
                const double mass = density * 4 / 3 * pi * r2 * ball.radius;
                return MassProperties{mass, Vec3::Zero(), 0.4 * mass * r2 * Mat3::Identity()};
            },
            [&](const Cylinder& cylinder) {
                const double r2 = cylinder.radius * cylinder.radius;
                const double h2 = cylinder.half_length * cylinder.half_length;
                const double mass = density * 2 * pi * r2 * cylinder.half_length;
                const double across = mass * (r2 / 4 + h2 / 3);
                const Vec3 inertia{across, across, mass * r2 / 2};
                return MassProperties{mass, Vec3::Zero(), inertia.asDiagonal()};
            },
            [&](const Ellipsoid& ellipsoid) {
                const Vec3 square = ellipsoid.radii.cwiseAbs2();
                const double mass = density * 4 / 3 * pi * ellipsoid.radii.prod();
                const Vec3 inertia = mass / 5 * (Vec3::Constant(square.sum()) - square);
                return MassProperties{mass, Vec3::Zero(), inertia.asDiagonal()};
            },
            [&](const Capsule& capsule) {
                // A cylinder and two half balls, whose centres are 3/8 of the radius beyond its
                // ends.
                const double r = capsule.radius, h = capsule.half_length;
                const double middle = density * 2 * pi * r * r * h;
                const double ends = density * 4 / 3 * pi * r * r * r;
                const double across =
                    middle * (r * r / 4 + h * h / 3) + ends * (0.4 * r * r + h * h + 0.75 * r * h);
                const double along = middle * r * r / 2 + ends * 0.4 * r * r;
                return MassProperties{middle + ends, Vec3::Zero(),
                                      Vec3{across, across, along}.asDiagonal()};
            },
            [](const Plane&) { return MassProperties{}; },
            [&](const TriangleShape& body) { return of_triangles(body.mesh, density); }},
        shape);
}

double bounding_radius(const RigidShape& shape)
{
    return std::visit(
        Overloaded{[](const Box& box) { return box.half_extents.norm(); },
                   [](const Ball& ball) { return ball.radius; },
                   [](const Cylinder& c) { return std::hypot(c.radius, c.half_length); },
                   [](const Ellipsoid& e) { return e.radii.maxCoeff(); },
                   [](const Capsule& c) { return c.radius + c.half_length; },
                   [](const Plane&) { return kInfinity; },
                   [](const TriangleShape& body) { return farthest_vertex(body); }},
        shape);
}

AxisBox axis_box(const RigidShape& shape, const Pose& pose)
{
    const Mat3 turn = pose.turn.toRotationMatrix();
    const auto around = [&](const Vec3& half) {
        return AxisBox{pose.place - half, pose.place + half};
    };
    return std::visit(
        Overloaded{[&](const Box& box) { return around(turn.cwiseAbs() * box.half_extents); },
                   [&](const Ball& ball) { return around(Vec3::Constant(ball.radius)); },
                   [&](const Cylinder& cylinder) {
                       const Vec3 axis = turn.col(2);
                       const Vec3 rim{std::hypot(axis[1], axis[2]), std::hypot(axis[2], axis[0]),
                                      std::hypot(axis[0], axis[1])};
                       return around(cylinder.half_length * axis.cwiseAbs() +
                                     cylinder.radius * rim);
                   },
                   [&](const Ellipsoid& ellipsoid) {
                       return around((turn * ellipsoid.radii.asDiagonal()).rowwise().norm());
                   },
                   [&](const Capsule& capsule) {
                       const Vec3 half = capsule.half_length * turn.col(2).cwiseAbs();
                       return around(half.array() + capsule.radius);
                   },
                   [&](const Plane&) {
                       AxisBox all{Vec3::Constant(-kInfinity), Vec3::Constant(kInfinity)};
                       const Vec3 normal = turn.col(2);
                       for (int k = 0; k < 3; ++k) {
                           if (normal[k] == 1) all.high[k] = pose.place[k];
                           if (normal[k] == -1) all.low[k] = pose.place[k];
                       }
                       return all;
                   },
                   [&](const TriangleShape& body) {
                       AxisBox box;
                       for (int k = 0; k < 3; ++k) {
                           const Vec3 axis = turn.row(k);
                           box.low[k] = lowest_along(body, axis);
                           box.high[k] = -lowest_along(body, -axis);
                       }
                       return AxisBox{box.low + pose.place, box.high + pose.place};
                   }},
        shape);
}

} // namespace amontons
