#include "validation/families/wires/wires.hpp"

#include "solver/step/wire_newton.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

// Of the cable the answer is that of a polygon with equal turns: n corners on the cylinder, half a
// turn's chord beyond the tangent points at either end, so that the ends leave along the tangents.
//
// A cable or wire lies around a cylinder of radius 1. It begins at its pulled end, beyond the
// cylinder, and ends at the dead load of 1 N. Both ends stand off along the tangent.

namespace amontons::validation {
namespace {

constexpr double kStrain = 1e-3; // of the stretched cable, everywhere about the same

/// Tension before a corner that turns the cable by d over that after it, where it slides.
double corner_ratio(double d, double mu)
{
    const double c = std::cos(0.5 * d), s = mu * std::sin(0.5 * d);
    return (c + s) / (c - s);
}

struct Capstan {
    Wire wire;
    Wall wall = make_cylinder_wall(Vec3::Zero(), Vec3::UnitZ(), 1, false);
    std::vector<WireWall> walls;
    double angle = 0; // of the whole contact [rad]
    double turn = 0;  // from element to element [rad]
    double mu = 0;
    int corners = 0; // of a cable
    int free = 3;    // elements off the cylinder at either end
};

/// Place at an arc length s from where the cable touches the cylinder on the pulled side.
Vec3 place(double s, double angle, Vec3& tangent)
{
    // Runs clockwise from the pulled end down to the load: at angle `angle` first, 0 last.
    const double on = std::clamp(s, 0.0, angle), phi = angle - on;
    tangent = Vec3(std::sin(phi), -std::cos(phi), 0);
    return Vec3(std::cos(phi), std::sin(phi), 0) + (s - on) * tangent;
}

/// Lays the nodes around the cylinder, drawn by a share of an element towards the pulled end.
void lay(Capstan& c, double drawn)
{
    WireState& state = c.wire.state;
    for (std::size_t i = 0; i < state.nodes.size(); ++i) {
        Vec3 tangent;
        const Vec3 x = place((double(i) - c.free - drawn) * c.turn, c.angle, tangent);
        Mat3 frame;
        frame << tangent, Vec3::UnitZ().cross(tangent), Vec3::UnitZ();
        const Quaternion q = quaternion_of(frame);
        state.nodes[i] = {};
        for (int k = 0; k < 3; ++k)
            state.nodes[i].x[k] = x[k];
        std::copy(q.q, q.q + 4, state.nodes[i].q);
    }
    if (!c.wire.cable || drawn < 0.5) return;
    // Its held end, in line with the first corner along the tangent; nodes stand at half turns.
    Vec3 first, along;
    const Vec3 corner = place(0.5 * c.turn, c.angle, first);
    place(0, c.angle, along);
    const Vec3 x = corner - (c.free + 1) * 2 * std::sin(0.5 * c.turn) * along;
    for (int k = 0; k < 3; ++k)
        state.nodes[0].x[k] = x[k];
}

/// @param angle     of the whole contact [rad]
/// @param elements  on the cylinder
/// @param EI        over the tension and the radius squared; 0: cable
void make(Capstan& c, double angle, int elements, double mu, double EI)
{
    c.angle = angle;
    c.turn = angle / elements;
    c.mu = mu;
    c.corners = elements;
    // Bending dies away over sqrt(EI/T) from where the wire leaves the cylinder.
    c.free = std::max(3, int(std::ceil(10 * std::sqrt(EI) / c.turn)));
    // Chords on the circle are stretched as they will be when all slides.
    const double h = 2 * std::sin(0.5 * c.turn) / (1 + kStrain);
    std::vector<BeamSegment> segments;
    for (int i = 0; i < elements + 2 * c.free; ++i) {
        const double from_load = std::clamp(angle - (i + 0.5 - c.free) * c.turn, 0.0, angle);
        // A cable's chord has as many corners after it as it will have in the end.
        const double tension = EI == 0 ? std::pow(corner_ratio(c.turn, mu),
                                                  std::clamp(c.free + elements - i, 0, elements))
                                       : std::exp(mu * from_load);
        BeamSegment g;
        g.length = g.element = h;
        g.radius = 1e-6; // the wire's own thickness would add to the arm of friction
        g.EA = {tension / kStrain, tension / kStrain};
        g.EI = {EI * tension, EI * tension};
        g.GJ = g.EI;
        segments.push_back(g);
    }
    c.wire.material = make_material(segments, h);
    c.wire.cable = EI == 0;
    WireMaterial& m = c.wire.material;
    for (MaterialPoint& p : m.point)
        p.radius = 0;
    // The scale of a contact's stiffness, which for a beam comes from its bending.
    for (std::size_t i = 0; i < m.law.size(); ++i)
        m.stiffness[i] = 1e-2 * m.law[i].S[0] / (h * h);
    c.wire.state.first = 0;
    c.wire.state.nodes.resize(m.node.size());
    c.wire.dead_force.assign(m.node.size(), Vec3::Zero());
    c.wire.dead_force.back() = Vec3(0, -1, 0);
    c.wire.state.reaction.assign(m.point.size(), {});
    // Reactions near those of the sliding cable: the scale of forces comes from them.
    for (std::size_t p = 0; p < m.point.size(); ++p) {
        const double s = (m.point[p].s / h - c.free) * c.turn;
        if (s < -0.5 * c.turn || s > angle + 0.5 * c.turn) continue;
        Vec3 tangent;
        place(s, angle, tangent);
        Reaction& guess = c.wire.state.reaction[p];
        const double from_load = (angle - s) / c.turn;
        guess.normal = EI == 0 ? c.turn * std::pow(corner_ratio(c.turn, mu),
                                                   std::clamp(from_load, 0.0, double(elements)))
                               : c.turn * std::exp(mu * (angle - s));
        guess.tangential = mu * guess.normal * tangent;
    }
    c.walls.resize(1);
    c.walls[0].wall = &c.wall;
    c.walls[0].friction.assign(m.point.size(), mu);
}

/// Draws the cable around the cylinder until everything slides.
/// @return  what the last solve states
NewtonReport draw(Capstan& c)
{
    NewtonWorkspace work(c.wire, 1);
    NewtonOptions options;
    options.tolerance = c.wire.cable ? 1e-13 : 1e-9;
    options.max_iterations = 100;
    options.reach = 0.5 * c.turn * c.turn;
    options.longest_move = 0.2 * c.turn;
    NewtonReport r;
    lay(c, 0);
    for (int step = 1; step <= (c.wire.cable ? 5 : 3); ++step) {
        const StepStart start = mark_step_start(c.wire);
        lay(c, 0.1 * step);
        r = solve_equilibrium(c.wire, c.walls, start, {}, options, work);
        // The stop is relative to the largest tension; continue for the small ones.
        for (int more = 0; more < 4 && r.converged; ++more)
            r = solve_equilibrium(c.wire, c.walls, start, {}, options, work);
        if (!r.converged) break;
    }
    return r;
}

Vec3 force_in(const Wire& w, std::size_t e)
{
    const ElementLaw& law = w.material.law[e];
    const BeamNode &a = w.state.nodes[e], &b = w.state.nodes[e + 1];
    if (w.cable) {
        const Vec3 d(b.difference(a, 0), b.difference(a, 1), b.difference(a, 2));
        const double stretch = d.norm() / law.length;
        return (law.S[0] * stretch - law.P[0]) / law.length * d.normalized();
    }
    const auto f =
        element_force(a, b, law.length, element_stress(law, element_strain(a, b, law.length)));
    return {f[6], f[7], f[8]};
}

} // namespace

std::vector<Measured> capstan_cable()
{
    std::vector<Measured> rows;
    struct Kind {
        double wraps, mu;
        int per_wrap;
        double listed = 0; // of the benchmark list; 0: the formula alone
    };
    for (const Kind& kind :
         {Kind{0.5, 0.3, 24}, Kind{1, 0.3, 24}, Kind{3, 0.3, 8, 401.683399},
          Kind{3, 0.3, 16, 309.664853}, Kind{3, 0.3, 32, 291.417418}, Kind{3, 0.3, 160, 285.90484},
          Kind{5, 0.3, 24}, Kind{10, 0.3, 24}, Kind{10, 0.5, 24}}) {
        Capstan c;
        const double angle = 2 * std::numbers::pi * kind.wraps;
        make(c, angle, int(kind.wraps * kind.per_wrap), kind.mu, 0);
        const std::string name =
            fmt::format("{} wraps, mu {}, {} corners a wrap", kind.wraps, kind.mu, kind.per_wrap);
        const NewtonReport report = draw(c);
        if (!report.converged) {
            rows.push_back(at_most("no convergence, " + name, report.residual.error(), 1e-12));
            continue;
        }
        ReferenceCurve curve{"angle from the load [rad]", "ln(tension over load)", {}, {}, {}};
        const double load = force_in(c.wire, c.wire.material.law.size() - 1).norm();
        const double each = corner_ratio(c.turn, kind.mu);
        double worst = 0, turned = 0, uneven = 0;
        int corners = 0;
        for (std::size_t p = 0; p < c.wire.material.point.size(); ++p) {
            if (!(c.wire.state.reaction[p].normal > 0)) continue;
            const std::size_t node = c.wire.material.node.size() - 1 - p;
            const Vec3 before = force_in(c.wire, node - 1), after = force_in(c.wire, node);
            const Vec3 x = c.wire.state.nodes[node].position();
            const Vec3 n = Vec3(x.x(), x.y(), 0).normalized();
            const Vec3 t = n.cross(Vec3::UnitZ()); // towards the load
            // Angles of the two chords with the tangent of the cylinder.
            const double a = std::atan2(n.dot(before), t.dot(before));
            const double b = std::atan2(-n.dot(after), t.dot(after));
            turned += a + b;
            if (a + b < 1e-6 * c.turn) continue; // a node that touches where nothing turns
            ++corners;
            raise_to(worst, std::abs(before.norm() / after.norm() / each - 1));
            raise_to(uneven, std::abs((a + b) / c.turn - 1));
            if (corners % std::max(1, c.corners / 100) == 0)
                curve.add(turned, corners * std::log(each), std::log(before.norm() / load));
        }
        const double ratio = force_in(c.wire, 0).norm() / load;
        rows.push_back(absolute("corners, " + name, c.corners, corners, 0));
        rows.push_back(at_most("worst corner, " + name, worst, 1e-8));
        rows.push_back(relative("tension ratio, " + name,
                                kind.listed > 0 ? kind.listed : std::pow(each, c.corners), ratio,
                                1e-8));
        rows.back().note = fmt::format("turns {:.9f} rad of {:.9f}, each alike to {:.1e}; "
                                       "exp(mu theta) {:.9g}",
                                       turned, angle, uneven, std::exp(kind.mu * angle));
        if (kind.wraps == 10 && kind.per_wrap == 24) rows.back().curve = std::move(curve);
    }
    rows.push_back(left_out("10 wraps, mu 0.5, 48 corners a wrap",
                            "Newton's method does not converge there; 24 corners a wrap do"));
    return rows;
}

std::vector<Measured> capstan_beam()
{
    // EI/(T R^2) bounds what the wire's bending changes; elements must be shorter than
    // sqrt(12 EI/T), or tension overcomes their shear stiffness.
    constexpr double kBending = 5e-7;
    const double mu = 0.3;
    std::vector<Measured> rows;
    for (double wraps : {0.5, 1.0})
        for (int per_wrap : {3000, 6000, 12000}) {
            Capstan c;
            const double angle = 2 * std::numbers::pi * wraps;
            make(c, angle, int(wraps * per_wrap), mu, kBending);
            c.wire.plane = Vec3::UnitZ();
            const std::string name = fmt::format("{} wrap{}, {} elements", wraps,
                                                 wraps < 1 ? "s" : "", wraps * per_wrap);
            const NewtonReport report = draw(c);
            if (!report.converged) {
                rows.push_back(at_most("no convergence, " + name, report.residual.error(), 1e-9));
                continue;
            }
            const Vec3 first = force_in(c.wire, 0);
            const Vec3 last = force_in(c.wire, c.wire.material.law.size() - 1);
            // What the force turns by on its way, near the angle of contact.
            const double part = std::atan2(last.cross(first).z(), first.dot(last));
            const double turned =
                part + 2 * std::numbers::pi * std::round((angle - part) / (2 * std::numbers::pi));
            rows.push_back(relative("tension ratio, " + name, std::exp(mu * turned),
                                    first.norm() / last.norm(), 1e-5));
            rows.back().note = fmt::format("force turns by {:.6f} rad; exp(mu 2 pi wraps) {:.9g}",
                                           turned, std::exp(mu * angle));
        }
    return rows;
}

} // namespace amontons::validation
