#include "contact/reaction_range.hpp"

#include "mesh/base/dense.hpp"
#include "mesh/base/error.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

// The program, in the variables theta (how much of the reaction found is taken back), lambda (of
// rays of the cones), rows of any sign, motions a, and slacks s:
//
//     max c . d,   d = -theta found + sum of lambda ray,   K (d, a) - s = 0,
//     0 <= theta <= 1,   lambda >= 0,   lower <= s <= upper.
//
// Each r within the cones is one of these with theta = 1, and d = 0 is a vertex to begin with: all
// slacks are basic. Cones are represented by their rays, one of 64 beside the best of them where a
// ray would enter.

namespace amontons {
namespace {

constexpr int kDirections = 64;
constexpr double kOptimal = 1e-7;      // of the largest c, what a unit of a variable gains
constexpr double kSmallPivot = 1e-11;  // entries that do not block, of the largest
constexpr double kRelax = 1e-4;        // of a slack's bounds, by which the ratio test exceeds
constexpr double kRelaxRay = 1e-12;    // of the rest
constexpr int kCheck = 100;            // pivots
constexpr double kInconsistent = 1e-3; // of bounds: with a larger error the inverse is made anew
constexpr double kHoldsNothing = 1e-6; // singular values of K below this count as zero
constexpr int kRangeRefinements = 4;
constexpr double kLeft = 1e-9;     // of c: a remainder of this size is round-off
constexpr double kViolated = 1e-2; // of bounds: a larger violation is no solution

} // namespace

ReactionRange::ReactionRange(const ReactionSet& set, double beyond) : set_(set), beyond_(beyond)
{
    const Eigen::Index m = set.K.rows(), reactions = set.found.size();
    AMONTONS_ASSERT(set.lower.size() == m && set.upper.size() == m && reactions <= set.K.cols());
    found_column_ = set.K.leftCols(reactions) * set.found;
    constexpr double kDenseShare = 0.1;
    Eigen::MatrixXd gram;
    if (double(set.K.nonZeros()) > kDenseShare * double(set.K.size())) {
        const Eigen::MatrixXd K = set.K;
        gram = K * K.transpose();
    } else {
        gram = Eigen::MatrixXd(set.K * Delassus::Sparse(set.K.transpose()));
    }
    const double most = m > 0 ? gram.diagonal().maxCoeff() : 0;
    gram.diagonal().array() += kHoldsNothing * kHoldsNothing * most;
    gram_root_ = cholesky_root(gram);
    for (Eigen::Index i = 0; i < m; ++i)
        basic_.push_back({Variable::slack, int(i), 1, {1, 0, 0}});
    basic_value_ = Eigen::VectorXd::Zero(m);
    inverse_ = -Eigen::MatrixXd::Identity(m, m);
    slack_.assign(std::size_t(m), 0);
    slack_basic_.assign(std::size_t(m), 1);
    signless_basic_.assign(std::size_t(set.K.cols()), 0);
}

/// With K^T z = c: c . x = z . K x, whose terms are bounded. The shortest z is taken.
double ReactionRange::widest(const Eigen::VectorXd& c) const
{
    if (gram_root_.size() == 0) return std::numeric_limits<double>::infinity();
    Eigen::VectorXd left = Eigen::VectorXd::Zero(set_.K.cols());
    left.head(c.size()) = c;
    Eigen::VectorXd z = Eigen::VectorXd::Zero(set_.K.rows());
    for (int i = 0; i < kRangeRefinements; ++i) {
        Eigen::VectorXd b = set_.K * left;
        b = gram_root_.transpose().triangularView<Eigen::Lower>().solve(b);
        b = gram_root_.triangularView<Eigen::Upper>().solve(b);
        z += b;
        left -= set_.K.transpose() * b;
        if (left.cwiseAbs().maxCoeff() <= kLeft * c.cwiseAbs().maxCoeff()) break;
    }
    if (!(left.cwiseAbs().maxCoeff() <= kLeft * c.cwiseAbs().maxCoeff()))
        return std::numeric_limits<double>::infinity();
    return z.cwiseAbs().dot(set_.upper - set_.lower);
}

/// action(row, value) for the entries of a variable's column.
template <class Action>
void ReactionRange::for_column(const Variable& v, const Action& action) const
{
    if (v.kind == Variable::slack) {
        action(Eigen::Index(v.index), -1.0);
    } else if (v.kind == Variable::share) {
        for (Eigen::Index i = 0; i < found_column_.size(); ++i)
            action(i, -found_column_[i]);
    } else {
        for (int k = 0; k < v.rows; ++k)
            for (Delassus::Sparse::InnerIterator entry(set_.K, v.index + k); entry; ++entry)
                action(Eigen::Index(entry.row()), v.part[k] * entry.value());
    }
}

/// What a unit of the variable gives c . d.
double ReactionRange::value_of(const Variable& v, const Eigen::VectorXd& c) const
{
    switch (v.kind) {
    case Variable::slack:
        return 0;
    case Variable::share:
        return -c.dot(set_.found);
    case Variable::signless:
        return v.index < c.size() ? c[v.index] : 0;
    case Variable::ray:
        break;
    }
    double sum = 0;
    for (int i = 0; i < v.rows; ++i)
        sum += v.part[i] * c[v.index + i];
    return sum;
}

double ReactionRange::lower(const Variable& v) const
{
    if (v.kind == Variable::slack) return set_.lower[v.index];
    return v.kind == Variable::signless ? -std::numeric_limits<double>::infinity() : 0;
}

double ReactionRange::upper(const Variable& v) const
{
    if (v.kind == Variable::slack) return set_.upper[v.index];
    return v.kind == Variable::share ? 1 : std::numeric_limits<double>::infinity();
}

/// The inverse and the basic variables anew, from the columns.
bool ReactionRange::refactor(std::int64_t& work)
{
    const Eigen::Index m = set_.K.rows();
    work -= 2 * m * m * m;
    if (work < 0) return false;
    pivots_ = 0;
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(m, m);
    for (Eigen::Index k = 0; k < m; ++k)
        for_column(basic_[std::size_t(k)], [&](Eigen::Index i, double v) { B(i, k) += v; });
    inverse_ = LuFactor(B).inverse();
    if (!inverse_.allFinite()) return false;
    basic_value_ = -(inverse_ * of_others());
    return true;
}

/// What the variables that are not basic add to K (d, a) - s.
Eigen::VectorXd ReactionRange::of_others() const
{
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(set_.K.rows());
    if (!share_basic_) sum -= share_ * found_column_;
    for (Eigen::Index i = 0; i < sum.size(); ++i)
        if (!slack_basic_[std::size_t(i)]) sum[i] -= slack_[std::size_t(i)];
    return sum;
}

/// The basic variables fit their columns: what round-off of the inverse has left is small beside
/// the bounds.
bool ReactionRange::is_consistent() const
{
    Eigen::VectorXd left = of_others();
    for (std::size_t k = 0; k < basic_.size(); ++k)
        for_column(basic_[k],
                   [&](Eigen::Index i, double v) { left[i] += v * basic_value_[Eigen::Index(k)]; });
    return (left.cwiseAbs().array() <= kInconsistent * (set_.upper - set_.lower).array()).all();
}

ReactionRange::End ReactionRange::maximise(const Eigen::VectorXd& c, std::int64_t& work,
                                           double enough)
{
    const Eigen::Index m = set_.K.rows(), n = set_.K.cols();
    const double optimal = kOptimal * c.cwiseAbs().maxCoeff();
    const double begun = now_;

    // ---- Simplex steps
    while (true) {
        work -= m * m + 4 * set_.K.nonZeros() + n;
        if (work < 0) return End::no_work;
        if (now_ - begun >= enough) return End::enough;

        // ---- The variable that enters: with y the multipliers of the rows, c - K^T y is the gain
        // of a unit of each variable that is not basic; of a slack the gain over its whole range
        Eigen::VectorXd y = Eigen::VectorXd::Zero(m);
        for (Eigen::Index k = 0; k < m; ++k)
            if (const double own = value_of(basic_[std::size_t(k)], c); own != 0)
                y += own * inverse_.row(k).transpose();
        Eigen::VectorXd gain = -(set_.K.transpose() * y);
        gain.head(c.size()) += c;
        Variable enters;
        double best = optimal, rate = 0;
        const auto offer = [&](const Variable& v, double of_unit, double weight) {
            if (std::abs(of_unit) * weight <= best) return;
            best = std::abs(of_unit) * weight;
            enters = v;
            rate = of_unit;
        };
        const auto row = [](Variable::Kind kind, Eigen::Index index) {
            return Variable{kind, int(index), 1, {1, 0, 0}};
        };
        for (Eigen::Index i = 0; i < m; ++i) {
            if (slack_basic_[std::size_t(i)]) continue;
            const bool at_upper = slack_[std::size_t(i)] > 0.5 * (set_.lower[i] + set_.upper[i]);
            if (at_upper ? y[i] < 0 : y[i] > 0)
                offer(row(Variable::slack, i), y[i], set_.upper[i] - set_.lower[i]);
        }
        if (!share_basic_) {
            const double g = -gain.head(c.size()).dot(set_.found);
            if (share_ < 0.5 ? g > 0 : g < 0) offer(row(Variable::share, 0), g, 1);
        }
        for (const ReactionSet::Contact& k : set_.contact) {
            if (k.kind == ContactKind::bilateral) {
                if (!signless_basic_[std::size_t(k.first)])
                    offer(row(Variable::signless, k.first), gain[k.first], 1);
                continue;
            }
            const Variable ray = best_ray(k, gain);
            if (const double g = value_of(ray, gain); g > 0) offer(ray, g, 1);
        }
        for (Eigen::Index j = c.size(); j < n; ++j)
            if (!signless_basic_[std::size_t(j)]) offer(row(Variable::signless, j), gain[j], 1);
        if (rate == 0) return End::optimum;

        // ---- The step, and the variable that leaves: of those that reach a bound about first,
        // within relaxed bounds, the one with the largest pivot (Harris)
        const double sign = rate > 0 ? 1 : -1;
        Eigen::VectorXd w = Eigen::VectorXd::Zero(m);
        for_column(enters, [&](Eigen::Index i, double v) { w += v * inverse_.col(i); });
        const double small = kSmallPivot * std::max(1.0, w.cwiseAbs().maxCoeff());
        const auto room = [&](Eigen::Index k, bool relaxed) {
            const Variable& v = basic_[std::size_t(k)];
            const double way = -sign * w[k]; // of the basic variable
            const double slack = !relaxed                    ? 0
                                 : v.kind == Variable::slack ? kRelax * (upper(v) - lower(v))
                                                             : kRelaxRay;
            return way > 0 ? (upper(v) - basic_value_[k] + slack) / way
                           : (basic_value_[k] - lower(v) + slack) / -way;
        };
        const double own = upper(enters) - lower(enters);
        double relaxed = own;
        for (Eigen::Index k = 0; k < m; ++k)
            if (std::abs(w[k]) > small) relaxed = std::min(relaxed, room(k, true));
        Eigen::Index leaves = -1;
        double step = own;
        for (Eigen::Index k = 0; k < m; ++k)
            if (std::abs(w[k]) > small && room(k, false) <= relaxed &&
                (leaves < 0 || std::abs(w[k]) > std::abs(w[leaves])))
                leaves = k;
        if (leaves >= 0) step = std::max(0.0, room(leaves, false));
        if (step >= own) { // from one bound to the other
            leaves = -1;
            step = own;
        }
        if (!std::isfinite(step) || now_ + std::abs(rate) * step > beyond_) return End::no_bound;

        // ---- The new values, and the exchange in the basis by a product of elementary matrices
        now_ += std::abs(rate) * step;
        basic_value_ -= sign * step * w;
        const double from = enters.kind == Variable::slack   ? slack_[std::size_t(enters.index)]
                            : enters.kind == Variable::share ? share_
                                                             : 0;
        if (leaves < 0) {
            (enters.kind == Variable::slack ? slack_[std::size_t(enters.index)] : share_) =
                from + sign * step;
            continue;
        }
        const Variable leaving = basic_[std::size_t(leaves)];
        const bool at_upper = -sign * w[leaves] > 0;
        if (leaving.kind == Variable::slack) {
            slack_basic_[std::size_t(leaving.index)] = 0;
            slack_[std::size_t(leaving.index)] = at_upper ? upper(leaving) : lower(leaving);
        } else if (leaving.kind == Variable::share) {
            share_basic_ = false;
            share_ = at_upper ? 1 : 0;
        } // a ray is left at 0, what has any sign never leaves
        if (enters.kind == Variable::slack) slack_basic_[std::size_t(enters.index)] = 1;
        if (enters.kind == Variable::share) share_basic_ = true;
        if (enters.kind == Variable::signless) signless_basic_[std::size_t(enters.index)] = 1;
        basic_[std::size_t(leaves)] = enters;
        basic_value_[leaves] = from + sign * step;
        const Eigen::RowVectorXd pivot_row = inverse_.row(leaves) / w[leaves];
        inverse_.noalias() -= w * pivot_row;
        inverse_.row(leaves) = pivot_row;
        if (++pivots_ % kCheck == 0 && !is_consistent() && !refactor(work)) return End::no_work;
    }
}

/// The ray of a contact's cone that gains the most.
ReactionRange::Variable ReactionRange::best_ray(const ReactionSet::Contact& k,
                                                const Eigen::VectorXd& gain)
{
    Variable ray{Variable::ray, k.first, 1, {1, 0, 0}};
    if (k.kind != ContactKind::frictional) return ray;
    ray.rows = 3;
    if (k.slides) {
        ray.part[1] = k.direction[0];
        ray.part[2] = k.direction[1];
        return ray;
    }
    constexpr double kTurn = 2 * std::numbers::pi / kDirections;
    const double at = std::atan2(gain[k.first + 2], gain[k.first + 1]);
    const double angle = kTurn * std::round(at / kTurn);
    ray.part[1] = k.mu * std::cos(angle);
    ray.part[2] = k.mu * std::sin(angle);
    return ray;
}

/// c . d now.
double ReactionRange::reached(const Eigen::VectorXd& c) const
{
    double sum = share_basic_ ? 0 : -share_ * c.dot(set_.found);
    for (std::size_t k = 0; k < basic_.size(); ++k)
        sum += value_of(basic_[k], c) * basic_value_[Eigen::Index(k)];
    return sum;
}

/// No basic variable violates its bounds by more than the accuracy of the intervals.
bool ReactionRange::is_within_bounds() const
{
    for (std::size_t k = 0; k < basic_.size(); ++k) {
        const Variable& v = basic_[k];
        const double allowed =
            kViolated * (v.kind == Variable::slack ? upper(v) - lower(v) : kViolated);
        const double x = basic_value_[Eigen::Index(k)];
        if (!(x <= upper(v) + allowed && x >= lower(v) - allowed)) return false;
    }
    return true;
}

ReactionInterval ReactionRange::interval(const Eigen::VectorXd& c, std::int64_t& work,
                                         double enough)
{
    ReactionInterval out;
    double end[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
        const Eigen::VectorXd up = side == 0 ? c : Eigen::VectorXd(-c);
        now_ = reached(up);
        end[1 - side] = std::max(end[1 - side], -now_);
        const End how = maximise(up, work, enough);
        if (how == End::no_work || (!is_consistent() && !refactor(work)) || !is_within_bounds())
            out.certain = false;
        end[side] =
            std::max(end[side],
                     how == End::no_bound ? std::numeric_limits<double>::infinity() : reached(up));
        if (std::isfinite(enough) && end[0] + end[1] >= enough) break;
    }
    const double middle = c.dot(set_.found);
    out.min = middle - end[1];
    out.max = middle + end[0];
    return out;
}

} // namespace amontons
