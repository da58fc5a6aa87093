#include "mesh/generate/vessel_shape.hpp"

#include "mesh/base/dense.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

namespace amontons {

namespace {

constexpr int kMostProjections = 8, kMostFootSteps = 12;
constexpr double kOnSurface = 1e-7;     // of the radius of curvature
constexpr double kFootConverged = 1e-3; // of the lengths at hand: a step of Newton's squares it
constexpr double kSlack = 0.01;         // of the distance, of a nearest triangle to begin with
constexpr double kSampledBand = 12; // grid spacings; a spline's reach twice, no contact is farther
constexpr double kRounding = 1e-9;
constexpr double kSteepest = 1.05; // no tube's distance changes faster than this (slopes)

} // namespace

VesselShape::VesselShape(std::vector<SweptTube> tubes, double blend_radius)
    : tubes_{std::move(tubes)}
    , width_{std::numbers::sqrt2 * blend_radius}
{
    for (const SweptTube& tube : tubes_)
        around_.push_back(around(tube));
}

VesselShape::Around VesselShape::around(const SweptTube& tube)
{
    const Centreline& line = tube.centreline();
    const CurveDerivatives start = line.derivatives(0, 0);
    Around straight{start.value, start.first.normalized(), line.length(), 0, 1};
    Around ball{line.at(line.length() / 2).position, Vec3::UnitX(), 0, 0, 1};
    bool is_straight = true;
    for (std::int32_t i = 0; i < line.piece_count(); ++i)
        for (int k = 0; k <= 8; ++k) {
            const double range = line.parameter_range(i);
            const CurveDerivatives c = line.derivatives(i, range * k / 8);
            // Between the points examined a curve gets no farther than half their spacing.
            ball.radius = std::max(ball.radius, (c.value - ball.start).norm() + c.radius +
                                                    c.first.norm() * range / 16);
            is_straight = is_straight && c.first == start.first && c.second.isZero(0) &&
                          c.third.isZero(0) && c.radius_second == 0;
            straight.radius = std::max(straight.radius, c.radius);
            straight.steepness =
                std::max(straight.steepness, std::hypot(1.0, c.radius_first / c.first.norm()));
        }
    straight.radius += kRounding * (straight.radius + line.length());
    return is_straight ? straight : ball;
}

double VesselShape::value(const Vec3& x, Hints& hints) const
{
    double f = tubes_[0].distance(x, hints[0]);
    for (std::size_t i = 1; i < tubes_.size(); ++i) {
        if (upper_bound(i, x) <= f - width_) continue;
        const double b = tubes_[i].distance(x, hints[i]);
        const double left = width_ - std::abs(f - b);
        f = std::max(f, b);
        if (left > 0) f += left * left / (4 * width_);
    }
    return f;
}

ImplicitSample VesselShape::sample(const Vec3& x, Hints& hints) const
{
    const auto take = [&](std::size_t i) {
        const WallSample w = tubes_[i].sample(x, hints[i]);
        return ImplicitSample{w.distance, w.normal, w.hessian};
    };
    ImplicitSample s = take(0);
    for (std::size_t i = 1; i < tubes_.size(); ++i) {
        if (upper_bound(i, x) <= s.value - width_) continue;
        if (tubes_[i].distance(x, hints[i]) <= s.value - width_) continue;
        const ImplicitSample other = take(i);
        const double u = s.value - other.value;
        if (u <= -width_) {
            s = other;
        } else if (u < width_) {
            const double part = 0.5 * (1 + u / width_), left = width_ - std::abs(u);
            const Vec3 jump = s.gradient - other.gradient;
            s.value = std::max(s.value, other.value) + left * left / (4 * width_);
            s.hessian = part * s.hessian + (1 - part) * other.hessian +
                        jump * jump.transpose() / (2 * width_);
            s.gradient = part * s.gradient + (1 - part) * other.gradient;
        }
    }
    return s;
}

Vec3 VesselShape::project(const Vec3& x, Hints& hints) const
{
    Vec3 p = x;
    for (int k = 0; k < kMostProjections; ++k) {
        const ImplicitSample s = sample(p, hints);
        const double steep = s.gradient.squaredNorm();
        if (!(steep > 0)) break;
        p -= s.value / steep * s.gradient;
        // The error is squared by a step: the next one would not show.
        if (std::abs(s.value) * s.hessian.norm() <= kOnSurface) break;
    }
    return p;
}

VesselDistance::VesselDistance(VesselShape shape, Late<SurfaceMesh> surface)
    : shape_{std::move(shape)}
    , tree_{[surface = std::move(surface)] { return BoundingTree{*surface}; }}
{
}

VesselDistance::VesselDistance(VesselShape shape, const Vec3& origin, double edge)
    : shape_{std::move(shape)}
    , tree_{std::function<BoundingTree()>{}}
{
    const auto surface = [this] {
        const auto hints = std::make_shared<VesselShape::Hints>(shape_.no_hints());
        return ImplicitSurface{
            [this, hints](const Vec3& x) { return shape_.value(x, *hints); },
            [this, hints](const Vec3& x) { return shape_.project(x, *hints); }};
    };
    seeds_.emplace(surface, origin, edge);
}

// Nearest point p of {F = 0} to x: p - x + mu grad F(p) = 0, F(p) = 0.
// @param value  of F at x
double VesselDistance::near_junction_(const Vec3& x, double value, Near& near) const
{
    const double sign = value > 0 ? 1.0 : -1.0;
    NearestTriangle seed;
    if (seeds_) {
        seed = seeds_->nearest(x, std::abs(value) + shape_.blend_width(), kSlack, near.seeds);
        if (seed.triangle < 0) return value; // no wall is near
    } else {
        seed = tree_->nearest(x, near.triangle, kSlack);
        near.triangle = seed.triangle;
    }
    const double seed_distance = std::sqrt(seed.squared);
    Vec3 p = seed.at.point;
    ImplicitSample s = shape_.sample(p, near.hints);
    double mu = (x - p).dot(s.gradient) / s.gradient.squaredNorm();
    const double longest = std::max(shape_.blend_width(), 0.0);
    for (int k = 0; k < kMostFootSteps; ++k) {
        Eigen::Matrix4d a;
        a.topLeftCorner<3, 3>() = Mat3::Identity() + mu * s.hessian;
        a.topRightCorner<3, 1>() = s.gradient;
        a.bottomLeftCorner<1, 3>() = s.gradient.transpose();
        a(3, 3) = 0;
        Eigen::Vector4d residual;
        residual << p - x + mu * s.gradient, s.value;
        const Eigen::Vector4d step = solve_small(a, residual);
        const double length = step.head<3>().norm();
        if (!(length <= longest)) break; // also when it is not a number
        p -= step.head<3>();
        mu -= step[3];
        if (length <= kFootConverged * (length + seed_distance + longest)) {
            const double found = (x - p).norm();
            // Beyond a centre of curvature it may have found a farthest point.
            if (found <= seed_distance + longest / 4) return sign * found;
            break;
        }
        s = shape_.sample(p, near.hints);
    }
    return sign * seed_distance;
}

double VesselDistance::distance(const Vec3& x) const
{
    Near near{-1, {}, shape_.no_hints()};
    return distance_(x, std::numeric_limits<double>::infinity(), near);
}

double VesselDistance::distance_(const Vec3& x, double band, Near& near) const
{
    const std::vector<SweptTube>& tubes = shape_.tubes();
    const double k = shape_.blend_width();
    std::size_t best = 0;
    double f = -std::numeric_limits<double>::infinity(), second = f;
    for (std::size_t i = 0; i < tubes.size(); ++i) {
        if (shape_.upper_bound(i, x) < second) continue;
        const double v = tubes[i].distance(x, near.hints[i]);
        if (v > f) {
            second = f;
            f = v;
            best = i;
        } else {
            second = std::max(second, v);
        }
    }
    if (std::abs(f) > band) return f;
    if (second > f - k)
        return near_junction_(x, shape_.value(x, near.hints), near);
    // The foot on this tube is on the wall when no other tube reaches it. Then the ball around
    // x through it holds no other point of the wall.
    if (second + kSteepest * std::abs(f) <= -k) return f;
    const Vec3 foot = x - f * tubes[best].sample(x, near.hints[best]).normal;
    for (std::size_t i = 0; i < tubes.size(); ++i) {
        if (i == best || shape_.upper_bound(i, foot) <= -k) continue;
        if (tubes[i].distance(foot, near.hints[i]) > -k)
            return near_junction_(x, f, near);
    }
    return f;
}

void VesselDistance::sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const
{
    const std::vector<SweptTube>& tubes = shape_.tubes();
    const Vec3 half = 0.5 * (n - 1) * edges.rowwise().sum(), centre = corner + half;
    const double reach = kSteepest * half.norm(), h = edges.col(0).norm();
    std::size_t best = 0;
    double f = -std::numeric_limits<double>::infinity(), second = f;
    for (std::size_t i = 0; i < tubes.size(); ++i) {
        WallHint hint;
        const double v = tubes[i].distance(centre, hint);
        if (v > f) {
            second = f;
            f = v;
            best = i;
        } else {
            second = std::max(second, v);
        }
    }
    // The reasons of `distance`, for all points of the cube at once.
    const bool alone = second + 2 * reach <= f - shape_.blend_width() &&
                       second + kSteepest * std::abs(f) + 2 * reach <= -shape_.blend_width();
    Near near{-1, {}, shape_.no_hints()};
    WallHint hint;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (int l = 0; l < n; ++l) {
                const Vec3 x = corner + edges * Vec3{1.0 * i, 1.0 * j, 1.0 * l};
                *out++ =
                    alone ? tubes[best].distance(x, hint) : distance_(x, kSampledBand * h, near);
            }
}

} // namespace amontons
