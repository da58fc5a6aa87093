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
/// Of Newton from the guess, before a bracket is made.
constexpr int kQuickIterations = 6;

/// r_t of slip with multiplier s, in the basis. By components: this is the inner loop of nsgs.
struct SlipPoint {
    double rt1 = 0, rt2 = 0;
    double t = 0; ///< |r_t|
    double h = 0, slope = 0;
};

/// h and its derivative at s; needs large + s > 0 and small + s > 0.
/// @param k  mu / A_nn
SlipPoint slip_at(const LocalBlock& a, double k, double bn, double c1, double c2, double s)
{
    const double l1 = a.large + s, l2 = a.small + s;
    SlipPoint p;
    double rate1, rate2; // d r_t / ds = -(S + s)^-1 r_t
    if (a.skew == 0) {
        const double inverse1 = 1 / l1, inverse2 = 1 / l2;
        p.rt1 = -c1 * inverse1;
        p.rt2 = -c2 * inverse2;
        rate1 = -p.rt1 * inverse1;
        rate2 = -p.rt2 * inverse2;
    } else {
        const double d = 1 / (l1 * l2 + a.skew * a.skew);
        p.rt1 = -(l2 * c1 - a.skew * c2) * d;
        p.rt2 = -(a.skew * c1 + l1 * c2) * d;
        rate1 = -(l2 * p.rt1 - a.skew * p.rt2) * d;
        rate2 = -(a.skew * p.rt1 + l1 * p.rt2) * d;
    }
    p.t = std::sqrt(p.rt1 * p.rt1 + p.rt2 * p.rt2);
    const double inverse_t = 1 / p.t;
    const double coupled = a.to_normal[0] * p.rt1 + a.to_normal[1] * p.rt2;
    const double coupled_rate = a.to_normal[0] * rate1 + a.to_normal[1] * rate2;
    const double ratio = -k * (bn + coupled) * inverse_t; // mu r_n / |r_t|
    const double t_rate = (p.rt1 * rate1 + p.rt2 * rate2) * inverse_t;
    p.h = ratio - 1;
    p.slope = -(k * coupled_rate + ratio * t_rate) * inverse_t;
    return p;
}

/// The reaction that makes u = 0 with the least |r_t|; false if there is none.
bool stick_point(const LocalBlock& a, const Eigen::Vector2d& c, double size_of_c,
                 Eigen::Vector2d& rt)
{
    if (a.large <= 0 || a.small <= 0) {
        // Singular, in one direction or both: there c must vanish, and r_t is free, so 0.
        if (a.skew != 0 || a.small < 0) return false;
        if (std::abs(c[1]) > kRoundOff * size_of_c) return false;
        if (a.large <= 0 && std::abs(c[0]) > kRoundOff * size_of_c) return false;
        rt = {a.large > 0 ? -c[0] / a.large : 0, 0};
    } else if (a.skew == 0) {
        rt = {-c[0] / a.large, -c[1] / a.small};
    } else {
        const double d = a.large * a.small + a.skew * a.skew;
        rt = {-(a.small * c[0] - a.skew * c[1]) / d, -(a.skew * c[0] + a.large * c[1]) / d};
    }
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
    const double radius = std::sqrt(half_difference * half_difference + off * off);
    // The half angle's tangent, from the nearer axis: the sine of a graded block keeps its digits.
    const double tangent = radius > 0 ? off / (std::abs(half_difference) + radius) : 0;
    a.cosine = 1 / std::sqrt(1 + tangent * tangent);
    a.sine = tangent * a.cosine;
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
    if (a.large > 0) a.inverse_large = 1 / a.large;
    if (a.small > 0) a.inverse_small = 1 / a.small;
    a.coupling = a.to_normal.norm() / a.normal;
    a.solvable = a.large >= 0;
    return a;
}

LocalReaction solve_local(const LocalBlock& a, double mu, const Vec3& b, double guess, double loose)
{
    LocalReaction result;
    if (b[0] >= 0) {
        result.state = LocalState::open;
        return result;
    }
    if (!a.solvable || !b.allFinite()) return result;

    const auto accept = [&](double rn, const Eigen::Vector2d& rt, LocalState state) {
        const Vec3 r{rn, a.cosine * rt[0] - a.sine * rt[1], a.sine * rt[0] + a.cosine * rt[1]};
        if (!r.allFinite()) return;
        result.r = r;
        result.state = state;
    };
    const double alone = -b[0] / a.normal; // r_n without friction
    if (mu == 0) {
        accept(alone, Eigen::Vector2d::Zero(), LocalState::slip);
        return result;
    }

    const Eigen::Vector2d bt{a.cosine * b[1] + a.sine * b[2], -a.sine * b[1] + a.cosine * b[2]};
    const Eigen::Vector2d shed = -alone * a.from_normal;
    const Eigen::Vector2d c = bt - shed;
    const bool regular = a.small > 0 && a.skew == 0;
    Eigen::Vector2d rt(-c[0] * a.inverse_large, -c[1] * a.inverse_small);
    if (regular || stick_point(a, c, bt.norm() + shed.norm(), rt)) {
        const double rn = alone - a.to_normal.dot(rt) / a.normal;
        if (rn >= 0 && rt.squaredNorm() <= mu * rn * (mu * rn)) {
            accept(rn, rt, LocalState::stick);
            return result;
        }
    }
    const double k = mu / a.normal;
    const double round_off = 2 * kEpsilon * (1 + mu * a.coupling); // h is not known better
    // On the cone to the last digit. Moving r_n is safe, |A_nt|^2 <= A_nn |A_tt|; moving r_t by
    // the same share would multiply the round-off of r_n by mu |A_nt| / A_nn.
    const auto accept_slip = [&](const SlipPoint& p, double s) {
        if (!(p.h > -1)) return;
        accept(p.t / mu, {p.rt1, p.rt2}, LocalState::slip);
        result.multiplier = s;
    };

    // Newton from a good guess needs no bracket; where it does not halve h each time, it does.
    if (guess > 0 && a.small > 0) {
        double s = guess, last = std::numeric_limits<double>::infinity(), enough = round_off;
        for (int i = 0; i < kQuickIterations; ++i) {
            const SlipPoint p = slip_at(a, k, b[0], c[0], c[1], s);
            const double size = std::abs(p.h);
            if (size <= enough) {
                accept_slip(p, s);
                return result;
            }
            if (i == 0) enough = std::max(round_off, loose * size);
            const double next = s - p.h / p.slope;
            if (!(size <= last / 2) || !(next > 0)) break;
            last = size;
            s = next;
        }
    }

    // |r_t| <= |c| / (s + small) makes h > 0 at the upper end, for any direction of A_nt.
    const double c_size = c.norm();
    const double start = std::max(0.0, -a.small);
    const double coupling = 1 + mu * a.coupling;
    double low = start;
    double high = start + c_size * coupling / (mu * alone) * (1 + 4 * kEpsilon);
    if (!(high > low) || !std::isfinite(high)) return result;
    if (a.small <= 0) {
        // No stick point tells the sign at the lower end: look next to it.
        const SlipPoint p =
            slip_at(a, k, b[0], c[0], c[1], low + kEpsilon * (low + kEpsilon * high));
        if (!(p.h < 0)) return result;
    }

    double s = guess > low && guess < high
                   ? guess
                   : std::clamp(c_size / (mu * alone) - (a.large + a.small) / 2, low, high);
    if (s <= low) s = low + (high - low) * 1e-3;
    double last = std::numeric_limits<double>::infinity();
    SlipPoint p;
    for (int i = 0; i < kMaxIterations; ++i) {
        p = slip_at(a, k, b[0], c[0], c[1], s);
        const double size = std::abs(p.h);
        if (size <= round_off) break;
        (p.h < 0 ? low : high) = s;
        double next = s - p.h / p.slope;
        // Newton while it stays inside and halves h; else the bracket is halved.
        const bool slow = size > last / 2;
        last = size;
        if (!(next > low && next < high) || slow) {
            // Bisection in the logarithm of small + s: the scale on which r_t(s) varies.
            const double floor = kEpsilon * kEpsilon * high;
            const double x = std::max(low + a.small, floor), y = std::max(high + a.small, floor);
            next = x * 4 < y ? std::sqrt(x) * std::sqrt(y) - a.small : (low + high) / 2;
            if (!(next > low && next < high)) next = (low + high) / 2;
        }
        if (!(next > low && next < high) || std::abs(next - s) <= kEpsilon * (s + a.small)) break;
        s = next;
    }
    accept_slip(p, s);
    return result;
}

} // namespace amontons
