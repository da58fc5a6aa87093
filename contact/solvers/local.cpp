#include "contact/solvers/local.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

// With u_n = 0:        r_n = -(b_n + A_nt . r_t) / A_nn
//                      u_t = S r_t + c,  S = A_tt - A_tn A_nt / A_nn,  c = b_t - A_tn b_n / A_nn
// Slip, u_t = -s r_t:  r_t(s) = -(S + s)^-1 c
// and s is a root of   h(s) = mu r_n(s) / |r_t(s)| - 1.
//
// h is exactly linear when S is a multiple of one, and near to it otherwise: Newton on h takes
// few steps. h -> +inf with s, and h(0) < 0 when the contact does not stick: a bracket for ever.
// S is taken in the eigenbasis of its symmetric part: the adjugate would lose the small
// eigenvalue, and with it the residual along the large one.

namespace amontons {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// Below this times the size of the terms it came from, a number is round-off.
constexpr double kRoundOff = 8 * kEpsilon;
/// Bisection of a bracket of any two doubles ends within this.
constexpr int kMaxIterations = 200;

struct SlipPoint {
    Eigen::Vector2d rt; ///< in the basis
    double rn = 0;
    double h = 0, slope = 0;
};

/// h and its derivative at s; needs large + s > 0 and small + s > 0.
SlipPoint slip_at(const LocalBlock& a, double mu, double bn, const Eigen::Vector2d& c, double s)
{
    const double l1 = a.large + s, l2 = a.small + s;
    SlipPoint p;
    Eigen::Vector2d rate; // d r_t / ds = -(S + s)^-1 r_t
    if (a.skew == 0) {
        p.rt = {-c[0] / l1, -c[1] / l2};
        rate = {-p.rt[0] / l1, -p.rt[1] / l2};
    } else {
        const double d = l1 * l2 + a.skew * a.skew;
        p.rt = {-(l2 * c[0] - a.skew * c[1]) / d, -(a.skew * c[0] + l1 * c[1]) / d};
        rate = {-(l2 * p.rt[0] - a.skew * p.rt[1]) / d, -(a.skew * p.rt[0] + l1 * p.rt[1]) / d};
    }
    p.rn = -(bn + a.to_normal.dot(p.rt)) / a.normal;
    const double t = p.rt.norm();
    p.h = mu * p.rn / t - 1;
    p.slope = (-mu * a.to_normal.dot(rate) / a.normal - mu * p.rn * p.rt.dot(rate) / (t * t)) / t;
    return p;
}

/// The reaction that makes u = 0 with the least |r_t|; false if there is none.
bool stick_point(const LocalBlock& a, double bn, const Eigen::Vector2d& c, double size_of_c,
                 SlipPoint& p)
{
    if (a.large <= 0 || a.small <= 0) {
        // Singular, in one direction or both: there c must vanish, and r_t is free, so 0.
        if (a.skew != 0 || a.small < 0) return false;
        if (std::abs(c[1]) > kRoundOff * size_of_c) return false;
        if (a.large <= 0 && std::abs(c[0]) > kRoundOff * size_of_c) return false;
        p.rt = {a.large > 0 ? -c[0] / a.large : 0, 0};
    } else {
        const double d = a.large * a.small + a.skew * a.skew;
        if (a.skew == 0)
            p.rt = {-c[0] / a.large, -c[1] / a.small};
        else
            p.rt = {-(a.small * c[0] - a.skew * c[1]) / d, -(a.skew * c[0] + a.large * c[1]) / d};
    }
    p.rn = -(bn + a.to_normal.dot(p.rt)) / a.normal;
    return true;
}

} // namespace

LocalBlock prepare(const Mat3& A)
{
    LocalBlock a;
    const double size = A.cwiseAbs().maxCoeff();
    a.normal = A(0, 0);
    a.solvable = a.normal > kRoundOff * size && std::isfinite(size);
    if (!a.solvable) return a;

    // Each entry's round-off comes from the terms that it was made of.
    const Eigen::Matrix2d shed = A.block<2, 1>(1, 0) * A.block<1, 2>(0, 1) / a.normal;
    const Eigen::Matrix2d S = A.block<2, 2>(1, 1) - shed;
    const double round_off =
        kRoundOff * (A.block<2, 2>(1, 1).cwiseAbs().maxCoeff() + shed.cwiseAbs().maxCoeff());

    const double off = (S(0, 1) + S(1, 0)) / 2;
    const double half_difference = (S(0, 0) - S(1, 1)) / 2;
    const double radius = std::hypot(half_difference, off);
    // Measured from the nearer axis: the sine of a graded block keeps its own digits.
    const double angle = std::atan2(off, std::abs(half_difference)) / 2;
    a.cosine = std::cos(angle);
    a.sine = std::sin(angle);
    if (half_difference < 0) std::swap(a.cosine, a.sine);
    a.large = (S(0, 0) + S(1, 1)) / 2 + radius;
    // The determinant keeps a small eigenvalue that the difference of two large ones loses.
    if (a.large > 0) a.small = (S(0, 0) * S(1, 1) - off * off) / a.large;
    a.skew = (S(0, 1) - S(1, 0)) / 2;
    if (std::abs(a.large) <= round_off) a.large = 0;
    if (std::abs(a.small) <= round_off) a.small = 0;
    if (std::abs(a.skew) <= round_off) a.skew = 0;

    const auto turned = [&](double x, double y) {
        return Eigen::Vector2d{a.cosine * x + a.sine * y, -a.sine * x + a.cosine * y};
    };
    a.to_normal = turned(A(0, 1), A(0, 2));
    a.from_normal = turned(A(1, 0), A(2, 0));
    a.solvable = a.large >= 0;
    return a;
}

LocalReaction solve_local(const LocalBlock& a, double mu, const Vec3& b, double guess)
{
    LocalReaction result;
    if (b[0] >= 0) {
        result.state = LocalState::open;
        return result;
    }
    if (!a.solvable || !b.allFinite()) return result;

    const auto accept = [&](const SlipPoint& p, LocalState state) {
        const Vec3 r{p.rn, a.cosine * p.rt[0] - a.sine * p.rt[1],
                     a.sine * p.rt[0] + a.cosine * p.rt[1]};
        if (!r.allFinite()) return;
        result.r = r;
        result.state = state;
    };

    SlipPoint p;
    if (mu == 0) {
        p.rt.setZero();
        p.rn = -b[0] / a.normal;
        accept(p, LocalState::slip);
        return result;
    }

    const Eigen::Vector2d bt{a.cosine * b[1] + a.sine * b[2], -a.sine * b[1] + a.cosine * b[2]};
    const Eigen::Vector2d shed = a.from_normal * (b[0] / a.normal);
    const Eigen::Vector2d c = bt - shed;
    if (stick_point(a, b[0], c, bt.norm() + shed.norm(), p) && p.rt.norm() <= mu * p.rn) {
        accept(p, LocalState::stick);
        return result;
    }

    // |r_t| <= |c| / (s + small) makes h > 0 at the upper end, for any direction of A_nt.
    const double c_size = c.norm();
    const double start = std::max(0.0, -a.small);
    const double k = mu / a.normal;
    double low = start;
    double high = start + c_size * (1 + k * a.to_normal.norm()) / (-k * b[0]) * (1 + 4 * kEpsilon);
    if (!(high > low) || !std::isfinite(high)) return result;
    if (a.small <= 0) {
        // No stick point tells the sign at the lower end: look next to it.
        p = slip_at(a, mu, b[0], c, low + kEpsilon * (low + kEpsilon * high));
        if (!(p.h < 0)) return result;
    }

    double s = guess > low && guess < high
                   ? guess
                   : std::clamp(c_size / (-k * b[0]) - (a.large + a.small) / 2, low, high);
    if (s <= low) s = low + (high - low) * 1e-3;
    double width = high - low;
    for (int i = 0; i < kMaxIterations; ++i) {
        p = slip_at(a, mu, b[0], c, s);
        if (std::abs(p.h) <= 2 * kEpsilon) break;
        (p.h < 0 ? low : high) = s;
        double next = s - p.h / p.slope;
        // Newton must stay inside and shrink the bracket; every third step may be forced.
        const bool shrunk = high - low <= width / 2;
        if (i % 3 == 2) width = high - low;
        if (!(next > low && next < high) || (i % 3 == 2 && !shrunk)) {
            // Bisection in the logarithm of small + s: the scale on which r_t(s) varies.
            const double floor = kEpsilon * kEpsilon * high;
            const double x = std::max(low + a.small, floor), y = std::max(high + a.small, floor);
            next = x * 4 < y ? std::sqrt(x) * std::sqrt(y) - a.small : (low + high) / 2;
            if (!(next > low && next < high)) next = (low + high) / 2;
        }
        if (!(next > low && next < high) || std::abs(next - s) <= kEpsilon * (s + a.small)) break;
        s = next;
    }
    // On the cone to the last digit. Moving r_n is safe, |A_nt|^2 <= A_nn |A_tt|; moving r_t by
    // the same share would multiply the round-off of r_n by mu |A_nt| / A_nn.
    if (!(p.rn > 0)) return result;
    p.rn = p.rt.norm() / mu;
    accept(p, LocalState::slip);
    return result;
}

} // namespace amontons
