#include "solver/body/node_index.hpp"
#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>

// Dynamic steps of a rod. Its mass moves with the points of its cubic middle line: with the rows N
// of a point of mass m, places of nodes x and velocities V (places in space, turns in the body),
//
//   sum m N^T (N' V' - N V) + J (W' - W) = h f,     x' = x + h (end V' + past)
//
// where ' is the end of the step, N^T at the place between (of the filtered rule: half way), J the
// rotary inertia of the sections (W' x J W', which is of the order of the section's size squared,
// is with it) and f the forces at the place between (rule theta) or those that the
// generalised-alpha rule filters.

namespace amontons {

Vec3 RodBody::point_velocity(const std::vector<BeamNode>& nodes, const std::vector<Vec6>& velocity,
                             int e, double xi) const
{
    const RodPlace p = rod_place(rod_, nodes, e, xi);
    return p.J.leftCols<6>() * velocity[std::size_t(e)] +
           p.J.rightCols<6>() * velocity[std::size_t(rod_.second(e))];
}

void RodBody::begin_memory()
{
    const TimeRule& rule = step_.rule;
    const std::size_t n = state_.nodes.size();
    if (!rule.filtered) {
        for (std::size_t i = 0; i < n; ++i) {
            past_velocity_[i] = rule.start * state_.velocity[i];
            past_force_[i].setZero();
        }
        return;
    }
    if (!memory_.begun) {
        forces(state_, step_.start, inner_, load_);
        memory_.force_now.resize(n);
        for (std::size_t i = 0; i < n; ++i)
            memory_.force_now[i] = ConstMap6(load_[i].value) - ConstMap6(inner_[i].value);
        memory_.velocity = state_.velocity;
        memory_.force = memory_.force_now;
        memory_.begun = true;
    }
    for (std::size_t i = 0; i < n; ++i) {
        past_velocity_[i] = rule.past(state_.velocity[i], memory_.velocity[i]);
        past_force_[i] = rule.past(memory_.force_now[i], memory_.force[i]);
    }
}

void RodBody::place_by_velocity()
{
    const double h = step_.h, a = step_.rule.end;
    for (std::size_t i = 0; i < now_.nodes.size(); ++i) {
        now_.nodes[i] = state_.nodes[i];
        const Vec6 mean = a * now_.velocity[i] + past_velocity_[i];
        for (int k = 0; k < 3; ++k)
            now_.nodes[i].move(k, h * mean[k]);
        rotate_in_body(now_.nodes[i].q, h * mean.tail<3>());
    }
}

BeamNode RodBody::half_way(int node) const
{
    const auto i = std::size_t(node);
    BeamNode n = state_.nodes[i];
    for (int k = 0; k < 3; ++k)
        n.move(k, 0.5 * now_.nodes[i].difference(state_.nodes[i], k));
    rotate_in_body(n.q, 0.5 * step_.h *
                            (step_.rule.end * now_.velocity[i] + past_velocity_[i]).tail<3>());
    return n;
}

RodBody::Motion RodBody::between() const
{
    const double theta = step_.rule.end;
    if (step_.rule.filtered || theta == 1) return now_;
    Motion m = now_;
    for (std::size_t i = 0; i < m.nodes.size(); ++i) {
        m.nodes[i] = state_.nodes[i];
        for (int k = 0; k < 3; ++k)
            m.nodes[i].move(k, theta * now_.nodes[i].difference(state_.nodes[i], k));
        rotate_in_body(m.nodes[i].q,
                       theta * step_.h * (theta * now_.velocity[i] + past_velocity_[i]).tail<3>());
    }
    return m;
}

/// The change of momentum that is missing into residual_, its matrix by end velocities into K_.
void RodBody::dynamic_residual()
{
    const double h = step_.h;
    const TimeRule& rule = step_.rule;
    const Motion m = between();
    const double when = rule.filtered ? step_.end() : step_.start + rule.end * h;
    forces(m, when, inner_, load_);
    K_.scale(h * rule.end * h * rule.end);
    residual_.resize(unknowns());
    const double weight = rule.filtered ? rule.end : 1;
    // Momentum changes half way, where its moment is that of the change of angular momentum up to
    // the third order of the step; the filtered rule's forces are means of both ends.
    Motion middle = m;
    for (std::size_t i = 0; rule.filtered && i < m.nodes.size(); ++i)
        middle.nodes[i] = half_way(int(i));
    for (std::size_t i = 0; i < m.nodes.size(); ++i)
        residual_.segment<6>(at6(i)) =
            h *
            (weight * (ConstMap6(load_[i].value) - ConstMap6(inner_[i].value)) + past_force_[i]);
    add_rod_mass(rod_, middle.nodes, 1 + damping_ * h * rule.end, K_);
    double largest = 0;
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        const Vec3 now = point_velocity(now_.nodes, now_.velocity, e, xi),
                   before = point_velocity(state_.nodes, state_.velocity, e, xi);
        const Vec3 mean = rule.end * now + (1 - rule.end) * before;
        const Vec3 p = mass * (now - before + damping_ * h * mean);
        const Eigen::Matrix<double, 12, 1> v =
            rod_place(rod_, middle.nodes, e, xi).J.transpose() * p;
        residual_.segment<6>(6 * e) -= v.head<6>();
        residual_.segment<6>(6 * rod_.second(e)) -= v.tail<6>();
        largest = std::max({largest, mass * now.norm() / h, mass * before.norm() / h});
    });
    for (std::size_t i = 0; i < m.nodes.size(); ++i) {
        const Vec3 J = rod_inertia(rod_, int(i));
        const Vec3 now = now_.velocity[i].tail<3>(), before = state_.velocity[i].tail<3>();
        const Vec3 spin = rule.end * now + (1 - rule.end) * before;
        residual_.segment<3>(at6(i) + 3) -= J.cwiseProduct(now - before + damping_ * h * spin) +
                                            h * spin.cross(J.cwiseProduct(spin));
        largest = std::max(largest, J.cwiseProduct(now).norm() / h / size_);
    }
    inertia_size_ = largest;
}

double RodBody::end_memory()
{
    // What implicit Euler takes of the change's energy, (theta - 1/2) (dv M dv + dx df), and the
    // damping. The filtered rule: mean rates less the trapezoid's.
    const TimeRule& rule = step_.rule;
    const double h = step_.h;
    double taken = 0;
    std::vector<Node6> inner, load;
    forces(state_, step_.start, inner, load);
    std::vector<Node6> start_inner = inner;
    forces(now_, step_.end(), inner, load);
    const double excess = rule.end - 0.5;
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        const Vec3 now = point_velocity(now_.nodes, now_.velocity, e, xi),
                   before = point_velocity(state_.nodes, state_.velocity, e, xi);
        const Vec3 mean = rule.end * now + (1 - rule.end) * before;
        taken += damping_ * h * mass * mean.squaredNorm();
        if (!rule.filtered) {
            taken += excess * mass * (now - before).squaredNorm();
        } else {
            const Vec3 moved =
                rod_point(rod_, now_.nodes, e, xi) - rod_point(rod_, state_.nodes, e, xi);
            taken += mass * (moved / h - 0.5 * (now + before)).dot(now - before);
        }
    });
    for (std::size_t i = 0; i < now_.nodes.size(); ++i) {
        Vec6 change = Vec6::Zero();
        const Vec6 a = ConstMap6(start_inner[i].value), b = ConstMap6(inner[i].value);
        if (!rule.filtered) change = excess * (b - a);
        taken += change.dot(moved_[i]);
    }
    if (rule.filtered)
        for (std::size_t i = 0; i < now_.nodes.size(); ++i) {
            const Vec6 force = ConstMap6(load[i].value) - ConstMap6(inner[i].value);
            memory_.velocity[i] =
                rule.next(now_.velocity[i], state_.velocity[i], memory_.velocity[i]);
            memory_.force[i] = rule.next(force, memory_.force_now[i], memory_.force[i]);
            memory_.force_now[i] = force;
        }
    return taken;
}

double RodBody::speed() const
{
    double most = 0;
    for (const Vec6& v : state_.velocity)
        most = std::max(most, v.head<3>().norm());
    return most;
}

double RodBody::kinetic_energy() const
{
    if (std::ranges::all_of(state_.velocity, [](const Vec6& v) { return v.isZero(0); })) return 0;
    double sum = 0;
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        sum += 0.5 * mass * point_velocity(state_.nodes, state_.velocity, e, xi).squaredNorm();
    });
    for (std::size_t i = 0; i < state_.nodes.size(); ++i) {
        const Vec3 w = state_.velocity[i].tail<3>();
        sum += 0.5 * w.dot(rod_inertia(rod_, int(i)).cwiseProduct(w));
    }
    return sum;
}

Vec3 RodBody::momentum() const
{
    Vec3 sum = Vec3::Zero();
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        sum += mass * point_velocity(state_.nodes, state_.velocity, e, xi);
    });
    return sum;
}

Vec3 RodBody::angular_momentum() const
{
    Vec3 sum = Vec3::Zero();
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        sum += mass * rod_point(rod_, state_.nodes, e, xi)
                          .cross(point_velocity(state_.nodes, state_.velocity, e, xi));
    });
    for (std::size_t i = 0; i < state_.nodes.size(); ++i)
        sum += rotation_matrix(state_.nodes[i].q) *
               rod_inertia(rod_, int(i)).cwiseProduct(state_.velocity[i].tail<3>());
    return sum;
}

std::vector<double> RodBody::state() const
{
    std::vector<double> s;
    for (const BeamNode& n : material_ ? accepted_.nodes : state_.nodes) {
        s.insert(s.end(), n.x, n.x + 3);
        s.insert(s.end(), n.rest, n.rest + 3);
        s.insert(s.end(), n.q, n.q + 4);
    }
    const auto add = [&](const std::vector<Vec6>& list) {
        for (std::size_t i = 0; i < state_.nodes.size(); ++i) {
            const Vec6 v = i < list.size() ? list[i] : Vec6(Vec6::Zero());
            s.insert(s.end(), v.data(), v.data() + 6);
        }
    };
    add(state_.velocity);
    add(memory_.velocity);
    add(memory_.force);
    add(memory_.force_now);
    add(drag_before_);
    for (const std::vector<Node6>* list : {material_ ? &accepted_.acting : &acting_, &reaction_})
        for (std::size_t i = 0; i < state_.nodes.size(); ++i) {
            const Node6 zero{};
            const double* v = i < list->size() ? (*list)[i].value : zero.value;
            s.insert(s.end(), v, v + 6);
        }
    s.push_back(memory_.begun ? 1 : 0);
    s.push_back(reaction_.empty() ? 0 : 1);
    s.push_back(stable_ ? 1 : 0);
    s.push_back(accepted_.end.node);
    s.push_back(accepted_.end.s);
    for (const double x : {accepted_.end.fed, accepted_.end.stretch, accepted_.end.turned,
                           accepted_.end.rotation, push_, torque_})
        s.push_back(x);
    s.push_back(path_.size() > 0 ? 1 : 0);
    for (Eigen::Index i = 0; i < unknowns(); ++i)
        s.push_back(path_.size() > 0 ? path_[i] : 0);
    return s;
}

void RodBody::set_state(std::span<const double> state)
{
    std::size_t at = 0;
    const auto take = [&](double* to, std::size_t count) {
        std::copy_n(state.begin() + std::ptrdiff_t(at), count, to);
        at += count;
    };
    const std::size_t n = state_.nodes.size();
    for (BeamNode& node : state_.nodes) {
        take(node.x, 3);
        take(node.rest, 3);
        take(node.q, 4);
    }
    for (std::vector<Vec6>* list :
         {&state_.velocity, &memory_.velocity, &memory_.force, &memory_.force_now, &drag_before_}) {
        list->resize(n);
        for (Vec6& v : *list)
            take(v.data(), 6);
    }
    for (std::vector<Node6>* list : {&acting_, &reaction_}) {
        list->assign(n, Node6{});
        for (Node6& v : *list)
            take(v.value, 6);
    }
    memory_.begun = state[at++] != 0;
    if (state[at++] == 0) {
        acting_.clear();
        reaction_.clear();
    }
    stable_ = state[at++] != 0;
    accepted_.end.node = int(state[at++]);
    accepted_.end.s = state[at++];
    for (double* x : {&accepted_.end.fed, &accepted_.end.stretch, &accepted_.end.turned,
                      &accepted_.end.rotation, &push_, &torque_})
        *x = state[at++];
    if (material_) {
        accepted_.nodes = state_.nodes;
        accepted_.acting = acting_;
        move_sheath_end(accepted_.end);
    }
    const bool path = state[at++] != 0;
    path_.resize(path ? unknowns() : 0);
    if (path) take(path_.data(), std::size_t(unknowns()));
    now_ = state_;
}

} // namespace amontons
