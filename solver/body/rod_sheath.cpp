#include "mesh/base/curve.hpp"
#include "mesh/base/dense.hpp"
#include "solver/beam/rotation.hpp"
#include "solver/beam/table_law.hpp"
#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>

// A rod that comes out of a straight sheath. Its end is a moving boundary of the material: the node
// nearest to it stands there, clamped, whatever place on the rod that is; the elements beside it
// change their length and law with the place. A step is Lagrangian: the places that its mesh has at
// its end are looked up at its start, the sheath moves its own by what is fed.
//
// What is fed by a length a runs from straight in the sheath to the strains e at its end, where the
// section carries the force and moment m. With w the energy per length, the push is
//
//     P = R - (m.e - w(e) - n) - w(straight),
//
// R what holds the rod along itself, n = -R. Of a linear section with natural strains e0 the
// bracket and the last term make sum (m_i + S_i e0_i)^2 / (2 S_i), M^2 / 2 EI of a straight rod.
// Source: Bigoni, Dal Corso, Bosi & Misseroni 2015 (Eshelby-like forces acting on elastic
// structures).

namespace amontons {
namespace {

constexpr double kShortest = 0.5; // of an element at the sheath's end, of its whole length
constexpr double kFirstOut = 0.1; // ... of the rod's last one

/// Strains of a section less its natural ones, under these section forces: those of bending alone
/// may follow tables.
std::array<double, 6> strains_under(const Section& c, const std::vector<TableShare>& tables,
                                    const std::array<double, 6>& m)
{
    std::array<double, 6> e{};
    for (std::size_t i = 0; i < 6; ++i)
        e[i] = c.stiffness[i] > 0 ? m[i] / c.stiffness[i] : 0;
    if (tables.empty()) return e;
    constexpr int kMost = 60;
    // Laws that rise: Newton's method, which alternates at most across their corners.
    for (int k = 0; k < kMost; ++k) {
        const BeyondLinear b = beyond_linear(tables, e);
        const double missing[3] = {m[0] - c.stiffness[0] * e[0] - b.stress[0],
                                   m[4] - c.stiffness[4] * e[4] - b.stress[4],
                                   m[5] - c.stiffness[5] * e[5] - b.stress[5]};
        const double a = c.stiffness[4] + b.bend22, d = c.stiffness[5] + b.bend33,
                     det = a * d - b.bend23 * b.bend23;
        const double step[3] = {missing[0] / (c.stiffness[0] + b.stretch),
                                (d * missing[1] - b.bend23 * missing[2]) / det,
                                (a * missing[2] - b.bend23 * missing[1]) / det};
        const double share = k < kMost / 3 ? 1 : 0.5;
        e[0] += share * step[0];
        e[4] += share * step[1];
        e[5] += share * step[2];
    }
    return e;
}

} // namespace

double RodBody::place_at_end(double t) const
{
    return std::max(rod_.length - curve_value(input_.fed, t), 0.0);
}

double RodBody::length_out_of_sheath() const
{
    return input_.fed.empty() ? rod_.length : rod_.length - accepted_.end.s;
}

double RodBody::change_in_sheath() const
{
    double compliance = 0; // [m/N]
    for (int e = 0; e < rod_.element_count() && !input_.fed.empty(); ++e) {
        const double from = rod_.s[std::size_t(e)];
        const double inside = std::min(accepted_.end.s, from + element_length(e)) - from;
        const ElementLaw& law = rod_.law[std::size_t(e)];
        if (inside > 0 && law.S[0] > 0) compliance += inside * law.length / law.S[0];
    }
    return push_ * compliance;
}

int RodBody::node_at_end(double s) const
{
    const int last = rod_.node_count() - 1;
    auto i = int(std::upper_bound(rod_.s.begin(), rod_.s.end(), s) - rod_.s.begin());
    for (i = std::max(i, 1); i <= last; ++i) {
        const double whole = rod_.s[std::size_t(i)] - rod_.s[std::size_t(i) - 1],
                     least = (i == last ? kFirstOut : kShortest) * whole;
        if (rod_.s[std::size_t(i)] - s >= least) return i - 1;
    }
    return last;
}

int RodBody::nodes_in_sheath(double t) const
{
    return input_.fed.empty() ? 0 : node_at_end(place_at_end(t)) + 1;
}

bool RodBody::in_sheath(const CurvePlace& at) const
{
    const int n = nodes_in_sheath(step_.end());
    return at.t <= 0 ? at.piece < n : at.piece + 1 < n;
}

/// Where the sheath has a node: the one at its end does not move but along the rod.
BeamNode RodBody::held_in_sheath(int node, double t) const
{
    const double s = place_at_end(t), own = rod_.s[std::size_t(node)],
                 out = rod_.length - fed_first_; // the sheath's end, along the first shape
    const int end = node_at_end(s);
    const bool at_end = node == end && end + 1 < rod_.node_count();
    const Vec3 along = first_axis(rod_.nodes[0].q);
    BeamNode n = rod_.nodes[std::size_t(node)];
    for (int k = 0; k < 3; ++k)
        n.move(k, (at_end ? out - own : out - s) * along[k]);
    return n;
}

/// Takes a mesh, and its laws.
void RodBody::move_sheath_end(const SheathEnd& next)
{
    const int elements = rod_.element_count();
    const auto beside = [&](int node, auto&& what) {
        for (int e = std::max(node - 1, 0); e < std::min(node + 1, elements); ++e) {
            what(e);
            rod_.natural[std::size_t(e)] = corotational_natural(rod_.law[std::size_t(e)]);
        }
    };
    if (sheath_.s >= 0)
        beside(sheath_.node, [&](int e) { rod_.law[std::size_t(e)] = whole_[std::size_t(e)]; });
    sheath_ = next;
    if (next.node == elements) return; // all of it is in the sheath
    beside(next.node, [&](int e) {
        const double a = e == next.node ? next.s : rod_.s[std::size_t(e)],
                     b = e == next.node ? rod_.s[std::size_t(e) + 1] : next.s;
        ElementLaw law = law_between(*material_, a, b);
        if (input_.shape.stress_free) {
            law.P = {law.S[0], 0, 0, 0, 0, 0};
            law.constant = 0.5 * law.S[0];
        }
        rod_.law[std::size_t(e)] = std::move(law);
    });
}

/// In the sheath straight, out of it on the cubic line.
BeamNode RodBody::at_place(double s) const
{
    const int first = accepted_.end.node;
    const bool inside = first == rod_.element_count();
    if (inside || s <= accepted_.end.s) {
        BeamNode n = accepted_.nodes[std::size_t(first)];
        const Vec3 along = first_axis(n.q);
        for (int k = 0; k < 3; ++k)
            n.move(k, (s - (inside ? rod_.length : accepted_.end.s)) * along[k]);
        return n;
    }
    int e = first;
    while (e + 1 < rod_.element_count() && s >= rod_.s[std::size_t(e) + 1])
        ++e;
    const double from = e == first ? accepted_.end.s : rod_.s[std::size_t(e)];
    const double xi = (s - from) / rod_.law[std::size_t(e)].length;
    if (xi >= 1) return accepted_.nodes[std::size_t(e) + 1];
    BeamNode n = accepted_.nodes[std::size_t(e)];
    const Vec3 x = rod_point(rod_, accepted_.nodes, e, xi);
    for (int k = 0; k < 3; ++k) {
        n.x[k] = x[k];
        n.rest[k] = 0;
    }
    const Quaternion q =
        interpolate(accepted_.nodes[std::size_t(e)].q, accepted_.nodes[std::size_t(e) + 1].q, xi);
    std::copy(q.q, q.q + 4, n.q);
    return n;
}

/// Before the first step: the first shape, on the mesh of time 0.
void RodBody::start_at_sheath()
{
    fed_first_ = input_.fed[0][1];
    material_ = make_material(rod_.segments, 0);
    whole_ = rod_.law;
    const double s = place_at_end(0);
    move_sheath_end({node_at_end(s), s});
    if (sheath_.node < rod_.element_count()) {
        const Vec3 along = first_axis(rod_.nodes[0].q);
        for (int k = 0; k < 3; ++k)
            state_.nodes[std::size_t(sheath_.node)].move(
                k, (s - rod_.s[std::size_t(sheath_.node)]) * along[k]);
    }
    accepted_ = {sheath_, state_.nodes, {}};
}

/// A step begins: its mesh, with its places where the accepted state has them, and what acts there.
void RodBody::begin_at_sheath()
{
    if (sheath_.s != accepted_.end.s) move_sheath_end(accepted_.end);
    state_.nodes = accepted_.nodes;
    acting_ = accepted_.acting;
    const double s = place_at_end(step_.end());
    const SheathEnd next{node_at_end(s), s}, last = accepted_.end;
    if (next.s == last.s) return;
    const int to = std::max(next.node, last.node);
    for (int i = std::min(next.node, last.node); i <= to; ++i) {
        const bool at_end = i == next.node && i < rod_.element_count();
        state_.nodes[std::size_t(i)] = at_place(at_end ? next.s : rod_.s[std::size_t(i)]);
    }
    move_sheath_end(next);
    if (acting_.empty()) return;
    acting_.assign(state_.nodes.size(), Node6{});
    add_loads(state_, step_.start, acting_, nullptr);
    for (std::size_t i = std::size_t(to) + 1; i < acting_.size(); ++i)
        acting_[i].column += reaction_[i].column;
    add_push(acting_);
}

/// The push does the work of what holds the rod in the sheath.
void RodBody::add_push(std::vector<Node6>& acting) const
{
    Map6(acting[std::size_t(sheath_.node)].value).head<3>() += push_ * first_axis(rod_.nodes[0].q);
}

/// @param acting  loads and what holds the rod; in the sheath that becomes the push
void RodBody::accept_at_sheath(std::vector<Node6>& acting)
{
    const Vec3 along = first_axis(rod_.nodes[0].q);
    push_ = -taken_at_end();
    for (std::size_t i = 0; i <= std::size_t(sheath_.node); ++i) {
        push_ += along.dot(Map6(reaction_[i].value).head<3>());
        acting[i] = load_[i];
    }
    add_push(acting);
}

double RodBody::taken_at_end() const
{
    Section c = section_at(*material_, sheath_.s);
    if (input_.shape.stress_free) c.natural = {1, 0, 0, 0, 0, 0};
    const std::vector<TableShare> tables = tables_at(*material_, sheath_.s);
    std::array<double, 6> straight{1, 0, 0, 0, 0, 0}; // strains in the sheath, less natural ones
    for (std::size_t i = 0; i < 6; ++i)
        straight[i] -= c.natural[i];
    const auto energy = [&](const std::array<double, 6>& e) {
        double w = tables.empty() ? 0 : beyond_linear(tables, e).energy;
        for (std::size_t i = 0; i < 6; ++i)
            w += 0.5 * c.stiffness[i] * e[i] * e[i];
        return w;
    };
    const int first = sheath_.node;
    if (first == rod_.element_count()) return energy(straight); // its end is free
    // Without what acts on the element in the sheath.
    Vec6 held = ConstMap6(reaction_[std::size_t(first)].value);
    if (first > 0) {
        const int e = first - 1;
        const ElementLaw& law = rod_.law[std::size_t(e)];
        const BeamNode &a = now_.nodes[std::size_t(e)], &b = now_.nodes[std::size_t(first)];
        const std::array<double, 12> inner =
            element_force(a, b, law.length, element_stress(law, element_strain(a, b, law.length)));
        held -= Eigen::Map<const Vec6>(inner.data() + 6);
        const Vec3 q =
            rotation_matrix(b.q).transpose() *
            (line_load(step_.end()) + rod_.mass[std::size_t(e)].per_length * step_.gravity);
        held.head<3>() += 0.5 * law.length * (rotation_matrix(b.q) * q);
        held.tail<3>() -= law.length * law.length / 12 * Vec3::UnitX().cross(q);
    }
    std::array<double, 6> m{}; // of the section at the end
    const Vec3 force =
        rotation_matrix(now_.nodes[std::size_t(first)].q).transpose() * held.head<3>();
    for (int i = 0; i < 3; ++i) {
        m[std::size_t(i)] = -force[i];
        m[std::size_t(i) + 3] = -held[i + 3];
    }
    const std::array<double, 6> elastic = strains_under(c, tables, m);
    double taken = energy(straight) - energy(elastic);
    for (std::size_t i = 0; i < 6; ++i)
        taken += m[i] * (elastic[i] - straight[i]);
    return taken;
}

double RodBody::straight_beyond() const
{
    if (input_.shape.stress_free) return 0;
    const auto up_to = [&](double s) { return held_between_base_and(*material_, s).bending; };
    if (sheath_.node == rod_.element_count()) return up_to(sheath_.s) - up_to(rod_.length);
    return sheath_.node == 0 ? up_to(sheath_.s) : 0;
}

} // namespace amontons
