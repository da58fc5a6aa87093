#include "mesh/centreline.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace amontons {

namespace {

constexpr std::size_t kGroupSize = 12;
constexpr int kMaxNewton = 60; // of a safeguarded Newton method: bisection alone needs 53
constexpr double kLastStep = 1e-9, kBracket = 1e-15; // of a piece's parameter range

[[noreturn]] void throw_issue(const std::string& place, const std::string& found,
                              const std::string& allowed)
{
    throw InputError({Issue{"", place, found, allowed}});
}

void check_positive(const std::string& place, double value)
{
    if (!(value > 0) || !std::isfinite(value))
        throw_issue(place, std::to_string(value), "> 0 and finite [m]");
}

// Second derivatives of the natural cubic spline with knots at the running sum of h:
// the usual tridiagonal system, solved by elimination without pivots (it is dominant).
template <class Value>
std::vector<Value> spline_second(const std::vector<Value>& y, const std::vector<double>& h)
{
    const std::size_t n = y.size();
    const Value zero = y[0] - y[0];
    std::vector<Value> m(n, zero), rhs(n, zero);
    std::vector<double> diagonal(n, 1.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        diagonal[i] = 2 * (h[i - 1] + h[i]);
        rhs[i] = 6 * ((y[i + 1] - y[i]) / h[i] - (y[i] - y[i - 1]) / h[i - 1]);
        if (i > 1) {
            const double factor = h[i - 1] / diagonal[i - 1];
            diagonal[i] -= factor * h[i - 1];
            rhs[i] -= factor * rhs[i - 1];
        }
    }
    for (std::size_t i = n - 2; i >= 1 && i < n; --i)
        m[i] = (rhs[i] - h[i] * m[i + 1]) / diagonal[i];
    return m;
}

} // namespace

Centreline::Centreline(const Vec3& start, const Vec3& direction, const Vec3& normal, double radius)
    : end_{start}
    , radius_{radius}
{
    check_positive("/centreline/radius", radius);
    if (!start.allFinite()) throw_issue("/centreline/start", "not finite", "finite [m]");
    if (!(direction.norm() > 0) || !direction.allFinite())
        throw_issue("/centreline/direction", "no direction", "a vector of length > 0");
    tangent_ = direction.normalized();
    const Vec3 across = normal - tangent_ * tangent_.dot(normal);
    if (!(across.norm() > 1e-9 * normal.norm()) || !normal.allFinite())
        throw_issue("/centreline/normal", "parallel to the direction, or zero",
                    "a vector across the direction");
    normal_ = across.normalized();
}

double Centreline::end_radius() const
{
    return radius_;
}

void Centreline::append_line(double length, double end_radius)
{
    check_positive("/centreline/pieces/length", length);
    check_positive("/centreline/pieces/radius", end_radius);
    Piece piece;
    piece.a0 = end_;
    piece.a1 = tangent_;
    piece.a2 = piece.a3 = Vec3::Zero();
    piece.range = piece.length = length;
    piece.r0 = radius_;
    piece.r1 = (end_radius - radius_) / length;
    end_ += length * tangent_;
    radius_ = end_radius;
    add_(piece);
}

void Centreline::append_arc(double bend_radius, double angle, double turn, double end_radius)
{
    check_positive("/centreline/pieces/radius", end_radius);
    if (!(angle > 0) || angle > 2 * std::numbers::pi)
        throw_issue("/centreline/pieces/angle", std::to_string(angle), "in (0, 2 pi] [rad]");
    if (!std::isfinite(turn))
        throw_issue("/centreline/pieces/direction", std::to_string(turn), "finite [rad]");
    if (!(bend_radius > std::max(radius_, end_radius)) || !std::isfinite(bend_radius))
        throw_issue("/centreline/pieces/radius", std::to_string(bend_radius),
                    "a bend wider than the tube's radius " +
                        std::to_string(std::max(radius_, end_radius)) + " m");
    const Vec3 inward = std::cos(turn) * normal_ + std::sin(turn) * tangent_.cross(normal_);
    Piece piece;
    piece.kind = Piece::Kind::arc;
    piece.bend_radius = bend_radius;
    piece.a0 = end_ + bend_radius * inward;
    piece.a1 = tangent_;
    piece.a2 = inward;
    piece.a3 = tangent_.cross(inward);
    piece.range = piece.length = bend_radius * angle;
    piece.r0 = radius_;
    piece.r1 = (end_radius - radius_) / piece.length;
    const Eigen::AngleAxisd turned{angle, tangent_.cross(inward)};
    end_ = piece.a0 - bend_radius * (turned * inward);
    tangent_ = (turned * tangent_).normalized();
    normal_ = turned * normal_;
    normal_ = (normal_ - tangent_ * tangent_.dot(normal_)).normalized();
    radius_ = end_radius;
    add_(piece);
}

void Centreline::add_(Piece piece)
{
    piece.start = length_;
    length_ += piece.length;
    // A ball around the piece: around the middle, as far as the curve can get from it.
    piece.ball_centre = derivatives_(piece, piece.range / 2).value;
    if (piece.kind == Piece::Kind::arc) {
        piece.ball_radius = 2 * piece.bend_radius * std::sin(piece.range / piece.bend_radius / 4);
    } else { // a cubic lies in the hull of its Bezier points
        const double u = piece.range;
        const Vec3 bezier[4] = {piece.a0, piece.a0 + u / 3 * piece.a1,
                                piece.a0 + u / 3 * (2 * piece.a1 + u * piece.a2),
                                piece.a0 + u * (piece.a1 + u * (piece.a2 + u * piece.a3))};
        piece.ball_radius = 0;
        for (const Vec3& b : bezier)
            piece.ball_radius = std::max(piece.ball_radius, (b - piece.ball_centre).norm());
    }
    piece.ball_radius *= 1 + 1e-9;
    pieces_.push_back(piece);
    if ((pieces_.size() - 1) % kGroupSize == 0) groups_.emplace_back();
    Group& group = groups_.back();
    const std::size_t first = (groups_.size() - 1) * kGroupSize;
    group.centre.setZero();
    for (std::size_t i = first; i < pieces_.size(); ++i)
        group.centre += pieces_[i].ball_centre;
    group.centre /= static_cast<double>(pieces_.size() - first);
    group.radius = 0;
    for (std::size_t i = first; i < pieces_.size(); ++i)
        group.radius = std::max(group.radius, (pieces_[i].ball_centre - group.centre).norm() +
                                                  pieces_[i].ball_radius);
}

CurveDerivatives Centreline::derivatives_(const Piece& p, double u)
{
    CurveDerivatives d;
    if (p.kind == Piece::Kind::arc) {
        const double s = std::sin(u / p.bend_radius), c = std::cos(u / p.bend_radius);
        d.value = p.a0 + p.bend_radius * (s * p.a1 - c * p.a2);
        d.first = c * p.a1 + s * p.a2;
        d.second = (c * p.a2 - s * p.a1) / p.bend_radius;
        d.third = -d.first / (p.bend_radius * p.bend_radius);
    } else {
        d.value = p.a0 + u * (p.a1 + u * (p.a2 + u * p.a3));
        d.first = p.a1 + u * (2 * p.a2 + u * 3 * p.a3);
        d.second = 2 * p.a2 + u * 6 * p.a3;
        d.third = 6 * p.a3;
    }
    d.radius = p.r0 + u * (p.r1 + u * (p.r2 + u * p.r3));
    d.radius_first = p.r1 + u * (2 * p.r2 + u * 3 * p.r3);
    d.radius_second = 2 * p.r2 + u * 6 * p.r3;
    return d;
}

CurveDerivatives Centreline::derivatives(std::int32_t piece, double parameter) const
{
    return derivatives_(pieces_[at_(piece)], parameter);
}

// Nearest point of one piece: squared distance, and the parameter in u. Of one that is farther than
// `beyond`, squared, any distance that is farther too.
double Centreline::nearest_(const Piece& p, const Vec3& x, double beyond, double& u)
{
    if (p.kind == Piece::Kind::arc) {
        const Vec3 e = x - p.a0;
        const double along = e.dot(p.a1), out = -e.dot(p.a2);
        const double angle = p.range / p.bend_radius;
        const double in_plane = std::sqrt(along * along + out * out) - p.bend_radius,
                     off = e.dot(p.a3);
        const double to_circle = in_plane * in_plane + off * off;
        if (to_circle > beyond * (1 + 1e-12)) return to_circle;
        double theta = std::atan2(along, out);
        if (theta < 0) theta += 2 * std::numbers::pi;
        if (theta <= angle) { // over the arc itself: no need for the point
            u = std::min(theta * p.bend_radius, p.range);
            return to_circle;
        }
        // Beyond the end: the nearer of the two ends, the first on a tie.
        u = theta - angle < 2 * std::numbers::pi - theta ? p.range : 0.0;
        return (x - derivatives_(p, u).value).squaredNorm();
    }
    if (p.kind == Piece::Kind::line) {
        u = std::clamp((x - p.a0).dot(p.a1), 0.0, p.range);
        return (x - p.a0 - u * p.a1).squaredNorm();
    }
    // Half the derivative of the squared distance, and its derivative.
    const auto slope = [&](double v, double& derivative) {
        const Vec3 e = x - (p.a0 + v * (p.a1 + v * (p.a2 + v * p.a3)));
        const Vec3 c1 = p.a1 + v * (2 * p.a2 + v * 3 * p.a3);
        const Vec3 c2 = 2 * p.a2 + v * 6 * p.a3;
        derivative = c1.squaredNorm() - e.dot(c2);
        return -e.dot(c1);
    };
    const auto squared = [&](double v) {
        return (x - (p.a0 + v * (p.a1 + v * (p.a2 + v * p.a3)))).squaredNorm();
    };
    double low = 0, high = p.range, derivative = 0;
    const double first = slope(low, derivative), last = slope(high, derivative);
    if (first >= 0 || last <= 0) { // no minimum inside (a piece is short against its bend)
        const double at_low = squared(low), at_high = squared(high);
        u = at_low <= at_high ? low : high;
        return std::min(at_low, at_high);
    }
    double v = high * first / (first - last);
    for (int k = 0; k < kMaxNewton; ++k) {
        const double f = slope(v, derivative);
        (f < 0 ? low : high) = v;
        const double next = v - f / derivative;
        const bool newton = next >= low && next <= high;
        const double step = std::abs(next - v);
        v = newton ? next : 0.5 * (low + high);
        // Newton's error is squared by each step, so this one was the last that shows.
        if ((newton && step <= kLastStep * p.range) || high - low <= kBracket * p.range) break;
    }
    u = v;
    return squared(v);
}

CurveLocation Centreline::nearest(const Vec3& x, std::int32_t hint) const
{
    CurveLocation best;
    double best_squared = std::numeric_limits<double>::infinity(), reach = best_squared;
    const auto visit = [&](std::size_t i) {
        double u = 0;
        const double squared = nearest_(pieces_[i], x, best_squared, u);
        const auto piece = static_cast<std::int32_t>(i);
        // The smaller index wins a tie, so that the order of the search shows in nothing.
        if (squared < best_squared || (squared == best_squared && piece < best.piece)) {
            best_squared = squared;
            reach = std::sqrt(squared);
            best = {piece, u, reach};
        }
    };
    const bool hinted = hint >= 0 && hint < piece_count();
    if (hinted) visit(at_(hint));
    for (std::size_t g = 0; g < groups_.size(); ++g) {
        const double group_bound = reach * (1 + 1e-12) + groups_[g].radius;
        if ((x - groups_[g].centre).squaredNorm() > group_bound * group_bound) continue;
        const std::size_t end = std::min(pieces_.size(), (g + 1) * kGroupSize);
        for (std::size_t i = g * kGroupSize; i < end; ++i) {
            if (hinted && i == at_(hint)) continue;
            const double bound = reach * (1 + 1e-12) + pieces_[i].ball_radius;
            if ((x - pieces_[i].ball_centre).squaredNorm() > bound * bound) continue;
            visit(i);
        }
    }
    return best;
}

double Centreline::distance_bound(const Vec3& x, std::int32_t piece) const
{
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const Piece& p = pieces_[at_(piece)];
    const Vec3 e = x - p.a0;
    const double along = e.dot(p.a1);
    if (p.kind == Piece::Kind::line)
        return along >= 0 && along <= p.range ? (e - along * p.a1).norm() : kNone;
    if (p.kind != Piece::Kind::arc) return kNone;
    const double out = e.dot(p.a2), off = e.dot(p.a3), rho = p.bend_radius;
    const double from_centre = std::sqrt(along * along + out * out);
    // The nearest point of the circle is on the arc if it is in the ball around the arc's middle,
    // through its ends: with the cosine of the angle between them, 2 rho^2 (1 - cos) <= radius^2.
    constexpr double kInside = 1 - 1e-8; // that ball is a little larger
    const double least = rho - kInside * p.ball_radius * p.ball_radius / (2 * rho);
    if (e.dot(p.ball_centre - p.a0) < from_centre * least) return kNone;
    const double in_plane = from_centre - rho;
    return std::sqrt(in_plane * in_plane + off * off);
}

double Centreline::constant_radius() const
{
    for (const Piece& p : pieces_)
        if (p.r0 != radius_ || p.r1 != 0 || p.r2 != 0 || p.r3 != 0) return 0;
    return pieces_.empty() ? 0 : radius_;
}

// Arc length from the start of a piece to u: 8 Gauss points on each of two halves.
double Centreline::length_to_(const Piece& p, double u)
{
    if (p.kind != Piece::Kind::cubic) return u;
    constexpr double node[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                0.9602898564975363};
    constexpr double weight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                  0.1012285362903763};
    double sum = 0;
    for (double middle : {0.25 * u, 0.75 * u})
        for (int k = 0; k < 4; ++k)
            for (double sign : {-1.0, 1.0})
                sum += weight[k] * derivatives_(p, middle + sign * node[k] * 0.25 * u).first.norm();
    return 0.25 * u * sum;
}

double Centreline::arc_length(const CurveLocation& location) const
{
    const Piece& p = pieces_[at_(location.piece)];
    return p.start + length_to_(p, location.parameter);
}

CurvePoint Centreline::at(const CurveLocation& location) const
{
    const CurveDerivatives d = derivatives(location.piece, location.parameter);
    const double speed = d.first.norm();
    CurvePoint point;
    point.position = d.value;
    point.tangent = d.first / speed;
    point.curvature = (d.second - point.tangent * point.tangent.dot(d.second)) / (speed * speed);
    point.radius = d.radius;
    point.slope = d.radius_first / speed;
    return point;
}

CurvePoint Centreline::at(double s) const
{
    s = std::clamp(s, 0.0, length_);
    const auto after = std::upper_bound(pieces_.begin() + 1, pieces_.end(), s,
                                        [](double v, const Piece& p) { return v < p.start; });
    const auto piece = after - 1;
    double u = std::clamp((s - piece->start) / piece->length, 0.0, 1.0) * piece->range;
    for (int k = 0; k < 8 && piece->kind != Piece::Kind::arc;
         ++k) { // one step on a line; Newton on a spline
        const double error = length_to_(*piece, u) - (s - piece->start);
        if (std::abs(error) <= 1e-15 * length_) break;
        u = std::clamp(u - error / derivatives_(*piece, u).first.norm(), 0.0, piece->range);
    }
    return at(CurveLocation{static_cast<std::int32_t>(piece - pieces_.begin()), u, 0.0});
}

Centreline make_spline(const std::vector<Vec3>& points, const std::vector<double>& radii)
{
    std::vector<Issue> issues;
    const auto report = [&](std::size_t i, std::string found, std::string allowed) {
        issues.push_back({"", "point " + std::to_string(i), std::move(found), std::move(allowed)});
    };
    if (points.size() < 2 || radii.size() != points.size())
        throw_issue("/centreline",
                    std::to_string(points.size()) + " points, " + std::to_string(radii.size()) +
                        " radii",
                    "at least 2 points, one radius for each");
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!points[i].allFinite()) report(i, "not finite", "finite coordinates [m]");
        if (!(radii[i] > 0) || !std::isfinite(radii[i]))
            report(i, "radius " + std::to_string(radii[i]), "> 0 and finite [m]");
        if (i > 0 && points[i] == points[i - 1]) report(i, "same as the point before", "distinct");
    }
    if (!issues.empty()) throw InputError(std::move(issues));

    std::vector<double> h(points.size() - 1);
    for (std::size_t i = 0; i < h.size(); ++i)
        h[i] = (points[i + 1] - points[i]).norm();
    const std::vector<Vec3> m = spline_second(points, h);
    const std::vector<double> q = spline_second(radii, h);
    Centreline line;
    for (std::size_t i = 0; i < h.size(); ++i) {
        Centreline::Piece p;
        p.kind = h.size() == 1 ? Centreline::Piece::Kind::line : Centreline::Piece::Kind::cubic;
        p.range = h[i];
        p.a0 = points[i];
        p.a1 = (points[i + 1] - points[i]) / h[i] - h[i] * (2 * m[i] + m[i + 1]) / 6;
        p.a2 = m[i] / 2;
        p.a3 = (m[i + 1] - m[i]) / (6 * h[i]);
        p.r0 = radii[i];
        p.r1 = (radii[i + 1] - radii[i]) / h[i] - h[i] * (2 * q[i] + q[i + 1]) / 6;
        p.r2 = q[i] / 2;
        p.r3 = (q[i + 1] - q[i]) / (6 * h[i]);
        for (int k = 1; k < 8; ++k) { // a spline of strongly varying radii may overshoot
            const double radius = Centreline::derivatives_(p, p.range * k / 8).radius;
            if (!(radius > 0))
                report(i, "interpolated radius " + std::to_string(radius) + " after it",
                       "radii that vary less from point to point");
        }
        p.length = Centreline::length_to_(p, p.range);
        line.add_(p);
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    const CurvePoint end = line.at(line.length());
    line.end_ = end.position;
    line.tangent_ = end.tangent;
    line.normal_ = end.tangent.unitOrthogonal();
    line.radius_ = end.radius;
    return line;
}

} // namespace amontons
