#include "mesh/base/dense.hpp"
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

Vec3 RodBody::point_velocity(const Motion& m, const std::vector<Vec6>& velocity, int e,
                             double xi) const
{
    const RodPlace p = place_on(m, e, xi);
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
    // Filtered rates begin with the first ones; anew where a step has another mesh.
    Memory& m = memory_at_start_;
    if (!material_) m = memory_;
    const std::size_t from_new = m.begun ? std::size_t(renewed_ + 1) : n;
    if (from_new > 0) {
        const Eigen::VectorXd f = missing_forces(state_, step_.start);
        m.force_now.resize(n);
        m.force.resize(n);
        m.velocity.resize(n);
        for (std::size_t i = 0; i < from_new; ++i) {
            m.force_now[i] = m.force[i] = f.segment<6>(at6(i));
            m.velocity[i] = state_.velocity[i];
        }
        if (!m.begun) m.moment = m.moment_now = moment_of_loads(state_);
        m.begun = true;
    }
    past_moment_ = rule.past(m.moment_now, m.moment);
    for (std::size_t i = 0; i < n; ++i) {
        past_velocity_[i] = rule.past(state_.velocity[i], m.velocity[i]);
        past_force_[i] = rule.past(m.force_now[i], m.force[i]);
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
    if (material_) place_at_sheath();
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
    if (material_) m.end = part_way(theta);
    return m;
}

RodBody::Motion RodBody::middle() const
{
    Motion m = between();
    for (std::size_t i = 0; step_.rule.filtered && i < m.nodes.size(); ++i)
        m.nodes[i] = half_way(int(i));
    if (material_ && step_.rule.filtered) m.end = part_way(0.5);
    return m;
}

/// Calls visit(e, mass, xi, xi_end, xi_start) for points of the mass that is out at `middle`, whose
/// mesh is taken: places on the element there and of the same material where the step ends and
/// starts.
template <class Visit> void RodBody::for_moving_mass(const Motion& middle, Visit visit) const
{
    double by_end = 1, by_start = 1;
    if (out_of_sheath()) {
        by_end = first_length(middle.end) / first_length(now_.end);
        by_start = first_length(middle.end) / first_length(state_.end);
    }
    for_mass_points(
        rod_,
        [&](int e, double mass, double xi) {
            const bool first = grows(e);
            visit(e, mass, xi, first ? 1 - (1 - xi) * by_end : xi,
                  first ? 1 - (1 - xi) * by_start : xi);
        },
        material_ ? sheath_.node : 0);
}

void RodBody::add_mass(const Motion& middle, double scale)
{
    if (!material_) return add_rod_mass(rod_, middle.nodes, scale, K_);
    for_moving_mass(middle, [&](int e, double mass, double xi, double, double) {
        const RodPlace p = place_on(middle, e, xi);
        add_element_matrix(rod_, e, scale * mass * p.J.transpose() * p.J, K_);
    });
    for (int i = sheath_.node; i < rod_.node_count(); ++i) {
        const Vec3 J = scale * rod_inertia(rod_, i, sheath_.node);
        for (int k = 0; k < 3; ++k)
            K_.chain.diagonal(i)(3 + k, 3 + k) += J[k];
    }
}

Eigen::VectorXd RodBody::missing_forces(const Motion& m, double t)
{
    if (material_) take_sheath_end(m.end);
    forces(m, t, inner_, load_);
    Eigen::VectorXd f(unknowns());
    for (std::size_t i = 0; i < m.nodes.size(); ++i)
        f.segment<6>(at6(i)) = ConstMap6(load_[i].value) - ConstMap6(inner_[i].value);
    if (!out_of_sheath()) return f;
    const SheathBalance b = sheath_balance(m, t, true);
    balance_at_sheath(b, {}, f);
    if (compliant_in_sheath()) stiffness_at_sheath(b);
    return f;
}

/// The change of momentum that is missing into residual_, its matrix by end velocities into K_.
void RodBody::dynamic_residual()
{
    const double h = step_.h;
    const TimeRule& rule = step_.rule;
    const Motion m = between();
    const double when = rule.filtered ? step_.end() : step_.start + rule.end * h;
    residual_ = missing_forces(m, when);
    K_.scale(h * rule.end * h * rule.end);
    const double weight = rule.filtered ? rule.end : 1;
    // Momentum changes half way, where its moment is that of the change of angular momentum up to
    // the third order of the step; the filtered rule's forces are means of both ends.
    const Motion middle = rule.filtered ? this->middle() : m;
    for (std::size_t i = 0; i < m.nodes.size(); ++i)
        residual_.segment<6>(at6(i)) =
            h * (weight * Vec6(residual_.segment<6>(at6(i))) + past_force_[i]);
    if (material_) take_sheath_end(middle.end);
    add_mass(middle, 1 + damping_ * h * rule.end);
    double largest = 0;
    for_moving_mass(middle, [&](int e, double mass, double xi, double at_end, double at_start) {
        const Vec3 now = point_velocity(now_, now_.velocity, e, at_end),
                   before = point_velocity(state_, state_.velocity, e, at_start);
        const Vec3 mean = rule.end * now + (1 - rule.end) * before;
        const Vec3 p = mass * (now - before + damping_ * h * mean);
        const Eigen::Matrix<double, 12, 1> v = place_on(middle, e, xi).J.transpose() * p;
        residual_.segment<6>(6 * e) -= v.head<6>();
        residual_.segment<6>(6 * rod_.second(e)) -= v.tail<6>();
        largest = std::max({largest, mass * now.norm() / h, mass * before.norm() / h});
    });
    const int first = material_ ? sheath_.node : 0;
    for (auto i = std::size_t(first); i < m.nodes.size(); ++i) {
        const Vec3 J = rod_inertia(rod_, int(i), first);
        const Vec3 now = now_.velocity[i].tail<3>(), before = state_.velocity[i].tail<3>();
        const Vec3 spin = rule.end * now + (1 - rule.end) * before;
        residual_.segment<3>(at6(i) + 3) -= J.cwiseProduct(now - before + damping_ * h * spin) +
                                            h * spin.cross(J.cwiseProduct(spin));
        largest = std::max(largest, J.cwiseProduct(now).norm() / h / size_);
    }
    if (rule.filtered && !material_ && holds_.empty()) leave_no_inner_moment(middle);
    inertia_size_ = largest;
    if (material_) take_sheath_end(now_.end);
}

/// Moment of the loads of the last forces() about the origin [N m].
Vec3 RodBody::moment_of_loads(const Motion& m) const
{
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < m.nodes.size(); ++i) {
        const ConstMap6 f(load_[i].value);
        sum +=
            m.nodes[i].position().cross(f.head<3>()) + rotation_matrix(m.nodes[i].q) * f.tail<3>();
    }
    return sum;
}

/// The filtered rule changes angular momentum by more than loads and contacts do: inner forces are
/// means of several places, none of which is the place where momentum changes, and the mean
/// velocity is not that of both ends. Both are of third order in a step where motion is resolved,
/// but not by the axial waves, that are too quick for the step. It is taken from residual_, as by a
/// turn of the rod as a whole about its centre of mass.
void RodBody::leave_no_inner_moment(const Motion& middle)
{
    const double h = step_.h;
    const std::size_t n = middle.nodes.size();
    Vec3 centre = Vec3::Zero(), moment = Vec3::Zero();
    double whole = 0;
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        whole += mass;
        centre += mass * place_on(middle, e, xi).x;
    });
    if (!(whole > 0)) return;
    centre /= whole;

    // ---- Angular momentum that is gained, less what acts from outside
    Mat3 inertia = Mat3::Zero();
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        const Vec3 now = point_velocity(now_, now_.velocity, e, xi),
                   before = point_velocity(state_, state_.velocity, e, xi),
                   mean = step_.rule.end * now + (1 - step_.rule.end) * before,
                   x = place_on(middle, e, xi).x, r = x - centre;
        moment += mass * (place_on(now_, e, xi).x.cross(now) -
                          place_on(state_, e, xi).x.cross(before) + damping_ * h * x.cross(mean));
        inertia += mass * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
    });
    for (std::size_t i = 0; i < n; ++i) {
        const Mat3 R = rotation_matrix(middle.nodes[i].q);
        const Vec3 J = rod_inertia(rod_, int(i)), now = now_.velocity[i].tail<3>(),
                   before = state_.velocity[i].tail<3>(),
                   mean = step_.rule.end * now + (1 - step_.rule.end) * before;
        inertia += R * J.asDiagonal() * R.transpose();
        moment += rotation_matrix(now_.nodes[i].q) * J.cwiseProduct(now) -
                  rotation_matrix(state_.nodes[i].q) * J.cwiseProduct(before) +
                  R * (damping_ * h * J.cwiseProduct(mean)) +
                  middle.nodes[i].position().cross(Vec3(residual_.segment<3>(at6(i)))) +
                  R * residual_.segment<3>(at6(i) + 3);
    }
    moment -= h * (step_.rule.end * moment_of_loads(now_) + past_moment_);

    // ---- The turn that takes it
    const Vec3 spin = solve_symmetric(inertia, moment);
    for_mass_points(rod_, [&](int e, double mass, double xi) {
        const RodPlace p = place_on(middle, e, xi);
        const Eigen::Matrix<double, 12, 1> v = p.J.transpose() * (mass * spin.cross(p.x - centre));
        residual_.segment<6>(6 * e) -= v.head<6>();
        residual_.segment<6>(6 * rod_.second(e)) -= v.tail<6>();
    });
    for (std::size_t i = 0; i < n; ++i)
        residual_.segment<3>(at6(i) + 3) -=
            rod_inertia(rod_, int(i))
                .cwiseProduct(rotation_matrix(middle.nodes[i].q).transpose() * spin);
}

double RodBody::end_memory()
{
    // What implicit Euler takes of the change's energy, (theta - 1/2) (dv M dv + dx df), and the
    // damping. The filtered rule: mean rates less the trapezoid's.
    const TimeRule& rule = step_.rule;
    const double h = step_.h;
    double taken = 0;
    const auto inner = [&](const Eigen::VectorXd& missing) { // as far as loads do not change it
        Eigen::VectorXd f = -missing;
        for (std::size_t i = 0; i < load_.size(); ++i)
            f.segment<6>(at6(i)) += ConstMap6(load_[i].value);
        return f;
    };
    const Eigen::VectorXd inner_start = inner(missing_forces(state_, step_.start)),
                          missing = missing_forces(now_, step_.end()), inner_end = inner(missing);
    const double excess = rule.end - 0.5;
    const Motion middle = this->middle();
    if (material_) take_sheath_end(middle.end);
    for_moving_mass(middle, [&](int e, double mass, double, double at_end, double at_start) {
        const Vec3 now = point_velocity(now_, now_.velocity, e, at_end),
                   before = point_velocity(state_, state_.velocity, e, at_start);
        const Vec3 mean = rule.end * now + (1 - rule.end) * before;
        taken += damping_ * h * mass * mean.squaredNorm();
        if (!rule.filtered) {
            taken += excess * mass * (now - before).squaredNorm();
        } else {
            const Vec3 moved = place_on(now_, e, at_end).x - place_on(state_, e, at_start).x;
            taken += mass * (moved / h - 0.5 * (now + before)).dot(now - before);
        }
    });
    if (material_) take_sheath_end(now_.end);
    for (std::size_t i = 0; i < now_.nodes.size() && !rule.filtered; ++i)
        taken += excess * (inner_end - inner_start).segment<6>(at6(i)).dot(moved_[i]);
    if (compliant_in_sheath() && !rule.filtered) { // its base moves as it is led
        const std::array<double, 2> start = base_forces(state_.end), end = base_forces(now_.end);
        taken += excess * ((end[0] - start[0]) * (now_.end.fed - state_.end.fed) +
                           (end[1] - start[1]) * (now_.end.turned - state_.end.turned));
    }
    if (!rule.filtered) return taken;
    Memory m = memory_at_start_;
    for (std::size_t i = 0; i < now_.nodes.size(); ++i) {
        const Vec6 force = missing.segment<6>(at6(i));
        m.velocity[i] = rule.next(now_.velocity[i], state_.velocity[i], m.velocity[i]);
        m.force[i] = rule.next(force, m.force_now[i], m.force[i]);
        m.force_now[i] = force;
    }
    const Vec3 moment = moment_of_loads(now_); // load_ is that of the end
    m.moment = rule.next(moment, m.moment_now, m.moment);
    m.moment_now = moment;
    memory_ = std::move(m);
    return taken;
}

double RodBody::speed() const
{
    double most = 0;
    for (const Vec6& v : state_.velocity)
        most = std::max(most, v.head<3>().norm());
    if (material_ && step_.dynamic) // as fast as it is fed from here on
        most = std::max(most, std::abs(led_.fed - state_.end.fed) / step_.h);
    return most;
}

double RodBody::kinetic_energy() const
{
    if (std::ranges::all_of(state_.velocity, [](const Vec6& v) { return v.isZero(0); })) return 0;
    double sum = 0;
    const int first = material_ ? sheath_.node : 0;
    for_mass_points(
        rod_,
        [&](int e, double mass, double xi) {
            sum += 0.5 * mass * point_velocity(state_, state_.velocity, e, xi).squaredNorm();
        },
        first);
    for (auto i = std::size_t(first); i < state_.nodes.size(); ++i) {
        const Vec3 w = state_.velocity[i].tail<3>();
        sum += 0.5 * w.dot(rod_inertia(rod_, int(i), first).cwiseProduct(w));
    }
    return sum;
}

Vec3 RodBody::momentum() const
{
    Vec3 sum = Vec3::Zero();
    for_mass_points(
        rod_,
        [&](int e, double mass, double xi) {
            sum += mass * point_velocity(state_, state_.velocity, e, xi);
        },
        material_ ? sheath_.node : 0);
    return sum;
}

Vec3 RodBody::angular_momentum() const
{
    Vec3 sum = Vec3::Zero();
    const int first = material_ ? sheath_.node : 0;
    for_mass_points(
        rod_,
        [&](int e, double mass, double xi) {
            sum += mass *
                   place_on(state_, e, xi).x.cross(point_velocity(state_, state_.velocity, e, xi));
        },
        first);
    for (auto i = std::size_t(first); i < state_.nodes.size(); ++i)
        sum += rotation_matrix(state_.nodes[i].q) *
               rod_inertia(rod_, int(i), first).cwiseProduct(state_.velocity[i].tail<3>());
    return sum;
}

std::vector<double> RodBody::state() const
{
    std::vector<double> s;
    s.reserve(64 * state_.nodes.size());
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
    add(material_ ? accepted_.velocity : state_.velocity);
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
                           accepted_.end.rotation, push_, torque_, most_fed_})
        s.push_back(x);
    for (const Vec3& v : {memory_.moment, memory_.moment_now})
        s.insert(s.end(), v.data(), v.data() + 3);
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
                      &accepted_.end.rotation, &push_, &torque_, &most_fed_})
        *x = state[at++];
    take(memory_.moment.data(), 3);
    take(memory_.moment_now.data(), 3);
    if (material_) {
        accepted_.nodes = state_.nodes;
        accepted_.velocity = state_.velocity;
        accepted_.acting = acting_;
        state_.end = accepted_.end;
        move_sheath_end(accepted_.end);
    }
    const bool path = state[at++] != 0;
    path_.resize(path ? unknowns() : 0);
    if (path) take(path_.data(), std::size_t(unknowns()));
    now_ = state_;
}

bool RodBody::rests_in_first_shape() const
{
    const bool natural = input_.shape.points.empty() && !input_.shape.has_curve();
    return !material_ && (natural || input_.shape.stress_free);
}

void RodBody::swap_velocities(std::vector<double>& velocities)
{
    velocities.resize(6 * state_.velocity.size());
    auto other = velocities.begin();
    for (Vec6& v : state_.velocity)
        for (double& component : v)
            std::swap(component, *other++);
}

} // namespace amontons
