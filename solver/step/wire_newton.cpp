#include "solver/step/wire_newton.hpp"

#include "mesh/base/phase_timer.hpp"
#include "solver/beam/plane_hold.hpp"
#include "solver/beam/soft_tube.hpp"
#include "solver/step/soft_balance.hpp"
#include "solver/step/wire_pivot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

constexpr double kCertificateRho = 1; // of the natural map, relative to WireMaterial::stiffness
constexpr double kHeldByPull = 1e-3;        // of a pull on the nodes: with kRhoNormal, ten times it
constexpr double kLost = 1e-3;        // of what soft walls are off by, relative

void assemble_viscous_pull(const Wire& wire, const ViscousPull& anchor, BlockTridiagonal& K,
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
            g[n].value[k + 3] += anchor.angular[n][k] * s * r[k + 1];
            K.diagonal(i)(k, k) += anchor.linear[n];
            K.diagonal(i)(k + 3, k + 3) += anchor.angular[n][k];
        }
    }
}

/// Where soft walls were touched and by what: for the next evaluation of them.
void keep_touches(Wire& wire, const NewtonWorkspace& w)
{
    wire.state.wall_energy = 0;
    for (const Candidate& c : w.candidates)
        wire.state.wall_energy += 0.5 * c.compliance * c.normal * c.normal;
    if (!w.compliant_walls) return;
    for (const WireWall& wall : *w.compliant_walls)
        if (wall.soft && !wall.soft->hyperelastic())
            wire.state.wall_energy += wall.soft->contact_energy();
    for (const Candidate& c : w.candidates) {
        Reaction& r = wire.state.reaction[std::size_t(c.index)];
        r.touch = {true, c.along, c.around, c.n};
        r.tangential = c.tangential[0] * c.t1 + c.tangential[1] * c.t2;
    }
}

} // namespace

ViscousPull make_viscous_pull(const Wire& wire, double stiffness)
{
    ViscousPull a;
    a.reference = wire.state.nodes;
    a.linear.assign(a.reference.size(), 0);
    a.angular.assign(a.reference.size(), Vec3::Zero());
    for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
        const std::size_t k = std::size_t(i);
        const double h = wire.material.law[k - 1].length;
        a.linear[k] = stiffness * h;
        a.angular[k].setConstant(a.linear[k] * h * h / 12);
    }
    return a;
}

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
        for (Node6& n : *v)
            n.column = Column6{};
}

void assemble_iterate(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                      const ViscousPull& anchor, const NewtonOptions& options, NewtonWorkspace& w,
                      NewtonReport& report)
{
    const Stopwatch elements;
    w.base.set_first(wire.state.first);
    w.base.set_zero();
    for (int i = wire.state.first; i <= wire.last(); ++i)
        w.gradient[std::size_t(i)].column = Column6{};
    assemble_wire(wire, w.laws, w.base, w.gradient, w.predicted);
    if (anchor.active()) assemble_viscous_pull(wire, anchor, w.base, w.gradient);
    report.seconds_elements += elements.seconds();

    const Stopwatch detection;
    w.unsettled =
        find_candidates(wire, walls, start, options.reach, w.proximity, w.candidates, w.covered);
    if (anchor.active()) // rows weigh more than what holds the wire
        for (Candidate& c : w.candidates) {
            const std::size_t e = std::size_t(c.place.element);
            c.held[0] = c.held[1] = kHeldByPull * std::max(anchor.linear[e], anchor.linear[e + 1]);
        }
    w.compliant_walls = any_soft(walls) ? &walls : nullptr;
    // The linearised problem contains the curvature of soft walls.
    assemble_reactions(wire, w.candidates, w.base, w.gradient, !w.compliant_walls);
    if (wire.tip) w.tip = hold_tip(wire, w.base, w.gradient);
    if (wire.plane) hold_in_plane(wire, w.base, w.gradient);
    report.seconds_detection += detection.seconds();
}

double contact_error(const Candidate& c, double& cone)
{
    const double rho = kCertificateRho * c.stiffness;
    double f = c.bilateral ? rho * std::abs(c.gap)
                           : std::abs(c.normal - std::max(0.0, c.normal - rho * c.gap));
    if (c.mu > 0) {
        const double s1 = c.tangential[0] - rho * c.slip[0], s2 = c.tangential[1] - rho * c.slip[1];
        const double m = std::hypot(s1, s2), bound = c.mu * c.normal;
        const double p = m > bound ? bound / m : 1;
        f = std::max(f, std::hypot(c.tangential[0] - p * s1, c.tangential[1] - p * s2));
        cone = std::max(cone, std::hypot(c.tangential[0], c.tangential[1]) - c.mu * c.normal);
    }
    return f;
}

Residual residual_of_iterate(const Wire& wire, const NewtonWorkspace& w)
{
    Residual res;
    double EA = 0, across = 0, reactions = 0;
    for (int i = wire.state.first; i <= wire.last(); ++i) {
        const double* r = w.gradient[std::size_t(i)].value;
        const double h = wire.material.law[std::size_t(std::min(i, wire.last() - 1))].length;
        // norms, not components: no axis of space decides when an iterate is good enough
        const double force = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
        const double moment = std::sqrt(r[3] * r[3] + r[4] * r[4] + r[5] * r[5]);
        res.equilibrium = std::max({res.equilibrium, force, moment / h});
        if (!std::isfinite(r[0] + r[1] + r[2] + r[3] + r[4] + r[5]))
            res.equilibrium = std::numeric_limits<double>::infinity();
        if (i == wire.last()) continue;
        const ElementLaw& law = wire.material.law[std::size_t(i)];
        EA = std::max(EA, law.S[0] / h);
        across = std::max(across, 12 * std::max(law.S[4], law.S[5]) / (h * h * h));
    }
    res.contact = w.unsettled;
    for (std::size_t k = 0; k < w.candidates.size(); ++k) {
        const Candidate& c = w.candidates[k];
        const double f = contact_error(c, res.cone);
        if (f > res.contact) {
            res.contact = f;
            res.worst = int(k);
        }
        res.penetration = std::max(res.penetration, -c.gap);
        reactions = std::max(reactions, c.normal);
    }
    const double length = wire.material.length;
    double EI = 0;
    for (const ElementLaw& law : wire.material.law)
        EI = std::max({EI, law.S[4] / law.length, law.S[5] / law.length});
    for (const Vec3& f : wire.dead_force)
        reactions = std::max(reactions, f.norm());
    for (const Vec3& m : wire.dead_moment)
        reactions = std::max(reactions, m.norm() / length);
    if (wire.sheath) reactions = std::max(reactions, std::abs(base_load(wire).push));
    res.scale = std::max(reactions, EI / (length * length));
    // Places and rotations rounded at epsilon make an axial force of EA epsilon, and in elements
    // shorter than the wire's radius a larger one across, 12 EI/h^2 epsilon: measured up to 4.2 and
    // 4 of those at a node.
    constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
    res.floor = std::max(6 * EA, 5 * across) * kEpsilon / res.scale;
    return res;
}

Residual residual_of(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                     const ViscousPull& anchor, const NewtonOptions& options, NewtonWorkspace& work)
{
    NewtonReport ignored;
    assemble_iterate(wire, walls, start, anchor, options, work, ignored);
    return residual_of_iterate(wire, work);
}

void take_trial(const Candidate& c, const NewtonWorkspace::Trial& t, double factor, Reaction& r)
{
    const double normal = std::max(0.0, t.normal);
    const double limit = c.mu * normal, m = std::hypot(t.t1, t.t2);
    const double back = m > limit ? limit / m : 1;
    r.normal = c.normal + factor * (normal - c.normal);
    const double f1 = c.tangential[0] + factor * (back * t.t1 - c.tangential[0]);
    const double f2 = c.tangential[1] + factor * (back * t.t2 - c.tangential[1]);
    r.tangential = f1 * c.t1 + f2 * c.t2;
    r.sticks = t.status == 1;
}

double step_factor(const Wire& wire, const std::vector<Node6>& increment, double longest_move)
{
    double move = 0, turn = 0;
    for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
        const double* d = increment[std::size_t(i)].value;
        move = std::max(move, std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
        turn = std::max(turn, std::sqrt(d[3] * d[3] + d[4] * d[4] + d[5] * d[5]));
    }
    if (!std::isfinite(move + turn)) return 0;
    double factor = 1;
    if (move > longest_move) factor = longest_move / move;
    if (turn * factor > 0.3) factor = 0.3 / turn;
    return factor;
}

namespace {

/// With displacements of hyperelastic walls by their tangents, and their offsets as they are.
NewtonReport solve_on_tangents(Wire& wire, const std::vector<WireWall>& walls,
                               const StepStart& start, const ViscousPull& anchor,
                               const NewtonOptions& options, NewtonWorkspace& w)
{
    NewtonReport report;
    if (!wire.outside()) {
        report.converged = report.stable = true;
        report.residual.scale = 1;
        return report;
    }
    double shift = w.shift = 0;
    for (report.iterations = 0; report.iterations <= options.max_iterations; ++report.iterations) {
        if (stopped(options)) return report;
        assemble_iterate(wire, walls, start, anchor, options, w, report);
        report.residual = residual_of_iterate(wire, w);
        const Residual& res = report.residual;
        if (!std::isfinite(res.equilibrium)) return report;
        // Forces so far from balance that the walls have no equilibrium under them.
        if (w.unsettled > kLost * res.scale) return report;
        keep_touches(wire, w);
        if (report.iterations > 0 && res.error() <= std::max(options.tolerance, res.floor)) {
            report.converged = true;
            report.stable = shift == 0;
            return report;
        }
        if (report.iterations == options.max_iterations) return report;

        const Stopwatch solving;
        shift = 0;
        solve_linearised(wire, w, res, options, shift, report);
        if (report.iterations >= kIterationsBeforeClosing && !w.compliant_walls)
            close_active_rows(wire, w, least_violation(res, options));
        if (shift > 0) ++report.shifted;
        report.seconds_contact += solving.seconds();
        const Stopwatch moving;

        const double factor = step_factor(wire, w.increment, options.longest_move);
        if (!(factor > 0)) {
            report.residual.equilibrium = std::numeric_limits<double>::infinity();
            return report;
        }
        for (std::size_t k = 0; k < w.candidates.size(); ++k) {
            const Candidate& c = w.candidates[k];
            take_trial(c, w.trial[k], factor, wire.state.reaction[std::size_t(c.index)]);
        }
        predict_strains(wire, w.increment, factor, w.predicted);
        move_wire(wire, w.increment, factor);
        report.seconds_rest += moving.seconds();
    }
    return report;
}

} // namespace

NewtonReport solve_equilibrium(Wire& wire, const std::vector<WireWall>& walls,
                               const StepStart& start, const ViscousPull& anchor,
                               const NewtonOptions& options, NewtonWorkspace& w)
{
    return balance_walls(wire, walls, options, [&](const NewtonOptions& o) {
        const NewtonReport report = solve_on_tangents(wire, walls, start, anchor, o, w);
        w.predicted.clear();
        return report;
    });
}

} // namespace amontons
