#include "mesh/base/curve.hpp"
#include "solver/beam/held_base.hpp"
#include "solver/body/node_index.hpp"
#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>

// Dynamic steps of a rod that comes out of a sheath. Coordinates of the rod are the length that is
// out, l, the turn about the sheath of the section at its end, and the nodes that are out. With the
// material coordinate s fixed the first element's cubic line x(s; l, nodes) gives the velocity of
// the material
//
//     v = x_l w + sum x_i V_i,        w = dl/dt,
//
// which at the sheath's end is w along it: what comes out has the velocity that it had inside. The
// balance is that of d'Alembert with these rows J = (x_l, x_i),
//
//     sum m J^T (v' - v) = h (forces - growth of the energy with l),
//
// over the material that is out where J is evaluated (half way, of rules of second order), v' and v
// of the same material where the step ends and begins. No term of a flux of momentum is left: the
// material passes the end without a jump of its velocity. Energy is kept by the same sum, with
//
//     1/2 m_l (l' - l) ((1 - a) w'^2 + a w^2)
//
// for what has come out, a the share of the step at which J is evaluated and m_l the mass per
// length: the drive has given it. What is in the sheath has no inertia of its own; it is the spring
// of rod_sheath.cpp.

namespace amontons {
namespace {

constexpr double kShortestInStep = 0.2; // of an element, or of what it was

} // namespace

bool RodBody::grows(int element) const
{
    return material_ && step_.dynamic && element == sheath_.node;
}

double RodBody::first_length(const SheathEnd& end) const
{
    return ((rod_.s[std::size_t(end.node) + 1] - rod_.length) + end.fed) + end.stretch;
}

/// Places of contacts are of the material where the step starts.
double RodBody::xi_now(int element, double xi) const
{
    if (!grows(element)) return xi;
    return 1 - (1 - xi) * (first_length(state_.end) / first_length(now_.end));
}

/// ... and its derivative by the motion of the nodes. Before the first element (xi < 0) the
/// material is in the sheath.
RodPlace RodBody::place_on(const Motion& m, int e, double xi) const
{
    if (!grows(e)) return rod_place(rod_, m.nodes, e, xi);
    const double L = first_length(m.end);
    const Vec3 along = along_sheath();
    if (xi < 0) {
        RodPlace p;
        p.x = m.nodes[std::size_t(e)].position() + xi * L * along;
        p.J.setZero();
        p.J.leftCols<3>() = along * along.transpose();
        return p;
    }
    RodPlace p = rod_place(rod_, m.nodes, e, xi, L);
    p.J.leftCols<3>() = along_by_way(m.nodes, L, xi) * along.transpose();
    return p;
}

/// Of the material at s, on the accepted mesh, in the axes of at_place(s).
Vec6 RodBody::velocity_before(double s) const
{
    const SheathEnd& end = accepted_.end;
    const auto f = std::size_t(end.node);
    if (end.node == rod_.element_count() || s <= end.s) return accepted_.velocity[f];
    int e = end.node;
    while (e + 1 < rod_.element_count() && s >= rod_.s[std::size_t(e) + 1])
        ++e;
    const double next = rod_.s[std::size_t(e) + 1],
                 from = e == end.node ? end.s : rod_.s[std::size_t(e)],
                 xi = (s - from) / (next - from);
    const auto a = std::size_t(e), b = a + 1;
    const Motion m{accepted_.nodes, {}, end};
    Vec6 v;
    v.head<3>() = point_velocity(m, accepted_.velocity, e, xi);
    const Vec3 spin = (1 - xi) * (rotation_matrix(m.nodes[a].q) * accepted_.velocity[a].tail<3>()) +
                      xi * (rotation_matrix(m.nodes[b].q) * accepted_.velocity[b].tail<3>());
    v.tail<3>() = rotation_matrix(at_place(s).q).transpose() * spin;
    return v;
}

/// Material that is out moves along the sheath as it is fed, and turns as its base does.
void RodBody::start_with_feed()
{
    if (!material_ || !input_.velocity.isZero(0) || !input_.spin.isZero(0)) return;
    double turn = 0;
    for (const RodHold& h : input_.hold)
        if (h.set == "start" && !input_.plane && !h.angle.empty())
            turn += (h.axis.dot(along_sheath()) < 0 ? -1 : 1) * curve_rate(h.angle, 0);
    const double rate = curve_rate(input_.fed, 0);
    for (Vec6& v : state_.velocity) {
        v.head<3>() = rate * along_sheath();
        v.tail<3>() = turn * Vec3::UnitX();
    }
    accepted_.velocity = state_.velocity;
    now_ = state_;
}

/// A step begins: the element at the sheath's end is long enough where it begins and where it ends.
void RodBody::begin_motion_at_sheath()
{
    const SheathEnd last = accepted_.end;
    const int all = rod_.element_count();
    take_sheath_end(last);
    state_ = {accepted_.nodes, accepted_.velocity, last};
    acting_ = accepted_.acting;
    memory_at_start_ = memory_;
    broken_ = false;
    led_.fed = base_way(step_.end());
    led_.turned = base_turn(step_.end());
    SheathEnd start = last;
    const double stretch = last.node == all ? 0 : last.stretch;
    start.node = node_at_end(std::max(last.s, rod_.length - led_.fed - stretch));
    compliant_in_step_ = start.node < all && compliant_at(led_.fed);
    if (!compliant_in_step_) {
        start.stretch = 0;
        start.rotation = start.turned;
    }
    start.s = rod_.length - start.fed - start.stretch;
    remeshed_ = std::max(start.node, last.node);
    const bool same = start.node == last.node;
    const double before = same ? 0 : kinetic_energy();
    for (int i = std::min(start.node, last.node); i <= remeshed_ && !same; ++i) {
        const auto k = std::size_t(i);
        const double s = i == start.node && i < all ? start.s : rod_.s[k];
        state_.nodes[k] = at_place(s);
        state_.velocity[k] = velocity_before(s);
    }
    state_.end = start;
    move_sheath_end(start);
    const double torsion = torsion_to(start, start.s);
    for (int i = 0; i <= start.node; ++i)
        state_.nodes[std::size_t(i)] = held_in_sheath(i, torsion);
    // What begins to be out, or ends to be.
    passed_energy_ = (start.node == all) != (last.node == all) ? kinetic_energy() - before : 0;
    renewed_ = same ? -1 : std::min(remeshed_ + 1, rod_.node_count() - 1);
}

RodBody::SheathEnd RodBody::part_way(double share) const
{
    const SheathEnd &a = state_.end, &b = now_.end;
    const auto mean = [share](double from, double to) { return from + share * (to - from); };
    SheathEnd end = b;
    end.fed = mean(a.fed, b.fed);
    end.stretch = mean(a.stretch, b.stretch);
    end.turned = mean(a.turned, b.turned);
    end.rotation = mean(a.rotation, b.rotation);
    end.s = mean(a.s, b.s);
    return end;
}

/// The end of the sheath and what is in there, by the velocities of the iterate.
void RodBody::place_at_sheath()
{
    SheathEnd next = now_.end;
    const auto f = std::size_t(next.node);
    if (compliant_in_step_) {
        const Vec6 way = step_.h * (step_.rule.end * now_.velocity[f] + past_velocity_[f]);
        next.stretch =
            (state_.end.fed - next.fed) + state_.end.stretch + along_sheath().dot(way.head<3>());
        next.rotation = state_.end.rotation + way[3];
    } else {
        next.stretch = 0;
        next.rotation = next.turned;
    }
    next.s = rod_.length - next.fed - next.stretch;
    if (next.node < rod_.element_count()) {
        const double least = kShortestInStep * std::min(whole_[f].length, first_length(state_.end));
        broken_ = !(first_length(next) > least) || (compliant_in_step_ && !(next.s > 0));
        if (broken_) return;
    }
    now_.end = next;
    take_sheath_end(next);
    const double torsion = torsion_to(next, next.s);
    for (int i = 0; i <= next.node; ++i)
        now_.nodes[std::size_t(i)] = held_in_sheath(i, torsion);
}

Vec6 RodBody::velocity_in_sheath() const
{
    Vec6 v = Vec6::Zero();
    v.head<3>() = (led_.fed - state_.end.fed) / step_.h * along_sheath();
    if (!input_.plane) v[3] = (led_.turned - state_.end.turned) / step_.h;
    return v;
}

double RodBody::base_off() const
{
    return std::abs(led_.fed - now_.end.fed) + std::abs(led_.turned - now_.end.turned) * size_;
}

/// The base moves with the free motion to where it is led.
void RodBody::lead_base(Eigen::VectorXd& rest)
{
    if (!compliant_in_step_ || base_off() == 0) return;
    const double way = led_.fed - now_.end.fed, turn = led_.turned - now_.end.turned,
                 lever = step_.h * step_.rule.end;
    const HeldBase base = held_base(step_.rule.filtered ? now_.end : part_way(step_.rule.end));
    const HeldWire held = held_part(base, base.end());
    const Section c = section_at(*material_, base.end());
    const double force = base.stretch() / held.axial,
                 torque = (base.base_twist - base.rotation) / held.torsion;
    const Eigen::Index f = at6(std::size_t(sheath_.node));
    rest.segment<3>(f) += lever *
                          ((1 + force / c.stiffness[0]) / held.axial * way -
                           torque / (c.stiffness[3] * held.torsion) * turn) *
                          along_sheath();
    rest[f + 3] += lever * turn / held.torsion;
}

/// Push and torque at the base, of what is in the sheath [N], [N m].
std::array<double, 2> RodBody::base_forces(const SheathEnd& end) const
{
    const HeldBase base = held_base(end);
    const HeldWire held = held_part(base, base.end());
    return {-base.stretch() / held.axial, (base.base_twist - base.rotation) / held.torsion};
}

/// Of what has come out in the step, where the balance is that of this share of it [J].
double RodBody::energy_fed(double share) const
{
    const int f = sheath_.node;
    if (f == rod_.element_count()) return passed_energy_;
    const double grown = first_length(now_.end) - first_length(state_.end);
    const ElementMass& m = rod_.mass[std::size_t(f)];
    const auto mean = [&](int node, const Vec6& weight) {
        const auto i = std::size_t(node);
        return weight.dot((1 - share) * now_.velocity[i].cwiseAbs2() +
                          share * state_.velocity[i].cwiseAbs2());
    };
    Vec6 line = Vec6::Zero(), turns = Vec6::Zero();
    line.head<3>().setConstant(m.per_length);
    turns.tail<3>() = 0.5 * Vec3(m.spin, m.bend, m.bend);
    return passed_energy_ + 0.5 * grown * (mean(f, line + turns) + mean(f + 1, turns));
}

/// As accept_at_sheath(). Push and torque are means of the step, but those that generalised-alpha
/// ends with.
double RodBody::accept_motion_at_sheath(std::vector<Node6>& acting)
{
    const TimeRule& rule = step_.rule;
    std::array<double, 2> mean{};
    if (compliant_in_step_ && rule.filtered) {
        const std::array<double, 2> start = base_forces(state_.end), end = base_forces(now_.end);
        mean = {0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])};
        push_ = end[0];
        torque_ = end[1];
    } else if (compliant_in_step_) {
        mean = base_forces(part_way(rule.end));
        push_ = mean[0];
        torque_ = mean[1];
    } else {
        const HeldBase base = held_base(sheath_);
        const Vec6 reaction = ConstMap6(reaction_[std::size_t(sheath_.node)].value);
        const bool inside = sheath_.node == rod_.element_count();
        push_ = inside ? -straight_energy(*material_, base.end())
                       : along_sheath().dot(reaction.head<3>());
        torque_ = inside ? 0 : reaction[3];
        mean = {push_, torque_};
    }
    for (std::size_t i = 0; i <= std::size_t(sheath_.node); ++i)
        acting[i] = load_[i];
    return mean[0] * (now_.end.fed - state_.end.fed) +
           mean[1] * (now_.end.turned - state_.end.turned) +
           energy_fed(rule.filtered ? 0.5 : rule.end);
}

} // namespace amontons
