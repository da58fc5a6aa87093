#include "contact/rigid/pair_contacts.hpp"

#include "mesh/base/index.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

// A rigid body against a smooth wall. Corners are always candidates. An edge or a face touches
// between its corners only where the wall bulges towards it, that is where the distance has a
// strict minimum along it.

namespace amontons {

namespace {

struct WallPair {
    const Pose& pose;
    const SampleWall& wall;
    double reach, size;
    RigidContacts& out;

    Vec3 in_space(const Vec3& x) const { return pose.place + pose.turn * x; }

    void add(const Vec3& x, const WallSample& at_x, Feature kind, std::size_t i,
             double inside = 0) const
    {
        const double gap = at_x.distance - inside;
        if (!(gap <= reach)) return;
        out.push_back({x - inside * at_x.normal, x - at_x.distance * at_x.normal, at_x.normal, gap,
                       contact_id(kind, i, Feature::whole, 0)});
    }
};

// The minimum of the distance on a line or plane, from x: each step moves to the foot of the
// centre of curvature of the wall's parallel surface, exact in one step for a round wall.
// @param flat  projector on the directions along the line or plane
// @returns nothing if the wall does not bulge, or the way leaves the ball of this radius
std::optional<Vec3> nearest_along(const WallPair& pair, const Mat3& flat, const Vec3& start,
                                  double radius)
{
    Vec3 x = start;
    for (int i = 0; i < 50; ++i) {
        const WallSample s = pair.wall(x);
        if (s.distance > radius + pair.reach) return {};
        const Vec3 slope = flat * s.normal;
        const double steep = slope.norm();
        if (steep < 1e-13) break;
        // The curvature that the wall shows to this direction.
        Vec3 across = slope - slope.dot(s.normal) * s.normal;
        if (!(across.norm() > 1e-9 * steep)) return {};
        across.normalize();
        const double curvature = across.dot(s.hessian * across);
        if (!(curvature * radius > 1e-6)) return {};
        const Vec3 step = -slope / curvature;
        x += step;
        if ((x - start).norm() > 1.01 * radius) return {};
        if (step.norm() < 1e-14 * pair.size) break;
    }
    return x;
}

// Does the distance bend upwards along all directions that flat leaves?
bool bulges(const WallSample& s, const Mat3& flat, double size, int dimensions)
{
    const Mat3 bend = flat * s.hessian * flat;
    if (dimensions == 1) return bend.trace() * size > 1e-6;
    const double minors =
        (bend.trace() * bend.trace() - (bend * bend).trace()) / 2; // product of the two
    return bend.trace() > 0 && minors * size * size > 1e-12;
}

void touch_wall_polyhedron(const WallPair& pair, const PolyhedronView& body)
{
    const PolyhedronTopology& topology = *body.topology;
    const Mat3 turn = pair.pose.turn.toRotationMatrix();
    for (std::size_t v = 0; v < body.vertices.size(); ++v) {
        const Vec3 x = pair.in_space(body.vertices[v]);
        pair.add(x, pair.wall(x), Feature::vertex, v);
    }
    for (std::size_t e = 0; e < body.edges.size(); ++e) {
        if (!topology.edges[e].convex) continue;
        const PolyhedronEdge& edge = body.edges[e];
        const Vec3 along = turn * edge.along;
        const Vec3 middle = pair.in_space(body.vertices[at(topology.edges[e].vertex[0])] +
                                          edge.length / 2 * edge.along);
        const Mat3 flat = along * along.transpose();
        const std::optional<Vec3> x = nearest_along(pair, flat, middle, edge.length / 2);
        if (!x || (*x - middle).norm() >= edge.length / 2 * (1 - 1e-9)) continue;
        const WallSample s = pair.wall(*x);
        // Both faces rise from the wall.
        if (s.normal.dot(turn * edge.into[0]) < -1e-9 || s.normal.dot(turn * edge.into[1]) < -1e-9)
            continue;
        if (bulges(s, flat, pair.size, 1)) pair.add(*x, s, Feature::edge, e);
    }
    for (std::size_t f = 0; f < body.normals.size(); ++f) {
        if (topology.face_convex[f] == 0) continue;
        Vec3 middle = Vec3::Zero();
        double corners = 0, radius = 0;
        const auto each_corner = [&](auto&& visit) {
            for (std::int32_t i = topology.face_begin[f]; i < topology.face_begin[f + 1]; ++i)
                for (const std::int32_t v : topology.edges[at(topology.face_edges[at(i)])].vertex)
                    visit(body.vertices[at(v)]);
        };
        each_corner([&](const Vec3& v) {
            middle += v;
            ++corners;
        });
        middle /= corners;
        each_corner([&](const Vec3& v) { radius = std::max(radius, (v - middle).norm()); });
        const Vec3 n = turn * body.normals[f];
        const Mat3 flat = Mat3::Identity() - n * n.transpose();
        const std::optional<Vec3> x = nearest_along(pair, flat, pair.in_space(middle), radius);
        if (!x) continue;
        const WallSample s = pair.wall(*x);
        if (s.normal.dot(n) > -0.999 || !bulges(s, flat, pair.size, 2)) continue;
        bool inside = true;
        const Vec3 own = pair.pose.turn.conjugate() * (*x - pair.pose.place);
        for (std::int32_t i = topology.face_begin[f]; i < topology.face_begin[f + 1]; ++i) {
            const auto e = at(topology.face_edges[at(i)]);
            const auto& ends = topology.edges[e];
            const Vec3& into = body.edges[e].into[at(ends.face[0]) == f ? 0 : 1];
            inside = inside && into.dot(own - body.vertices[at(ends.vertex[0])]) > 0;
        }
        if (inside) pair.add(*x, s, Feature::face, f);
    }
}

// The point of a rim that is nearest to the wall: each step moves towards the centre of curvature
// that the wall's parallel surface shows along the rim, exact in one step for a round wall; away
// from it where the wall is hollow.
// @returns nothing where the end lies flat
std::optional<Vec3> lowest_on_rim(const WallPair& pair, const Vec3& centre, const Vec3& axis,
                                  double radius)
{
    Vec3 x = centre;
    for (int i = 0; i < 50; ++i) {
        const WallSample s = pair.wall(x);
        Vec3 towards = -s.normal;
        if (i > 0) {
            const Vec3 tangent = axis.cross(x - centre) / radius;
            const double along = tangent.dot(s.normal), square = 1 - along * along;
            if (square > 1e-6) towards += tangent.dot(s.hessian * tangent) / square * (x - centre);
        }
        towards -= towards.dot(axis) * axis;
        const double length = towards.norm();
        if (length < 1e-9) return {};
        const Vec3 next = centre + radius / length * towards;
        const double step = (next - x).norm();
        x = next;
        if (step < 1e-14 * pair.size) break;
    }
    return x;
}

/// A wall that bulges into the side of a cylinder or a capsule: the axis's nearest point, then the
/// side below it.
void touch_side(const WallPair& pair, const Vec3& axis, double half_length, double radius)
{
    const Mat3 flat = axis * axis.transpose();
    const std::optional<Vec3> x = nearest_along(pair, flat, pair.pose.place, half_length + radius);
    if (!x || (*x - pair.pose.place).norm() >= half_length) return;
    const WallSample s = pair.wall(*x);
    if (std::abs(s.normal.dot(axis)) > 1e-3 || !bulges(s, flat, pair.size, 1)) return;
    pair.add(*x, s, Feature::face, 2, radius);
}

void touch_cylinder(const WallPair& pair, const Cylinder& a)
{
    const Mat3 turn = pair.pose.turn.toRotationMatrix();
    const Vec3 axis = turn.col(2);
    for (std::size_t end = 0; end < 2; ++end) {
        const double side = end == 0 ? -1 : 1;
        const Vec3 centre = pair.pose.place + side * a.half_length * axis;
        if (const std::optional<Vec3> low = lowest_on_rim(pair, centre, axis, a.radius)) {
            const WallSample s = pair.wall(*low);
            if (-side * axis.dot(s.normal) >= -kInclined) pair.add(*low, s, Feature::rim, end);
        }
        // A wall that bulges into the end.
        const Mat3 flat = Mat3::Identity() - axis * axis.transpose();
        const std::optional<Vec3> x = nearest_along(pair, flat, centre, a.radius);
        if (x && (*x - centre).norm() < a.radius) {
            const WallSample s = pair.wall(*x);
            if (-side * axis.dot(s.normal) > 0.999 && bulges(s, flat, pair.size, 2))
                pair.add(*x, s, Feature::face, end);
        }
        if (-side * axis.dot(pair.wall(centre).normal) < kOpposed) continue;
        for (std::size_t k = 0; k < 8; ++k) {
            const double angle = static_cast<double>(k) * std::numbers::pi / 4;
            const Vec3 rim =
                centre + a.radius * (std::cos(angle) * turn.col(0) + std::sin(angle) * turn.col(1));
            pair.add(rim, pair.wall(rim), Feature::rim, 2 + 8 * end + k);
        }
    }
    touch_side(pair, axis, a.half_length, a.radius);
}

void touch_wall_capsule(const WallPair& pair, const Capsule& a)
{
    const Vec3 axis = pair.pose.turn * Vec3::UnitZ();
    for (std::size_t end = 0; end < 2; ++end) {
        const Vec3 centre = pair.pose.place + (end == 0 ? -1 : 1) * a.half_length * axis;
        pair.add(centre, pair.wall(centre), Feature::vertex, end, a.radius);
    }
    touch_side(pair, axis, a.half_length, a.radius);
}

// Every place of an ellipsoid whose distance from the wall is a minimum along its surface: there
// its outward normal m is against the wall's. By Newton's method on m, from the side that faces the
// wall and from the ends of the axes.
void touch_wall_ellipsoid(const WallPair& pair, const Ellipsoid& a)
{
    const Mat3 turn = pair.pose.turn.toRotationMatrix();
    const Mat3 square = turn * a.radii.cwiseAbs2().asDiagonal() * turn.transpose();
    const auto place = [&](const Vec3& m) -> Vec3 {
        return pair.pose.place + square * m / std::sqrt(m.dot(square * m));
    };
    std::vector<Vec3> found;
    for (int start = 0; start < 7; ++start) {
        Vec3 m = start == 0 ? Vec3(-pair.wall(pair.pose.place).normal)
                            : Vec3(turn * signed_axis((start - 1) / 2, start % 2 == 0));
        WallSample s = pair.wall(place(m));
        for (int step = 0; step < 60; ++step) {
            const Vec3 x = square * m;
            const double h = std::sqrt(m.dot(x));
            const Mat3 moves = (square - x * x.transpose() / (h * h)) / h; // the place, as m turns
            Eigen::Matrix<double, 3, 2> tangent;
            tangent.col(0) = m.unitOrthogonal();
            tangent.col(1) = m.cross(tangent.col(0));
            const Eigen::Vector2d off = tangent.transpose() * s.normal;
            if (off.norm() < 1e-14 && m.dot(s.normal) < 0) break;
            Eigen::Matrix2d slope = tangent.transpose() * s.hessian * moves * tangent;
            slope.diagonal().array() -= m.dot(s.normal);
            if (!(slope.determinant() > 1e-6 && slope.trace() > 0))
                slope = Eigen::Matrix2d::Identity(); // not near a minimum: towards the wall
            Eigen::Vector2d change = -slope.inverse() * off;
            if (change.norm() > 0.5) change *= 0.5 / change.norm();
            bool nearer = false;
            for (int halved = 0; halved < 30; ++halved, change /= 2) {
                const Vec3 next = (m + tangent * change).normalized();
                const WallSample there = pair.wall(place(next));
                // At round-off of the distance the normal still shows the side.
                const double slack = 1e-14 * pair.size;
                const Vec3 beside = there.normal - there.normal.dot(next) * next;
                if (!(there.distance < s.distance - slack) &&
                    !(there.distance < s.distance + slack && beside.norm() < 0.9 * off.norm()))
                    continue;
                m = next;
                s = there;
                nearer = true;
                break;
            }
            if (!nearer) break;
        }
        const Vec3 beside = s.normal - s.normal.dot(m) * m;
        if (m.dot(s.normal) > -0.99 || beside.norm() > 1e-3) continue;
        if (std::any_of(found.begin(), found.end(),
                        [&](const Vec3& f) { return f.dot(m) > 1 - 1e-6; }))
            continue;
        found.push_back(m);
        // By the half axis that is nearest: the same over steps, but where it rolls over.
        Eigen::Index k = 0;
        const Vec3 own = turn.transpose() * m;
        own.cwiseAbs().maxCoeff(&k);
        std::size_t number = 2 * static_cast<std::size_t>(k) + (own[k] < 0 ? 1 : 0);
        for (const RigidContact& c : pair.out)
            if (c.id == contact_id(Feature::whole, number, Feature::whole, 0)) number += 6;
        pair.add(place(m), s, Feature::whole, number);
    }
}

} // namespace

void detect_wall(const RigidShape& a, const Pose& pose_a, const SampleWall& wall, double reach,
                 std::vector<RigidContact>& out)
{
    const double size = bounding_radius(a);
    const WallPair pair{pose_a, wall, reach, size, out};
    if (std::holds_alternative<Plane>(a)) return;
    const std::size_t begin = out.size();
    if (const auto* ball = std::get_if<Ball>(&a)) {
        pair.add(pose_a.place, wall(pose_a.place), Feature::whole, 0, ball->radius);
    } else if (wall(pose_a.place).distance <= 1.5 * size + reach) { // slope up to 1.5
        if (const auto* capsule = std::get_if<Capsule>(&a)) touch_wall_capsule(pair, *capsule);
        if (const auto* ellipsoid = std::get_if<Ellipsoid>(&a))
            touch_wall_ellipsoid(pair, *ellipsoid);
        if (const auto* cylinder = std::get_if<Cylinder>(&a)) {
            touch_cylinder(pair, *cylinder);
        } else if (const auto* box = std::get_if<Box>(&a)) {
            touch_wall_polyhedron(pair, BoxPolyhedron(box->half_extents).view());
        } else if (const auto* body = std::get_if<TriangleShape>(&a)) {
            const PolyhedronTopology topology = body->polyhedron.topology();
            touch_wall_polyhedron(pair, body->polyhedron.view(topology));
        }
    }
    drop_repeated(out, begin, size);
}

} // namespace amontons
