#include "contact/rigid/polyhedron_pair.hpp"
#include "contact/rigid/turned_cylinder.hpp"
#include "mesh/base/index.hpp"
#include "mesh/base/limits.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

// Ellipsoids against everything. They are strictly convex: with a convex body there is one contact.
//
// The signed distance d from an ellipsoid is a convex function of the place. Along faces its least
// is at the lowest point; along an edge or an axis it has one minimum, found by its monotone slope;
// along a rim it is sampled and refined. Apart, the nearest of all is the distance of the bodies.
// Where they overlap, a place counts if the other body lies behind the normal there, and the way
// out is the one of least overlap. Two ellipsoids: the normal n along which they are farthest
// apart, by Newton's method on the sphere of normals.

namespace amontons {

NearestPlace nearest_on(const Ellipsoid& ellipsoid, const Vec3& x)
{
    // The foot is x_i e_i^2 / (e_i^2 + t), with t the root of sum (e_i x_i / (e_i^2 + t))^2 = 1
    // above -min e^2: the function falls and is convex, so Newton's method from its left does not
    // pass. Source: Eberly, Distance from a Point to an Ellipsoid, in units of the least half axis.
    const Vec3& e = ellipsoid.radii;
    Eigen::Index k = 0;
    const double least = e.minCoeff(&k);
    const Vec3 r = (e / least).cwiseAbs2(), z = x.cwiseAbs().cwiseQuotient(e);
    double s = (r.array() * (z.array() - 1)).maxCoeff();
    bool on_middle = false; // of the least axis: the root may not exist, and there are two feet
    if (!(z[k] > 0)) {
        double there = 0;
        for (int i = 0; i < 3; ++i)
            if (r[i] > 1) there += std::pow(r[i] * z[i] / (r[i] - 1), 2);
        on_middle = there < 1 && (r.array() > 1 || z.array() == 0).all();
    }
    if (on_middle) {
        s = -1;
    } else {
        for (int step = 0; step < 200; ++step) {
            double g = -1, slope = 0;
            for (int i = 0; i < 3; ++i) {
                if (!(z[i] > 0)) continue;
                const double q = r[i] * z[i] / (s + r[i]);
                g += q * q;
                slope -= 2 * q * q / (s + r[i]);
            }
            const double next = s - g / slope;
            if (!(next > s)) break;
            s = next;
        }
    }
    NearestPlace near;
    Vec3 foot;
    double rest = 1;
    for (int i = 0; i < 3; ++i) {
        foot[i] = s + r[i] > 0 ? r[i] * x[i] / (s + r[i]) : 0;
        if (i != k) rest -= foot[i] * foot[i] / (e[i] * e[i]);
    }
    if (on_middle) foot[k] = least * std::sqrt(std::max(0.0, rest));
    near.point = foot;
    near.normal = foot.cwiseQuotient(e.cwiseAbs2()).normalized();
    near.distance = on_middle ? -(foot - x).norm()
                              : s * least * least * foot.cwiseQuotient(e.cwiseAbs2()).norm();
    return near;
}

namespace {

constexpr double kCreased = 1e-6; // cosine of a normal and a line to which it is normal

// An ellipsoid in the frame of the other body.
struct TurnedEllipsoid {
    const Ellipsoid& own;
    Mat3 turn;
    Vec3 centre;

    Vec3 lowest(const Vec3& n) const
    {
        return centre + turn * own.support(-(turn.transpose() * n));
    }
    // The nearest place on it, its normal outwards from the ellipsoid.
    NearestPlace nearest(const Vec3& x) const
    {
        NearestPlace near = nearest_on(own, turn.transpose() * (x - centre));
        near.point = centre + turn * near.point;
        near.normal = turn * near.normal;
        return near;
    }
    double size() const { return own.radii.maxCoeff(); }
};

// Where a feature of the other body faces the ellipsoid; the gap is less by `radius`.
struct Facing {
    RigidContact contact;
    bool behind = true; // the other body lies behind the normal
};

RigidContact facing_contact(const Vec3& place, const NearestPlace& on_a, double radius,
                            Feature kind, std::size_t i)
{
    const Vec3 n = -on_a.normal;
    return {on_a.point, place + radius * n, n, on_a.distance - radius,
            contact_id(Feature::whole, 0, kind, i)};
}

// The minimum of the distance on from + t along, t in [low, high]: its slope rises.
double nearest_on_line(const TurnedEllipsoid& a, const Vec3& from, const Vec3& along, double low,
                       double high)
{
    const auto slope = [&](double t) { return along.dot(a.nearest(from + t * along).normal); };
    double at_low = slope(low), at_high = slope(high);
    if (at_low >= 0) return low;
    if (at_high <= 0) return high;
    // The Illinois method, and bisection where it is slow.
    const double small = 1e-15 * (std::abs(low) + std::abs(high) + a.size());
    int side = 0;
    for (int step = 0; step < 200 && high - low > small; ++step) {
        const double t =
            step % 3 == 2 ? (low + high) / 2 : (low * at_high - high * at_low) / (at_high - at_low);
        if (!(t > low && t < high)) break;
        const double there = slope(t);
        if (there == 0) return t;
        if (there < 0) {
            low = t;
            at_low = there;
            if (side == -1) at_high /= 2;
            side = -1;
        } else {
            high = t;
            at_high = there;
            if (side == 1) at_low /= 2;
            side = 1;
        }
    }
    return at_high < -at_low ? high : low;
}

// Of a convex body: the nearest place if the bodies are apart along its normal, else the way out of
// least overlap.
// @param highest  of the other body along a unit vector
// @param out_of_faces  called for a contact if no place will do
template <class Highest, class Fallback>
void add_nearest(const PairFrame& pair, const std::vector<Facing>& all, Highest highest,
                 Fallback out_of_faces, RigidContacts& out)
{
    const Facing *nearest = nullptr, *least = nullptr;
    for (const Facing& f : all) {
        const double gap = f.contact.gap;
        if (gap >= 0 && (!nearest || gap < nearest->contact.gap)) nearest = &f;
        if (f.behind && (!least || gap > least->contact.gap)) least = &f;
    }
    if (nearest) {
        const RigidContact& c = nearest->contact;
        const double apart = c.normal.dot(c.point_a) - highest(c.normal);
        if (apart < c.gap - kSamePlace * pair.size) nearest = nullptr;
    }
    if (nearest || least) {
        const RigidContact& c = nearest ? nearest->contact : least->contact;
        if (c.gap <= pair.reach) out.push_back(c);
    } else if (!all.empty()) {
        out_of_faces();
    }
}

void touch_ellipsoid_polyhedron(const PairFrame& pair, const Ellipsoid& own,
                                const PolyhedronSide& side, bool convex, RigidContacts& out)
{
    const TurnedEllipsoid a{own, pair.turn, pair.shift};
    const PolyhedronView& b = side.view;
    const PolyhedronTopology& topology = *b.topology;
    const double slack = kSamePlace * pair.size, far = a.size() + pair.reach;
    if (convex)
        for (std::size_t f = 0; f < b.normals.size(); ++f)
            if (b.normals[f].dot(a.lowest(b.normals[f])) - b.offsets[f] > pair.reach) return;
    std::vector<Facing> all;

    // ---- Faces, edges, vertices
    for (std::size_t f = 0; f < b.normals.size(); ++f) {
        const Vec3 &n = b.normals[f], x = a.lowest(n);
        const double h = n.dot(x) - b.offsets[f];
        if (h > pair.reach || !on_face(side, number(f), x - h * n, slack)) continue;
        all.push_back({{x, x - h * n, n, h, contact_id(Feature::whole, 0, Feature::face, f)}});
    }
    for (std::size_t i = 0; i < b.edges.size(); ++i) {
        const auto& ends = topology.edges[i];
        const PolyhedronEdge& edge = b.edges[i];
        const Vec3& from = b.vertices[at(ends.vertex[0])];
        const double s = std::clamp(edge.along.dot(a.centre - from), 0.0, edge.length);
        if (!ends.convex || (from + s * edge.along - a.centre).norm() > far) continue;
        const double t = nearest_on_line(a, from, edge.along, 0, edge.length);
        if (t <= 0 || t >= edge.length) continue; // its corners are examined below
        const Vec3 x = from + t * edge.along;
        RigidContact c = facing_contact(x, a.nearest(x), 0, Feature::edge, i);
        // Deep inside, the distance has a crease, where no normal is across the edge.
        const bool behind = std::abs(c.normal.dot(edge.along)) < kCreased &&
                            c.normal.dot(edge.into[0]) <= kStrict &&
                            c.normal.dot(edge.into[1]) <= kStrict;
        all.push_back({c, behind});
    }
    for (std::size_t v = 0; v < b.vertices.size(); ++v) {
        if ((b.vertices[v] - a.centre).norm() > far) continue;
        RigidContact c =
            facing_contact(b.vertices[v], a.nearest(b.vertices[v]), 0, Feature::vertex, v);
        all.push_back({c, rises(b, number(v), -c.normal, kStrict)});
    }

    // ---- Bodies that are not convex
    if (!convex) {
        const std::size_t begin = out.size();
        for (const Facing& f : all) {
            const double gap = f.contact.gap;
            if (!f.behind || gap > pair.reach) continue;
            // Deep inside, places of far sides are none of its ways out.
            if (gap < -kTouching * pair.size && signed_distance(side, f.contact.point_a) > gap / 4)
                continue;
            out.push_back(f.contact);
        }
        if (out.size() > begin || !side.mesh) return;
        // So deep that no place is its own way out: through the face nearest to the centre.
        const NearestPlace near = nearest_on(*side.mesh, a.centre);
        if (near.distance > 0 && a.nearest(near.point).distance > 0) return;
        const NearestTriangle found = side.mesh->tree.nearest(a.centre, -1);
        const auto f = at(side.mesh->polyhedron.face_of[at(found.triangle)]);
        const Vec3 &n = b.normals[f], x = a.lowest(n);
        const double gap = n.dot(x) - b.offsets[f];
        if (gap <= pair.reach)
            out.push_back(
                {x, x - gap * n, n, gap, contact_id(Feature::whole, 0, Feature::face, f)});
        return;
    }
    const auto highest = [&](const Vec3& n) {
        double high = -kInfinity;
        for (const Vec3& v : b.vertices)
            high = std::max(high, n.dot(v));
        return high;
    };
    add_nearest(
        pair, all, highest,
        [&] {
            double best = -kInfinity;
            std::size_t face = 0;
            for (std::size_t f = 0; f < b.normals.size(); ++f)
                if (const double d = b.normals[f].dot(a.lowest(b.normals[f])) - b.offsets[f];
                    d > best) {
                    best = d;
                    face = f;
                }
            const Vec3 &n = b.normals[face], x = a.lowest(n);
            if (best > 0) return; // what is nearest is beyond reach
            out.push_back(
                {x, x - best * n, n, best, contact_id(Feature::whole, 0, Feature::face, face)});
        },
        out);
}

} // namespace

void touch(const PairFrame& pair, const Ball& a, const Ellipsoid& b, RigidContacts& out)
{
    const NearestPlace near = nearest_on(b, pair.shift);
    const double gap = near.distance - a.radius;
    if (gap > pair.reach) return;
    out.push_back({pair.shift - a.radius * near.normal, near.point, near.normal, gap, 0});
}

void touch(const PairFrame& pair, const Ellipsoid& a, const Plane&, RigidContacts& out)
{
    const Vec3 x = TurnedEllipsoid{a, pair.turn, pair.shift}.lowest(Vec3::UnitZ());
    if (x[2] > pair.reach) return;
    out.push_back({x, Vec3{x[0], x[1], 0}, Vec3::UnitZ(), x[2], 0});
}

void touch(const PairFrame& pair, const Ellipsoid& a, const Box& b, RigidContacts& out)
{
    const BoxPolyhedron own(b.half_extents);
    touch_ellipsoid_polyhedron(pair, a, {own.view(), nullptr, &b, Mat3::Identity(), Vec3::Zero()},
                               true, out);
}

void touch(const PairFrame& pair, const Ellipsoid& a, const TriangleShape& b, RigidContacts& out)
{
    std::vector<std::int32_t> near;
    b.tree.within(pair.shift, a.radii.maxCoeff() + pair.reach, near);
    if (near.empty() && nearest_on(b, pair.shift).distance > 0) return;
    const PolyhedronTopology topology = b.polyhedron.topology();
    touch_ellipsoid_polyhedron(
        pair, a, {b.polyhedron.view(topology), &b, nullptr, Mat3::Identity(), Vec3::Zero()},
        convex_and_small(b.polyhedron), out);
}

void touch(const PairFrame& pair, const Ellipsoid& own, const Capsule& b, RigidContacts& out)
{
    const TurnedEllipsoid a{own, pair.turn, pair.shift};
    const double z = nearest_on_line(a, Vec3::Zero(), Vec3::UnitZ(), -b.half_length, b.half_length);
    const bool end = std::abs(z) >= b.half_length;
    const Vec3 x{0, 0, z};
    RigidContact c =
        facing_contact(x, a.nearest(x), b.radius, end ? Feature::vertex : Feature::face,
                       end ? (z < 0 ? 0 : 1) : 2);
    if (!end && std::abs(c.normal[2]) >= kCreased) {
        // The axis crosses the middle of the ellipsoid: out across it, by the shortest way.
        const auto normal = [](double angle) -> Vec3 {
            return {std::cos(angle), std::sin(angle), 0};
        };
        const auto slope = [&](double angle) {
            return Vec3{-std::sin(angle), std::cos(angle), 0}.dot(a.lowest(normal(angle)));
        };
        constexpr int kPlaces = 24;
        double best = -kInfinity;
        for (int k = 0; k < kPlaces; ++k) {
            double low = 2 * std::numbers::pi * k / kPlaces,
                   high = 2 * std::numbers::pi * (k + 1) / kPlaces;
            if (!(slope(low) > 0 && slope(high) <= 0)) continue;
            for (int step = 0; step < 60; ++step) {
                const double middle = (low + high) / 2;
                (slope(middle) > 0 ? low : high) = middle;
            }
            const Vec3 n = normal(high), x = a.lowest(n);
            const double gap = n.dot(x) - b.radius;
            if (gap <= best) continue;
            best = gap;
            c.normal = n;
            c.gap = gap;
            c.point_a = x;
            c.point_b = x - gap * n;
        }
    }
    if (c.gap <= pair.reach) out.push_back(c);
}

void touch(const PairFrame& pair, const Ellipsoid& own, const Cylinder& b, RigidContacts& out)
{
    const TurnedEllipsoid a{own, pair.turn, pair.shift};
    if (a.centre.norm() > a.size() + std::hypot(b.radius, b.half_length) + pair.reach) return;
    std::vector<Facing> all;
    for (std::size_t end = 0; end < 2; ++end) {
        const Vec3 n = signed_axis(2, end == 1), x = a.lowest(n);
        const double h = n.dot(x) - b.half_length;
        const Vec3 foot = x - h * n;
        if (foot.head<2>().norm() <= b.radius)
            all.push_back({{x, foot, n, h, contact_id(Feature::whole, 0, Feature::face, end)}});
        // The rim: sampled, and refined around each of its minima.
        const auto on_rim = [&](double angle) -> Vec3 {
            return {b.radius * std::cos(angle), b.radius * std::sin(angle), n[2] * b.half_length};
        };
        const auto slope = [&](double angle) {
            const Vec3 tangent{-std::sin(angle), std::cos(angle), 0};
            return tangent.dot(a.nearest(on_rim(angle)).normal);
        };
        constexpr int kPlaces = 24;
        for (int k = 0; k < kPlaces; ++k) {
            double low = 2 * std::numbers::pi * k / kPlaces,
                   high = 2 * std::numbers::pi * (k + 1) / kPlaces;
            double at_low = slope(low);
            const double at_high = slope(high);
            if (!(at_low < 0 && at_high >= 0)) continue;
            double angle = (low + high) / 2;
            for (int step = 0; step < 60 && high - low > 1e-15; ++step) {
                angle = (low + high) / 2;
                (slope(angle) < 0 ? low : high) = angle;
            }
            const Vec3 place = on_rim(angle);
            RigidContact c = facing_contact(place, a.nearest(place), 0, Feature::rim, end);
            const Vec3 radial{std::cos(angle), std::sin(angle), 0};
            all.push_back({c, c.normal.dot(n) >= -kStrict && c.normal.dot(radial) >= -kStrict});
        }
    }
    const double z = nearest_on_line(a, Vec3::Zero(), Vec3::UnitZ(), -b.half_length, b.half_length);
    if (std::abs(z) < b.half_length) {
        const Vec3 x{0, 0, z};
        RigidContact c = facing_contact(x, a.nearest(x), b.radius, Feature::face, 2);
        all.push_back({c, std::abs(c.normal[2]) < kCreased});
    }
    const TurnedCylinder other(b, Mat3::Identity(), Vec3::Zero());
    add_nearest(
        pair, all, [&](const Vec3& n) { return other.highest(n); },
        [&] {
            RigidContact best;
            best.gap = -kInfinity;
            const auto take = [&](const Vec3& n) {
                const Vec3 x = a.lowest(n);
                const double gap = n.dot(x) - other.highest(n);
                if (gap > best.gap) best = {x, x - gap * n, n, gap, 0};
            };
            take(Vec3::UnitZ());
            take(-Vec3::UnitZ());
            for (int k = 0; k < 24; ++k) {
                const double angle = std::numbers::pi * k / 12;
                take({std::cos(angle), std::sin(angle), 0});
            }
            if (best.gap <= 0) out.push_back(best);
        },
        out);
}

void touch(const PairFrame& pair, const Ellipsoid& own_a, const Ellipsoid& own_b,
           RigidContacts& out)
{
    const TurnedEllipsoid a{own_a, pair.turn, pair.shift}, b{own_b, Mat3::Identity(), Vec3::Zero()};
    if (a.centre.norm() > a.size() + b.size() + pair.reach) return;
    const Mat3 square_a = a.turn * a.own.radii.cwiseAbs2().asDiagonal() * a.turn.transpose(),
               square_b = b.own.radii.cwiseAbs2().asDiagonal();
    // How far apart the bodies are along n, and its derivatives: the way between their extreme
    // points, less what these move as n turns.
    const auto apart = [&](const Vec3& n) -> Vec3 { return a.lowest(n) - b.lowest(-n); };
    const auto bend = [](const Mat3& square, const Vec3& n) -> Mat3 {
        const Vec3 x = square * n;
        const double h = std::sqrt(n.dot(x));
        return (square - x * x.transpose() / (h * h)) / h;
    };
    const auto farthest = [&](Vec3 n) {
        double value = n.dot(apart(n));
        for (int step = 0; step < 100; ++step) {
            const Vec3 way = apart(n);
            Eigen::Matrix<double, 3, 2> tangent;
            tangent.col(0) = n.unitOrthogonal();
            tangent.col(1) = n.cross(tangent.col(0));
            const Eigen::Vector2d slope = tangent.transpose() * way;
            if (slope.norm() <= 1e-15 * pair.size) break;
            Eigen::Matrix2d curve =
                tangent.transpose() * (bend(square_a, n) + bend(square_b, n)) * tangent;
            curve.diagonal().array() += value;
            // Of a maximum it is positive; else uphill.
            if (!(curve.determinant() > 1e-12 * pair.size * pair.size && curve.trace() > 0))
                curve = pair.size * Eigen::Matrix2d::Identity();
            Eigen::Vector2d change = curve.inverse() * slope;
            if (change.norm() > 0.5) change *= 0.5 / change.norm();
            bool moved = false;
            for (int halved = 0; halved < 40; ++halved, change /= 2) {
                const Vec3 next = (n + tangent * change).normalized();
                const Vec3 way_there = apart(next);
                const double there = next.dot(way_there);
                // At round-off of the distance the slope still shows the side.
                const double slack = 1e-14 * pair.size;
                if (!(there > value + slack) &&
                    !(there > value - slack &&
                      (way_there - there * next).norm() < 0.9 * slope.norm()))
                    continue;
                value = there;
                n = next;
                moved = true;
                break;
            }
            if (!moved) break;
        }
        return std::pair(value, n);
    };
    const Vec3 towards = a.centre.norm() > 0 ? Vec3(a.centre.normalized()) : Vec3(Vec3::UnitZ());
    auto best = farthest(towards);
    // Apart there is one maximum; where they overlap there may be several.
    if (best.first < -0.05 * std::min(own_a.radii.minCoeff(), own_b.radii.minCoeff()))
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z) {
                    if (x == 0 && y == 0 && z == 0) continue;
                    const auto found = farthest(Vec3{double(x), double(y), double(z)}.normalized());
                    if (found.first > best.first + kTouching * pair.size) best = found;
                }
    if (best.first > pair.reach) return;
    const Vec3& n = best.second;
    out.push_back({a.lowest(n), b.lowest(-n), n, best.first, 0});
}

} // namespace amontons
