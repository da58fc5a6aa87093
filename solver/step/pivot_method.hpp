#pragma once

#include "mesh/base/dense.hpp"
#include "solver/step/contact_status.hpp"
#include "solver/step/negative_mode.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

// Pivoting contacts between open, stick and slip, for one wire (wire_pivot.cpp), for instruments
// in one another (coaxial_pivot.cpp) and for rods (rod_problem.cpp). A System states which rows a
// contact has and in which matrix:
//
//   Row                          of derivatives; with the nodes that it stands on:
//                                apply(row, increment, place), add_force(right, place, row, s),
//                                add_product(matrix, place, f, h, s, from), combine(a, s, b, t, c),
//                                combine(s, b, t, c)
//   contacts(), contact(k)       as Candidate
//   place(k), normal(k), tangent(k, i)
//   lowest(k), highest(k)        nodes of its rows
//   follows(k)                   k is the neighbour of k - 1 on the same wire and wall
//   first(), last()              nodes
//   gradient(), right(), increment(), trial(), matrix()
//   start_matrix(shift, from)    the base system with the shift in the rows from that node on
//   most_trials()                of statuses, before sticking contacts are springs, and of each
//                                stiffness of these
//   shift_levels()               optional: how often it is, kShiftLevels without
//   min_stiffness()              scale of the shift [N/m]
//   last_shift()                 of the last iterate of this solve that needed one [N/m]
//   weigh(x)                     optional: x <- M x, by which a shift is added (negative_mode.hpp)
//   bodies(), bodies_of(k)       optional: how many there are, and on which two k is (-1: none)
//   has_compliant_walls(), pivot_compliant(...)   optional: walls that are compliant, see
//   soft_pivot.hpp

namespace amontons::pivoting {

/// Of statuses, of one wire or instruments in one another; beyond them as long as one of the last
/// few has made fewer wrong, and at the most.
constexpr int kTrials = 24, kTrialsAfterProgress = 8, kTrialsAtMost = 200;
/// Levels of the shift in one iteration.
constexpr int kShiftLevels = 4;
constexpr double kLeastShift = 1e-6, kLargestShift = 1e6; ///< relative to the wire's stiffness

/// Normal plus mu times the slip force's direction.
template <class System> typename System::Row slip_force_row(System& s, std::size_t k)
{
    const Trial& t = s.trial()[k];
    const double mu = s.contact(k).mu;
    return System::combine(s.normal(k), mu * t.c1, s.tangent(k, 0), mu * t.c2, s.tangent(k, 1));
}

/// The row across the direction of slip.
template <class System> typename System::Row across_row(System& s, std::size_t k)
{
    const Trial& t = s.trial()[k];
    return System::combine(-t.c2, s.tangent(k, 0), t.c1, s.tangent(k, 1));
}

/// Adds a contact with its trial status to the linear system: reactions of active rows are
/// r - rho (g + H d) (normal, stick), mu r_n along the slip force, and -across (u + H d) across
/// it, the linearisation of r_t = P(r_t - rho u_t) on the cone's edge.
template <class System> void add_contact(System& s, std::size_t k, bool coupled, int from)
{
    const Candidate& c = s.contact(k);
    const Trial& t = s.trial()[k];
    const auto place = s.place(k);
    auto& K = s.matrix();
    const double rho = normal_weight(c);
    if (t.status == 2) {
        if (coupled)
            System::add_product(K, place, slip_force_row(s, k), s.normal(k), rho, from);
        else
            System::add_product(K, place, s.normal(k), s.normal(k), rho, from);
        if (t.across > 0) {
            const typename System::Row p = across_row(s, k);
            System::add_product(K, place, p, p, t.across, from);
        }
        return;
    }
    System::add_product(K, place, s.normal(k), s.normal(k), rho, from);
    if (c.mu > 0)
        for (int i = 0; i < 2; ++i)
            System::add_product(K, place, s.tangent(k, i), s.tangent(k, i), t.hold, from);
}

/// Adds the forces of contact k to the right-hand side.
template <class System> void add_contact_force(System& s, std::size_t k)
{
    const Candidate& c = s.contact(k);
    const Trial& t = s.trial()[k];
    const auto place = s.place(k);
    auto& r = s.right();
    const double fn = c.normal - normal_weight(c) * c.gap;
    if (t.status == 2) {
        System::add_force(r, place, slip_force_row(s, k), fn);
        if (t.across > 0)
            System::add_force(r, place, across_row(s, k),
                              -t.across * (-t.c2 * c.slip[0] + t.c1 * c.slip[1]));
        return;
    }
    System::add_force(r, place, s.normal(k), fn);
    if (c.mu > 0)
        for (int i = 0; i < 2; ++i)
            System::add_force(r, place, s.tangent(k, i), c.tangential[i] - t.hold * c.slip[i]);
}

/// Friction force of a slipping contact from its normal reaction and its motion.
template <class System> void set_slip_reaction(System& s, std::size_t k)
{
    const Candidate& c = s.contact(k);
    Trial& t = s.trial()[k];
    t.v1 = c.slip[0] + System::apply(s.tangent(k, 0), s.increment(), s.place(k));
    t.v2 = c.slip[1] + System::apply(s.tangent(k, 1), s.increment(), s.place(k));
    const double across = -t.across * (-t.c2 * t.v1 + t.c1 * t.v2);
    t.t1 = c.mu * t.normal * t.c1 - across * t.c2;
    t.t2 = c.mu * t.normal * t.c2 + across * t.c1;
}

/// Reaction and motion of a contact after a trial.
template <class System> void evaluate(System& s, std::size_t k)
{
    const Candidate& c = s.contact(k);
    Trial& t = s.trial()[k];
    const auto place = s.place(k);
    t.gap = c.gap + System::apply(s.normal(k), s.increment(), place);
    if (c.mu > 0) {
        t.v1 = c.slip[0] + System::apply(s.tangent(k, 0), s.increment(), place);
        t.v2 = c.slip[1] + System::apply(s.tangent(k, 1), s.increment(), place);
    }
    t.normal = t.t1 = t.t2 = 0;
    if (t.status == 0) {
        t.gap -= c.compliance * c.normal;
        return;
    }
    t.normal = c.normal - normal_weight(c) * t.gap;
    t.gap += c.compliance * (t.normal - c.normal);
    if (t.status == 1 && c.mu > 0) {
        t.t1 = c.tangential[0] - t.hold * t.v1;
        t.t2 = c.tangential[1] - t.hold * t.v2;
    } else if (t.status == 2) {
        set_slip_reaction(s, k);
    }
}

/// Right-hand side without the present reactions (the gradient holds them; the rows of active
/// contacts put theirs back).
template <class System> void set_right_side(System& s)
{
    for (int i = s.first(); i <= s.last(); ++i)
        s.right()[std::size_t(i)].column = -s.gradient()[std::size_t(i)].column;
    for (std::size_t k = 0; k < s.contacts(); ++k) {
        const Candidate& c = s.contact(k);
        if (c.normal > 0) {
            System::add_force(s.right(), s.place(k), s.normal(k), -c.normal);
            System::add_force(s.right(), s.place(k), s.tangent(k, 0), -c.tangential[0]);
            System::add_force(s.right(), s.place(k), s.tangent(k, 1), -c.tangential[1]);
        }
        if (s.trial()[k].status != 0) add_contact_force(s, k);
    }
}

/// Base plus shift plus active contacts, in the rows of nodes >= from; without friction's
/// coupling to the normal reaction if not `coupled`.
template <class System> void set_system(System& s, double shift, bool coupled, int from)
{
    s.start_matrix(shift, from);
    for (std::size_t k = 0; k < s.contacts(); ++k)
        if (s.trial()[k].status != 0 && s.highest(k) >= from) add_contact(s, k, coupled, from);
}

/// Factors the system of the trials, with a shift that makes the wire stable on the motions that
/// contact leaves free: the inertia of the system without friction's coupling. The coupling can
/// make a pivot negative by itself, in one frame and not in another; whether to compute it is
/// decided by the determinants, which are the same in all.
/// @param from  in: the factor of nodes before it is that of the last trial
template <class System>
void factor_definite(System& s, int from, double& shift, NewtonReport& report)
{
    const auto factor = [&](bool coupled, int node) {
        set_system(s, shift, coupled, node);
        ++report.factorisations;
        return s.matrix().factor(node);
    };
    const bool unsymmetric = std::any_of(s.trial().begin(), s.trial().end(),
                                         [](const Trial& t) { return t.status == 2; });
    const int negative = factor(true, from);
    if ((unsymmetric ? s.matrix().negative_determinants() : negative) == 0) return;
    const int first = s.first();
    bool definite = unsymmetric && factor(false, first) == 0;
    double needed = 0;
    if constexpr (requires { s.weigh(s.right()); })
        if (!definite && unsymmetric)
            needed = 2 * negative_eigenvalue(
                             s.right(), [&](std::vector<Node6>& x) { s.weigh(x); },
                             [&](std::vector<Node6>& x) { s.matrix().solve(x); });
    while (!definite) {
        // Where the iterate before ended is a better guess than nothing.
        const double least =
            needed > 0 ? needed : std::max(kLeastShift * s.min_stiffness(), s.last_shift() / 16);
        shift = shift > 0 ? std::max(4 * shift, shift + needed) : least;
        needed = 0;
        if (shift > kLargestShift * s.min_stiffness()) return;
        definite = factor(!unsymmetric, first) == 0;
    }
    if (unsymmetric) factor(true, first);
}

/// Counts trials that do not reduce the number of wrong statuses; after them contacts are changed
/// one at a time: first one on each body, then one of all.
struct StallCounter {
    /// Trials without progress after which all, or separate, states change.
    static constexpr int kAll = 8, kApart = 40;
    /// Fewest wrong states so far, and trials left.
    int best = std::numeric_limits<int>::max(), all = kAll, apart = kApart;
};

/// Finds that trials go in circles, where one follows from the one before alone.
struct CircleFinder {
    std::vector<std::uint64_t> tried; ///< hashes of the trials so far

    /// @param shift  of the matrix [N/m]
    /// @return  true if these statuses have been tried with it before
    bool closed_by(const std::vector<Trial>& now, double shift)
    {
        constexpr double kSame = 1e-6; // directions that differ by less: no turn is as small
        std::uint64_t hash = 14695981039346656037u;
        const auto add = [&](std::uint64_t value) { hash = (hash ^ value) * 1099511628211u; };
        add(std::bit_cast<std::uint64_t>(shift));
        for (const Trial& t : now) {
            add(std::uint64_t(t.status));
            if (t.status != 2) continue;
            for (const double c : {t.c1, t.c2})
                add(std::uint64_t(std::int64_t(std::lround(c / kSame))));
        }
        if (std::ranges::find(tried, hash) != tried.end()) return true;
        tried.push_back(hash);
        return false;
    }
};

/// Changes the status of the last contact whose status is wrong, and of every one before it that is
/// on no body of those already changed, so that separate places are changed in the same trial.
template <class System, class Turn>
void flip_independent(const System& s, const std::vector<Change>& wrong, const Turn& turn)
{
    std::vector<char> taken(s.bodies(), 0);
    for (std::size_t k = wrong.size(); k-- > 0;) {
        if (wrong[k].kind == Change::none) continue;
        const std::array<int, 2> on = s.bodies_of(k); // -1: one that stands still
        const auto is_taken = [&](int b) { return b >= 0 && taken[std::size_t(b)]; };
        if (is_taken(on[0]) || is_taken(on[1])) continue;
        for (const int b : on)
            if (b >= 0) taken[std::size_t(b)] = 1;
        turn(k);
    }
}

/// Statuses of several contacts may be changed at once, on separate bodies.
template <class System> bool tries_apart(const System& s, const StallCounter& patience)
{
    if constexpr (requires { s.bodies(); }) return patience.apart > 0 && s.bodies() > 1;
    return false;
}

/// Changes the status of contacts where it is wrong: of all of them, or of separate ones, or of
/// one, while the number of wrong statuses does not decrease.
/// @param turn  changes the status of a contact
template <class System, class Turn>
void flip_statuses(const System& s, std::vector<Change>& wrong, int count, StallCounter& patience,
                   const Turn& turn)
{
    const std::size_t n = wrong.size();
    bool all = true;
    if (count < patience.best)
        patience = {count};
    else if (patience.all > 0)
        --patience.all;
    else
        all = false;
    if (!all) {
        if constexpr (requires { s.bodies(); })
            if (patience.apart > 0) {
                --patience.apart;
                return flip_independent(s, wrong, turn);
            }
        std::size_t k = n - 1;
        while (wrong[k].kind == Change::none)
            --k;
        turn(k);
        return;
    }
    // Of neighbours that would all open (or all close) only the worst does: the rows of one
    // element depend on each other.
    for (std::size_t i = 0; i < n;) {
        const Change::Kind kind = wrong[i].kind;
        if (kind != Change::open && kind != Change::close) {
            ++i;
            continue;
        }
        std::size_t end = i, worst = i;
        while (end < n && wrong[end].kind == kind && (end == i || s.follows(end))) {
            if (wrong[end].size > wrong[worst].size) worst = end;
            ++end;
        }
        for (std::size_t k = i; k < end; ++k)
            if (k != worst) wrong[k].kind = Change::none;
        i = end;
    }
    for (std::size_t k = 0; k < n; ++k)
        if (wrong[k].kind != Change::none) turn(k);
}

/// Statuses of the iterate.
template <class System> void start_trials(System& s)
{
    s.trial().resize(s.contacts());
    for (std::size_t k = 0; k < s.contacts(); ++k)
        initial_status(s.contact(k), s.trial()[k]);
}

/// Pivots the statuses from those of the trials. Leaves the increment and the trials.
template <class System>
bool pivot(System& s, const Residual& res, const NewtonOptions& options, double& shift,
           NewtonReport& report)
{
    const std::size_t n = s.contacts();
    std::vector<Trial>& trials = s.trial();
    const double force = least_violation(res, options);

    std::vector<Change> wrong(n);
    StallCounter patience;
    CircleFinder circle;
    int from = s.first(); // the factor of nodes before it is that of the last trial
    int progress = 0;     // the last trial with fewer wrong statuses than all before it
    for (int trial = 0; trial < std::max(s.most_trials(),
                                         std::min(progress + kTrialsAfterProgress, kTrialsAtMost));
         ++trial) {
        if (options.stop && *options.stop) return false;
        set_right_side(s);
        factor_definite(s, from, shift, report);
        if (shift > kLargestShift * s.min_stiffness()) return false;
        s.increment() = s.right();
        s.matrix().solve(s.increment());

        int count = 0;
        for (std::size_t k = 0; k < n; ++k) {
            evaluate(s, k);
            const Candidate& c = s.contact(k);
            wrong[k] = violation(c, trials[k], force, force / c.stiffness);
            if (wrong[k].kind != Change::none) ++count;
        }
        if (count == 0) return true;

        from = s.last();
        if (count < patience.best) {
            progress = trial;
            circle = {};
        } else if (patience.all == 0 && circle.closed_by(trials, shift)) {
            if (!tries_apart(s, patience)) return false;
            patience.apart = 0; // the other way to change them is left
            circle = {};
        }
        flip_statuses(s, wrong, count, patience, [&](std::size_t k) {
            change(s.contact(k), trials[k], wrong[k].kind);
            from = std::min(from, s.lowest(k));
        });
    }
    return false;
}

/// Pivots from the statuses of the iterate. Where friction turns in many contacts at once that runs
/// in circles: then sticking contacts are springs first, and these are stiffened until they hold;
/// the statuses of each stiffness are nearly those of the next.
template <class System>
bool pivot_or_stiffen(System& s, const Residual& res, const NewtonOptions& options, double& shift,
                      NewtonReport& report)
{
    constexpr double kSoftest = 1e-5, kStiffening = 30; // of the weight that holds (ratio)
    const double before = shift;
    start_trials(s);
    if (pivot(s, res, options, shift, report)) return true;
    bool is_held = false; // by friction
    for (std::size_t k = 0; k < s.contacts(); ++k)
        is_held |= s.trial()[k].status != 0 && s.contact(k).mu > 0;
    if (!is_held || shift > kLargestShift * s.min_stiffness()) return false;

    const double after = shift;
    shift = before;
    start_trials(s);
    for (double part = kSoftest;; part = std::min(1.0, kStiffening * part)) {
        for (std::size_t k = 0; k < s.contacts(); ++k)
            s.trial()[k].hold = part * stick_weight(s.contact(k));
        if (!pivot(s, res, options, shift, report)) {
            shift = after;
            return false;
        }
        if (part == 1) return true;
    }
}

/// The multipliers of one solve err by 1 / (1 + rho W): nothing, unless friction has all but
/// cancelled the compliance W of a contact (a wedge about to lock). Then the remaining gaps of
/// the active rows are closed exactly, by their own small dense system. Where there are more rows
/// than motions, that system has reactions of any size: those far beyond a cone are not taken.
/// @param force  reactions below it do not count [N]
template <class System> void close_active(System& s, double force)
{
    struct Row {
        std::size_t candidate;
        int which; // 0 normal, 1 and 2 tangential
    };
    std::vector<Row> rows;
    for (std::size_t k = 0; k < s.contacts(); ++k) {
        const int status = s.trial()[k].status;
        if (status == 0) continue;
        rows.push_back({k, 0});
        if (status == 1 && s.contact(k).mu > 0) {
            rows.push_back({k, 1});
            rows.push_back({k, 2});
        }
    }
    const auto n = Eigen::Index(rows.size());
    if (n == 0) return;
    Eigen::MatrixXd S(n, n);
    Eigen::VectorXd gap(n);
    std::vector<std::vector<Node6>> columns(rows.size());
    for (Eigen::Index j = 0; j < n; ++j) {
        const Row& r = rows[std::size_t(j)];
        const Trial& t = s.trial()[r.candidate];
        std::vector<Node6>& x = columns[std::size_t(j)];
        x.resize(s.right().size());
        for (int i = s.first(); i <= s.last(); ++i)
            x[std::size_t(i)].column = Column6{};
        if (r.which > 0)
            System::add_force(x, s.place(r.candidate), s.tangent(r.candidate, r.which - 1), 1);
        else if (t.status == 2)
            System::add_force(x, s.place(r.candidate), slip_force_row(s, r.candidate), 1);
        else
            System::add_force(x, s.place(r.candidate), s.normal(r.candidate), 1);
        s.matrix().solve(x);
        gap[j] = r.which == 0 ? t.gap : r.which == 1 ? t.v1 : t.v2;
        for (Eigen::Index i = 0; i < n; ++i) {
            const Row& q = rows[std::size_t(i)];
            S(i, j) = System::apply(q.which == 0 ? s.normal(q.candidate)
                                                 : s.tangent(q.candidate, q.which - 1),
                                    x, s.place(q.candidate));
        }
        if (r.which == 0) S(j, j) += s.contact(r.candidate).compliance;
    }
    const Eigen::VectorXd change = solve_full_pivots(S, -gap);
    if (!change.allFinite()) return;
    const std::vector<Trial> before = s.trial();
    const std::vector<Node6> increment = s.increment();
    for (Eigen::Index j = 0; j < n; ++j)
        for (int i = s.first(); i <= s.last(); ++i)
            s.increment()[std::size_t(i)].column +=
                splat6(change[j]) * columns[std::size_t(j)][std::size_t(i)].column;
    for (std::size_t k = 0; k < s.contacts(); ++k)
        evaluate(s, k);
    for (Eigen::Index j = 0; j < n; ++j) {
        const Row& r = rows[std::size_t(j)];
        Trial& t = s.trial()[r.candidate];
        if (r.which == 0) t.normal += change[j];
        if (r.which == 1) t.t1 += change[j];
        if (r.which == 2) t.t2 += change[j];
        if (r.which == 0 && t.status == 2) set_slip_reaction(s, r.candidate);
    }
    constexpr double kFar = 4; // times the radius of the cone
    const auto far = [&](std::size_t k) {
        const Trial& t = s.trial()[k];
        return t.status == 1 &&
               std::hypot(t.t1, t.t2) > kFar * s.contact(k).mu * std::max(t.normal, 0.0) + force;
    };
    for (std::size_t k = 0; k < s.contacts(); ++k) {
        if (!far(k)) continue;
        s.trial() = before;
        s.increment() = increment;
        return;
    }
}

/// Solves the linearised contact problem by pivoting. Where that finds no solution (the wire is
/// about to become unstable), a shift makes the problem more definite and the increment shorter.
/// @return  whether a solution was found
template <class System>
bool solve(System& s, const Residual& res, const NewtonOptions& options, double& shift,
           NewtonReport& report)
{
    bool done = false;
    int levels = kShiftLevels;
    if constexpr (requires { s.shift_levels(); }) levels = s.shift_levels();
    for (int level = 0; level < levels; ++level) {
        if constexpr (requires { s.has_compliant_walls(); }) {
            done = s.has_compliant_walls() ? s.pivot_compliant(res, options, shift, report)
                                           : pivot_or_stiffen(s, res, options, shift, report);
        } else {
            done = pivot_or_stiffen(s, res, options, shift, report);
        }
        if (done) break;
        shift = std::max(16 * shift, 1e-3 * s.min_stiffness());
    }
    if constexpr (requires { s.has_compliant_walls(); })
        if (s.has_compliant_walls() && !done) // the last trial is no solution: the solve ends
            s.increment()[std::size_t(s.last())].value[0] =
                std::numeric_limits<double>::quiet_NaN();
    if (shift > 0) s.last_shift() = shift;
    return done;
}

} // namespace amontons::pivoting
