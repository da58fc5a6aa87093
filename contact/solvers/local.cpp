#include "contact/solvers/local.hpp"

#include "mesh/base/limits.hpp"

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

/// Below this times the size of the terms it came from, a number is round-off.
constexpr double kLocalRoundOff = 8 * kEpsilon;
/// Bisection of a bracket of any two doubles ends within this.
constexpr int kMaxIterations = 200;
/// Of Newton from the guess, before a bracket is made.
constexpr int kQuickIterations = 6;

/// Share by which a near guess may be off, in S + s; cubed it is below what sweeps need.
constexpr double kNear = 0.02;

/// r_t of slip with multiplier s, in the basis. By components: this is the inner loop of nsgs.
struct SlipPoint {
    double rt1 = 0, rt2 = 0;
    double t = 0; ///< |r_t|
    double h = 0, slope = 0;
};

/// h and its derivative at s; needs large + s > 0 and small + s > 0.
/// @param k  mu / A_nn
inline SlipPoint slip_at(const LocalBlock& a, double k, double bn, double c1, double c2, double s)
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
        if (std::abs(c[1]) > kLocalRoundOff * size_of_c) return false;
        if (a.large <= 0 && std::abs(c[0]) > kLocalRoundOff * size_of_c) return false;
        rt = {a.large > 0 ? -c[0] / a.large : 0, 0};
    } else if (a.skew == 0) {
        rt = {-c[0] / a.large, -c[1] / a.small};
    } else {
        const double d = a.large * a.small + a.skew * a.skew;
        rt = {-(a.small * c[0] - a.skew * c[1]) / d, -(a.skew * c[0] + a.large * c[1]) / d};
    }
    return true;
}

/// The root of h between two signs. @param s  a guess, leaves as the root
/// @returns false if there is no sign that shows one
bool slip_by_bracket(const LocalBlock& a, double mu, double alone, double bn, double c1, double c2,
                     SlipPoint& p, double& s)
{
    const double k = mu * a.inverse_normal;
    const double round_off = 2 * kEpsilon * (1 + mu * a.coupling); // h is not known better
    // |r_t| <= |c| / (s + small) makes h > 0 at the upper end, for any direction of A_nt.
    const double c_size = std::sqrt(c1 * c1 + c2 * c2);
    const double start = std::max(0.0, -a.small);
    const double coupling = 1 + mu * a.coupling;
    double low = start;
    double high = start + c_size * coupling / (mu * alone) * (1 + 4 * kEpsilon);
    if (!(high > low) || !std::isfinite(high)) return false;
    if (a.small <= 0) {
        // Without a stick point the sign at the lower end is unknown: evaluate next to it.
        const SlipPoint next_to_low =
            slip_at(a, k, bn, c1, c2, low + kEpsilon * (low + kEpsilon * high));
        if (!(next_to_low.h < 0)) return false;
    }

    if (!(s > low && s < high))
        s = std::clamp(c_size / (mu * alone) - (a.large + a.small) / 2, low, high);
    if (s <= low) s = low + (high - low) * 1e-3;
    double last = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kMaxIterations; ++i) {
        p = slip_at(a, k, bn, c1, c2, s);
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
    return true;
}

} // namespace

LocalBlock prepare(const Mat3& A)
{
    LocalBlock a;
    const double size = A.cwiseAbs().maxCoeff();
    a.normal = A(0, 0);
    a.solvable = a.normal > kLocalRoundOff * size && std::isfinite(size);
    if (!a.solvable) return a;
    a.inverse_normal = 1 / a.normal;

    // Each entry's round-off comes from the terms that it was made of.
    const Eigen::Matrix2d shed = A.block<2, 1>(1, 0) * A.block<1, 2>(0, 1) / a.normal;
    const Eigen::Matrix2d S = A.block<2, 2>(1, 1) - shed;
    const double round_off =
        kLocalRoundOff * (A.block<2, 2>(1, 1).cwiseAbs().maxCoeff() + shed.cwiseAbs().maxCoeff());

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

LocalReaction solve_local(const LocalBlock& a, double mu, const Vec3& b, double guess, bool loose)
{
    LocalReaction result;
    if (b[0] >= 0) {
        result.state = LocalState::open;
        return result;
    }
    if (!a.solvable || !std::isfinite(b[0] + b[1] + b[2])) return result;

    // ---- Open and frictionless
    // By components from here on: vectors that are written by halves wait for themselves.
    const auto accept = [&](double rn, double rt1, double rt2, LocalState state) {
        const Vec3 r{rn, a.cosine * rt1 - a.sine * rt2, a.sine * rt1 + a.cosine * rt2};
        if (!std::isfinite(r[0] + r[1] + r[2])) return;
        result.r = r;
        result.state = state;
    };
    const double alone = -b[0] * a.inverse_normal; // r_n without friction
    if (mu == 0) {
        accept(alone, 0, 0, LocalState::slip);
        return result;
    }

    const double bt1 = a.cosine * b[1] + a.sine * b[2], bt2 = a.cosine * b[2] - a.sine * b[1];
    const double shed1 = -alone * a.from_normal[0], shed2 = -alone * a.from_normal[1];
    const double c1 = bt1 - shed1, c2 = bt2 - shed2;
    const double coupling1 = a.to_normal[0] * a.inverse_normal;
    const double coupling2 = a.to_normal[1] * a.inverse_normal;

    // ---- Stick
    const auto sticks = [&](double rt1, double rt2) {
        const double rn = alone - (coupling1 * rt1 + coupling2 * rt2);
        if (!(rn >= 0 && rt1 * rt1 + rt2 * rt2 <= mu * rn * (mu * rn))) return false;
        accept(rn, rt1, rt2, LocalState::stick);
        return true;
    };
    if (a.small > 0 && a.skew == 0) {
        if (sticks(-c1 * a.inverse_large, -c2 * a.inverse_small)) return result;
    } else {
        const double size_of_c = std::hypot(bt1, bt2) + std::hypot(shed1, shed2);
        Eigen::Vector2d rt;
        if (stick_point(a, {c1, c2}, size_of_c, rt) && sticks(rt[0], rt[1])) return result;
    }

    // ---- Slip: the root of h(s)
    const double k = mu * a.inverse_normal;
    const double round_off = 2 * kEpsilon * (1 + mu * a.coupling); // h is not known better
    // On the cone to the last digit. Moving r_n is safe, |A_nt|^2 <= A_nn |A_tt|; moving r_t by
    // the same share would multiply the round-off of r_n by mu |A_nt| / A_nn.
    const auto accept_slip = [&](const SlipPoint& p, double s) {
        if (!(p.h > -1)) return;
        accept(p.t / mu, p.rt1, p.rt2, LocalState::slip);
        result.multiplier = s;
    };

    // Newton from a good guess needs no bracket; where it does not halve h each time, it does.
    if (loose && guess > 0 && a.small > 0 && a.skew == 0) {
        const double inverse_mu = 1 / mu; // long before it is needed
        double s = guess, last = std::numeric_limits<double>::infinity();
        for (int i = 0; i < kQuickIterations; ++i) {
            // Newton's step on h as in slip_at, h = (N - t) / t, in an order in which no division
            // waits for a root.
            const double inverse1 = 1 / (a.large + s), inverse2 = 1 / (a.small + s);
            const double rt1 = -c1 * inverse1, rt2 = -c2 * inverse2;
            const double y1 = rt1 * inverse1, y2 = rt2 * inverse2; // -d r_t / ds
            const double t2 = rt1 * rt1 + rt2 * rt2;
            const double N = mu * (alone - (coupling1 * rt1 + coupling2 * rt2)); // mu r_n
            const double slope =
                mu * (coupling1 * y1 + coupling2 * y2) * t2 + N * (rt1 * y1 + rt2 * y2);
            const double difference = N - std::sqrt(t2);
            const double step = -difference * t2 / slope;
            // r_t at s + step, the inverses by their series.
            const double x1 = step * inverse1, x2 = step * inverse2;
            if (std::abs(x2) < kNear && N > 0) { // and |x1| <= |x2|
                const double near1 = rt1 - rt1 * (x1 * (1 - x1)),
                             near2 = rt2 - rt2 * (x2 * (1 - x2));
                accept(std::sqrt(near1 * near1 + near2 * near2) * inverse_mu, near1, near2,
                       LocalState::slip);
                result.multiplier = s + step;
                return result;
            }
            const double size = std::abs(difference) / std::sqrt(t2);
            if (!(size <= last / 2) || !(s + step > 0)) break;
            last = size;
            s += step;
        }
    } else if (guess > 0 && a.small > 0) {
        double s = guess, last = std::numeric_limits<double>::infinity();
        for (int i = 0; i < kQuickIterations; ++i) {
            const SlipPoint p = slip_at(a, k, b[0], c1, c2, s);
            const double size = std::abs(p.h);
            if (size <= round_off) {
                accept_slip(p, s);
                return result;
            }
            const double next = s - p.h / p.slope;
            if (!(size <= last / 2) || !(next > 0)) break;
            last = size;
            s = next;
        }
    }
    SlipPoint p;
    double s = guess;
    if (slip_by_bracket(a, mu, alone, b[0], c1, c2, p, s)) accept_slip(p, s);
    return result;
}

} // namespace amontons
