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
        p.steepness = std::sqrt(1 + p.slope * p.slope);
        if (const double curvature = c.second.norm(); curvature > 0) {
            p.bend = 1 / curvature;
            p.a2 = -c.second * p.bend;
            p.a0 -= p.bend * p.a2;
            p.sine = std::sin(p.range / p.bend);
            p.cosine = std::cos(p.range / p.bend);
        }
        pieces_.push_back(p);
    }
}

/// The squared distance of a piece's point that is nearest to x, and its parameter: not a number
/// inside an arc, see along_arc_(). Of an arc that is farther than `beyond`, squared, any distance
/// that is farther too.
double VesselTube::nearest_(const Piece& p, const Vec3& x, double beyond, double& u)
{
    const Vec3 e = x - p.a0;
    const double along = e.dot(p.a1);
    if (p.bend == 0) {
        u = std::clamp(along, 0.0, p.range);
        return (e - u * p.a1).squaredNorm();
    }
    const double out = e.dot(p.a2), off = e.squaredNorm() - along * along - out * out;
    const double in_plane = std::sqrt(along * along + out * out) - p.bend;
    const double to_circle = in_plane * in_plane + std::max(off, 0.0);
    if (!(to_circle < beyond)) return to_circle;
    // Beyond the arc's end, seen from its start; and before its start.
    const double past = p.cosine * along - p.sine * out;
    const bool outside =
        p.range <= std::numbers::pi * p.bend ? along < 0 || past > 0 : along < 0 && past > 0;
    if (!outside) {
        u = std::numeric_limits<double>::quiet_NaN();
        return to_circle;
    }
    // The nearer of the two ends, the first on a tie.
    const bool last = p.cosine * out + p.sine * along > out;
    u = last ? p.range : 0.0;
    const Vec3 end = last ? Vec3{p.sine * p.a1 + p.cosine * p.a2} : p.a2;
    return (e - p.bend * end).squaredNorm();
}

/// The parameter of the point of an arc's circle that is nearest to x.
double VesselTube::along_arc_(const Piece& p, const Vec3& x)
{
    const Vec3 e = x - p.a0;
    const double theta = std::atan2(e.dot(p.a1), e.dot(p.a2));
    return p.bend * (theta < 0 ? theta + 2 * std::numbers::pi : theta);
}

VesselTube::Foot VesselTube::foot_(const Vec3& x, const TubePart& part) const
{
    Foot best;
    best.squared = std::numeric_limits<double>::infinity();
    const int last = std::min(part.last, int(pieces_.size()) - 1);
    for (int i = part.first; i <= last; ++i) {
        const Piece& p = pieces_[std::size_t(i)];
        double u = 0;
        const double squared = nearest_(p, x, best.squared, u);
        if (squared < best.squared) best = {&p, u, squared, false};
    }
    if (std::isnan(best.u)) best.u = along_arc_(*best.piece, x);
    best.closed = (best.piece == &pieces_.front() && best.u <= 0) ||
                  (best.piece == &pieces_.back() && best.u >= best.piece->range);
    return best;
}

/// The foot where it is inside a piece.
VesselTube::Foot VesselTube::foot_inside_(const Piece& p, const Vec3& x)
{
    if (p.bend == 0) return {&p, (x - p.a0).dot(p.a1), 0, false};
    return {&p, p.slope == 0 ? 0 : along_arc_(p, x), 0, false};
}

TubePart VesselTube::part_around(const Vec3& centre, double radius) const
{
    constexpr double kFarther = 2 + 1e-6; // radii: that much farther none is the nearest anywhere
    const Foot best = foot_(centre, {});
    const Piece& p = *best.piece;
    TubePart part{int(&p - pieces_.data()), int(&p - pieces_.data())};
    const double farthest = std::pow(std::sqrt(best.squared) + kFarther * radius, 2);
    for (int i = 0; i < int(pieces_.size()); ++i) {
        double u = 0;
        if (i >= part.first && i <= part.last) continue;
        if (!(nearest_(pieces_[std::size_t(i)], centre, farthest, u) < farthest)) continue;
        part.first = std::min(part.first, i);
        part.last = std::max(part.last, i);
    }
    if (part.first != part.last) return part;
    // How far the foot moves: on an arc more than the point, by its radius over the distance from
    // its axis.
    const Vec3 e = centre - p.a0;
    const double from_axis =
        p.bend == 0 ? 0 : std::sqrt(std::pow(e.dot(p.a1), 2) + std::pow(e.dot(p.a2), 2)) - radius;
    if (p.bend > 0 && !(from_axis > kLeastFocal * p.bend + radius)) return part;
    const double moves = p.bend == 0 ? radius : 2 * radius * std::max(1.0, p.bend / from_axis);
    part.inside = best.u > moves && best.u < p.range - moves;
    return part;
}

/// D of swept_tube.cpp: on an arc the distance from its axis over its radius.
double VesselTube::focal_(const Piece& p, const Vec3& x)
{
    if (p.bend == 0) return 1;
    const Vec3 e = x - p.a0;
    const double along = e.dot(p.a1), out = e.dot(p.a2);
    return std::max(std::sqrt(along * along + out * out) / p.bend, kLeastFocal);
}

/// Distance where the nearest point is inside a piece.
double VesselTube::inside_(const Piece& p, const Vec3& x)
{
    const Vec3 e = x - p.a0;
    const double along = e.dot(p.a1);
    if (p.bend == 0) return (p.radius + along * p.slope - (e - along * p.a1).norm()) / p.steepness;
    const double out = e.dot(p.a2), from_axis = std::sqrt(along * along + out * out),
                 in_plane = from_axis - p.bend,
                 off = std::max(e.squaredNorm() - along * along - out * out, 0.0),
                 distance = std::sqrt(in_plane * in_plane + off);
    if (p.slope == 0) return p.radius - distance;
    double theta = std::atan2(along, out);
    if (theta < 0) theta += 2 * std::numbers::pi;
    const double steep = p.slope * p.bend / from_axis;
    return (p.radius + theta * p.bend * p.slope - distance) / std::sqrt(1 + steep * steep);
}

/// The normal of sample() where the nearest point is inside a piece.
Vec3 VesselTube::normal_inside_(const Piece& p, const Vec3& x) const
{
    Vec3 e = x - p.a0, tangent = p.a1;
    const double along = e.dot(p.a1);
    double slope = p.slope;
    if (p.bend == 0) {
        e -= along * p.a1;
    } else {
        const double out = e.dot(p.a2), from_axis = std::sqrt(along * along + out * out);
        e -= p.bend / from_axis * (along * p.a1 + out * p.a2);
        tangent = (out * p.a1 - along * p.a2) / from_axis;
        slope *= p.bend / from_axis;
    }
    const double d = e.norm();
    if (!(d > kNearAxis * p.radius)) return sample(x).gradient;
    return (slope * tangent - e / d) / std::sqrt(1 + slope * slope);
}

double VesselTube::any_(const Vec3& x, const TubePart& part) const
{
    const Foot f = foot_(x, part);
    const double gap = f.piece->radius + f.u * f.piece->slope - std::sqrt(f.squared);
    if (f.closed || f.piece->slope == 0) return gap;
    const double steep = f.piece->slope / focal_(*f.piece, x);
    return gap / std::sqrt(1 + steep * steep);
}

/// The way from the middle line to x, at its foot.
VesselTube::Across VesselTube::across_(const Foot& f, const Vec3& x, bool inside)
{
    const Piece& p = *f.piece;
    const double radius = p.radius + f.u * p.slope;
    Across a{Vec3::Zero(), p.a1, Vec3::Zero()};
    Vec3 c = p.a0;
    if (p.bend == 0) {
        c += f.u * p.a1;
    } else {
        double sine, cosine;
        if (!inside) {
            sine = std::sin(f.u / p.bend);
            cosine = std::cos(f.u / p.bend);
        } else {
            const double along = (x - p.a0).dot(p.a1), out = (x - p.a0).dot(p.a2),
                         from_axis = std::sqrt(along * along + out * out);
            sine = along / from_axis;
            cosine = out / from_axis;
        }
        a.bent = sine * p.a1 + cosine * p.a2;
        a.tangent = cosine * p.a1 - sine * p.a2;
        c += p.bend * a.bent;
        a.bent *= -1 / p.bend;
    }
    a.e = x - c;
    a.d = a.e.norm();
    a.gap = radius - a.d;
    if (a.d <= kNearAxis * radius) { // on the axis: any direction across, always the same one
        a.d = kNearAxis * radius;
        a.e = a.d * a.tangent.unitOrthogonal();
    }
    return a;
}

/// The normal of sample(), without its Hessian.
Vec3 VesselTube::any_normal_(const Vec3& x, const TubePart& part) const
{
    const Foot f = foot_(x, part);
    const Across a = across_(f, x, false);
    const Vec3 m = a.e / a.d;
    const double slope = f.piece->slope;
    if (f.closed || slope == 0) return -m;
    const double focal = std::max(1 - a.e.dot(a.bent), kLeastFocal);
    const Vec3 gradient = slope / focal * a.tangent - m;
    return gradient / gradient.norm();
}

ImplicitSample VesselTube::sample(const Vec3& x, const TubePart& part) const
{
    const Foot f = part.inside ? foot_inside_(pieces_[std::size_t(part.first)], x) : foot_(x, part);
    const auto [e, tangent, bent, d, gap] = across_(f, x, part.inside);
    const double slope = f.piece->slope;
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
