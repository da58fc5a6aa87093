#include "mesh/base/curve.hpp"
#include "mesh/base/dense.hpp"
#include "solver/beam/held_base.hpp"
#include "solver/beam/rotation.hpp"
#include "solver/beam/wire.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/node_index.hpp"
#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>

// A rod that comes out of a straight sheath, as a wire out of its introducer (beam/held_base): in
// there it is a spring along itself and about itself, whose base is led. The sheath's end is a
// moving boundary of the material: the node nearest to it stands there, whatever place on the rod
// that is; the elements beside it change their length and law with the place. A step is
// Lagrangian: the places of its mesh at its end are located at its start.
//
// Of the node at the end two unknowns are left. That along the sheath is the way of the material
// there, over the step: what is prescribed of it brings the node to the end, and what is more has
// come out of the sheath past it. The energy changes by that at the rate (growth)
//
//     N - [m.e - w(e) - n] - w(straight),    N = stretch of what is held / its flexibility,
//
// which is zero in balance, and the push is -N. The other is the turn about the sheath.

namespace amontons {
namespace {

constexpr double kShortest = 0.5;   // of an element at the sheath's end, of its whole length
constexpr double kFirstOut = 0.1;   // ... of the rod's last one
constexpr double kCompliant = 1e-6; // of an element: less in the sheath is as good as rigid
constexpr double kLeast = 0.25; // of an element, of its whole length: Newton's method stops there
constexpr double kMost = 2;     // ... and there

} // namespace

double RodBody::length_out_of_sheath() const
{
    return input_.fed.empty() ? rod_.length : rod_.length - accepted_.end.s;
}

/// What turns its start turns its base.
double RodBody::base_turn(double t) const
{
    double turn = 0;
    for (const RodHold& h : input_.hold)
        if (h.set == "start" && !h.angle.empty())
            turn += (h.axis.dot(along_sheath()) < 0 ? -1 : 1) * curve_value(h.angle, t);
    return turn;
}

double RodBody::base_way(double t) const
{
    const double led = curve_value(input_.fed, t);
    return feed_is_stopped() ? std::min(led, most_fed_) : led;
}

double RodBody::turned_in_sheath() const
{
    return accepted_.end.turned;
}

double RodBody::tip_rotation() const
{
    double turn = sheath_.rotation;
    for (int e = sheath_.node; e < rod_.element_count(); ++e)
        turn += strain(e)[3] * element_length(e);
    return turn;
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

int RodBody::nodes_in_sheath() const
{
    return material_ ? sheath_.node + 1 : 0;
}

bool RodBody::in_sheath(const CurvePlace& at) const
{
    const int n = nodes_in_sheath();
    return at.t <= 0 ? at.piece < n : at.piece + 1 < n;
}

StencilEntry RodBody::acting_place(const CurvePlace& at) const
{
    if (material_ && at.piece < sheath_.node && sheath_.node < rod_.element_count())
        return {sheath_.node, 0.0};
    return {at.piece, at.t};
}

Vec3 RodBody::along_sheath() const
{
    return first_axis(rod_.nodes[0].q);
}

bool RodBody::compliant_at(double fed) const
{
    return rod_.length - fed > kCompliant * whole_[0].length;
}

bool RodBody::compliant_in_sheath() const
{
    if (step_.dynamic) return compliant_in_step_;
    return out_of_sheath() && compliant_at(sheath_.fed);
}

HeldBase RodBody::held_base(const SheathEnd& at) const
{
    HeldBase base{*material_};
    // Where hardly anything is in the sheath its end is the base, by whatever it is held.
    if (!compliant_at(at.fed)) base.compliance = base.turn_compliance = 1;
    if (at.node < rod_.element_count()) base.next = rod_.s[std::size_t(at.node) + 1];
    base.base_insertion = at.fed;
    base.inserted = at.fed + at.stretch;
    base.inserted_rest = at.stretch - (base.inserted - at.fed);
    base.base_twist = at.turned;
    base.rotation = at.rotation;
    return base;
}

/// Torsional flexibility of the rod between its base and s [rad/(N m)].
double RodBody::torsion_to(const SheathEnd& at, double s) const
{
    return held_part(held_base(at), std::max(s, 0.0)).torsion;
}

/// The turn about the sheath of a section in it.
/// @param part   torsional flexibility between the base and the section
/// @param whole  between the base and the sheath's end [rad/(N m)]
double RodBody::turn_in_sheath(const SheathEnd& at, double part, double whole)
{
    if (at.turned == at.rotation) return at.rotation;
    return at.turned + (at.rotation - at.turned) * (whole > 0 ? part / whole : 1);
}

/// Where the sheath has a node.
/// @param whole  torsion_to(sheath_, sheath_.s); of the node at its end not used
BeamNode RodBody::held_in_sheath(int node, double whole) const
{
    const double own = rod_.s[std::size_t(node)],
                 out = rod_.length - fed_first_; // the sheath's end, along the first shape
    const bool at_end = node == sheath_.node && node < rod_.element_count();
    const Vec3 along = along_sheath();
    BeamNode n = rod_.nodes[std::size_t(node)];
    for (int k = 0; k < 3; ++k)
        n.move(k, (at_end ? out - own : out - sheath_.s) * along[k]);
    double turn = sheath_.rotation;
    if (!at_end && sheath_.turned != sheath_.rotation) {
        const double part = material_->flexibility_torsion[std::size_t(node)] +
                            held_base(sheath_).turn_compliance;
        turn = turn_in_sheath(sheath_, part, whole);
    }
    if (turn != 0) rotate_in_body(n.q, turn * Vec3::UnitX());
    return n;
}

/// Takes a mesh, and its laws.
void RodBody::move_sheath_end(const SheathEnd& next)
{
    take_sheath_end(next);
    place_stations();
}

void RodBody::take_sheath_end(const SheathEnd& next)
{
    const int elements = rod_.element_count();
    const auto beside = [&](int node, auto&& what) {
        for (int e = std::max(node - 1, 0); e < std::min(node + 1, elements); ++e)
            what(e);
    };
    if (sheath_.s >= 0 || sheath_.fed > 0)
        beside(sheath_.node, [&](int e) { rod_.law[std::size_t(e)] = whole_[std::size_t(e)]; });
    sheath_ = next;
    if (next.node < elements) // else all of it is in the sheath
        beside(next.node, [&](int e) {
            rod_.law[std::size_t(e)] =
                e == next.node ? law_at_end(held_base(next), 0)
                               : law_between(*material_, rod_.s[std::size_t(e)], next.s);
        });
}

/// Stations are places of the material: those that are out on the first element stand on it where
/// they are now.
void RodBody::place_stations()
{
    stations_ = whole_stations_;
    const int first = sheath_.node;
    if (first == rod_.element_count()) return;
    for (CurvePlace& p : stations_) {
        if (p.piece > first) break;
        const double s = rod_.s[std::size_t(p.piece)] + p.t * whole_[std::size_t(p.piece)].length,
                     L = rod_.law[std::size_t(first)].length,
                     left = rod_.s[std::size_t(first) + 1] - s;
        if (s > sheath_.s)
            p = {first, std::max(1 - left / L, 0.0)};
        else if (p.piece == first)
            p = first > 0 ? CurvePlace{first - 1, 1} : CurvePlace{0, 0};
    }
}

/// In the sheath straight, out of it on the cubic line.
BeamNode RodBody::at_place(double s) const
{
    const SheathEnd& end = accepted_.end;
    const int first = end.node;
    const bool inside = first == rod_.element_count();
    if (inside || s <= end.s) {
        BeamNode n = accepted_.nodes[std::size_t(first)];
        const Vec3 along = first_axis(n.q);
        const double from = inside ? rod_.length : end.s;
        for (int k = 0; k < 3; ++k)
            n.move(k, (s - from) * along[k]);
        const auto turn_at = [&, whole = torsion_to(end, end.s)](double x) {
            return turn_in_sheath(end, torsion_to(end, x), whole);
        };
        const double turn = turn_at(s) - turn_at(from);
        if (turn != 0) rotate_in_body(n.q, turn * Vec3::UnitX());
        return n;
    }
    int e = first;
    while (e + 1 < rod_.element_count() && s >= rod_.s[std::size_t(e) + 1])
        ++e;
    const BeamNode &a = accepted_.nodes[std::size_t(e)], &b = accepted_.nodes[std::size_t(e) + 1];
    const double from = e == first ? end.s : rod_.s[std::size_t(e)],
                 L = rod_.s[std::size_t(e) + 1] - from, xi = (s - from) / L;
    if (xi >= 1) return b;
    const Hermite h = hermite(xi, L);
    const Vec3 x =
        h.h0 * a.position() + h.h1 * b.position() + h.h2 * first_axis(a.q) + h.h3 * first_axis(b.q);
    BeamNode n = a;
    for (int k = 0; k < 3; ++k) {
        n.x[k] = x[k];
        n.rest[k] = 0;
    }
    const Quaternion q = interpolate(a.q, b.q, xi);
    std::copy(q.q, q.q + 4, n.q);
    return n;
}

/// Of a place that the step's mesh has on an element: where it was when the step began.
std::optional<BeamNode> RodBody::place_before(int element, double xi) const
{
    if (!material_ || element > remeshed_) return {};
    const double next = rod_.s[std::size_t(element) + 1];
    return at_place(next - (1 - xi) * rod_.law[std::size_t(element)].length);
}

/// Before the first step: the first shape, on the mesh of time 0.
void RodBody::start_at_sheath()
{
    fed_first_ = input_.fed[0][1];
    material_ = make_material(rod_.segments, 0);
    whole_ = rod_.law;
    SheathEnd end;
    end.fed = curve_value(input_.fed, 0);
    end.turned = end.rotation = base_turn(0);
    end.s = rod_.length - end.fed;
    end.node = node_at_end(end.s);
    whole_stations_ = amontons::stations(curve_of(state_), input_.contact_spacing);
    move_sheath_end(end);
    const Vec3 along = along_sheath();
    for (BeamNode& n : state_.nodes)
        if (end.turned != 0) rotate_in_body(n.q, end.turned * Vec3::UnitX());
    if (end.node < rod_.element_count())
        for (int k = 0; k < 3; ++k)
            state_.nodes[std::size_t(end.node)].move(k, (end.s - rod_.s[std::size_t(end.node)]) *
                                                            along[k]);
    state_.end = sheath_;
    accepted_ = {sheath_, state_.nodes, {}, {}};
}

/// A step begins: its mesh, with its places where the accepted state has them, and what acts there.
void RodBody::begin_at_sheath()
{
    move_sheath_end(accepted_.end);
    state_.nodes = accepted_.nodes;
    acting_ = accepted_.acting;
    const SheathEnd last = accepted_.end;
    SheathEnd next = last;
    next.fed = base_way(step_.end());
    next.turned = base_turn(step_.end());
    if (!input_.plane) next.rotation += next.turned - last.turned; // a guess
    next.s = rod_.length - next.fed - next.stretch;
    next.node = node_at_end(rod_.length - next.fed);
    if (next.node == rod_.element_count() || !compliant_at(next.fed)) {
        next.stretch = 0;
        next.rotation = next.turned;
        next.s = rod_.length - next.fed;
    } else {
        // Stretched or compressed in the sheath by much of an element it is not where its base
        // states.
        const double whole = whole_[std::size_t(next.node)].length,
                     first = rod_.s[std::size_t(next.node) + 1] - next.s;
        if (!(first > kLeast * whole && first < kMost * whole))
            next.node = std::min(node_at_end(next.s), rod_.element_count() - 1);
    }
    remeshed_ = std::max(next.node, last.node);
    if (next.s == last.s && next.node == last.node) {
        move_sheath_end(next);
        return;
    }
    for (int i = std::min(next.node, last.node); i <= remeshed_; ++i) {
        const bool at_end = i == next.node && i < rod_.element_count();
        state_.nodes[std::size_t(i)] = at_place(at_end ? next.s : rod_.s[std::size_t(i)]);
    }
    move_sheath_end(next);
    if (acting_.empty()) return;
    acting_.assign(state_.nodes.size(), Node6{});
    add_loads(state_, step_.start, acting_, nullptr);
    for (std::size_t i = std::size_t(remeshed_) + 1; i < acting_.size(); ++i)
        acting_[i].column += reaction_[i].column;
}

/// What is out is turned as its base is: a guess, from which the balance is not far. What nothing
/// else holds turns about the sheath as a whole; what rests on something turns where it is.
void RodBody::turn_with_sheath()
{
    const double turn = sheath_.turned - accepted_.end.turned;
    if (turn == 0 || input_.plane || !out_of_sheath()) return;
    std::vector<Node6> inner, load;
    forces(state_, step_.start, inner, load);
    constexpr double kNothing = 1e-6; // of the scale of forces
    bool whole = std::ranges::all_of(holds_, [&](const Hold& h) { return h.nodes[0] == 0; });
    for (auto i = std::size_t(remeshed_) + 2; i < inner.size() && whole; ++i)
        whole = (ConstMap6(inner[i].value) - ConstMap6(load[i].value)).head<3>().norm() <=
                kNothing * force_scale();
    const Vec3 along = along_sheath(), end = held_in_sheath(sheath_.node, 0).position();
    const Mat3 about = rotation(turn * along).toRotationMatrix() - Mat3::Identity();
    for (auto i = std::size_t(sheath_.node); i < now_.nodes.size(); ++i) {
        const bool held = std::ranges::any_of(holds_, [&](const Hold& h) {
            return h.input->turns != "free" && std::ranges::count(h.nodes, int(i)) > 0;
        });
        if (held && int(i) > sheath_.node) continue;
        BeamNode& n = now_.nodes[i];
        const Vec3 own =
            whole ? Vec3(rotation_matrix(n.q).transpose() * (turn * along)) : turn * Vec3::UnitX();
        const Vec3 way = whole ? Vec3(about * (n.position() - end)) : Vec3(Vec3::Zero());
        for (int k = 0; k < 3 && whole; ++k)
            n.move(k, way[k]);
        rotate_in_body(n.q, own);
        moved_[i].head<3>() += way;
        moved_[i].tail<3>() += own;
    }
}

RodBody::SheathBalance RodBody::sheath_balance(const Motion& m, double t, bool stiffness) const
{
    SheathBalance b;
    const auto f = std::size_t(sheath_.node);
    const BeamNode &first = m.nodes[f], &second = m.nodes[f + 1];
    const ElementLaw& law = rod_.law[f];
    const HeldBase base = held_base(sheath_);
    const Growth grow = growth(base, first, second, law, 0);
    b.along = along_sheath();
    b.slope = grow.slope;
    b.torque = grow.torque;
    // A load along the rod, on the element that grows and on what is in the sheath.
    const Vec3 load = line_load(t) + rod_.mass[f].per_length * step_.gravity;
    if (!load.isZero(0)) {
        const double L = law.length;
        const Vec3 a1 = first_axis(first.q), b1 = first_axis(second.q);
        b.slope -= load.dot(0.5 * (second.position() - first.position()) + L / 6 * (a1 - b1));
        if (!input_.instrument) b.slope -= load.dot(b.along) * sheath_.s;
        if (stiffness) {
            const Vec3 in_a = rotation_matrix(first.q).transpose() * load,
                       in_b = rotation_matrix(second.q).transpose() * load;
            b.mixed.segment<3>(0) += 0.5 * load;
            b.mixed.segment<3>(3) -= L / 6 * Vec3::UnitX().cross(in_a);
            b.mixed.segment<3>(6) -= 0.5 * load;
            b.mixed.segment<3>(9) += L / 6 * Vec3::UnitX().cross(in_b);
            b.way -= load.dot(a1 - b1) / 6;
            if (!input_.instrument) b.way += load.dot(b.along);
        }
    }
    if (!stiffness) return b;
    const std::array<double, 12> mixed = element_force(first, second, law.length, grow.tau);
    b.mixed += Eigen::Map<const Vec12>(mixed.data());
    b.way += growth_stiffness(base, first, second);
    b.turn = 1 / grow.torsion;
    b.both = -grow.torque / (section_at(*material_, base.end()).stiffness[3] * grow.torsion);
    return b;
}

/// What is missing in the balance of the node at the sheath's end.
/// @param move  of the nodes, that is part of the motion; empty: none
void RodBody::balance_at_sheath(const SheathBalance& b, const Eigen::VectorXd& move,
                                Eigen::VectorXd& missing) const
{
    const Eigen::Index f = at6(std::size_t(sheath_.node));
    double way = -b.slope;
    if (move.size() > 0) way -= b.mixed.dot(move.segment<12>(f));
    missing.segment<3>(f) += (way - b.along.dot(missing.segment<3>(f))) * b.along;
    missing[f + 3] += b.torque;
}

/// The matrix by the two unknowns of the node at the sheath's end.
void RodBody::stiffness_at_sheath(const SheathBalance& b)
{
    const int f = sheath_.node;
    Mat6 across = Mat6::Identity();
    across.topLeftCorner<3, 3>() -= b.along * b.along.transpose();
    Mat6 own = across * dense(K_.chain.diagonal(f)) * across;
    own.topLeftCorner<3, 3>() += b.way * (b.along * b.along.transpose());
    const double both = b.mixed[3] + b.both;
    own.block<3, 1>(0, 3) += both * b.along;
    own.block<1, 3>(3, 0) += both * b.along.transpose();
    own(3, 3) += b.turn;
    set_block(K_.chain.diagonal(f), own);
    Mat6 up = across * dense(K_.chain.upper(f)), low = dense(K_.chain.lower(f)) * across;
    up.topRows<3>() += b.along * b.mixed.tail<6>().transpose();
    low.leftCols<3>() += b.mixed.tail<6>() * b.along.transpose();
    set_block(K_.chain.upper(f), up);
    set_block(K_.chain.lower(f), low);
}

/// Derivative of a place of the material on the first element by its way at the sheath's end.
Vec3 RodBody::along_by_way(const std::vector<BeamNode>& nodes, double L, double xi) const
{
    const auto f = std::size_t(sheath_.node);
    const BeamNode &a = nodes[f], &b = nodes[f + 1];
    const Vec3 ta = first_axis(a.q), tb = first_axis(b.q);
    const Hermite h = hermite(xi, L);
    const Vec3 by_xi = 6 * xi * (1 - xi) * (b.position() - a.position()) +
                       L * (1 - xi) * (1 - 3 * xi) * ta - L * xi * (2 - 3 * xi) * tb;
    return (1 - xi) / L * by_xi + (h.h2 * ta + h.h3 * tb) / L;
}

/// Of a motion of the nodes, what passes the node at the sheath's end: (way, turn) of the material
/// beside what is prescribed. The way is taken out of the motion.
std::array<double, 2> RodBody::past_sheath_end(Eigen::VectorXd& y) const
{
    if (!compliant_in_sheath()) return {0, 0};
    const Eigen::Index f = at6(std::size_t(sheath_.node));
    const Vec3 along = along_sheath();
    const BeamNode there = held_in_sheath(sheath_.node, 0);
    const BeamNode& now = now_.nodes[std::size_t(sheath_.node)];
    double move = 0;
    for (int k = 0; k < 3; ++k)
        move += there.difference(now, k) * along[k];
    const auto turn_of = [](const BeamNode& n) {
        return Eigen::Quaterniond(n.q[0], n.q[1], n.q[2], n.q[3]);
    };
    const double turn = rotation_vector(turn_of(now).conjugate() * turn_of(there)).x();
    const double way = along.dot(y.segment<3>(f)) - move;
    y.segment<3>(f) -= way * along;
    return {way, y[f + 3] - turn};
}

/// The share of such a way that leaves the first element a length.
double RodBody::share_past_end(double way) const
{
    if (way == 0) return 1;
    const double whole = whole_[std::size_t(sheath_.node)].length,
                 now = rod_.law[std::size_t(sheath_.node)].length,
                 least = std::min(kLeast * whole, 0.9 * now),
                 most = std::max(kMost * whole, 1.1 * now);
    double room = way > 0 ? most - now : now - least;
    if (way > 0) room = std::min(room, 0.5 * sheath_.s); // and the sheath some of the rod
    return std::abs(way) > room ? room / std::abs(way) : 1;
}

/// The material comes out by a way, and turns.
void RodBody::pass_sheath_end(double way, double turn)
{
    if (!compliant_in_sheath()) return;
    SheathEnd next = sheath_;
    next.stretch += way;
    next.rotation += turn;
    next.s = rod_.length - next.fed - next.stretch;
    move_sheath_end(next);
    const Vec3 along = along_sheath();
    const auto f = std::size_t(sheath_.node);
    state_.nodes[f] = at_place(sheath_.s);
    for (std::size_t i = 0; i <= f; ++i) {
        moved_[i].head<3>() += way * along;
        for (int k = 0; k < 3 && i < f; ++k)
            now_.nodes[i].move(k, way * along[k]);
    }
}

/// @param acting  loads and what holds the rod; what holds it in the sheath does its work at the
/// base
/// @return  that work, of the step [J]
double RodBody::accept_at_sheath(std::vector<Node6>& acting)
{
    const double push = push_, torque = torque_;
    const HeldBase base = held_base(sheath_);
    const bool first = acting_.empty();
    if (compliant_in_sheath()) {
        const HeldWire held = held_part(base, base.end());
        push_ = -base.stretch() / held.axial;
        torque_ = (base.base_twist - base.rotation) / held.torsion;
    } else {
        push_ = torque_ = 0;
        if (sheath_.node == rod_.element_count()) // pushing sets free what straight wire holds
            push_ = -straight_energy(*material_, base.end());
        else
            push_ = along_sheath().dot(Map6(reaction_[std::size_t(sheath_.node)].value).head<3>()),
            torque_ = reaction_[std::size_t(sheath_.node)].value[3];
    }
    for (std::size_t i = 0; i <= std::size_t(sheath_.node); ++i)
        acting[i] = load_[i];
    const double fed = sheath_.fed - accepted_.end.fed,
                 turned = sheath_.turned - accepted_.end.turned;
    return first ? push_ * fed + torque_ * turned
                 : 0.5 * (push + push_) * fed + 0.5 * (torque + torque_) * turned;
}

double RodBody::energy_in_sheath() const
{
    const HeldBase base = held_base(sheath_);
    const HeldWire held = held_part(base, std::max(base.end(), 0.0));
    double energy = held.bending;
    if (!compliant_in_sheath()) return energy;
    const double turn = base.base_twist - base.rotation;
    energy += 0.5 * base.stretch() * base.stretch() / held.axial + 0.5 * turn * turn / held.torsion;
    return energy;
}

} // namespace amontons
