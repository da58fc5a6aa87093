#include "contact/rigid/polyhedron_pair.hpp"
#include "contact/rigid/spread.hpp"
#include "contact/rigid/turned_cylinder.hpp"
#include "mesh/base/index.hpp"
#include "mesh/base/limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

// Cylinders against planes, boxes, triangle bodies and each other.
//
// Against a flat face: the lowest point of each rim, exactly, and where an end faces it, fixed
// points of the rim. Against corners and edges: the side and the ends, exactly. A rim crosses an
// edge, or another cylinder's axis, where the way between them is normal to both: Newton's method.

namespace amontons {

namespace {

// The points of a cylinder that may touch a flat face with this normal: visit(x, kind, number).
template <class Visit>
void facing_points(const Cylinder& own, const Mat3& turn, const Vec3& shift, const Vec3& n,
                   Visit visit)
{
    const TurnedCylinder a(own, turn, shift);
    const Vec3 down = n.dot(a.axis) * a.axis - n; // normal to the axis
    const double tilt = down.norm();              // sine of the axis's angle to the normal
    for (std::size_t end = 0; end < 2; ++end) {
        const Vec3 centre = a.end_centre(end);
        const double fall = -a.side(end) * a.axis.dot(n); // > 0: this end is the lower one
        // A rim point of the higher end counts only if the cylinder nearly lies.
        if (fall < -kInclined) continue;
        if (own.spread > 0 && fall > 0 && tilt < kFlatOn) {
            spread_over(own, static_cast<int>(end), [&](const Vec3& x, std::size_t i) {
                visit(turn * x + shift, Feature::spread, i);
            });
            continue;
        }
        if (tilt > kSamePlace) visit(centre + a.radius / tilt * down, Feature::rim, end);
        if (fall < kOpposed) continue;
        for (std::size_t k = 0; k < 8; ++k) {
            const double angle = static_cast<double>(k) * std::numbers::pi / 4;
            visit(centre + a.radius * (std::cos(angle) * a.x_axis + std::sin(angle) * a.y_axis),
                  Feature::rim, 2 + 8 * end + k);
        }
    }
}

} // namespace

int crossing_starts(const TurnedCylinder& cylinder, const Vec3& from, const Vec3& along,
                    double starts[2])
{
    const Vec3 p = cylinder.across(from), d = along - along.dot(cylinder.axis) * cylinder.axis;
    const double square = d.squaredNorm();
    if (square < kParallel * kParallel) {
        starts[0] = 0;
        return 1;
    }
    const double nearest = -p.dot(d) / square;
    const double room =
        (cylinder.radius * cylinder.radius - (p + nearest * d).squaredNorm()) / square;
    if (room <= 0) {
        starts[0] = nearest;
        return 1;
    }
    starts[0] = nearest - std::sqrt(room);
    starts[1] = nearest + std::sqrt(room);
    return 2;
}

std::optional<RimCrossing> rim_crossing(const TurnedCylinder& cylinder, std::size_t end,
                                        const Vec3& from, const Vec3& along, double start)
{
    const Vec3 centre = cylinder.end_centre(end);
    const Vec3 first = cylinder.across(from + start * along);
    if (!(first.norm() > 1e-9 * cylinder.radius)) return {};
    double angle = std::atan2(first.dot(cylinder.y_axis), first.dot(cylinder.x_axis)), t = start;
    // The gradient and Hessian of half the squared distance over angle and t.
    for (int i = 0; i < 30; ++i) {
        const Vec3 radial = std::cos(angle) * cylinder.x_axis + std::sin(angle) * cylinder.y_axis;
        const Vec3 tangent = cylinder.axis.cross(radial);
        const Vec3 w = centre + cylinder.radius * radial - from - t * along;
        const double r = cylinder.radius;
        const double f = r * w.dot(tangent), g = -w.dot(along);
        double a = r * r - r * w.dot(radial);
        const double b = -r * tangent.dot(along);
        if (a <= 1e-3 * r * r) a = r * r; // beyond the centre of curvature: a plain step
        const double determinant = a - b * b;
        if (std::abs(determinant) < 1e-9 * r * r) return {};
        const double step = (f - b * g) / determinant;
        const double step_t = (a * g - b * f) / determinant;
        angle -= std::clamp(step, -0.5, 0.5);
        t -= step_t;
        if (std::abs(step) < 1e-13 && std::abs(step_t) < 1e-13 * r)
            return RimCrossing{centre + r * radial, from + t * along, tangent, t};
    }
    return {};
}

void touch(const PairFrame& pair, const Cylinder& a, const Plane&, RigidContacts& out)
{
    facing_points(a, pair.turn, pair.shift, Vec3::UnitZ(),
                  [&](const Vec3& x, Feature kind, std::size_t i) {
                      if (x[2] > pair.reach) return;
                      out.push_back({x, Vec3{x[0], x[1], 0}, Vec3::UnitZ(), x[2],
                                     contact_id(kind, i, Feature::whole, 0)});
                  });
}

namespace {

// ---- against polyhedra

struct CylinderPair {
    const Cylinder& own;
    TurnedCylinder a;
    PolyhedronPair pair; // its a is not used
    const PairFrame& frame;
};

void add_contact(CylinderPair& p, const Vec3& x, const Vec3& y, const Vec3& n, double gap,
                 Feature kind_a, std::size_t a, Feature kind_b, std::int32_t b)
{
    if (!(gap <= p.pair.reach) || gap < p.pair.least || !p.pair.agrees(n)) return;
    p.pair.out->push_back({x, y, n, gap, contact_id(kind_a, a, kind_b, at(b))});
}

// The lowest place of a cylinder along n: one of its points, the middle of a line or of an end.
Vec3 lowest_of_cylinder(const TurnedCylinder& a, const Vec3& n)
{
    const double c = n.dot(a.axis);
    const Vec3 down = c * a.axis - n;
    Vec3 x = a.centre;
    if (std::abs(c) > kSamePlace) x -= (c > 0 ? 1 : -1) * a.half_length * a.axis;
    if (down.norm() > kSamePlace) x += a.radius * down.normalized();
    return x;
}

// Directions along which the bodies are farthest apart or overlap least: faces, ends, and edges
// against the side. (A rim against an edge or corner only makes a positive distance larger.)
struct Best {
    double distance = -kInfinity;
    Vec3 normal = Vec3::UnitZ();
};

Best cylinder_separation(const TurnedCylinder& a, const PolyhedronView& b)
{
    Best best;
    const auto take = [&](double distance, const Vec3& n) {
        if (distance > best.distance) best = {distance, n};
    };
    for (std::size_t f = 0; f < b.normals.size(); ++f)
        take(a.lowest(b.normals[f]) - b.offsets[f], b.normals[f]);
    const auto try_normal = [&](const Vec3& n) {
        double high = -kInfinity;
        for (const Vec3& v : b.vertices)
            high = std::max(high, n.dot(v));
        take(a.lowest(n) - high, n);
    };
    try_normal(a.axis);
    try_normal(-a.axis);
    for (const PolyhedronEdge& edge : b.edges) {
        const Vec3 n = edge.along.cross(a.axis);
        const double sine = n.norm();
        if (sine < 1e-3) continue;
        try_normal(n / sine);
        try_normal(n / -sine);
    }
    for (const Vec3& v : b.vertices) {
        const Vec3 w = a.across(v);
        if (w.norm() > 1e-9 * a.radius) try_normal(-w.normalized());
    }
    return best;
}

// Of bodies that are not convex: may a point this deep under a face, or in the cylinder, move
// this way out?
bool nearest_way(const CylinderPair& p, double depth, double least_depth)
{
    return p.pair.convex || depth <= kTouching * p.pair.size + least_depth * (1 + 1e-6);
}

void touch_cylinder_faces(CylinderPair& p)
{
    const PolyhedronView& b = p.pair.b.view;
    const double slack = kSamePlace * p.pair.size;
    for (std::size_t f = 0; f < b.normals.size(); ++f) {
        const Vec3& n = b.normals[f];
        if (p.a.lowest(n) - b.offsets[f] > p.pair.reach) continue;
        facing_points(p.own, p.frame.turn, p.frame.shift, n,
                      [&](const Vec3& x, Feature kind, std::size_t i) {
                          const double h = n.dot(x) - b.offsets[f];
                          if (h > p.pair.reach) return;
                          const Vec3 foot = x - h * n;
                          if (!on_face(p.pair.b, number(f), foot, slack)) return;
                          if (h < -kTouching * p.pair.size && !p.pair.convex &&
                              !nearest_way(p, -h, -signed_distance(p.pair.b, x)))
                              return;
                          add_contact(p, x, foot, n, h, kind, i, Feature::face, number(f));
                      });
    }
}

void touch_vertices(CylinderPair& p)
{
    const PolyhedronView& b = p.pair.b.view;
    const double slack = kSamePlace * p.pair.size;
    for (std::size_t i = 0; i < b.vertices.size(); ++i) {
        const std::int32_t v = number(i);
        const Vec3& y = b.vertices[i];
        const Vec3 w = p.a.across(y);
        const double z = p.a.along(y), r = w.norm();
        const double beyond_side = r - p.a.radius, beyond_end = std::abs(z) - p.a.half_length;
        if (beyond_side > p.pair.reach || beyond_end > p.pair.reach) continue;
        const Vec3 radial = r > 1e-12 * p.a.radius ? Vec3{w / r} : p.a.x_axis;
        for (std::size_t end = 0; end < 2; ++end) {
            const Vec3 m = p.a.side(end) * p.a.axis;
            const double h = p.a.side(end) * z - p.a.half_length;
            if (h <= p.pair.reach && beyond_side <= slack && rises(b, v, m, kInclined) &&
                (h >= 0 || nearest_way(p, -h, std::max(0.0, -beyond_side))))
                add_contact(p, y - h * m, y, -m, h, Feature::face, end, Feature::vertex, v);
        }
        if (beyond_end <= slack && rises(b, v, radial, kStrict, p.a.axis) &&
            (beyond_side >= 0 || nearest_way(p, -beyond_side, std::max(0.0, -beyond_end))))
            add_contact(p, y - beyond_side * radial, y, -radial, beyond_side, Feature::face, 2,
                        Feature::vertex, v);
        if (beyond_side > 0 && beyond_end > 0) {
            const std::size_t end = z < 0 ? 0 : 1;
            const Vec3 x = p.a.end_centre(end) + p.a.radius * radial;
            const double distance = (x - y).norm();
            if (distance < kTouching * p.pair.size) continue;
            const Vec3 n = (x - y) / distance;
            if (rises(b, v, -n, kStrict))
                add_contact(p, x, y, n, distance, Feature::rim, end, Feature::vertex, v);
        }
    }
}

// Does the body at a convex edge lie behind n, or, at an outline of a face that is opposed to m,
// nearly so?
bool behind(const PolyhedronView& b, std::int32_t edge, const Vec3& n, const Vec3& m)
{
    const PolyhedronEdge& e = b.edges[at(edge)];
    if (n.dot(e.into[0]) <= kStrict && n.dot(e.into[1]) <= kStrict) return true;
    for (const std::int32_t f : b.topology->edges[at(edge)].face) {
        const Vec3& nf = b.normals[at(f)];
        if (nf.dot(m) > -kOpposed || n.dot(nf) < kOpposed) continue;
        if (n.cross(nf).norm() <= 2 * (m + nf).norm() + kStrict) return true;
    }
    return false;
}

void touch_cylinder_edges(CylinderPair& p)
{
    const PolyhedronView& b = p.pair.b.view;
    const double slack = kSamePlace * p.pair.size;
    for (std::size_t i = 0; i < b.edges.size(); ++i) {
        const auto& ends = b.topology->edges[i];
        const PolyhedronEdge& edge = b.edges[i];
        if (!ends.convex) continue;
        const Vec3& from = b.vertices[at(ends.vertex[0])];
        const Vec3 middle = from + edge.length / 2 * edge.along;
        const double far = edge.length / 2 + p.pair.reach + p.a.half_length + p.a.radius;
        if ((middle - p.a.centre).squaredNorm() > far * far) continue;
        const Vec3 outwards = b.normals[at(ends.face[0])] + b.normals[at(ends.face[1])];
        const auto deep = [&](double gap, const Vec3& x) {
            return gap < -kTouching * p.pair.size && !p.pair.convex &&
                   signed_distance(p.pair.b, x) > gap / 4;
        };

        // The side.
        const Vec3 cross = p.a.axis.cross(edge.along);
        const double sine = cross.norm();
        if (sine > kParallel) {
            const Vec3 n = cross / (cross.dot(outwards) < 0 ? -sine : sine);
            const Vec3 w = from - p.a.centre;
            const double s = w.cross(edge.along).dot(cross) / (sine * sine);
            const double t = w.cross(p.a.axis).dot(cross) / (sine * sine);
            const double gap = -n.dot(w) - p.a.radius;
            const Vec3 x = p.a.centre + s * p.a.axis - p.a.radius * n;
            if (std::abs(s) <= p.a.half_length + slack && t >= -slack && t <= edge.length + slack &&
                n.dot(edge.into[0]) <= kStrict && n.dot(edge.into[1]) <= kStrict && !deep(gap, x))
                add_contact(p, x, from + t * edge.along, n, gap, Feature::face, 2, Feature::edge,
                            number(i));
        }

        // The rims.
        for (std::size_t end = 0; end < 2; ++end) {
            const Vec3 m = p.a.side(end) * p.a.axis;
            double starts[2];
            const int count = crossing_starts(p.a, from, edge.along, starts);
            for (int k = 0; k < count; ++k) {
                const auto c = rim_crossing(p.a, end, from, edge.along, starts[k]);
                if (!c || c->t < -slack || c->t > edge.length + slack) continue;
                Vec3 n = c->tangent.cross(edge.along);
                const double size = n.norm();
                if (size < kParallel) continue;
                n /= n.dot(outwards) < 0 ? -size : size;
                const double gap = n.dot(c->on_rim - c->on_line);
                // The other side of the rim, or the cylinder before it.
                const Vec3 radial = (c->on_rim - p.a.end_centre(end)) / p.a.radius;
                const bool along = std::abs(edge.along.dot(p.a.axis)) >= kOpposed;
                if (n.dot(m) > (along ? kInclined : kStrict)) continue;
                const bool flat = n.dot(m) < -kOpposed;
                if (n.dot(radial) > (flat ? kInclined : kStrict)) continue;
                if (!behind(b, number(i), n, m) || deep(gap, c->on_rim)) continue;
                add_contact(p, c->on_rim, c->on_line, n, gap, Feature::rim,
                            2 * end + static_cast<std::size_t>(k) + 32, Feature::edge, number(i));
            }
        }
    }
}

void touch_cylinder_polyhedron(const PairFrame& frame, const Cylinder& own,
                               const PolyhedronSide& side, bool convex, RigidContacts& out)
{
    CylinderPair p{own,
                   TurnedCylinder(own, frame.turn, frame.shift),
                   {{}, side, frame.reach, frame.size, &out},
                   frame};
    const double slack = kTouching * frame.size;
    const std::size_t begin = out.size();
    Best best;
    if (convex) {
        best = cylinder_separation(p.a, side.view);
        if (best.distance > frame.reach) return;
        p.pair.convex = true;
        if (best.distance <= slack)
            p.pair.away = best.normal;
        else
            p.pair.least = -kSamePlace * frame.size;
    }
    touch_cylinder_faces(p);
    touch_vertices(p);
    touch_cylinder_edges(p);
    if (!convex || out.size() > begin || best.distance > slack) return;
    // Deep inside each other: the lowest place of the cylinder alone.
    const Vec3& n = best.normal;
    const Vec3 x = lowest_of_cylinder(p.a, n);
    out.push_back({x, x - best.distance * n, n, best.distance,
                   contact_id(Feature::whole, 0, Feature::whole, 0)});
}

} // namespace

void touch(const PairFrame& frame, const Cylinder& a, const Box& b, RigidContacts& out)
{
    const BoxPolyhedron own(b.half_extents);
    touch_cylinder_polyhedron(frame, a, {own.view(), nullptr, &b, Mat3::Identity(), Vec3::Zero()},
                              true, out);
}

void touch(const PairFrame& frame, const Cylinder& a, const TriangleShape& b, RigidContacts& out)
{
    const PolyhedronTopology topology = b.polyhedron.topology();
    touch_cylinder_polyhedron(
        frame, a, {b.polyhedron.view(topology), &b, nullptr, Mat3::Identity(), Vec3::Zero()},
        convex_and_small(b.polyhedron), out);
}

// ---- against each other

namespace {

// Sides that cross.
void touch_sides(const PairFrame& frame, const TurnedCylinder& a, const TurnedCylinder& b,
                 RigidContacts& out)
{
    const Vec3 cross = a.axis.cross(b.axis), w = b.centre - a.centre;
    const double square = cross.squaredNorm();
    if (square < kParallel * kParallel) return;
    const double s = w.cross(b.axis).dot(cross) / square, t = w.cross(a.axis).dot(cross) / square;
    if (std::abs(s) > a.half_length || std::abs(t) > b.half_length) return;
    const double height = -w.dot(cross);
    const Vec3 n = cross / (height < 0 ? -std::sqrt(square) : std::sqrt(square));
    const double gap = std::abs(height) / std::sqrt(square) - a.radius - b.radius;
    if (gap > frame.reach) return;
    out.push_back({a.centre + s * a.axis - a.radius * n, b.centre + t * b.axis + b.radius * n, n,
                   gap, contact_id(Feature::face, 2, Feature::face, 2)});
}

// The rims of a on the side of b.
template <class Add>
void rims_on_side(const TurnedCylinder& a, const TurnedCylinder& b, Add add_contact)
{
    for (std::size_t end = 0; end < 2; ++end) {
        const Vec3 m = a.side(end) * a.axis;
        double starts[2];
        const int count = crossing_starts(a, b.centre, b.axis, starts);
        for (int k = 0; k < count; ++k) {
            const auto c = rim_crossing(a, end, b.centre, b.axis, starts[k]);
            if (!c || std::abs(c->t) > b.half_length) continue;
            const Vec3 w = c->on_rim - c->on_line;
            const double distance = w.norm();
            if (distance < kTouching * b.radius) continue;
            const Vec3 n = w / distance;
            const Vec3 radial = (c->on_rim - a.end_centre(end)) / a.radius;
            const bool along = std::abs(a.axis.dot(b.axis)) >= kOpposed;
            if (n.dot(m) > (along ? kInclined : kStrict) || n.dot(radial) > kStrict) continue;
            add_contact(c->on_rim, c->on_line + b.radius * n, n, distance - b.radius, Feature::rim,
                        2 * end + static_cast<std::size_t>(k) + 32, Feature::face, 2);
        }
    }
}

// Points of the rims of a on the ends of b.
template <class Add>
void rims_on_ends(const Cylinder& own, const Mat3& turn, const Vec3& shift, const TurnedCylinder& b,
                  Add add_contact)
{
    for (std::size_t end = 0; end < 2; ++end) {
        const Vec3 n = b.side(end) * b.axis;
        facing_points(own, turn, shift, n, [&](const Vec3& x, Feature kind, std::size_t i) {
            const double h = n.dot(x - b.end_centre(end));
            if (b.across(x).norm() <= b.radius * (1 + kSamePlace))
                add_contact(x, x - h * n, n, h, kind, i, Feature::face, end);
        });
    }
}

// Places on two rims where the way between them is normal to both, by Newton's method on half the
// squared distance, from angles on each.
bool settle(const TurnedCylinder& a, std::size_t i, const TurnedCylinder& b, std::size_t j,
            double angle_a, double angle_b, Vec3& on_a, Vec3& on_b)
{
    const auto rim = [](const TurnedCylinder& c, double angle) -> Vec3 {
        return std::cos(angle) * c.x_axis + std::sin(angle) * c.y_axis;
    };
    for (int step = 0; step < 40; ++step) {
        const Vec3 ra = rim(a, angle_a), rb = rim(b, angle_b);
        const Vec3 ta = a.axis.cross(ra), tb = b.axis.cross(rb);
        on_a = a.end_centre(i) + a.radius * ra;
        on_b = b.end_centre(j) + b.radius * rb;
        const Vec3 w = on_a - on_b;
        const double f = a.radius * w.dot(ta), g = -b.radius * w.dot(tb);
        double aa = a.radius * (a.radius - w.dot(ra)), bb = b.radius * (b.radius + w.dot(rb));
        double ab = -a.radius * b.radius * ta.dot(tb);
        if (aa <= 0 || bb <= 0 || aa * bb - ab * ab <= 1e-9 * aa * bb) {
            // Not near a minimum: down the slope.
            aa = a.radius * a.radius + a.radius * w.norm();
            bb = b.radius * b.radius + b.radius * w.norm();
            ab = 0;
        }
        const double determinant = aa * bb - ab * ab;
        const double step_a = (bb * f - ab * g) / determinant;
        const double step_b = (aa * g - ab * f) / determinant;
        angle_a -= std::clamp(step_a, -0.5, 0.5);
        angle_b -= std::clamp(step_b, -0.5, 0.5);
        if (std::abs(step_a) + std::abs(step_b) < 1e-13) return true;
    }
    return false;
}

// Rims that cross: where two ends overlap, and at any angle.
template <class Add>
void rims_on_rims(const TurnedCylinder& a, const TurnedCylinder& b, Add add_contact)
{
    const auto angle_on = [](const TurnedCylinder& c, const Vec3& x) {
        return std::atan2(c.y_axis.dot(x - c.centre), c.x_axis.dot(x - c.centre));
    };
    for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t j = 0; j < 2; ++j) {
            const Vec3 ma = a.side(i) * a.axis, mb = b.side(j) * b.axis;
            const Vec3 ca = a.end_centre(i), cb = b.end_centre(j);
            const bool opposed = ma.dot(mb) < -kOpposed;
            const Vec3 middle = opposed ? Vec3{(mb - ma).normalized()} : mb;
            // Beside the line of centres, where circles in the plane between them would cross;
            // else from four sides.
            Vec3 start[4];
            std::size_t starts = 0;
            Vec3 w = ca - cb;
            w -= w.dot(middle) * middle;
            const double d = w.norm();
            if (opposed) {
                if (d <= std::abs(a.radius - b.radius)) continue;
                const double x = (d * d + b.radius * b.radius - a.radius * a.radius) / (2 * d);
                const double y = std::sqrt(std::max(0.0, b.radius * b.radius - x * x));
                const Vec3 e = w / d, f = middle.cross(e);
                for (const double side : {y, -y})
                    start[starts++] = cb + std::min(x, b.radius) * e + side * f;
            } else {
                for (const Vec3& r : {a.x_axis, a.y_axis})
                    for (const double side : {a.radius, -a.radius})
                        start[starts++] = ca + side * r;
            }
            for (std::size_t k = 0; k < starts; ++k) {
                Vec3 x, y;
                if (!settle(a, i, b, j, angle_on(a, start[k]), angle_on(b, start[k]), x, y))
                    continue;
                const Vec3 ra = (x - ca) / a.radius, rb = (y - cb) / b.radius;
                Vec3 n = a.axis.cross(ra).cross(b.axis.cross(rb));
                const double sine = n.norm();
                if (sine < kParallel) continue;
                n /= n.dot(mb + rb - ma - ra) < 0 ? -sine : sine;
                const bool behind = n.dot(ma) <= kStrict && n.dot(ra) <= kStrict &&
                                    n.dot(mb) >= -kStrict && n.dot(rb) >= -kStrict;
                const bool flat = opposed && n.dot(middle) > kOpposed &&
                                  n.cross(middle).norm() <= 2 * (ma + mb).norm() + kStrict;
                if (!behind && !flat) continue;
                const std::size_t side = (ca - cb).cross(x - cb).dot(mb - ma) < 0 ? 1 : 0;
                add_contact(x, y, n, n.dot(x - y), Feature::rim, 64 + 2 * i + side, Feature::rim,
                            64 + 2 * j + side);
            }
        }
}

} // namespace

void touch(const PairFrame& frame, const Cylinder& own_a, const Cylinder& own_b, RigidContacts& out)
{
    const TurnedCylinder a(own_a, frame.turn, frame.shift),
        b(own_b, Mat3::Identity(), Vec3::Zero());
    const double slack = kTouching * frame.size;
    // The direction of least overlap among ends, sides across and sides along.
    Best best;
    const auto try_normal = [&](const Vec3& n) {
        const double distance = a.lowest(n) - b.highest(n);
        if (distance > best.distance) best = {distance, n};
    };
    const auto both_ways = [&](const Vec3& v) {
        if (!(v.norm() > kParallel)) return;
        try_normal(v.normalized());
        try_normal(-v.normalized());
    };
    both_ways(b.axis);
    both_ways(a.axis);
    both_ways(a.axis.cross(b.axis));
    both_ways(b.across(a.centre));
    both_ways(a.across(b.centre));
    for (std::size_t end = 0; end < 2; ++end) {
        both_ways(b.across(a.end_centre(end)));
        both_ways(a.across(b.end_centre(end)));
    }
    if (best.distance > frame.reach) return;

    const std::size_t begin = out.size();
    const auto add_if = [&](const Vec3& x, const Vec3& y, const Vec3& n, double gap,
                            std::uint64_t id) {
        if (gap > frame.reach) return;
        if (best.distance <= slack ? n.dot(best.normal) <= 0.5 : gap < -kSamePlace * frame.size)
            return;
        out.push_back({x, y, n, gap, id});
    };
    const auto forward = [&](const Vec3& x, const Vec3& y, const Vec3& n, double gap, Feature ka,
                             std::size_t i, Feature kb,
                             std::size_t j) { add_if(x, y, n, gap, contact_id(ka, i, kb, j)); };
    const auto backward = [&](const Vec3& x, const Vec3& y, const Vec3& n, double gap, Feature ka,
                              std::size_t i, Feature kb,
                              std::size_t j) { add_if(y, x, -n, gap, contact_id(kb, j, ka, i)); };
    touch_sides(frame, a, b, out);
    if (best.distance <= slack && out.size() > begin && out.back().normal.dot(best.normal) <= 0.5)
        out.pop_back();
    rims_on_side(a, b, forward);
    rims_on_side(b, a, backward);
    rims_on_ends(own_a, frame.turn, frame.shift, b, forward);
    rims_on_ends(own_b, Mat3::Identity(), Vec3::Zero(), a, backward);
    rims_on_rims(a, b, forward);
    if (out.size() > begin || best.distance > slack) return;
    const Vec3& n = best.normal;
    const Vec3 middle = (lowest_of_cylinder(a, n) + lowest_of_cylinder(b, -n)) / 2;
    out.push_back(
        {middle + best.distance / 2 * n, middle - best.distance / 2 * n, n, best.distance, 0});
}

} // namespace amontons
