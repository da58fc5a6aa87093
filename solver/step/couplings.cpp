#include "solver/step/couplings.hpp"

#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/solid/corotational.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

namespace amontons {
namespace {

/// Edges of the tetrahedron that a solid's anchor stands in.
Mat3 edges(std::span<const StencilEntry> nodes, std::span<const Vec3> places)
{
    Mat3 J;
    for (std::size_t i = 0; i < 3; ++i)
        J.col(Eigen::Index(i)) =
            places[std::size_t(nodes[i + 1].node)] - places[std::size_t(nodes[0].node)];
    return J;
}

/// How a body has turned where an anchor is.
Eigen::Quaterniond turn_of(const std::vector<BodyRef>& bodies, const CoupledPlace& anchor)
{
    if (anchor.body < 0) return Eigen::Quaterniond::Identity();
    const BodyRef& b = bodies[std::size_t(anchor.body)];
    if (b.rigid) return b.rigid->placement().turn;
    if (!b.solid->nonlinear()) return b.solid->frame().turn;
    const Mat3 F = edges(anchor.nodes, b.solid->places()) *
                   edges(anchor.nodes, b.solid->mesh().nodes).inverse();
    return Eigen::Quaterniond(polar_rotation(F));
}

/// The corner nodes of the element that is nearest to x, with the weights that make x of them.
std::vector<StencilEntry> nodes_at(const SolidBody& solid, const Vec3& x, double& distance)
{
    std::vector<StencilEntry> best;
    double least = std::numeric_limits<double>::infinity();
    const std::span<const Vec3> places = solid.places();
    for_each_element(solid.mesh(), [&](std::int32_t, ElementKind kind, auto nodes) {
        // A tetrahedron of corners is enough to make any point nearby exactly, and any motion of it
        // to the first order.
        constexpr std::array<std::array<int, 4>, 2> kCorners{{{0, 1, 2, 3}, {0, 1, 3, 4}}};
        const auto& c = kCorners[kind == ElementKind::H8 ? 1 : 0];
        const auto place = [&](int i) {
            return places[std::size_t(nodes[std::size_t(c[std::size_t(i)])])];
        };
        Mat3 J;
        for (int i = 0; i < 3; ++i)
            J.col(i) = place(i + 1) - place(0);
        const Vec3 l = J.inverse() * (x - place(0));
        const double w[] = {1 - l.sum(), l.x(), l.y(), l.z()};
        // To the point of the element with the nearest weights, which are at most 1.
        Vec3 inside = l.cwiseMax(0);
        inside = kind == ElementKind::H8 ? Vec3(inside.cwiseMin(1))
                                         : Vec3(inside / std::max(1.0, inside.sum()));
        const double out = (J * (l - inside)).norm();
        if (out < least) {
            least = out;
            best.clear();
            for (int i = 0; i < 4; ++i)
                best.push_back({nodes[std::size_t(c[std::size_t(i)])], w[i]});
        }
    });
    distance = least;
    return best;
}

} // namespace

Vec3 anchor_point(const std::vector<BodyRef>& bodies, const CoupledPlace& anchor)
{
    if (anchor.body < 0) return anchor.local;
    const BodyRef& b = bodies[std::size_t(anchor.body)];
    if (b.rigid) return b.rigid->placement() * anchor.local;
    Vec3 x = Vec3::Zero();
    for (const StencilEntry& e : anchor.nodes)
        x += e.weight * b.solid->places()[std::size_t(e.node)];
    return x;
}

bool same_anchors(const Coupling& a, const Coupling& b)
{
    return a.input == b.input && !a.turns && !b.turns && a.a.nodes.empty() && a.b.nodes.empty() &&
           a.a.local == b.a.local && a.b.local == b.b.local;
}

CouplingRow coupling_row(const std::vector<BodyRef>& bodies, const Coupling& c, double known,
                         const CouplingRow* same)
{
    CouplingRow row;
    if (c.turns) { // of the turn of a against b what is about the axis
        const Eigen::Quaterniond a = turn_of(bodies, c.a);
        const Eigen::Quaterniond turned = turn_of(bodies, c.b).conjugate() * a * c.turn;
        row.turns = true;
        row.direction = a * c.axis;
        // Along the axis as b has it: where a hinge holds the two, both have the same.
        const Vec3 axis = c.turn.conjugate() * c.axis;
        row.value = 2 * std::atan2(turned.vec().dot(axis), turned.w()) - c.rest;
        constexpr double kWhole = 2 * std::numbers::pi;
        row.value += kWhole * std::round((known - row.value) / kWhole);
        return row;
    }
    row.anchor_a = row.point_a = same ? same->anchor_a : anchor_point(bodies, c.a);
    row.point_b = same ? same->point_b : anchor_point(bodies, c.b);
    const Vec3 between = row.point_a - row.point_b;
    row.direction = turn_of(bodies, c.a) * c.axis;
    if (c.along_line && between.norm() > 0) row.direction = between.normalized();
    row.length = between.norm();
    row.value = row.direction.dot(between) - c.rest;
    // A direction that turns with a, of a place that slides along it: the row's derivative by a's
    // turn is that of a's place at b. Two places would make a couple of the row's two forces.
    if (!c.along_line && c.a.nodes.empty()) row.point_a = row.point_b;
    if (c.slides && !c.a.nodes.empty()) {
        const std::span<const Vec3> x = bodies[std::size_t(c.a.body)].solid->places();
        const Vec3 l =
            edges(c.a.nodes, x).inverse() * (row.point_b - x[std::size_t(c.a.nodes[0].node)]);
        const double weight[] = {1 - l.sum(), l.x(), l.y(), l.z()};
        row.nodes_a = c.a.nodes;
        for (std::size_t i = 0; i < row.nodes_a.size(); ++i)
            row.nodes_a[i].weight = weight[i];
        row.point_a = row.point_b;
    }
    return row;
}

CouplingRow row_between(const Coupling& c, const CouplingRow& start, const CouplingRow& end)
{
    CouplingRow row = end;
    const double lengths = start.length + end.length;
    if (!c.along_line)
        row.direction = (start.direction + end.direction).normalized();
    else if (lengths > 0) // |x'|^2 - |x|^2 = (x' + x) . (x' - x)
        row.direction = (start.length * start.direction + end.length * end.direction) / lengths;
    row.point_a = 0.5 * (start.point_a + end.point_a);
    row.point_b = 0.5 * (start.point_b + end.point_b);
    return row;
}

SpringRow spring_row(const Coupling& c, const TimeRule& rule, double h,
                     const CouplingMemory& before, double value)
{
    const double k = 1 / c.softness, own = k * rule.end + c.damping / h;
    const double past = rule.past(before.value, before.filtered);
    return {value + (k * past - c.damping / h * before.value) / own, 1 / (h * own)};
}

double spring_energy(const std::vector<Coupling>& couplings,
                     const std::vector<CouplingMemory>& memory)
{
    double sum = 0;
    for (std::size_t c = 0; c < couplings.size(); ++c)
        if (couplings[c].softness > 0)
            sum += 0.5 * memory[c].value * memory[c].value / couplings[c].softness;
    return sum;
}

std::vector<CouplingMemory> begin_memory(const std::vector<BodyRef>& bodies,
                                         const std::vector<Coupling>& couplings)
{
    std::vector<CouplingMemory> memory;
    for (const Coupling& c : couplings) {
        const double value = coupling_row(bodies, c).value;
        memory.push_back({value, value});
    }
    return memory;
}

std::vector<Coupling> make_couplings(const Scene& scene, const std::vector<BodyRef>& bodies)
{
    std::vector<Coupling> rows;
    std::vector<Issue> issues;
    for (std::size_t k = 0; k < scene.couplings.size(); ++k) {
        const CouplingInput& c = scene.couplings[k];
        int index[2] = {-1, -1};
        for (std::size_t s = 0; s < 2; ++s)
            for (std::size_t b = 0; b < bodies.size(); ++b)
                if (bodies[b].name == c.between[s]) index[s] = int(b);
        double size = 1;
        for (const int b : index)
            if (b >= 0) size = bodies[std::size_t(b)].body->size();
        const auto anchor = [&](int body, const Vec3& x) {
            CoupledPlace a;
            a.body = body;
            a.local = x;
            if (body < 0) return a;
            const BodyRef& b = bodies[std::size_t(body)];
            if (b.rigid) {
                const Placement p = b.rigid->placement();
                a.local = p.turn.conjugate() * (x - p.shift);
                return a;
            }
            double away = 0;
            a.nodes = nodes_at(*b.solid, x, away);
            // Of the places that the scene names; a joint's rows share them.
            const bool named = x == c.at || (c.to && x == *c.to);
            if (named && away > 0.5 * b.body->size()) {
                const Issue issue{scene.file,
                                  fmt::format("/couplings/{}/{}", k, x == c.at ? "at" : "to"),
                                  fmt::format("a place {:.3g} m from \"{}\"", away, b.name),
                                  "a place on or in the body"};
                if (std::ranges::none_of(issues, [&](const Issue& told) {
                        return told.place == issue.place && told.found == issue.found;
                    }))
                    issues.push_back(issue);
            }
            return a;
        };
        const bool slides = c.kind == "slider";
        const auto add = [&](const Vec3& x, const Vec3& axis) {
            Coupling row;
            row.a = anchor(index[0], x);
            row.b = anchor(index[1], x);
            row.axis = turn_of(bodies, row.a).conjugate() * axis;
            row.slides = slides;
            row.input = int(k);
            rows.push_back(row);
        };
        const Vec3 n = c.axis.normalized();
        const Vec3 s = n.unitOrthogonal(), t = n.cross(s);
        const double arm = 0.25 * size; // between the points that stop turns
        if (c.kind == "turn_spring") {
            Coupling row;
            row.turns = true;
            for (std::size_t s = 0; s < 2; ++s) {
                (s == 0 ? row.a : row.b).body = index[s];
                if (index[s] < 0 || bodies[std::size_t(index[s])].rigid) continue;
                issues.push_back({scene.file, fmt::format("/couplings/{}/between/{}", k, s),
                                  fmt::format("\"{}\"", c.between[s]),
                                  "a rigid body or \"world\": turn springs act on these"});
            }
            if (!issues.empty()) continue;
            row.turn = turn_of(bodies, row.a).conjugate() * turn_of(bodies, row.b);
            row.axis = turn_of(bodies, row.a).conjugate() * n;
            row.softness = 1 / c.stiffness;
            row.damping = c.damping;
            row.input = int(k);
            rows.push_back(row);
            continue;
        }
        if (c.kind == "spring" || c.kind == "distance") {
            Coupling row;
            row.a = anchor(index[0], c.at);
            row.b = anchor(index[1], *c.to);
            row.along_line = true;
            row.rest = c.length.value_or((c.at - *c.to).norm());
            if (c.kind == "spring") {
                row.softness = 1 / c.stiffness;
                row.damping = c.damping;
            }
            row.axis = turn_of(bodies, row.a).conjugate() *
                       ((c.at - *c.to).norm() > 0 ? Vec3((c.at - *c.to).normalized()) : n);
            row.input = int(k);
            rows.push_back(row);
            continue;
        }
        const bool turns = c.kind == "ball";
        add(c.at, s);
        add(c.at, t);
        if (!slides) add(c.at, n);
        if (turns) continue;
        add(c.at + arm * n, s); // no turn about t and s
        add(c.at + arm * n, t);
        if (c.kind != "hinge") add(c.at + arm * s, t); // nor about the axis
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    return rows;
}

std::vector<Issue> jolts(const Scene& scene, const std::vector<BodyRef>& bodies,
                         const std::vector<Coupling>& couplings)
{
    constexpr double kAlike = 1e-9; // of the velocities
    std::vector<double> worst(scene.couplings.size(), 0);
    for (const Coupling& c : couplings) {
        if (c.softness > 0) continue;
        const CouplingRow row = coupling_row(bodies, c);
        const auto velocity = [&](const CoupledPlace& at, const Vec3& point) {
            return at.body < 0
                       ? Vec3::Zero().eval()
                       : bodies[std::size_t(at.body)].body->start_velocity({at.nodes, point});
        };
        const Vec3 a = velocity(c.a, row.point_a), b = velocity(c.b, row.point_b);
        const double apart = std::abs(row.direction.dot(a - b));
        double& of_all = worst[std::size_t(c.input)];
        if (apart > kAlike * (a.norm() + b.norm())) of_all = std::max(of_all, apart);
    }
    std::vector<Issue> found;
    for (std::size_t k = 0; k < worst.size(); ++k)
        if (worst[k] > 0)
            found.push_back(
                {scene.file, fmt::format("/couplings/{}", k),
                 fmt::format("bodies that start {:.3g} m/s apart where they are joined: "
                             "this rule lets them swing",
                             worst[k]),
                 "alike velocities, or a rule that damps (theta 1)"});
    return found;
}

} // namespace amontons
