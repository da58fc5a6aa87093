#include "mesh/generate/vessel_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace amontons {

namespace {

constexpr int kMostProjections = 8;
constexpr double kOnSurface = 1e-7; // of the radius of curvature
constexpr double kRounding = 1e-9;

} // namespace

VesselShape::VesselShape(std::vector<SweptTube> tubes, double blend_radius)
    : tubes_{std::move(tubes)}
    , width_{std::numbers::sqrt2 * blend_radius}
{
    for (const SweptTube& tube : tubes_) {
        around_.push_back(around(tube));
        fast_.emplace_back(tube.centreline());
    }
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

VesselParts VesselShape::parts_around(const Vec3& centre, double radius) const
{
    VesselParts p{centre, radius * radius};
    p.part.reserve(fast_.size());
    for (const VesselTube& tube : fast_)
        p.part.push_back(tube.part_around(centre, radius));
    return p;
}

double VesselShape::value(const Vec3& x, const VesselParts& near) const
{
    double f = fast_[0].distance(x, near.of(0, x));
    for (std::size_t i = 1; i < tubes_.size(); ++i) {
        if (upper_bound(i, x) <= f - width_) continue;
        f = joined(f, fast_[i].distance(x, near.of(i, x)));
    }
    return f;
}

ImplicitSample VesselShape::sample(const Vec3& x, const VesselParts& near) const
{
    ImplicitSample s = fast_[0].sample(x, near.of(0, x));
    for (std::size_t i = 1; i < tubes_.size(); ++i) {
        if (upper_bound(i, x) <= s.value - width_) continue;
        if (fast_[i].distance(x, near.of(i, x)) <= s.value - width_) continue;
        const ImplicitSample other = fast_[i].sample(x, near.of(i, x));
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

VesselShape::Junction VesselShape::junction(const Vec3& x, const VesselParts& near) const
{
    constexpr double kNone = -std::numeric_limits<double>::infinity();
    double first = kNone, second = kNone;
    for (std::size_t i = 0; i < tubes_.size(); ++i) {
        if (upper_bound(i, x) <= second) continue;
        const double f = fast_[i].distance(x, near.of(i, x));
        second = std::max(second, std::min(first, f));
        first = std::max(first, f);
    }
    return {joined(first, second), first - second};
}

Vec3 VesselShape::project(const Vec3& x, const VesselParts& near) const
{
    Vec3 p = x;
    for (int k = 0; k < kMostProjections; ++k) {
        const ImplicitSample s = sample(p, near);
        const double steep = s.gradient.squaredNorm();
        if (!(steep > 0)) break;
        p -= s.value / steep * s.gradient;
        // The error is squared by a step: the next one would not show.
        if (std::abs(s.value) * s.hessian.norm() <= kOnSurface) break;
    }
    return p;
}

} // namespace amontons
