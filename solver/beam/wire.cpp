#include "solver/beam/wire.hpp"

#include "solver/beam/cable.hpp"
#include "solver/beam/held_base.hpp"
#include "solver/beam/wire_place.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

BeamNode node_at(const Vec3& x, const Quaternion& q)
{
    BeamNode n;
    for (int i = 0; i < 3; ++i)
        n.x[i] = x[i];
    std::copy(q.q, q.q + 4, n.q);
    return n;
}

/// Sets the held node from the state's two scalars.
void place_held_node(const Wire& wire, WireState& state)
{
    Quaternion q = quaternion_of(wire.sheath->frame);
    rotate_in_body(q.q, state.rotation * Vec3::UnitX());
    state.nodes[std::size_t(state.first)] = node_at(wire.sheath->end, q);
}

double material_at_end(const Wire& wire, const WireState& state)
{
    return wire.material.length - state.inserted;
}

HeldBase base_of(const Wire& wire, const WireState& s)
{
    HeldBase base{wire.material};
    if (s.first < wire.last()) base.next = wire.material.node[std::size_t(s.first) + 1];
    base.inserted = s.inserted;
    base.inserted_rest = s.inserted_rest;
    base.base_insertion = s.base_insertion;
    base.rotation = s.rotation;
    base.base_twist = s.base_twist;
    if (wire.sheath) {
        base.compliance = wire.sheath->compliance;
        base.turn_compliance = wire.sheath->turn_compliance;
    }
    return base;
}

void add(Node6& g, int row, const Vec3& v)
{
    for (int i = 0; i < 3; ++i)
        g.value[row + i] += v[i];
}

void clear_row(Block6& b, int row)
{
    for (int j = 0; j < 6; ++j)
        b(row, j) = 0;
}

void clear_column(Block6& b, int col)
{
    b.column[col] = Column6{};
}

// The first node's rows become (inserted, rotation): see wire.hpp.
void assemble_sheath(const Wire& wire, const ElementLaw& law, BlockTridiagonal& K,
                     std::vector<Node6>& g)
{
    const WireState& s = wire.state;
    const int f = s.first;
    const std::size_t n = std::size_t(f);
    const HeldBase base = base_of(wire, s);
    const Growth grow = growth(base, s.nodes[n], s.nodes[n + 1], law, 0);
    const std::array<double, 12> mixed =
        element_force(s.nodes[n], s.nodes[n + 1], law.length, grow.tau);

    Block6& d = K.diagonal(f);
    Block6& up = K.upper(f);
    Block6& lo = K.lower(f);
    const double d33 = d(3, 3);
    for (int j = 0; j < 6; ++j)
        clear_column(d, j);
    d(0, 0) = growth_stiffness(base, s.nodes[n], s.nodes[n + 1]);
    d(3, 3) = d33 + 1 / grow.torsion;
    d(0, 3) = d(3, 0) =
        mixed[3] - grow.torque / (section_at(wire.material, material_at_end(wire, s)).stiffness[3] *
                                  grow.torsion);
    d(1, 1) = d(2, 2) = d(4, 4) = d(5, 5) = 1;
    for (int row : {0, 1, 2, 4, 5}) {
        clear_row(up, row);
        clear_column(lo, row);
    }
    for (int j = 0; j < 6; ++j) {
        const double m = mixed[std::size_t(j) + 6];
        up(0, j) = m;
        lo(j, 0) = m;
    }
    double* r = g[n].value;
    const double g3 = r[3];
    std::fill(r, r + 8, 0.0);
    r[0] = grow.slope;
    r[3] = g3 - grow.torque;
}

/// Elastic grip of the sheath's fading end on the contact points that it holds:
/// 1/2 k(z) |lateral|^2 per length, k falling as a parabola to 0 over the fade, so that a point
/// leaves without a jump of force.
struct Grip {
    double k, slope, bend; // k, k', k'' at the point, times the length it stands for
    Vec3 lateral;
};
std::optional<Grip> grip_at(const Wire& wire, const MaterialPoint& p, const Vec3& x)
{
    const Sheath& s = *wire.sheath;
    const Vec3 d = s.frame.col(0);
    const Vec3 r = x - s.end;
    const double z = r.dot(d);
    if (z >= s.fade) return {};
    const double k0 = s.grip * p.spacing;
    const double t = 1 - std::max(z, 0.0) / s.fade;
    return Grip{k0 * t * t, -2 * k0 * t / s.fade, 2 * k0 / (s.fade * s.fade), r - z * d};
}

template <class Visit> void for_gripped_points(const Wire& wire, const Visit& visit)
{
    if (!wire.sheath || !(wire.sheath->fade > 0)) return;
    // Points come from the tip; the gripped ones are the last that are out.
    const double behind = wire.material.length - wire.state.inserted;
    const auto& points = wire.material.point;
    const double reach = 2 * wire.sheath->fade;
    auto it = std::partition_point(points.begin(), points.end(),
                                   [&](const MaterialPoint& p) { return p.s > behind + reach; });
    for (; it != points.end(); ++it) {
        const auto place = place_of(wire, wire.state, it->s, it->element, it->xi);
        if (!place) break;
        const Vec3 x = centreline_point(wire.state, *place);
        if (const auto g = grip_at(wire, *it, x)) visit(*place, *g);
    }
}

void assemble_grip(const Wire& wire, BlockTridiagonal& K, std::vector<Node6>& g)
{
    for_gripped_points(wire, [&](const WirePlace& p, const Grip& grip) {
        const Vec3 d = wire.sheath->frame.col(0);
        const Vec3 force =
            grip.k * grip.lateral + (0.5 * grip.slope * grip.lateral.squaredNorm()) * d;
        const Mat3 H = grip.k * (Mat3::Identity() - d * d.transpose()) +
                       grip.slope * (grip.lateral * d.transpose() + d * grip.lateral.transpose()) +
                       (0.5 * grip.bend * grip.lateral.squaredNorm()) * d * d.transpose();
        const Eigen::Matrix<double, 3, 12> J = point_jacobian(wire, p);
        const Eigen::Matrix<double, 12, 1> r = J.transpose() * force;
        const Eigen::Matrix<double, 12, 12> k = J.transpose() * H * J;
        for (int i = 0; i < 6; ++i) {
            g[std::size_t(p.element)].value[i] += r[i];
            g[std::size_t(p.element) + 1].value[i] += r[i + 6];
            for (int j = 0; j < 6; ++j) {
                K.diagonal(p.element)(i, j) += k(i, j);
                K.diagonal(p.element + 1)(i, j) += k(i + 6, j + 6);
                K.upper(p.element)(i, j) += k(i, j + 6);
                K.lower(p.element)(i, j) += k(i + 6, j);
            }
        }
    });
}

void assemble_dead_loads(const Wire& wire, BlockTridiagonal& K, std::vector<Node6>& g)
{
    for (std::size_t i = std::size_t(wire.state.first) + 1; i < wire.dead_force.size(); ++i)
        add(g[i], 0, -wire.dead_force[i]);
    for (std::size_t i = std::size_t(wire.state.first) + 1; i < wire.dead_moment.size(); ++i) {
        if (wire.dead_moment[i].squaredNorm() == 0) continue;
        const Vec3 m = rotation_matrix(wire.state.nodes[i].q).transpose() * wire.dead_moment[i];
        add(g[i], 3, -m);
        const Mat3 k = -0.5 * skew_matrix(m);
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
                K.diagonal(int(i))(r + 3, c + 3) += k(r, c);
    }
}

} // namespace

int first_node(const WireMaterial& m, double insertion)
{
    const double end = m.length - insertion;
    const int last = int(m.node.size()) - 1;
    auto it = std::upper_bound(m.node.begin(), m.node.end(), end);
    int i = std::max(1, int(it - m.node.begin())); // first node past the end
    for (; i <= last; ++i) {
        const double full = m.node[std::size_t(i)] - m.node[std::size_t(i) - 1];
        if (m.node[std::size_t(i)] - end >= 0.5 * full) return i - 1;
    }
    return last;
}

void start_in_sheath(Wire& wire, double insertion, double twist)
{
    WireState& s = wire.state;
    s.nodes.assign(wire.material.node.size(), BeamNode{});
    s.inserted = s.base_insertion = insertion;
    s.inserted_rest = 0;
    s.rotation = s.base_twist = twist;
    s.first = first_node(wire.material, insertion);
    place_held_node(wire, s);
    // Element by element with its natural strains, so that it is unstressed.
    for (int i = s.first; i < wire.last(); ++i) {
        const ElementLaw law =
            i == s.first ? held_element_law(wire, s) : wire.material.law[std::size_t(i)];
        BeamNode& next = s.nodes[std::size_t(i) + 1];
        next = s.nodes[std::size_t(i)];
        move_along(next, natural_strain(law), law.length);
    }
}

ElementLaw held_element_law(const Wire& wire, const WireState& s)
{
    if (!wire.sheath) return wire.material.law[std::size_t(s.first)];
    return law_at_end(base_of(wire, s), 0);
}

Vec3 held_point(const Wire& wire, const WireState& state, double s)
{
    return wire.sheath->end + (s - material_at_end(wire, state)) * wire.sheath->frame.col(0);
}

Quaternion held_rotation(const Wire& wire, const WireState& state, double s)
{
    const double end = material_at_end(wire, state);
    const HeldBase base = base_of(wire, state);
    const double whole = held_part(base, end).torsion;
    const double part = held_part(base, std::max(s, 0.0)).torsion;
    const double angle =
        state.base_twist + (state.rotation - state.base_twist) * (whole > 0 ? part / whole : 1);
    Quaternion q = quaternion_of(wire.sheath->frame);
    rotate_in_body(q.q, angle * Vec3::UnitX());
    return q;
}

// By how much of an element's length the first one may differ from a whole one.
constexpr double kFurthestLag = 0.75;

bool first_element_lags(const Wire& wire)
{
    const WireState& s = wire.state;
    if (!wire.sheath || !wire.outside()) return false;
    const std::size_t next = std::size_t(s.first) + 1;
    const double out = wire.material.node[next] - material_at_end(wire, s);
    const double full = wire.material.node[next] - wire.material.node[next - 1];
    return std::abs(out - full) > kFurthestLag * full;
}

void drive_base(Wire& wire, double insertion, double twist)
{
    if (!wire.sheath) return; // a clamp stands where its node is
    const WireState old = wire.state;
    WireState& s = wire.state;
    const double shift = insertion - old.base_insertion;
    const double turn = twist - old.base_twist;
    s.base_insertion = insertion;
    s.base_twist = twist;
    s.inserted += shift;
    s.inserted_rest = 0;
    s.rotation += turn;

    // ---- Mesh of the new base position
    s.first = first_node(wire.material, insertion);
    // Compressed or stretched in the sheath by much of an element, the wire is not where its base
    // states: the element at the sheath's end would have almost no length, or a negative one.
    if (first_element_lags(wire))
        s.first = std::min(first_node(wire.material, s.inserted), wire.last() - 1);
    if (!wire.outside()) {
        s.inserted = insertion;
        s.rotation = twist;
        for (Reaction& r : s.reaction)
            r = {};
        return;
    }
    const bool was_out = old.first < wire.last();
    if (!was_out) {
        std::vector<Reaction> none(s.reaction.size());
        start_in_sheath(wire, insertion, twist);
        s.reaction = none;
        return;
    }

    // ---- Translation along the centreline
    place_held_node(wire, s);
    if (shift != 0 || s.first != old.first) {
        // Node i passes where the wire was a length `shift` further on.
        const int last = wire.last();
        int j = old.first;
        const double old_end = wire.material.length - old.inserted;
        // Where a step of curvature is on the element that grows, what comes out of it is not where
        // one curve through its ends has it.
        const ElementLaw growing = held_element_law(wire, old);
        const std::array<double, 6> natural = natural_strain(growing);
        std::array<double, 6> beyond_natural = element_strain(
            old.nodes[std::size_t(j)], old.nodes[std::size_t(j) + 1], growing.length);
        for (std::size_t k = 0; k < 6; ++k)
            beyond_natural[k] -= natural[k];
        const bool steps = natural[1] != 0 || natural[2] != 0;
        for (int i = s.first + 1; i <= last; ++i) {
            const double at = wire.material.node[std::size_t(i)] + shift;
            BeamNode& n = s.nodes[std::size_t(i)];
            if (at <= old_end) {
                n = node_at(held_point(wire, old, at), held_rotation(wire, old, at));
                continue;
            }
            while (j + 1 < last && wire.material.node[std::size_t(j) + 1] < at)
                ++j;
            const double a = j == old.first ? old_end : wire.material.node[std::size_t(j)];
            const double b = wire.material.node[std::size_t(j) + 1];
            if (at < b && j == old.first && steps) {
                n = old.nodes[std::size_t(j)];
                move_along_wire(n, wire.material, a, at, beyond_natural);
            } else if (at <= b) {
                const WirePlace p{j, (at - a) / (b - a), b - a};
                n = node_at(centreline_point(old, p), section_rotation(old, p));
            } else {
                const BeamNode& tip = old.nodes[std::size_t(last)];
                Quaternion q;
                std::copy(tip.q, tip.q + 4, q.q);
                const Section c = section_at(wire.material, wire.material.length);
                rotate_in_body(q.q, (at - b) * Vec3(0, c.natural[4], c.natural[5]));
                n = node_at(tip.position() + (at - b) * first_axis(tip.q), q);
            }
        }
        // Reactions move along with the places that they act at.
        const std::size_t walls =
            wire.material.point.empty() ? 0 : s.reaction.size() / wire.material.point.size();
        for (std::size_t p = 0; p < wire.material.point.size(); ++p) {
            const MaterialPoint& m = wire.material.point[p];
            const double t = double(p) - shift / m.spacing;
            const double down = std::floor(t);
            for (std::size_t w = 0; w < walls; ++w) {
                Reaction r;
                for (int side = 0; side < 2; ++side) {
                    const double k = down + side;
                    const double weight = side ? t - down : 1 - (t - down);
                    if (k < 0 || k >= double(wire.material.point.size()) || weight == 0) continue;
                    const Reaction& o = old.reaction[std::size_t(k) * walls + w];
                    r.normal += weight * o.normal;
                    r.tangential += weight * o.tangential;
                    if (weight >= 0.5) {
                        r.sticks = o.sticks;
                        r.touch = o.touch;
                    }
                }
                s.reaction[p * walls + w] = r;
            }
        }
    }
    if (turn != 0)
        for (int i = s.first + 1; i <= wire.last(); ++i)
            rotate_in_body(s.nodes[std::size_t(i)].q, turn * Vec3::UnitX());
}

BaseLoad base_load(const Wire& wire)
{
    const WireState& s = wire.state;
    const double end = material_at_end(wire, s);
    if (!wire.outside()) {
        // Nothing is bent outside: pushing sets free the energy that the sheath holds.
        return {-straight_energy(wire.material, end), 0};
    }
    const HeldWire held = held_part(base_of(wire, s), end);
    return {((s.base_insertion - s.inserted) - s.inserted_rest) / held.axial,
            (s.base_twist - s.rotation) / held.torsion};
}

// The base's spring energy 1/2 (l - b)^2 / axial(l) + 1/2 (theta - phi)^2 / torsion(l), with
// d(axial)/dl = -1/EA and d(torsion)/dl = -1/GJ at the sheath's end.
BaseStiffness base_stiffness(const Wire& wire)
{
    const WireState& s = wire.state;
    const double end = material_at_end(wire, s);
    const Section c = section_at(wire.material, end);
    const HeldWire held = held_part(base_of(wire, s), end);
    const BaseLoad load = base_load(wire);
    BaseStiffness k;
    k.own << 1 / held.axial, 0, 0, 1 / held.torsion;
    k.mixed << -(1 - load.push / c.stiffness[0]) / held.axial,
        load.torque / (c.stiffness[3] * held.torsion), 0, -1 / held.torsion;
    return k;
}

double elastic_energy(const Wire& wire)
{
    const WireState& s = wire.state;
    double energy = 0;
    for (int i = s.first; i < wire.last(); ++i) {
        const std::size_t n = std::size_t(i);
        const auto energy_of = wire.cable ? cable_energy : element_energy;
        energy += energy_of(s.nodes[n], s.nodes[n + 1],
                            i == s.first ? held_element_law(wire, s) : wire.material.law[n]);
    }
    if (wire.sheath) {
        const HeldWire held = held_part(base_of(wire, s), material_at_end(wire, s));
        const double stretch = (s.inserted - s.base_insertion) + s.inserted_rest;
        const double turn = s.base_twist - s.rotation;
        energy += held.bending;
        if (wire.outside())
            energy += 0.5 * stretch * stretch / held.axial + 0.5 * turn * turn / held.torsion;
        for_gripped_points(wire, [&](const WirePlace&, const Grip& g) {
            energy += 0.5 * g.k * g.lateral.squaredNorm();
        });
    }
    return energy;
}

void assemble_wire(const Wire& wire, std::vector<ElementLaw>& laws, BlockTridiagonal& K,
                   std::vector<Node6>& g, const std::vector<std::array<double, 6>>& predicted)
{
    const WireState& s = wire.state;
    const std::size_t f = std::size_t(s.first);
    const ElementLaw whole = laws[f];
    laws[f] = held_element_law(wire, s);
    if (wire.cable)
        add_cable(s.first, wire.last(), s.nodes, laws, K, g);
    else
        add_elements(s.first, wire.last(), s.nodes, laws, K, g,
                     predicted.empty() ? nullptr : &predicted);
    if (wire.sheath) {
        assemble_sheath(wire, laws[f], K, g);
        assemble_grip(wire, K, g);
    } else {
        Block6& d = K.diagonal(s.first);
        for (int j = 0; j < 6; ++j) {
            clear_column(d, j);
            d(j, j) = 1;
            clear_row(K.upper(s.first), j);
            clear_column(K.lower(s.first), j);
        }
        g[f].column = Column6{};
    }
    laws[f] = whole;
    assemble_dead_loads(wire, K, g);
}

void predict_strains(const Wire& wire, const std::vector<Node6>& increment, double factor,
                     std::vector<std::array<double, 6>>& out)
{
    const WireState& s = wire.state;
    out.resize(wire.material.law.size());
    for (int i = s.first; i < wire.last(); ++i) {
        const std::size_t n = std::size_t(i);
        double d[2][6] = {};
        for (std::size_t side = 0; side < 2; ++side)
            for (std::size_t k = 0; k < 6; ++k)
                d[side][k] = factor * increment[n + side].value[k];
        double length = wire.material.law[n].length, grows = 0;
        if (i == s.first) {
            length = held_element_law(wire, s).length;
            if (wire.sheath) grows = d[0][0], d[0][0] = 0; // its unknown is the length that is out
        }
        out[n] = predicted_strain(s.nodes[n], s.nodes[n + 1], length, d[0], d[1]);
        if (grows == 0) continue;
        const std::array<double, 6> own = element_strain(s.nodes[n], s.nodes[n + 1], length);
        for (std::size_t k = 0; k < 6; ++k)
            out[n][k] -= own[k] * grows / length;
    }
}

void move_wire(Wire& wire, const std::vector<Node6>& increment, double factor)
{
    WireState& s = wire.state;
    for (int i = s.first + 1; i <= wire.last(); ++i) {
        const double* d = increment[std::size_t(i)].value;
        BeamNode& n = s.nodes[std::size_t(i)];
        for (int k = 0; k < 3; ++k)
            n.move(k, factor * d[k]);
        rotate_in_body(n.q, factor * Vec3(d[3], d[4], d[5]));
    }
    if (wire.sheath) {
        const double add = factor * increment[std::size_t(s.first)].value[0] + s.inserted_rest;
        const double sum = s.inserted + add, back = sum - s.inserted;
        s.inserted_rest = (s.inserted - (sum - back)) + (add - back);
        s.inserted = sum;
        s.rotation += factor * increment[std::size_t(s.first)].value[3];
        place_held_node(wire, s);
    }
}

} // namespace amontons
