#pragma once

#include "contact/problem.hpp"

#include <cstdint>
#include <limits>
#include <vector>

namespace amontons {

/// What the laws of contact and a tolerance leave open of reactions: all r = found + d with
///
///     lower <= K x <= upper,     x = (d, a),     r within its cones,
///
/// a being motions that follow d. A convex set: what is linear in r lies in an interval, whose
/// ends a linear program finds (docs/theory/certificate.md).
struct ReactionSet {
    /// A contact of one row (normal) or three (n, t1, t2), or a row whose reaction has any sign.
    struct Contact {
        int first = 0; ///< its first column of K
        ContactKind kind = ContactKind::frictional;
        /// Coefficient of friction.
        double mu = 0;
        bool slides = false;          ///< friction keeps its direction
        double direction[2] = {0, 0}; ///< then: r_t / r_n (ratio)
    };
    std::vector<Contact> contact;
    /// One row for each bound, one column for each reaction, then for each motion; scaled to
    /// entries of about 1.
    Delassus::Sparse K;
    Eigen::VectorXd lower, upper; ///< of the rows of K, <= 0 and >= 0
    Eigen::VectorXd found;        ///< the reactions that were found, one for each row of contacts
};

/// The interval of a linear function c . r over a ReactionSet.
struct ReactionInterval {
    /// Its ends [unit of c . r]; infinite where the set does not bound it.
    double min = 0, max = 0;
    /// False: the permitted work did not suffice; the true ends may lie farther apart.
    bool certain = true;
};

/// Intervals over one set, each linear program started from the basis of the one before. The
/// revised simplex method with bounds; columns of a cone are generated as needed, in 64 directions
/// (an error of 0.12 % of the friction).
class ReactionRange {
public:
    /// @param beyond  a c . r that grows above this counts as unbounded [unit of c . r]
    ReactionRange(const ReactionSet& set, double beyond);

    /// An upper bound on the width of interval(c), by the bounds of K x alone [unit of c . r];
    /// infinite where these do not bound c . r.
    /// @param c  one coefficient for each reaction
    double widest(const Eigen::VectorXd& c) const;

    /// The interval of c . r.
    /// @param work    multiplications that are permitted; reduced by those that were used
    /// @param enough  the search may end at an interval of this width [unit of c . r], whose ends
    ///                some r reach: others may lie beyond
    ReactionInterval interval(const Eigen::VectorXd& c, std::int64_t& work,
                              double enough = std::numeric_limits<double>::infinity());

private:
    struct Variable { // a column of the program
        enum Kind { slack, share, ray, signless } kind = slack;
        int index = 0;              ///< row, or first column of K
        int rows = 1;               ///< of a ray
        double part[3] = {1, 0, 0}; ///< of it
    };
    enum class End { optimum, no_bound, enough, no_work };
    End maximise(const Eigen::VectorXd& c, std::int64_t& work, double enough);
    static Variable best_ray(const ReactionSet::Contact& contact, const Eigen::VectorXd& gain);
    double reached(const Eigen::VectorXd& c) const;
    bool is_within_bounds() const;
    Eigen::VectorXd of_others() const;
    bool is_consistent() const;
    bool refactor(std::int64_t& work);
    template <class Action> void for_column(const Variable& v, const Action& action) const;
    double value_of(const Variable& v, const Eigen::VectorXd& c) const;
    double lower(const Variable& v) const;
    double upper(const Variable& v) const;

    const ReactionSet& set_;
    double beyond_;
    Eigen::VectorXd found_column_; ///< K found
    Eigen::MatrixXd gram_root_;    ///< U^T U = K K^T + a little
    std::vector<Variable> basic_;
    Eigen::VectorXd basic_value_;
    Eigen::MatrixXd inverse_;   ///< of the basic columns
    std::vector<double> slack_; ///< of each row, where it is not basic
    std::vector<char> slack_basic_, signless_basic_;
    double share_ = 0; ///< of the reaction found that was taken back, where that is not basic
    bool share_basic_ = false;
    int pivots_ = 0; ///< since the inverse was made
    double now_ = 0; ///< c . d
};

} // namespace amontons
