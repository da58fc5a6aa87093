#include "mesh/swept_tube.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

// With e = x - c(u), d = |e|, m = e / d, and u(x) the foot: e . c' = 0. Differentiating that,
//   D u_i = c'_i              D = c' . c' - e . c''
//   D u_ij = c''_i u_j + u_i c''_j - (3 c' . c'' - e . c''') u_i u_j
//   d_i = m_i
//   d_ij = (I_ij - m_i m_j - c'_i c'_j / D) / d
// and so for g = R(u) - d
//   g_i = R' u_i - m_i,       g_ij = R'' u_i u_j + R' u_ij - d_ij.
// D <= 0 beyond the centre of curvature, where a foot is not the nearest point: only a point
// outside a tube reaches it, beside an end.

namespace amontons {

namespace {

constexpr double kAxis = 1e-9;    // of the radius: nearer to the axis the normal has no meaning
constexpr double kRounded = 1e-9; // of the radius: more than distances are rounded by
constexpr double kFocal = 0.02;   // least D / c'^2: less is beside an end, or in a bend too tight

} // namespace

CurveDerivatives SweptTube::foot_(const Vec3& x, WallHint& hint) const
{
    const CurveLocation at = centreline_.nearest(x, hint.piece);
    hint.piece = at.piece;
    CurveDerivatives c = centreline_.derivatives(at.piece, at.parameter);
    const bool before = at.piece == 0 && at.parameter <= 0;
    const bool beyond = at.piece == centreline_.piece_count() - 1 &&
                        at.parameter >= centreline_.parameter_range(at.piece);
    if (!before && !beyond) return c;
    // Straight on, in arc length. The radius changes over to a constant without a kink.
    const double speed = c.first.norm();
    const Vec3 tangent = c.first / speed;
    if ((before ? start_ : end_) == TubeEnd::ball) { // a foot that does not move
        c.first.setZero();
        c.second.setZero();
        c.third.setZero();
        c.radius_first = c.radius_second = 0;
        return c;
    }
    const double past = (x - c.value).dot(tangent); // < 0 before the start
    const double slope = c.radius_first / speed;
    const double fade = c.radius / (1 + std::abs(slope));
    const double decay = std::exp(-std::abs(past) / fade);
    c.value += past * tangent;
    c.first = tangent;
    c.second.setZero();
    c.third.setZero();
    c.radius += std::copysign(slope * fade * (1 - decay), slope * past);
    c.radius_first = slope * decay;
    c.radius_second = -std::copysign(slope * decay / fade, slope * past);
    return c;
}

double SweptTube::distance(const Vec3& x, WallHint& hint) const
{
    const CurveDerivatives c = foot_(x, hint);
    const Vec3 e = x - c.value;
    const double gap = c.radius - e.norm();
    if (c.radius_first == 0) return gap;
    const double speed2 = c.first.squaredNorm();
    const double focal = std::max(speed2 - e.dot(c.second), kFocal * speed2);
    const double steep = c.radius_first / focal;
    return gap / std::sqrt(1 + steep * steep * speed2);
}

double SweptTube::clearance(const Vec3& x, const WallHint& hint) const
{
    if (!(radius_ > 0) || hint.piece < 0 || hint.piece >= centreline_.piece_count())
        return -std::numeric_limits<double>::infinity();
    // Beyond its ends a tube continues along a line or ends in a point, none farther than the
    // piece.
    return (1 - kRounded) * radius_ - centreline_.distance_bound(x, hint.piece);
}

WallSample SweptTube::sample(const Vec3& x, WallHint& hint) const
{
    const CurveDerivatives c = foot_(x, hint);
    Vec3 e = x - c.value;
    double d = e.norm();
    const double gap = c.radius - d;
    const double speed2 = c.first.squaredNorm();
    if (d <= kAxis * c.radius) { // on the axis: any direction across, always the same one
        d = kAxis * c.radius;
        e = speed2 > 0 ? Vec3{d * c.first.unitOrthogonal()} : Vec3{d * Vec3::UnitX()};
    }
    const Vec3 m = e / d;
    if (speed2 == 0) return {gap, -m, (m * m.transpose() - Mat3::Identity()) / d}; // a ball
    const double focal = std::max(speed2 - e.dot(c.second), kFocal * speed2);
    const Vec3 grad_u = c.first / focal;
    Mat3 hessian = (m * m.transpose() - Mat3::Identity()) / d +
                   c.first * (1 / (focal * d)) * c.first.transpose();
    WallSample out;
    if (c.radius_first == 0 && c.radius_second == 0) {
        out.distance = gap;
        out.normal = -m;
        out.hessian = hessian;
        return out;
    }
    const double bend = (3 * c.first.dot(c.second) - e.dot(c.third)) / focal;
    const Mat3 mixed = c.second * grad_u.transpose() / focal;
    hessian += (c.radius_second - c.radius_first * bend) * grad_u * grad_u.transpose() +
               c.radius_first * (mixed + mixed.transpose());
    const Vec3 gradient = c.radius_first * grad_u - m;
    const double size = gradient.norm();
    out.distance = gap / size;
    out.normal = gradient / size;
    const Mat3 across = Mat3::Identity() - out.normal * out.normal.transpose();
    out.hessian = across * (hessian / size) * across;
    return out;
}

} // namespace amontons
