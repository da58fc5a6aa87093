#include "contact/rigid/first_touch.hpp"

#include "contact/rigid/broad_phase.hpp"
#include "contact/rigid/extent.hpp"
#include "mesh/closest_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

// Conservative advancement. For any unit n, the distance d of two convex bodies along n is a lower
// bound of their distance, and shrinks no faster than their points approach along n: so nothing
// touches before d / speed. The direction of the nearest points makes d largest. Bodies that are
// not convex are taken triangle by triangle.

namespace amontons {

namespace {

constexpr double kArrived = 1e-6; // of the smaller body's size
constexpr int kSteps = 1000;

// A convex piece of a body, in its frame: the points within `radius` of a core.
struct ConvexPiece {
    std::span<const Vec3> points; // the core's corners; none: a cylinder or an ellipsoid
    double radius = 0;
    double cylinder_radius = 0, half_length = 0;
    const Ellipsoid* ellipsoid = nullptr;
    const TriangleShape* body = nullptr; // the convex body whose corners all `points` are
    double farthest = 0;                 // from the frame's origin

    Vec3 support(const Vec3& direction) const
    {
        if (ellipsoid) return ellipsoid->support(direction);
        if (points.empty()) {
            const double r = std::hypot(direction[0], direction[1]);
            const double s = r > 0 ? cylinder_radius / r : 0;
            return {s * direction[0], s * direction[1],
                    direction[2] < 0 ? -half_length : half_length};
        }
        if (body) return points[static_cast<std::size_t>(lowest_vertex(*body, -direction))];
        std::size_t best = 0;
        double most = -std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < points.size(); ++i)
            if (const double x = direction.dot(points[i]); x > most) {
                most = x;
                best = i;
            }
        return points[best];
    }
};

struct Apart {
    double distance = 0; // along the normal, a lower bound of the true one; <= 0: none found
    Vec3 normal = Vec3::UnitZ();
};

// The point of a simplex nearest to the origin; corners that it does not need are dropped.
Vec3 nearest_of(std::array<Vec3, 4>& corner, std::size_t& count)
{
    if (count == 1) return corner[0];
    if (count == 2) corner[2] = corner[1]; // a segment is a triangle without area
    TrianglePoint best;
    std::array<std::size_t, 3> of{0, 1, 2};
    if (count <= 3) {
        best = closest_on_triangle(Vec3::Zero(), corner[0], corner[1], corner[2]);
    } else {
        constexpr std::size_t faces[4][4] = {
            {0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
        double least = std::numeric_limits<double>::infinity();
        bool inside = true;
        for (const auto& f : faces) {
            const Vec3 &a = corner[f[0]], &b = corner[f[1]], &c = corner[f[2]];
            const Vec3 n = (b - a).cross(c - a);
            // The origin and the fourth corner on different sides: outside of this face.
            if (n.dot(corner[f[3]] - a) * n.dot(-a) > 0) continue;
            inside = false;
            const TrianglePoint p = closest_on_triangle(Vec3::Zero(), a, b, c);
            if (p.point.squaredNorm() >= least) continue;
            least = p.point.squaredNorm();
            best = p;
            of = {f[0], f[1], f[2]};
        }
        if (inside) return Vec3::Zero();
    }
    std::array<Vec3, 4> kept;
    std::size_t n = 0;
    for (std::size_t k = 0; k < 3; ++k)
        if (best.weights[static_cast<Eigen::Index>(k)] > 0) kept[n++] = corner[of[k]];
    corner = kept;
    count = n;
    return best.point;
}

// Source: Gilbert, Johnson & Keerthi 1988; every support plane gives a lower bound.
Apart pieces_apart(const ConvexPiece& a, const Pose& pa, const ConvexPiece& b, const Pose& pb,
                   Vec3 guess)
{
    const Eigen::Quaterniond back_a = pa.turn.conjugate(), back_b = pb.turn.conjugate();
    const Vec3 shift = pa.place - pb.place;
    const auto lowest = [&](const Vec3& n) -> Vec3 { // of a - b along n
        return shift + pa.turn * a.support(back_a * -n) - pb.turn * b.support(back_b * n);
    };
    const double radius = a.radius + b.radius;
    Apart best{-std::numeric_limits<double>::infinity(), guess};
    std::array<Vec3, 4> corner;
    std::size_t count = 1;
    corner[0] = lowest(guess);
    best.distance = guess.dot(corner[0]) - radius;
    for (int i = 0; i < 64; ++i) {
        const Vec3 v = nearest_of(corner, count);
        const double length = v.norm();
        if (!(length > 0)) return best;
        const Vec3 n = v / length, w = lowest(n);
        const double bound = n.dot(w) - radius;
        if (bound > best.distance) best = {bound, n};
        if (length - radius - best.distance <= 1e-9 * length) return best;
        for (std::size_t k = 0; k < count; ++k)
            if (w == corner[k]) return best;
        if (count == 4) return best; // round-off: the origin is inside
        corner[count++] = w;
    }
    return best;
}

// One body's motion and how fast its points can be.
struct Motion {
    Pose from, to;
    Vec3 velocity; // of the frame's origin, per whole motion
    double angle;  // [rad]

    Motion(const Pose& begin, const Pose& end)
        : from(begin)
        , to(end)
        , velocity(end.place - begin.place)
        , angle(begin.turn.angularDistance(end.turn))
    {
    }
};

double advance(const ConvexPiece& a, const Motion& ma, const ConvexPiece& b, const Motion& mb,
               double arrived, double until)
{
    const Vec3 velocity = ma.velocity - mb.velocity;
    const double turning = ma.angle * a.farthest + mb.angle * b.farthest;
    double t = 0;
    Vec3 guess = Vec3::UnitZ();
    for (int i = 0; i < kSteps; ++i) {
        const Apart d = pieces_apart(a, pose_between(ma.from, ma.to, t), b,
                                     pose_between(mb.from, mb.to, t), guess);
        if (d.distance <= 2 * arrived) return t;
        guess = d.normal;
        const double speed = turning - velocity.dot(d.normal);
        if (speed <= 0) return 1; // apart along this normal until the end
        t += (d.distance - arrived) / speed;
        if (t >= until) return until;
    }
    return t;
}

// Against the half-space z <= 0 of b.
double advance_to_plane(const ConvexPiece& a, const Motion& ma, const Motion& mb, double arrived,
                        double until)
{
    // Points of a are this far from the plane's origin at most.
    const double far =
        std::max((ma.from.place - mb.from.place).norm(), (ma.to.place - mb.to.place).norm()) +
        a.farthest + a.radius;
    double t = 0;
    for (int i = 0; i < kSteps; ++i) {
        const Pose pa = pose_between(ma.from, ma.to, t), pb = pose_between(mb.from, mb.to, t);
        const Vec3 n = pb.turn * Vec3::UnitZ();
        const Vec3 low = pa.place + pa.turn * a.support(pa.turn.conjugate() * -n);
        const double distance = n.dot(low - pb.place) - a.radius;
        if (distance <= 2 * arrived) return t;
        // The normal turns, so the plane's part of the speed changes: bounded from above.
        const Vec3 velocity = ma.velocity - mb.velocity;
        const double approach = mb.angle > 0 ? velocity.norm() : -velocity.dot(n);
        const double speed = approach + ma.angle * a.farthest + mb.angle * far;
        if (speed <= 0) return 1;
        t += (distance - arrived) / speed;
        if (t >= until) return until;
    }
    return t;
}

// A body as convex pieces. The spans point into `store` and the shape.
struct Pieces {
    std::vector<Vec3> store;
    std::vector<ConvexPiece> all;
    explicit Pieces(const RigidShape& shape)
    {
        ConvexPiece piece;
        piece.farthest = bounding_radius(shape);
        if (const auto* box = std::get_if<Box>(&shape)) {
            const BoxPolyhedron corners(box->half_extents);
            store.assign(corners.vertices.begin(), corners.vertices.end());
            piece.points = store;
        } else if (const auto* ball = std::get_if<Ball>(&shape)) {
            store.assign(1, Vec3::Zero());
            piece.points = store;
            piece.radius = ball->radius;
            piece.farthest = 0; // turning moves no point of its surface
        } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) {
            piece.ellipsoid = ellipsoid;
        } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
            store = {Vec3{0, 0, -capsule->half_length}, Vec3{0, 0, capsule->half_length}};
            piece.points = store;
            piece.radius = capsule->radius;
            piece.farthest = capsule->half_length; // turning about its axis moves no point of it
        } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
            piece.cylinder_radius = cylinder->radius;
            piece.half_length = cylinder->half_length;
        } else if (const auto* body = std::get_if<TriangleShape>(&shape)) {
            piece.points = body->polyhedron.vertices;
            piece.body = body;
            if (!body->polyhedron.convex) {
                piece.body = nullptr;
                for (const auto& triangle : body->polyhedron.triangles) {
                    piece.points = triangle;
                    piece.farthest = 0;
                    for (const Vec3& x : triangle)
                        piece.farthest = std::max(piece.farthest, x.norm());
                    all.push_back(piece);
                }
                return;
            }
        }
        all.push_back(piece);
    }
};

// Holds a piece all along the motion; see swept_box.
AxisBox swept(const ConvexPiece& piece, const Motion& motion)
{
    const double room = piece.farthest * motion.angle * motion.angle / 8 + piece.radius;
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Pose& pose : {motion.from, motion.to}) {
        const auto add = [&](const Vec3& x, double around) {
            low = low.cwiseMin((x.array() - around).matrix());
            high = high.cwiseMax((x.array() + around).matrix());
        };
        if (piece.points.empty()) add(pose.place, piece.farthest);
        for (const Vec3& x : piece.points)
            add(pose.place + pose.turn * x, room);
    }
    return {low, high};
}

} // namespace

double first_touch(const RigidShape& a, const Pose& a0, const Pose& a1, const RigidShape& b,
                   const Pose& b0, const Pose& b1)
{
    const bool plane_a = std::holds_alternative<Plane>(a),
               plane_b = std::holds_alternative<Plane>(b);
    if (plane_a && plane_b) return 1;
    if (plane_a) return first_touch(b, b0, b1, a, a0, a1);
    const Motion ma(a0, a1), mb(b0, b1);
    const double arrived = kArrived / 2 * std::min(bounding_radius(a), bounding_radius(b));
    const Pieces pieces_a(a);
    double first = 1;
    if (plane_b) {
        for (const ConvexPiece& piece : pieces_a.all)
            first = std::min(first, advance_to_plane(piece, ma, mb, arrived, first));
        return first;
    }
    const Pieces pieces_b(b);
    const auto count = static_cast<std::int32_t>(pieces_a.all.size());
    std::vector<BoxPair> pairs{{0, count}};
    if (pieces_a.all.size() + pieces_b.all.size() > 2) {
        std::vector<AxisBox> boxes;
        for (const ConvexPiece& piece : pieces_a.all)
            boxes.push_back(swept(piece, ma));
        for (const ConvexPiece& piece : pieces_b.all)
            boxes.push_back(swept(piece, mb));
        for (AxisBox& box : boxes) {
            box.low.array() -= arrived;
            box.high.array() += arrived;
        }
        overlapping_pairs(boxes, pairs);
    }
    for (const BoxPair& pair : pairs) {
        if (pair.a >= count || pair.b < count) continue; // of the same body
        first = std::min(first, advance(pieces_a.all[static_cast<std::size_t>(pair.a)], ma,
                                        pieces_b.all[static_cast<std::size_t>(pair.b - count)], mb,
                                        arrived, first));
    }
    return first;
}

} // namespace amontons
