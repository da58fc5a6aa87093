#include "mesh/generate/vessel_distance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace amontons {

namespace {

constexpr int kMostFootSteps = 12, kMostSlides = 30, kMostHalves = 6, kMostDoublings = 4;
constexpr double kFootConverged = 1e-3; // of the lengths at hand: a step of Newton's squares it
constexpr double kSampledBand = 12; // grid spacings; a spline's reach twice, no contact is farther
constexpr double kSteepest = 1.05;  // no tube's distance changes faster than this (slopes)
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

} // namespace

/// What is known around the points of a cube.
struct VesselDistance::Near {
    Vec3 centre = Vec3::Zero();
    double size = 0;                // farthest of the points from the centre [m]
    std::vector<std::size_t> tubes; // that have a part in the distance of one of the points
    VesselParts parts;              // of those tubes; of all once a junction is searched for
    bool all_parts = false;
    VesselParts feet;                   // of what is as near as the wall, once they are requested
    std::vector<EdgeSeeds::Near> seeds; // that reach into a ball around the centre
    double reach = -1;                  // its radius [m]
    std::vector<double> at_x; // distances of the tubes at one of the points, not a number: unknown

    const TubePart& part(std::size_t i) const { return parts.part[i]; }
    double of_tube(const VesselShape& shape, std::size_t i, const Vec3& x)
    {
        if (std::isnan(at_x[i])) at_x[i] = shape.fast()[i].distance(x, part(i));
        return at_x[i];
    }
};

namespace {

/// The two largest of some values, and whose the first is.
struct TwoLargest {
    std::size_t best = 0;
    double first = -kInfinite, second = -kInfinite;

    void take(std::size_t i, double value)
    {
        if (value > first) {
            second = first;
            first = value;
            best = i;
        } else {
            second = std::max(second, value);
        }
    }
};

} // namespace

VesselDistance::VesselDistance(VesselShape shape, const Vec3& origin, double edge)
    : shape_{std::move(shape)}
    , seeds_{shape_, origin, edge}
{
}

// From a point of the wall to a nearest one: Newton's method in the tangent plane, down the
// distance where that is not convex, each step no longer than lessens it.
// @return  the distance
double VesselDistance::slide_(const Vec3& x, Vec3 p) const
{
    const double longest = shape_.blend_width() / 2;
    double least = (x - p).norm();
    for (int k = 0; k < kMostSlides; ++k) {
        const ImplicitSample s = shape_.sample(p);
        const double steep = s.gradient.norm();
        if (!(steep > 0)) break;
        const Vec3 n = s.gradient / steep, e = x - p, u = n.unitOrthogonal(), v = n.cross(u);
        const Mat3 bent = Mat3::Identity() + e.dot(n) / steep * s.hessian;
        const double a = u.dot(bent * u), b = u.dot(bent * v), c = v.dot(bent * v),
                     det = a * c - b * b, eu = e.dot(u), ev = e.dot(v);
        if (std::hypot(eu, ev) <= kFootConverged * least) break; // its square is the error
        const bool convex = a > 0 && det > 0;
        Vec3 step = convex ? Vec3{((c * eu - b * ev) * u + (a * ev - b * eu) * v) / det}
                           : Vec3{eu * u + ev * v};
        step *= std::min(1.0, longest / step.norm());
        bool nearer = false;
        for (int half = 0; half < kMostHalves && !nearer; ++half, step /= 2) {
            const Vec3 q = shape_.project(p + step);
            const double found = (x - q).norm();
            nearer = found < least;
            if (!nearer) continue;
            least = found;
            p = q;
        }
        if (!nearer) break;
    }
    return least;
}

// Nearest point p of {F = 0} to x: p - x + mu grad F(p) = 0, F(p) = 0.
// @param squared  distance of the seed
// @return  the distance
double VesselDistance::from_edge_(const Vec3& x, const Vec3& seed, double squared, Near& near) const
{
    const double seed_distance = std::sqrt(squared), longest = shape_.blend_width();
    Vec3 p = seed;
    ImplicitSample s = shape_.sample(p, near.feet);
    double mu = (x - p).dot(s.gradient) / s.gradient.squaredNorm();
    for (int k = 0; k < kMostFootSteps; ++k) {
        // By the columns of I + mu H: rows of its inverse are their cross products.
        const Mat3 bent = Mat3::Identity() + mu * s.hessian;
        Mat3 inverse;
        for (int a = 0; a < 3; ++a)
            inverse.row(a) = bent.col((a + 1) % 3).cross(bent.col((a + 2) % 3));
        inverse /= inverse.row(0).dot(bent.col(0));
        const Vec3 across = inverse * (p - x + mu * s.gradient), along = inverse * s.gradient;
        const double change = (s.gradient.dot(across) - s.value) / s.gradient.dot(along);
        const Vec3 step = across - change * along;
        const double length = step.norm();
        if (!(length <= longest)) break; // also when it is not a number
        p -= step;
        mu -= change;
        if (length <= kFootConverged * (length + seed_distance + longest)) {
            const double found = (x - p).norm();
            if (found <= seed_distance) return found;
            break; // a farthest point, beyond a centre of curvature
        }
        s = shape_.sample(p, near.feet);
    }
    return slide_(x, seed);
}

/// @param f  distance of one of the points [m]
void VesselDistance::find_feet_(Near& near, double f) const
{
    if (near.feet.squared < 0)
        near.feet = shape_.parts_around(near.centre, kSteepest * std::abs(f) + 3 * near.size +
                                                         shape_.blend_width());
}

// Whether the nearest point on the wall of tube i is on that of the vessel: no other tube reaches
// it. Mostly known from the distances at x.
// @param f  distance of x
bool VesselDistance::foot_on_wall_(const Vec3& x, std::size_t i, double f, Near& near) const
{
    const std::vector<VesselTube>& tubes = shape_.fast();
    const double k = shape_.blend_width(), way = kSteepest * std::abs(f);
    bool sure = true;
    for (std::size_t j = 0; j < tubes.size(); ++j) {
        if (j == i || shape_.upper_bound(j, x) + way <= -k) continue;
        const double other = near.of_tube(shape_, j, x);
        if (other - way > -k) return false;
        sure = sure && other + way <= -k;
    }
    if (sure) return true;
    const Vec3 foot = x - f * tubes[i].normal(x, near.part(i));
    for (std::size_t j = 0; j < tubes.size(); ++j)
        if (j != i && shape_.upper_bound(j, foot) > -k &&
            tubes[j].distance(foot, near.feet.of(j, foot)) > -k)
            return false;
    return true;
}

double VesselDistance::near_junction_(const Vec3& x, double value, Near& near) const
{
    find_feet_(near, value);
    if (!near.all_parts) near.parts = shape_.parts_around(near.centre, near.size);
    near.all_parts = true;
    // ---- Nearest points of single tubes
    const std::vector<VesselTube>& tubes = shape_.fast();
    const double k = shape_.blend_width();
    double least = kInfinite;
    for (std::size_t i = 0; i < tubes.size(); ++i) {
        if (shape_.upper_bound(i, x) <= -least) continue;
        const double f = near.of_tube(shape_, i, x);
        if (std::abs(f) < least && foot_on_wall_(x, i, f, near)) least = std::abs(f);
    }

    // ---- The nearest point where tubes join
    double reach = std::abs(value) + k + near.size;
    for (int doubled = 0; doubled <= kMostDoublings; ++doubled, reach *= 2) {
        const double useful = std::min(reach, least) + near.size; // what is farther is not nearest
        if (near.reach < useful) {
            near.reach = useful;
            near.seeds = seeds_.around(near.centre, near.reach);
        }
        double squared = least * least;
        if (const Vec3* seed = EdgeSeeds::nearest(x, near.centre, near.seeds, squared))
            if (squared <= reach * reach) {
                least = std::min(least, from_edge_(x, *seed, squared, near));
                break;
            }
        if (least <= reach) break;
    }
    if (!std::isfinite(least)) return value; // no wall is near
    return value > 0 ? least : -least;
}

double VesselDistance::distance(const Vec3& x) const
{
    Near near{x};
    near.parts.part.resize(shape_.fast().size());
    near.at_x.resize(shape_.fast().size());
    for (std::size_t i = 0; i < shape_.fast().size(); ++i)
        near.tubes.push_back(i);
    return distance_(x, kInfinite, near);
}

double VesselDistance::clearance(const Vec3& x, std::int32_t& near) const
{
    const std::vector<VesselTube>& tubes = shape_.fast();
    double most = -kInfinite;
    const auto take = [&](std::size_t i) {
        if (shape_.upper_bound(i, x) <= most) return;
        if (const double f = tubes[i].distance(x); f > most) {
            most = f;
            near = static_cast<std::int32_t>(i);
        }
    };
    const std::int32_t last = near;
    if (last >= 0 && static_cast<std::size_t>(last) < tubes.size())
        take(static_cast<std::size_t>(last));
    for (std::size_t i = 0; i < tubes.size(); ++i)
        if (static_cast<std::int32_t>(i) != last) take(i);
    return most / kSteepest;
}

double VesselDistance::distance_(const Vec3& x, double band, Near& near) const
{
    const double k = shape_.blend_width();
    std::ranges::fill(near.at_x, kUnknown);
    TwoLargest of_tubes;
    for (const std::size_t i : near.tubes)
        if (!(shape_.upper_bound(i, x) < of_tubes.second))
            of_tubes.take(i, near.of_tube(shape_, i, x));
    const auto [best, f, second] = of_tubes;
    if (std::abs(f) > band) return f;
    if (second > f - k) {
        find_feet_(near, f);
        return near_junction_(x, value_(x, near), near);
    }
    // The foot on this tube is on the wall when no other tube reaches it. Then the ball around
    // x through it holds no other point of the wall.
    if (second + kSteepest * std::abs(f) <= -k) return f;
    find_feet_(near, f);
    return foot_on_wall_(x, best, f, near) ? f : near_junction_(x, f, near);
}

// That of the shape, from the distances of its tubes at x.
double VesselDistance::value_(const Vec3& x, Near& near) const
{
    double f = near.of_tube(shape_, 0, x);
    for (std::size_t i = 1; i < shape_.fast().size(); ++i)
        if (shape_.upper_bound(i, x) > f - shape_.blend_width())
            f = shape_.joined(f, near.of_tube(shape_, i, x));
    return f;
}

void VesselDistance::sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const
{
    const std::vector<VesselTube>& tubes = shape_.fast();
    const Vec3 half = 0.5 * (n - 1) * edges.rowwise().sum(), centre = corner + half;
    const double reach = kSteepest * half.norm(), h = edges.col(0).norm();
    TwoLargest of_tubes;
    for (std::size_t i = 0; i < tubes.size(); ++i)
        if (!(shape_.upper_bound(i, centre) < of_tubes.second))
            of_tubes.take(i, tubes[i].distance(centre));
    const auto [best, f, second] = of_tubes;
    // Tubes with no more than that at the centre have no part in any point's distance: the reasons
    // of `distance_`, for all points of the cube at once.
    const double others =
        std::min(f, -kSteepest * std::abs(f)) - shape_.blend_width() - kSteepest * 2 * reach;
    const bool alone = second <= others;
    Near near{centre, half.norm()};
    near.parts.part.resize(tubes.size());
    near.at_x.resize(tubes.size());
    for (std::size_t i = 0; i < tubes.size(); ++i)
        if (i == best || (!alone && shape_.upper_bound(i, centre) > others)) {
            near.tubes.push_back(i);
            near.parts.part[i] = tubes[i].part_around(centre, near.size);
        }
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (int l = 0; l < n; ++l) {
                const Vec3 x = corner + edges * Vec3{1.0 * i, 1.0 * j, 1.0 * l};
                *out++ = alone ? tubes[best].distance(x, near.part(best))
                               : distance_(x, kSampledBand * h, near);
            }
}

} // namespace amontons
