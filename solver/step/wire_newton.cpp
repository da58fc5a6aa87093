#include "solver/step/wire_newton.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

// Multiplier weights relative to the wire's own stiffness (WireMaterial::stiffness). They change
// the linear systems' conditioning and the number of iterations, never the solution: the
// reaction is r - rho (g + H dx), exact when the gap is zero.
constexpr double kRhoNormal = 1e4;
constexpr double kRhoStick = 1e4;
constexpr double kRhoSlip = 0.3;      // of the slip direction's predictor r_t - rho u_t
constexpr double kCertificateRho = 1; // of the natural map that is reported
constexpr int kTrials = 24;       // of statuses, before the step is made shorter by a shift
constexpr int kShiftLevels = 4;
constexpr int kSlow = 8;          // iterations before the active rows are closed exactly
constexpr double kTurnTolerance = 0.1; // slip directions are renewed within an iteration [rad]

double now()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

using Trial = NewtonWorkspace::Trial;

double dot(const Node6& a, const Node6& b)
{
    double s = 0;
    for (int i = 0; i < 6; ++i) s += a.value[i] * b.value[i];
    return s;
}

double apply(const ContactRow& row, const std::vector<Node6>& d, int e)
{
    return dot(row.a, d[std::size_t(e)]) + dot(row.b, d[std::size_t(e) + 1]);
}

/// K += s f h^T on the two nodes of element e.
void add_product(BlockTridiagonal& K, int e, const ContactRow& f, const ContactRow& h, double s)
{
    Block6 &d1 = K.diagonal(e), &d2 = K.diagonal(e + 1), &up = K.upper(e), &lo = K.lower(e);
    const Column6 fa = f.a.column * splat6(s), fb = f.b.column * splat6(s);
    for (int j = 0; j < 6; ++j) {
        const Column6 ha = splat6(h.a.value[j]), hb = splat6(h.b.value[j]);
        d1.column[j] += fa * ha;
        lo.column[j] += fb * ha;
        up.column[j] += fa * hb;
        d2.column[j] += fb * hb;
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

void assemble_anchor(const Wire& wire, const Anchor& anchor, BlockTridiagonal& K,
                     std::vector<Node6>& g)
{
    for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
        const std::size_t n = std::size_t(i);
        const BeamNode &a = anchor.reference[n], &b = wire.state.nodes[n];
        // rotation from the reference in the body frame, small
        const double conj[4] = {a.q[0], -a.q[1], -a.q[2], -a.q[3]};
        double r[4];
        quaternion_product(conj, b.q, r);
        const double s = r[0] < 0 ? -2 : 2;
        for (int k = 0; k < 3; ++k) {
            g[n].value[k] += anchor.linear[n] * b.difference(a, k);
            g[n].value[k + 3] += anchor.angular[n] * s * r[k + 1];
            K.diagonal(i)(k, k) += anchor.linear[n];
            K.diagonal(i)(k + 3, k + 3) += anchor.angular[n];
        }
    }
}

/// Everything of one iterate: candidates, base system, gradient with the present reactions.
Residual assemble(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                  const Anchor& anchor, const NewtonOptions& options, NewtonWorkspace& w,
                  NewtonReport& report)
{
    const double t0 = now();
    w.base.set_first(wire.state.first);
    w.base.set_zero();
    for (int i = wire.state.first; i <= wire.last(); ++i)
        w.gradient[std::size_t(i)].column = Column6{};
    assemble_wire(wire, w.laws, w.base, w.gradient);
    if (anchor.active()) assemble_anchor(wire, anchor, w.base, w.gradient);
    const double t1 = now();
    report.seconds_elements += t1 - t0;

    find_candidates(wire, walls, start, options.reach, w.proximity, w.candidates);
    assemble_reactions(wire, w.candidates, w.base, w.gradient);
    if (wire.plane) {
        // contact must not put back what the plane takes
        const Vec3 n = *wire.plane;
        for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
            double* r = w.gradient[std::size_t(i)].value;
            const double out = n[0] * r[0] + n[1] * r[1] + n[2] * r[2];
            for (int a = 0; a < 3; ++a) r[a] -= out * n[a];
            r[3] = r[4] = 0;
        }
    }
    report.seconds_detection += now() - t1;

    Residual res;
    double EA = 0, reactions = 0;
    for (int i = wire.state.first; i <= wire.last(); ++i) {
        const double* r = w.gradient[std::size_t(i)].value;
        const double h =
            wire.material.law[std::size_t(std::min(i, wire.last() - 1))].length;
        for (int k = 0; k < 3; ++k) {
            res.equilibrium = std::max(res.equilibrium, std::abs(r[k]));
            res.equilibrium = std::max(res.equilibrium, std::abs(r[k + 3]) / h);
        }
        if (!std::isfinite(r[0] + r[1] + r[2] + r[3] + r[4] + r[5]))
            res.equilibrium = std::numeric_limits<double>::infinity();
        if (i < wire.last())
            EA = std::max(EA, wire.material.law[std::size_t(i)].S[0] / h);
    }
    for (std::size_t k = 0; k < w.candidates.size(); ++k) {
        const Candidate& c = w.candidates[k];
        const double rho = kCertificateRho * c.stiffness;
        double f = std::abs(c.normal - std::max(0.0, c.normal - rho * c.gap));
        if (c.mu > 0) {
            const double s1 = c.tangential[0] - rho * c.slip[0],
                         s2 = c.tangential[1] - rho * c.slip[1];
            const double m = std::hypot(s1, s2), bound = c.mu * c.normal;
            const double p = m > bound ? bound / m : 1;
            f = std::max(f, std::hypot(c.tangential[0] - p * s1, c.tangential[1] - p * s2));
            res.cone = std::max(res.cone,
                                std::hypot(c.tangential[0], c.tangential[1]) - c.mu * c.normal);
        }
        if (f > res.contact) {
            res.contact = f;
            res.worst = int(k);
        }
        res.penetration = std::max(res.penetration, -c.gap);
        reactions = std::max(reactions, c.normal);
    }
    const double length = wire.material.length;
    double EI = 0;
    for (const ElementLaw& law : wire.material.law) EI = std::max(EI, law.S[4] / law.length);
    for (const Vec3& f : wire.dead_force) reactions = std::max(reactions, f.norm());
    for (const Vec3& m : wire.dead_moment) reactions = std::max(reactions, m.norm() / length);
    if (wire.sheath) reactions = std::max(reactions, std::abs(base_load(wire).push));
    res.scale = std::max(reactions, EI / (length * length));
    // A rotation rounded at epsilon makes an axial force of EA epsilon.
    res.floor = 4 * std::numeric_limits<double>::epsilon() * EA / res.scale;
    return res;
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
void add_contact(const Candidate& c, const Trial& t, BlockTridiagonal& K, bool coupled)
{
    const int e = c.place.element;
    const double rho = kRhoNormal * c.stiffness;
    if (t.status == 2) {
        add_product(K, e, coupled ? slip_force_row(c, t) : c.hn, c.hn, rho);
        if (t.across > 0) {
            const ContactRow p = across_row(c, t);
            add_product(K, e, p, p, t.across);
        }
        return;
    }
    add_product(K, e, c.hn, c.hn, rho);
    if (c.mu > 0)
        for (const ContactRow& h : c.ht) add_product(K, e, h, h, kRhoStick * c.stiffness);
}

void add_contact_force(const Candidate& c, const Trial& t, std::vector<Node6>& r)
{
    const int e = c.place.element;
    const double fn = c.normal - kRhoNormal * c.stiffness * c.gap;
    if (t.status == 2) {
        add_force(r, e, slip_force_row(c, t), fn);
        if (t.across > 0)
            add_force(r, e, across_row(c, t),
                      -t.across * (-t.c2 * c.slip[0] + t.c1 * c.slip[1]));
        return;
    }
    add_force(r, e, c.hn, fn);
    if (c.mu > 0)
        for (int k = 0; k < 2; ++k)
            add_force(r, e, c.ht[k],
                      c.tangential[k] - kRhoStick * c.stiffness * c.slip[k]);
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
        const double p = -t.across * (-t.c2 * t.v1 + t.c1 * t.v2);
        t.t1 = c.mu * t.normal * t.c1 - p * t.c2;
        t.t2 = c.mu * t.normal * t.c2 + p * t.c1;
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
    case Change::open: t.status = 0; break;
    case Change::close:
        t.status = 1;
        // A point that comes in sliding goes on sliding.
        if (c.mu > 0 && std::hypot(t.v1, t.v2) > 0) set_slip(c, t, -t.v1, -t.v2, 0);
        break;
    case Change::stick: t.status = 1; break;
    case Change::slip: set_slip(c, t, t.t1, t.t2, bound); break;
    case Change::turn: {
        const double m = std::hypot(t.t1, t.t2);
        const double k = m > bound && m > 0 ? bound / m : 1;
        set_slip(c, t, k * t.t1 - rho * t.v1, k * t.t2 - rho * t.v2, bound);
        break;
    }
    case Change::none: break;
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
    if (!c.sticks && m > 0 && m >= bound * (1 - 1e-9)) set_slip(c, t, s1, s2, bound);
    else if (m > bound * (1 + 1e-6) && m > 0) set_slip(c, t, s1, s2, bound);
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

/// Base plus shift plus active contacts; without friction's coupling to the normal reaction if
/// not `coupled`.
void set_system(const Wire& wire, NewtonWorkspace& w, double shift, bool coupled)
{
    w.system.copy_from(w.base, wire.state.first);
    if (shift > 0)
        for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
            const double h = wire.material.law[std::size_t(i) - 1].length;
            Block6& d = w.system.diagonal(i);
            for (int a = 0; a < 3; ++a) {
                d(a, a) += shift;
                d(a + 3, a + 3) += shift * h * h;
            }
        }
    for (std::size_t k = 0; k < w.candidates.size(); ++k)
        if (w.trial[k].status != 0) add_contact(w.candidates[k], w.trial[k], w.system, coupled);
}

/// Pivots the statuses from those of the iterate. Leaves the increment and the trials.
bool pivot(const Wire& wire, NewtonWorkspace& w, const Residual& res,
                      const NewtonOptions& options, double& shift, NewtonReport& report)
{
    const std::size_t n = w.candidates.size();
    const double force = 1e-3 * options.tolerance * res.scale;
    w.trial.resize(n);
    for (std::size_t k = 0; k < n; ++k) initial_status(w.candidates[k], w.trial[k]);

    std::vector<Change> wrong(n);
    int best = std::numeric_limits<int>::max(), patience = 8;
    for (int trial = 0; trial < kTrials; ++trial) {
        for (;;) {
            set_right_side(wire, w);
            set_system(wire, w, shift, true);
            ++report.factorisations;
            if (w.system.factor(wire.state.first) == 0) break;
            // Friction's unsymmetric rows can make a pivot negative by themselves; whether the
            // wire is stable on the motions that contact leaves free is the inertia without them.
            bool unsymmetric = false;
            for (const Trial& t : w.trial) unsymmetric |= t.status == 2;
            if (unsymmetric) {
                set_system(wire, w, shift, false);
                ++report.factorisations;
                if (w.system.factor(wire.state.first) == 0) {
                    set_system(wire, w, shift, true);
                    ++report.factorisations;
                    w.system.factor(wire.state.first);
                    break;
                }
            }
            const double unit = *std::min_element(wire.material.stiffness.begin(),
                                                  wire.material.stiffness.end());
            shift = shift > 0 ? 4 * shift : 1e-6 * unit;
            if (shift > 1e6 * unit) return false;
        }
        w.increment = w.right;
        w.system.solve(w.increment);

        int count = 0;
        for (std::size_t k = 0; k < n; ++k) {
            evaluate(w.candidates[k], w.trial[k], w.increment);
            wrong[k] = violation(w.candidates[k], w.trial[k], force,
                                 force / (kCertificateRho * w.candidates[k].stiffness));
            if (wrong[k].kind != Change::none) ++count;
        }
        if (count == 0) return true;

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
                change(w.candidates[k], w.trial[k], wrong[k].kind);
        } else {
            for (std::size_t k = n; k-- > 0;)
                if (wrong[k].kind != Change::none) {
                    change(w.candidates[k], w.trial[k], wrong[k].kind);
                    break;
                }
        }
    }
    return false;
}

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
        const ContactRow f = r.which > 0       ? c.ht[r.which - 1]
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
    for (Eigen::Index j = 0; j < n; ++j) {
        const Row& r = rows[std::size_t(j)];
        Trial& t = w.trial[r.candidate];
        const double mu = w.candidates[r.candidate].mu;
        if (r.which == 0) t.normal += change[j];
        if (r.which == 1) t.t1 += change[j];
        if (r.which == 2) t.t2 += change[j];
        if (r.which == 0 && t.status == 2) {
            t.t1 += mu * change[j] * t.c1;
            t.t2 += mu * change[j] * t.c2;
        }
    }
}

/// The linearised contact problem. Where pivoting finds no solution (the wire is about to lose
/// its hold), a shift makes the problem more definite and its solution nearer.
void solve_linearised(const Wire& wire, NewtonWorkspace& w, const Residual& res,
                      const NewtonOptions& options, double& shift, NewtonReport& report)
{
    const double unit = *std::min_element(wire.material.stiffness.begin(),
                                          wire.material.stiffness.end());
    for (int level = 0; level < kShiftLevels; ++level) {
        if (pivot(wire, w, res, options, shift, report)) return;
        shift = std::max(16 * shift, 1e-3 * unit);
    }
}

} // namespace

NewtonWorkspace::NewtonWorkspace(const Wire& wire, std::size_t walls)
    : base(int(wire.material.node.size()))
    , system(int(wire.material.node.size()))
    , gradient(wire.material.node.size())
    , right(wire.material.node.size())
    , increment(wire.material.node.size())
    , laws(wire.material.law)
    , proximity(wire.material.point.size() * walls)
{
    for (auto* v : {&gradient, &right, &increment})
        for (Node6& n : *v) n.column = Column6{};
}

Residual residual_of(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                     const Anchor& anchor, const NewtonOptions& options, NewtonWorkspace& work)
{
    NewtonReport ignored;
    return assemble(wire, walls, start, anchor, options, work, ignored);
}

NewtonReport solve_equilibrium(Wire& wire, const std::vector<WireWall>& walls,
                               const StepStart& start, const Anchor& anchor,
                               const NewtonOptions& options, NewtonWorkspace& w)
{
    NewtonReport report;
    if (!wire.outside()) {
        report.converged = report.stable = true;
        report.residual.scale = 1;
        return report;
    }
    double shift = 0;
    for (report.iterations = 0; report.iterations <= options.max_iterations; ++report.iterations) {
        report.residual = assemble(wire, walls, start, anchor, options, w, report);
        const Residual& res = report.residual;
        if (!std::isfinite(res.equilibrium)) return report;
        if (report.iterations > 0 && res.error() <= std::max(options.tolerance, res.floor)) {
            report.converged = true;
            report.stable = shift == 0;
            return report;
        }
        if (report.iterations == options.max_iterations) return report;

        const double t0 = now();
        shift = 0;
        solve_linearised(wire, w, res, options, shift, report);
        if (report.iterations >= kSlow) close_active_rows(wire, w);
        if (shift > 0) ++report.shifted;
        const double t1 = now();
        report.seconds_contact += t1 - t0;

        double move = 0, turn = 0;
        for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
            const double* d = w.increment[std::size_t(i)].value;
            move = std::max(move, std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
            turn = std::max(turn, std::sqrt(d[3] * d[3] + d[4] * d[4] + d[5] * d[5]));
        }
        if (!std::isfinite(move + turn)) {
            report.residual.equilibrium = std::numeric_limits<double>::infinity();
            return report;
        }
        double factor = 1;
        if (move > options.longest_move) factor = options.longest_move / move;
        if (turn * factor > 0.3) factor = 0.3 / turn;
        for (std::size_t k = 0; k < w.candidates.size(); ++k) {
            const Candidate& c = w.candidates[k];
            const Trial& t = w.trial[k];
            Reaction& r = wire.state.reaction[std::size_t(c.index)];
            const double normal = std::max(0.0, t.normal);
            const double limit = c.mu * normal, m = std::hypot(t.t1, t.t2);
            const double back = m > limit ? limit / m : 1;
            r.normal = c.normal + factor * (normal - c.normal);
            const double f1 = c.tangential[0] + factor * (back * t.t1 - c.tangential[0]);
            const double f2 = c.tangential[1] + factor * (back * t.t2 - c.tangential[1]);
            r.tangential = f1 * c.t1 + f2 * c.t2;
            r.sticks = t.status == 1;
        }
        move_wire(wire, w.increment, factor);
        report.seconds_rest += now() - t1;
    }
    return report;
}

} // namespace amontons
