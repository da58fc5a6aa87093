#include "mesh/generate/vessel_tube.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

// The formulas of swept_tube.cpp, where c' is a unit vector, c'' points to an arc's centre, and
// e . c' = e . c''' = 0: the curve has no kink, so that a foot between two pieces is one of both.

namespace amontons {

namespace {

constexpr double kNearAxis = 1e-9;   // of the radius: there the normal has no meaning
constexpr double kLeastFocal = 0.02; // of D: less is beside an end, or in a bend too tight

} // namespace

VesselTube::VesselTube(const Centreline& line)
{
    for (std::int32_t i = 0; i < line.piece_count(); ++i) {
        const CurveDerivatives c = line.derivatives(i, 0);
        Piece p{c.value, c.first};
        p.range = line.parameter_range(i);
        p.radius = c.radius;
        p.slope = c.radius_first;
        if (const double curvature = c.second.norm(); curvature > 0) {
            p.bend = 1 / curvature;
            p.a2 = -c.second * p.bend;
            p.a0 -= p.bend * p.a2;
        }
        pieces_.push_back(p);
    }
}

VesselTube::Foot VesselTube::foot_(const Vec3& x) const
{
    Foot best;
    best.squared = std::numeric_limits<double>::infinity();
    for (const Piece& p : pieces_) {
        const Vec3 e = x - p.a0;
        const double along = e.dot(p.a1);
        double u, squared;
        if (p.bend == 0) {
            u = std::clamp(along, 0.0, p.range);
            squared = (e - u * p.a1).squaredNorm();
        } else {
            const double out = e.dot(p.a2), off = e.squaredNorm() - along * along - out * out;
            const double in_plane = std::sqrt(along * along + out * out) - p.bend;
            squared = in_plane * in_plane + std::max(off, 0.0);
            if (!(squared < best.squared)) continue;
            double theta = std::atan2(along, out);
            const double angle = p.range / p.bend;
            if (theta < 0) theta += 2 * std::numbers::pi;
            if (theta > angle) { // the nearer of the two ends, the first on a tie
                theta = theta - angle < 2 * std::numbers::pi - theta ? angle : 0.0;
                squared =
                    (e - p.bend * (std::sin(theta) * p.a1 + std::cos(theta) * p.a2)).squaredNorm();
            }
            u = theta * p.bend;
        }
        if (squared < best.squared) best = {&p, u, squared, false};
    }
    best.closed = (best.piece == &pieces_.front() && best.u <= 0) ||
                  (best.piece == &pieces_.back() && best.u >= best.piece->range);
    return best;
}

/// D of swept_tube.cpp: on an arc the distance from its axis over its radius.
double VesselTube::focal_(const Piece& p, const Vec3& x)
{
    if (p.bend == 0) return 1;
    const Vec3 e = x - p.a0;
    return std::max(std::hypot(e.dot(p.a1), e.dot(p.a2)) / p.bend, kLeastFocal);
}

double VesselTube::distance(const Vec3& x) const
{
    const Foot f = foot_(x);
    const double gap = f.piece->radius + f.u * f.piece->slope - std::sqrt(f.squared);
    if (f.closed || f.piece->slope == 0) return gap;
    const double steep = f.piece->slope / focal_(*f.piece, x);
    return gap / std::sqrt(1 + steep * steep);
}

ImplicitSample VesselTube::sample(const Vec3& x) const
{
    const Foot f = foot_(x);
    const Piece& p = *f.piece;
    const double radius = p.radius + f.u * p.slope, slope = p.slope;
    Vec3 c = p.a0, tangent = p.a1, bent = Vec3::Zero();
    if (p.bend == 0) {
        c += f.u * p.a1;
    } else {
        const double sine = std::sin(f.u / p.bend), cosine = std::cos(f.u / p.bend);
        bent = sine * p.a1 + cosine * p.a2;
        tangent = cosine * p.a1 - sine * p.a2;
        c += p.bend * bent;
        bent *= -1 / p.bend;
    }
    Vec3 e = x - c;
    double d = e.norm();
    const double gap = radius - d;
    if (d <= kNearAxis * radius) { // on the axis: any direction across, always the same one
        d = kNearAxis * radius;
        e = d * tangent.unitOrthogonal();
    }
    const Vec3 m = e / d;
    Mat3 hessian = (m * m.transpose() - Mat3::Identity()) / d;
    if (f.closed) return {gap, -m, hessian};
    const double focal = std::max(1 - e.dot(bent), kLeastFocal);
    hessian += tangent * (1 / (focal * d)) * tangent.transpose();
    if (slope == 0) return {gap, -m, hessian};
    const Mat3 mixed = bent * (tangent / (focal * focal)).transpose();
    hessian += slope * (mixed + mixed.transpose());
    const Vec3 gradient = slope / focal * tangent - m;
    const double size = gradient.norm();
    const Vec3 normal = gradient / size;
    const Mat3 across = Mat3::Identity() - normal * normal.transpose();
    return {gap / size, normal, across * (hessian / size) * across};
}

} // namespace amontons
