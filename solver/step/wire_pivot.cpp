#include "solver/step/wire_pivot.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

// Multiplier weights relative to the wire's own stiffness (WireMaterial::stiffness). They change
// the linear systems' conditioning and the number of iterations, never the solution: the
// reaction is r - rho (g + H dx), exact when the gap is zero.
constexpr double kRhoNormal = 1e4;
constexpr double kRhoStick = 1e4;
constexpr double kRhoSlip = 0.3; // of the slip direction's predictor r_t - rho u_t
constexpr int kTrials = 24;      // of statuses, before the step is made shorter by a shift
constexpr int kShiftLevels = 4;
constexpr double kLeastShift = 1e-6, kLargestShift = 1e6; // relative to the wire's stiffness
constexpr double kTurnTolerance = 0.1; // slip directions are renewed within an iteration [rad]

using Trial = NewtonWorkspace::Trial;

double dot(const Node6& a, const Node6& b)
{
    double s = 0;
    for (int i = 0; i < 6; ++i)
        s += a.value[i] * b.value[i];
    return s;
}

double apply(const ContactRow& row, const std::vector<Node6>& d, int e)
{
    return dot(row.a, d[std::size_t(e)]) + dot(row.b, d[std::size_t(e) + 1]);
}

/// K += s f h^T on the two nodes of element e, but only in rows and columns of nodes >= from.
void add_product(BlockTridiagonal& K, int e, const ContactRow& f, const ContactRow& h, double s,
                 int from)
{
    const Column6 fa = f.a.column * splat6(s), fb = f.b.column * splat6(s);
    Block6& d2 = K.diagonal(e + 1);
    for (int j = 0; j < 6; ++j)
        d2.column[j] += fb * splat6(h.b.value[j]);
    if (e < from) return;
    Block6 &d1 = K.diagonal(e), &up = K.upper(e), &lo = K.lower(e);
    for (int j = 0; j < 6; ++j) {
        const Column6 ha = splat6(h.a.value[j]);
        d1.column[j] += fa * ha;
        lo.column[j] += fb * ha;
        up.column[j] += fa * splat6(h.b.value[j]);
    }
}

void add_force(std::vector<Node6>& r, int e, const ContactRow& h, double s)
{
    r[std::size_t(e)].column += h.a.column * splat6(s);
    r[std::size_t(e) + 1].column += h.b.column * splat6(s);
}

ContactRow combine(const ContactRow& a, double s, const ContactRow& b, double t,
                   const ContactRow& c)
{
    ContactRow r;
    r.a.column = a.a.column + splat6(s) * b.a.column + splat6(t) * c.a.column;
    r.b.column = a.b.column + splat6(s) * b.b.column + splat6(t) * c.b.column;
    return r;
}

/// Normal plus mu times the slip force's direction.
ContactRow slip_force_row(const Candidate& c, const Trial& t)
{
    return combine(c.hn, c.mu * t.c1, c.ht[0], c.mu * t.c2, c.ht[1]);
}

ContactRow across_row(const Candidate& c, const Trial& t)
{
    ContactRow p;
    p.a.column = splat6(-t.c2) * c.ht[0].a.column + splat6(t.c1) * c.ht[1].a.column;
    p.b.column = splat6(-t.c2) * c.ht[0].b.column + splat6(t.c1) * c.ht[1].b.column;
    return p;
}

// Adds a contact with its trial status to the linear system: reactions of active rows are
// r - rho (g + H d) (normal, stick), mu r_n along the slip force, and -across (u + H d) across
// it, the linearisation of r_t = P(r_t - rho u_t) on the cone's edge.
void add_contact(const Candidate& c, const Trial& t, BlockTridiagonal& K, bool coupled, int from)
{
    const int e = c.place.element;
    const double rho = kRhoNormal * c.stiffness;
    if (t.status == 2) {
        add_product(K, e, coupled ? slip_force_row(c, t) : c.hn, c.hn, rho, from);
        if (t.across > 0) {
            const ContactRow p = across_row(c, t);
            add_product(K, e, p, p, t.across, from);
        }
        return;
    }
    add_product(K, e, c.hn, c.hn, rho, from);
    if (c.mu > 0)
        for (const ContactRow& h : c.ht)
            add_product(K, e, h, h, kRhoStick * c.stiffness, from);
}

void add_contact_force(const Candidate& c, const Trial& t, std::vector<Node6>& r)
{
    const int e = c.place.element;
    const double fn = c.normal - kRhoNormal * c.stiffness * c.gap;
    if (t.status == 2) {
        add_force(r, e, slip_force_row(c, t), fn);
        if (t.across > 0)
            add_force(r, e, across_row(c, t), -t.across * (-t.c2 * c.slip[0] + t.c1 * c.slip[1]));
        return;
    }
    add_force(r, e, c.hn, fn);
    if (c.mu > 0)
        for (int k = 0; k < 2; ++k)
            add_force(r, e, c.ht[k], c.tangential[k] - kRhoStick * c.stiffness * c.slip[k]);
}

/// Friction force of a slipping contact from its normal reaction and its motion d.
void set_slip_reaction(const Candidate& c, Trial& t, const std::vector<Node6>& d)
{
    t.v1 = c.slip[0] + apply(c.ht[0], d, c.place.element);
    t.v2 = c.slip[1] + apply(c.ht[1], d, c.place.element);
    const double across = -t.across * (-t.c2 * t.v1 + t.c1 * t.v2);
    t.t1 = c.mu * t.normal * t.c1 - across * t.c2;
    t.t2 = c.mu * t.normal * t.c2 + across * t.c1;
}

/// Reaction and motion of a contact after a trial.
void evaluate(const Candidate& c, Trial& t, const std::vector<Node6>& d)
{
    const int e = c.place.element;
    t.gap = c.gap + apply(c.hn, d, e);
    if (c.mu > 0) {
        t.v1 = c.slip[0] + apply(c.ht[0], d, e);
        t.v2 = c.slip[1] + apply(c.ht[1], d, e);
    }
    t.normal = t.t1 = t.t2 = 0;
    if (t.status == 0) return;
    t.normal = c.normal - kRhoNormal * c.stiffness * t.gap;
    if (t.status == 1 && c.mu > 0) {
        const double rt = kRhoStick * c.stiffness;
        t.t1 = c.tangential[0] - rt * t.v1;
        t.t2 = c.tangential[1] - rt * t.v2;
    } else if (t.status == 2) {
        set_slip_reaction(c, t, d);
    }
}

/// Slip direction and stiffness across it from a predictor outside the cone's section.
void set_slip(const Candidate& c, Trial& t, double s1, double s2, double bound)
{
    const double m = std::hypot(s1, s2);
    t.status = 2;
    t.c1 = s1 / m;
    t.c2 = s2 / m;
    const double beta = std::min(bound / m, 1 - 1e-9);
    t.across = kRhoSlip * c.stiffness * beta / (1 - beta);
}

struct Change {
    enum Kind { none, open, close, stick, slip, turn } kind = none;
    double size = 0;
};

/// What is wrong with a contact's status after a trial.
Change violation(const Candidate& c, const Trial& t, double force, double length)
{
    if (t.status == 0) {
        if (t.gap < -length) return {Change::close, -t.gap};
        return {};
    }
    if (t.normal < -force) return {Change::open, -t.normal};
    if (!(c.mu > 0)) return {};
    const double bound = c.mu * std::max(t.normal, 0.0);
    if (t.status == 1) {
        const double m = std::hypot(t.t1, t.t2);
        if (m > bound * (1 + 1e-9) + force) return {Change::slip, m - bound};
        return {};
    }
    const double m = std::hypot(t.t1, t.t2);
    const double k = m > bound && m > 0 ? bound / m : 1;
    const double rho = kRhoSlip * c.stiffness;
    const double s1 = k * t.t1 - rho * t.v1, s2 = k * t.t2 - rho * t.v2;
    const double s = std::hypot(s1, s2);
    if (s < bound * (1 - 1e-9) - force) return {Change::stick, bound - s};
    // Slip against its own friction: sticks first, or the two opposite slips alternate.
    if (t.v1 * t.c1 + t.v2 * t.c2 > force / rho) return {Change::stick, bound};
    const double turn = std::abs(s1 * t.c2 - s2 * t.c1);
    if (s > 0 && turn > kTurnTolerance * s && bound > force) return {Change::turn, turn};
    return {};
}

void change(const Candidate& c, Trial& t, Change::Kind kind)
{
    const double rho = kRhoSlip * c.stiffness;
    const double bound = c.mu * std::max(t.normal, 0.0);
    switch (kind) {
    case Change::open:
        t.status = 0;
        break;
    case Change::close:
        t.status = 1;
        // A point that comes in sliding goes on sliding.
        if (c.mu > 0 && std::hypot(t.v1, t.v2) > 0) set_slip(c, t, -t.v1, -t.v2, 0);
        break;
    case Change::stick:
        t.status = 1;
        break;
    case Change::slip:
        set_slip(c, t, t.t1, t.t2, bound);
        break;
    case Change::turn: {
        const double m = std::hypot(t.t1, t.t2);
        const double k = m > bound && m > 0 ? bound / m : 1;
        set_slip(c, t, k * t.t1 - rho * t.v1, k * t.t2 - rho * t.v2, bound);
        break;
    }
    case Change::none:
        break;
    }
}

/// Status to start with, from the reactions that the iterate has.
void initial_status(const Candidate& c, Trial& t)
{
    t = Trial{};
    if (!(c.normal > 0) && c.gap >= 0) return;
    t.status = 1;
    if (!(c.mu > 0)) return;
    const double rho = kRhoSlip * c.stiffness;
    const double s1 = c.tangential[0] - rho * c.slip[0], s2 = c.tangential[1] - rho * c.slip[1];
    const double bound = c.mu * c.normal, m = std::hypot(s1, s2);
    if (!c.sticks && m > 0 && m >= bound * (1 - 1e-9))
        set_slip(c, t, s1, s2, bound);
    else if (m > bound * (1 + 1e-6) && m > 0)
        set_slip(c, t, s1, s2, bound);
}

/// Right-hand side without the present reactions (the gradient holds them; the rows of active
/// contacts put theirs back).
void set_right_side(const Wire& wire, NewtonWorkspace& w)
{
    for (int i = wire.state.first; i <= wire.last(); ++i)
        w.right[std::size_t(i)].column = -w.gradient[std::size_t(i)].column;
    for (std::size_t k = 0; k < w.candidates.size(); ++k) {
        const Candidate& c = w.candidates[k];
        const int e = c.place.element;
        if (c.normal > 0) {
            add_force(w.right, e, c.hn, -c.normal);
            add_force(w.right, e, c.ht[0], -c.tangential[0]);
            add_force(w.right, e, c.ht[1], -c.tangential[1]);
        }
        if (w.trial[k].status != 0) add_contact_force(c, w.trial[k], w.right);
    }
}

/// Base plus shift plus active contacts, in the rows of nodes >= from; without friction's
/// coupling to the normal reaction if not `coupled`.
void set_system(const Wire& wire, NewtonWorkspace& w, double shift, bool coupled, int from)
{
    w.system.copy_from(w.base, from);
    if (shift > 0)
        for (int i = std::max(from, wire.state.first + 1); i <= wire.last(); ++i) {
            const double h = wire.material.law[std::size_t(i) - 1].length;
            Block6& d = w.system.diagonal(i);
            for (int a = 0; a < 3; ++a) {
                d(a, a) += shift;
                d(a + 3, a + 3) += shift * h * h;
            }
        }
    for (std::size_t k = 0; k < w.candidates.size(); ++k)
        if (w.trial[k].status != 0 && w.candidates[k].place.element + 1 >= from)
            add_contact(w.candidates[k], w.trial[k], w.system, coupled, from);
}

double softest(const Wire& wire)
{
    return *std::min_element(wire.material.stiffness.begin(), wire.material.stiffness.end());
}

/// Factors the system of the trials, with a shift that makes the wire stable on the motions that
/// contact leaves free: the inertia of the system without friction's coupling. The coupling can
/// make a pivot negative by itself, in one frame and not in another; whether to ask is decided by
/// the determinants, which are the same in all.
/// @param from  in: the factor of nodes before it is that of the last trial
void factor_definite(const Wire& wire, NewtonWorkspace& w, int from, double& shift,
                     NewtonReport& report)
{
    const auto factor = [&](bool coupled, int node) {
        set_system(wire, w, shift, coupled, node);
        ++report.factorisations;
        return w.system.factor(node);
    };
    const bool unsymmetric =
        std::any_of(w.trial.begin(), w.trial.end(), [](const Trial& t) { return t.status == 2; });
    const int negative = factor(true, from);
    if ((unsymmetric ? w.system.negative_determinants() : negative) == 0) return;
    const int first = wire.state.first;
    bool definite = unsymmetric && factor(false, first) == 0;
    while (!definite) {
        // Where the iterate before ended is a better guess than nothing.
        shift = shift > 0 ? 4 * shift : std::max(kLeastShift * softest(wire), w.shift / 16);
        if (shift > kLargestShift * softest(wire)) return;
        definite = factor(!unsymmetric, first) == 0;
    }
    if (unsymmetric) factor(true, first);
}

/// Pivots the statuses from those of the iterate. Leaves the increment and the trials.
bool pivot(const Wire& wire, NewtonWorkspace& w, const Residual& res, const NewtonOptions& options,
           double& shift, NewtonReport& report)
{
    const std::size_t n = w.candidates.size();
    const double force = 1e-3 * options.tolerance * res.scale;
    w.trial.resize(n);
    for (std::size_t k = 0; k < n; ++k)
        initial_status(w.candidates[k], w.trial[k]);

    std::vector<Change> wrong(n);
    int best = std::numeric_limits<int>::max(), patience = 8;
    int from = wire.state.first; // the factor of nodes before it is that of the last trial
    for (int trial = 0; trial < kTrials; ++trial) {
        set_right_side(wire, w);
        factor_definite(wire, w, from, shift, report);
        if (shift > kLargestShift * softest(wire)) return false;
        w.increment = w.right;
        w.system.solve(w.increment);

        int count = 0;
        for (std::size_t k = 0; k < n; ++k) {
            evaluate(w.candidates[k], w.trial[k], w.increment);
            wrong[k] =
                violation(w.candidates[k], w.trial[k], force, force / (w.candidates[k].stiffness));
            if (wrong[k].kind != Change::none) ++count;
        }
        if (count == 0) return true;

        from = wire.last();
        const auto turn = [&](std::size_t k) {
            if (wrong[k].kind == Change::none) return;
            change(w.candidates[k], w.trial[k], wrong[k].kind);
            from = std::min(from, w.candidates[k].place.element);
        };
        bool all = true;
        if (count < best) {
            best = count;
            patience = 8;
        } else if (patience > 0) {
            --patience;
        } else {
            all = false;
        }
        if (all) {
            // Of neighbours that all want to open (or all to close) only the worst does: the
            // rows of one element depend on each other.
            for (std::size_t i = 0; i < n;) {
                const Change::Kind kind = wrong[i].kind;
                if (kind != Change::open && kind != Change::close) {
                    ++i;
                    continue;
                }
                std::size_t end = i, worst = i;
                while (end < n && wrong[end].kind == kind &&
                       (end == i || w.candidates[end].index == w.candidates[end - 1].index + 1)) {
                    if (wrong[end].size > wrong[worst].size) worst = end;
                    ++end;
                }
                for (std::size_t k = i; k < end; ++k)
                    if (k != worst) wrong[k].kind = Change::none;
                i = end;
            }
            for (std::size_t k = 0; k < n; ++k)
                turn(k);
        } else {
            std::size_t k = n - 1;
            while (wrong[k].kind == Change::none)
                --k;
            turn(k);
        }
    }
    return false;
}

} // namespace

// The multipliers of one solve err by 1 / (1 + rho W): nothing, unless friction has all but
// cancelled the compliance W of a contact (a wedge about to lock). Then the remaining gaps of
// the active rows are closed exactly, by their own small dense system.
void close_active_rows(const Wire& wire, NewtonWorkspace& w)
{
    struct Row {
        std::size_t candidate;
        int which; // 0 normal, 1 and 2 tangential
    };
    std::vector<Row> rows;
    for (std::size_t k = 0; k < w.candidates.size(); ++k) {
        const int status = w.trial[k].status;
        if (status == 0) continue;
        rows.push_back({k, 0});
        if (status == 1 && w.candidates[k].mu > 0) {
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
        const Candidate& c = w.candidates[r.candidate];
        const Trial& t = w.trial[r.candidate];
        std::vector<Node6>& x = columns[std::size_t(j)];
        x.resize(w.right.size());
        for (int i = wire.state.first; i <= wire.last(); ++i)
            x[std::size_t(i)].column = Column6{};
        const ContactRow f = r.which > 0     ? c.ht[r.which - 1]
                             : t.status == 2 ? slip_force_row(c, t)
                                             : c.hn;
        add_force(x, c.place.element, f, 1);
        w.system.solve(x);
        gap[j] = r.which == 0 ? t.gap : r.which == 1 ? t.v1 : t.v2;
        for (Eigen::Index i = 0; i < n; ++i) {
            const Row& q = rows[std::size_t(i)];
            const Candidate& o = w.candidates[q.candidate];
            S(i, j) = apply(q.which == 0 ? o.hn : o.ht[q.which - 1], x, o.place.element);
        }
    }
    const Eigen::VectorXd change = S.fullPivLu().solve(-gap);
    if (!change.allFinite()) return;
    for (Eigen::Index j = 0; j < n; ++j)
        for (int i = wire.state.first; i <= wire.last(); ++i)
            w.increment[std::size_t(i)].column +=
                splat6(change[j]) * columns[std::size_t(j)][std::size_t(i)].column;
    for (std::size_t k = 0; k < w.candidates.size(); ++k)
        evaluate(w.candidates[k], w.trial[k], w.increment);
    for (Eigen::Index j = 0; j < n; ++j) {
        const Row& r = rows[std::size_t(j)];
        Trial& t = w.trial[r.candidate];
        if (r.which == 0) t.normal += change[j];
        if (r.which == 1) t.t1 += change[j];
        if (r.which == 2) t.t2 += change[j];
        if (r.which == 0 && t.status == 2)
            set_slip_reaction(w.candidates[r.candidate], t, w.increment);
    }
}

// Where pivoting finds no solution (the wire is about to lose
// its hold), a shift makes the problem more definite and its solution nearer.
void solve_linearised(const Wire& wire, NewtonWorkspace& w, const Residual& res,
                      const NewtonOptions& options, double& shift, NewtonReport& report)
{
    for (int level = 0; level < kShiftLevels; ++level) {
        if (pivot(wire, w, res, options, shift, report)) break;
        shift = std::max(16 * shift, 1e-3 * softest(wire));
    }
    if (shift > 0) w.shift = shift;
}

} // namespace amontons
