#include "solver/body/rigid_body.hpp"

#include "mesh/base/curve.hpp"
#include "mesh/base/dense.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/rigid_turn.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

// In a step of motion that does not follow them, contacts are as the step found them at its start,
// and so are their arms: after some iterations the centre has moved on, and an arm from there would
// be off by what the body slides in a step; so would one from where the step has ended, when its
// contacts are condensed for the hand. The anchors of joints move along with the iterate.
bool is_of_start(const BodyPlace& at, const StepInput& step)
{
    return step.dynamic && !step.follows && !at.half_way;
}

Vec3 arm_of(const BodyPlace& at, const StepInput& step, const Vec3& start, const Vec3& now)
{
    return at.point - (is_of_start(at, step) ? start : now);
}

} // namespace

RigidBody::RigidBody(const RigidInput& input, RigidShape shape, const MassProperties& mass)
    : input_(input)
    , shape_(std::move(shape))
    , mass_(mass)
{
    size_ = bounding_radius(shape_);
    const Placement start = amontons::start_placement(input.start);
    state_.turn = start.turn;
    state_.centre = start * mass_.centre;
    state_.velocity = input.start.velocity;
    state_.spin = input.start.spin;
    if (driven()) state_ = driven_motion(0);
    angular_ = inertia(state_.turn) * state_.spin;
    now_ = state_;
    if (mass_.mass > 0) inverse_inertia_ = mass_.inertia.inverse();
}

Placement RigidBody::placement_of(const Motion& m) const
{
    return {m.turn, m.centre - m.turn * mass_.centre};
}

Placement RigidBody::free_placement(const StepInput& step) const
{
    if (driven()) return placement_of(driven_motion(step.end()));
    Motion m = state_;
    m.centre += step.h * (m.velocity + step.h * step.gravity);
    m.turn = rotation(step.h * m.spin) * m.turn;
    return placement_of(m);
}

std::vector<LiveCurve> RigidBody::live_curves()
{
    std::vector<LiveCurve> all;
    if (driven()) add_drive(input_.name, input_.drive, all);
    if (!(input_.force.isZero(0) && input_.torque.isZero(0)))
        all.push_back({input_.name + ".over", "", &input_.over, 1});
    return all;
}

RigidBody::Motion RigidBody::driven_motion(double t) const
{
    const Placement p =
        driven_to_ ? *driven_to_
                   : driven_placement(input_.drive, amontons::start_placement(input_.start),
                                      mass_.centre, t);
    Motion m;
    m.turn = p.turn;
    m.centre = p * mass_.centre;
    return m;
}

double RigidBody::prescribed_motion(double from, double to) const
{
    if (!driven()) return 0;
    const Motion a = driven_motion(from), b = driven_motion(to);
    return (b.centre - a.centre).norm() + a.turn.angularDistance(b.turn) * 2 * size_;
}

void RigidBody::swap_velocities(std::vector<double>& velocities)
{
    velocities.resize(6);
    for (int i = 0; i < 3; ++i) {
        std::swap(velocities[std::size_t(i)], state_.velocity[i]);
        std::swap(velocities[std::size_t(3 + i)], state_.spin[i]);
    }
    angular_ = inertia(state_.turn) * state_.spin;
}

Mat3 RigidBody::inertia(const Eigen::Quaterniond& turn) const
{
    const Mat3 R = turn.toRotationMatrix();
    return R * mass_.inertia * R.transpose();
}

Vec3 RigidBody::force(double t) const
{
    return step_.load * (input_.over.empty() ? 1.0 : curve_value(input_.over, t)) * input_.force +
           mass_.mass * step_.gravity;
}

Vec3 RigidBody::torque(double t) const
{
    return step_.load * (input_.over.empty() ? 1.0 : curve_value(input_.over, t)) * input_.torque;
}

void RigidBody::begin(const StepInput& step)
{
    step_ = step;
    now_ = state_;
    begun_ = state_.centre;
    modes_.resize(6, 0);
    if (driven()) {
        modes_.resize(0, 0);
        drive(step.end());
    } else if (step.dynamic) { // the iterate stands where the step starts
        begin_memory();
        now_.velocity = -past_velocity_ / step.rule.end;
        now_.spin = -past_spin_ / step.rule.end;
        now_angular_ = -past_angular_ / step.rule.end;
        mean_spin_.setZero();
    } else { // nothing but contacts holds it; turns are measured by the path at its size
        modes_ = Eigen::MatrixXd::Identity(6, 6);
        modes_.bottomRightCorner(3, 3) /= size_;
    }
}

/// To where it is led, with the velocity that this takes.
void RigidBody::drive(double t)
{
    now_ = driven_motion(t);
    if (step_.h > 0) {
        now_.velocity = (now_.centre - state_.centre) / step_.h;
        now_.spin = rotation_vector(now_.turn * state_.turn.conjugate()) / step_.h;
    }
}

bool RigidBody::reset_to_start()
{
    if (driven()) now_ = state_;
    return driven();
}

void RigidBody::drive_to(const Placement& at)
{
    driven_to_ = at;
    drive(step_.end());
}

/// What is known of the step's means: all but the shares of velocity and spin at its end.
void RigidBody::begin_memory()
{
    const TimeRule& rule = step_.rule;
    if (!rule.filtered) {
        const double middle = step_.start + rule.end * step_.h;
        mean_force_ = force(middle);
        mean_torque_ = torque(middle);
        past_velocity_ = rule.start * state_.velocity;
        past_angular_ = rule.start * angular_;
        past_spin_ = rule.start * state_.spin;
        return;
    }
    const Vec3 f = force(step_.start), m = torque(step_.start);
    if (!memory_.begun) memory_ = {true, state_.velocity, state_.turn.conjugate() * angular_, f, m};
    mean_force_ = rule.end * force(step_.end()) + rule.past(f, memory_.force);
    mean_torque_ = rule.end * torque(step_.end()) + rule.past(m, memory_.torque);
    past_velocity_ = rule.past(state_.velocity, memory_.velocity);
    past_angular_ = rule.past(angular_, Vec3(state_.turn * memory_.angular));
    past_spin_ = solve_symmetric(inertia(state_.turn), past_angular_);
}

/// The end of a step of second order under these impulses of contacts and joints.
/// @param moment  about reference() [N m s]
void RigidBody::move_by(const Vec3& impulse, const Vec3& moment)
{
    const double h = step_.h, share = step_.rule.end;
    now_.velocity = state_.velocity + (h * mean_force_ + impulse) / mass_.mass;
    now_.centre = state_.centre + h * (share * now_.velocity + past_velocity_);
    now_angular_ = angular_ + h * mean_torque_ + moment;
    const Eigen::Quaterniond back = state_.turn.conjugate();
    mean_spin_ = state_.turn * amontons::mean_spin(mass_.inertia, inverse_inertia_, h, share,
                                                   back * now_angular_, back * past_angular_,
                                                   back * mean_spin_);
    now_.turn = (cayley_turn(h * mean_spin_) * state_.turn).normalized();
    now_.spin = now_.turn * (inverse_inertia_ * (now_.turn.conjugate() * now_angular_));
}

/// About which moments of contacts and joints are taken in a step of second order: followed ones
/// act half way, others where the step starts, on a centre that continues (see accept()).
Vec3 RigidBody::reference() const
{
    return step_.follows ? Vec3(0.5 * (state_.centre + now_.centre))
                         : Vec3(state_.centre + step_.h * past_velocity_);
}

/// Half way through a step of second order, at the iterate in others [1/(kg m^2)].
Mat3 RigidBody::inverse_inertia() const
{
    if (!second_order()) return inertia(now_.turn).inverse();
    Eigen::Quaterniond half = now_.turn;
    half.coeffs() += (half.dot(state_.turn) < 0 ? -1 : 1) * state_.turn.coeffs();
    const Mat3 R = half.normalized().toRotationMatrix();
    return R * inverse_inertia_ * R.transpose();
}

/// The motion of the step at its mean place, of bodies that are followed: a point of the body that
/// moves there on average moves by shift + turn x (its mean place - the centre's).
RigidBody::MeanMotion RigidBody::mean_motion() const
{
    return {now_.centre - state_.centre,
            driven() ? cayley_vector(now_.turn * state_.turn.conjugate())
                     : Vec3(step_.h * mean_spin_),
            0.5 * (state_.centre + now_.centre)};
}

/// The place that the velocity of the iterate leads to.
void RigidBody::move_with_velocity()
{
    const double a = step_.rule.end;
    now_.centre = state_.centre + step_.h * (a * now_.velocity + past_velocity_);
    now_.turn = rotation(step_.h * (a * now_.spin + past_spin_)) * state_.turn;
    now_.turn.normalize();
}

void RigidBody::add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                           std::vector<Eigen::Triplet<double>>& out) const
{
    if (driven()) return;
    if (at.turns) {
        for (int i = 0; i < 3; ++i)
            out.emplace_back(3 + i, column, scale * direction[i]);
        return;
    }
    const Vec3 moment = lever(at).cross(direction);
    for (int i = 0; i < 3; ++i) // ascending, so that columns need not be sorted
        out.emplace_back(i, column, scale * direction[i]);
    for (int i = 0; i < 3; ++i)
        out.emplace_back(3 + i, column, scale * moment[i]);
}

void RigidBody::add_force(const BodyPlace& at, const Vec3& force, Eigen::VectorXd& on) const
{
    if (driven()) return;
    if (!at.turns) on.head<3>() += force;
    on.tail<3>() += at.turns ? force : Vec3(lever(at).cross(force));
}

/// The arm by which forces at a place turn the body.
Vec3 RigidBody::lever(const BodyPlace& at) const
{
    return step_.follows ? Vec3(at.point - 0.5 * (state_.centre + now_.centre))
                         : arm_of(at, step_, begun_, now_.centre);
}

Vec3 RigidBody::displacement(const BodyPlace& at) const
{
    if (at.turns) {
        if (step_.follows) return mean_motion().turn;
        return rotation_vector(now_.turn * state_.turn.conjugate());
    }
    if (step_.follows) {
        const MeanMotion m = mean_motion();
        return m.shift + m.turn.cross(at.point - m.centre);
    }
    if (step_.dynamic && !driven()) { // by the velocities: what forces there work on
        const Vec3 arm = at.point - state_.centre;
        return step_.h * (step_.rule.end * (now_.velocity + now_.spin.cross(arm)) + past_velocity_ +
                          past_spin_.cross(arm));
    }
    // A body of revolution that turns about its axis rolls: ever other material comes to where it
    // touches. What has come past there is the turn's arc; what touches at the end has moved by the
    // chord, which falls short of it by a share that grows with the step.
    const Vec3 turned = rotation_vector(now_.turn * state_.turn.conjugate());
    if (is_of_revolution_about(now_.turn.conjugate() * turned)) {
        const Placement from = placement_of(state_), to = placement_of(now_);
        return to.shift - from.shift + turned.cross(at.point - to.shift);
    }
    const Vec3 arm = now_.turn.conjugate() * (at.point - now_.centre);
    return at.point - (state_.centre + state_.turn * arm);
}

/// Of the shape, and an axis through its origin in its frame.
bool RigidBody::is_of_revolution_about(const Vec3& axis) const
{
    if (std::holds_alternative<Ball>(shape_)) return true;
    constexpr double kAside = 1e-6;
    const bool round =
        std::holds_alternative<Cylinder>(shape_) || std::holds_alternative<Capsule>(shape_);
    return round && axis.head<2>().norm() <= kAside * std::abs(axis.z());
}

Vec3 RigidBody::iterate_velocity(const BodyPlace& at) const
{
    if (at.turns) return now_.spin;
    return now_.velocity + now_.spin.cross(arm_of(at, step_, begun_, now_.centre));
}

Vec3 RigidBody::start_velocity(const BodyPlace& at) const
{
    if (at.turns) return state_.spin;
    const Vec3 arm = arm_of(at, step_, begun_, now_.centre);
    return state_.velocity +
           state_.spin.cross(
               is_of_start(at, step_) ? arm : Vec3(state_.turn * (now_.turn.conjugate() * arm)));
}

Vec3 RigidBody::past_velocity(const BodyPlace& at) const
{
    if (driven()) return (1 - step_.rule.end) * iterate_velocity(at);
    if (at.turns) return past_spin_;
    const Vec3 arm = arm_of(at, step_, begun_, now_.centre);
    return past_velocity_ +
           past_spin_.cross(
               is_of_start(at, step_) ? arm : Vec3(state_.turn * (now_.turn.conjugate() * arm)));
}

Eigen::VectorXd RigidBody::free_change() const
{
    Eigen::VectorXd y = Eigen::VectorXd::Zero(unknowns());
    if (driven() || !step_.dynamic) return y;
    const double h = step_.h;
    const Vec3 momentum = angular_ + h * mean_torque_;
    y.head<3>() = state_.velocity + h / mass_.mass * mean_force_ - now_.velocity;
    y.tail<3>() = second_order() ? Vec3(inverse_inertia() * (momentum - now_angular_))
                                 : Vec3(solve_symmetric(inertia(now_.turn), momentum) - now_.spin);
    return y;
}

void RigidBody::compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    if (driven() || !step_.dynamic) {
        W.setZero(C.cols(), C.cols());
        return;
    }
    const Eigen::MatrixXd H = C;
    const Mat3 J = inverse_inertia();
    const Eigen::MatrixXd velocity = H.topRows(3) / mass_.mass,
                          spin = 0.5 * (J + J.transpose()) * H.bottomRows(3);
    // Of three rows each: a general product takes several times as long.
    const Eigen::Index n = H.cols();
    W.resize(n, n);
    for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = 0; i < n; ++i) {
            double shifted = 0, turned = 0;
            for (Eigen::Index k = 0; k < 3; ++k) {
                shifted += H(k, i) * velocity(k, j);
                turned += H(3 + k, i) * spin(k, j);
            }
            W(i, j) = shifted + turned;
        }
    for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = 0; i < j; ++i)
            W(i, j) = W(j, i) = 0.5 * (W(i, j) + W(j, i));
}

Eigen::VectorXd RigidBody::solve(const Eigen::VectorXd& f)
{
    Eigen::VectorXd y = Eigen::VectorXd::Zero(unknowns());
    if (driven() || !step_.dynamic) return y;
    y.head<3>() = f.head<3>() / mass_.mass;
    y.tail<3>() = second_order() ? Vec3(inverse_inertia() * f.tail<3>())
                                 : solve_symmetric(inertia(now_.turn), f.tail<3>());
    return y;
}

Eigen::VectorXd RigidBody::mode_load() const
{
    if (modes_.cols() == 0) return {};
    Eigen::VectorXd load(6);
    load << force(step_.end()), torque(step_.end());
    return modes_.transpose() * load;
}

std::string RigidBody::mode_name(const Eigen::VectorXd& a) const
{
    const Eigen::VectorXd motion = modes_ * a;
    return name_of_motion(motion.head<3>(), size_ * motion.tail<3>());
}

void RigidBody::update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                       const Eigen::VectorXd& force)
{
    if (driven()) return;
    if (second_order()) {
        move_by(force.head<3>(), force.tail<3>());
        return;
    }
    if (step_.dynamic) {
        now_.velocity += y.head<3>();
        now_.spin += y.tail<3>();
        move_with_velocity();
        return;
    }
    const Eigen::VectorXd shift = modes_ * mode;
    now_.centre += shift.head<3>();
    now_.turn = rotation(shift.tail<3>()) * now_.turn;
    now_.turn.normalize();
}

void RigidBody::add_reaction(const Vec3& force, const Vec3& torque)
{
    carried_ = force;
    const Vec3 middle = step_.follows ? Vec3(0.5 * (state_.centre + now_.centre)) : now_.centre;
    carried_torque_ = torque - middle.cross(force);
}

BodyEnergy RigidBody::accept(const Eigen::VectorXd& contact)
{
    BodyEnergy e;
    const double kinetic_before = kinetic_energy();
    if (second_order()) {
        Vec3 impulse = Vec3::Zero(), moment = Vec3::Zero();
        if (contact.size() == 6) {
            impulse = contact.head<3>();
            moment = contact_moment_ ? Vec3(*contact_moment_ - reference().cross(impulse))
                                     : Vec3(contact.tail<3>());
        }
        move_by(impulse, moment);
        return accept_second_order();
    }
    const Vec3 moved = now_.centre - state_.centre;
    const Vec3 turned =
        step_.follows ? mean_motion().turn : rotation_vector(now_.turn * state_.turn.conjugate());
    if (driven()) {
        const double before = step_.dynamic ? 0 : 0.5, after = 1 - before;
        e.work = -(before * carried_before_ + after * carried_).dot(moved) -
                 (before * torque_before_ + after * carried_torque_).dot(turned);
        angular_ = inertia(now_.turn) * now_.spin;
        carried_before_ = carried_;
        torque_before_ = carried_torque_;
    } else {
        // At rest by the rule of the trapezoid, as the work of all other forces.
        const Vec3 f = step_.dynamic ? mean_force_
                                     : Vec3(0.5 * (force(step_.start) + force(step_.end()))),
                   m = step_.dynamic ? mean_torque_
                                     : Vec3(0.5 * (torque(step_.start) + torque(step_.end())));
        e.work = f.dot(moved) + m.dot(turned);
        e.work_absolute = std::abs(e.work);
        if (step_.dynamic) {
            // Momentum first, from the forces alone. The turn follows by the midpoint rule, which
            // keeps the energy of a body left alone; the spin from the turn reached.
            const Vec3 before = angular_;
            angular_ += step_.h * mean_torque_;
            if (contact.size() == 6) {
                const Vec3 impulse = contact.head<3>(),
                           centre = state_.centre + step_.h * past_velocity_;
                angular_ += contact_moment_ ? Vec3(*contact_moment_ - centre.cross(impulse))
                                            : Vec3(contact.tail<3>());
            }
            const Vec3 momentum = step_.rule.end * angular_ + past_angular_;
            constexpr int kTurns = 8; // each brings h |spin| of the error's digits
            Eigen::Quaterniond half = now_.turn;
            for (int i = 0; i < kTurns; ++i) {
                const Eigen::Quaterniond last = half;
                half = rotation(0.5 * step_.h * solve_symmetric(inertia(half), momentum)) *
                       state_.turn;
                if (half.coeffs() == last.coeffs()) break; // all others would be the same
            }
            const Vec3 spin = solve_symmetric(inertia(half), momentum);
            now_.turn = (rotation(step_.h * spin) * state_.turn).normalized();
            now_.spin = solve_symmetric(inertia(now_.turn), angular_);
            // What the rule takes: the change of momentum times the excess of the mean velocity.
            const Vec3 dv = now_.velocity - state_.velocity, dL = angular_ - before;
            const Vec3 faster = moved / step_.h - state_.velocity - 0.5 * dv;
            e.dissipated = mass_.mass * dv.dot(faster) +
                           dL.dot(solve_symmetric(inertia(half), momentum - before - 0.5 * dL));
        }
    }
    contact_moment_.reset();
    state_ = now_;
    e.kinetic = step_.dynamic ? kinetic_energy() : 0;
    if (driven()) { // with what moves the body itself, its weight included
        if (step_.dynamic) e.work += e.kinetic - kinetic_before;
        e.work_absolute = std::abs(e.work);
    }
    return e;
}

/// The iterate of a step of second order becomes the state.
BodyEnergy RigidBody::accept_second_order()
{
    BodyEnergy e;
    const MeanMotion m = mean_motion();
    e.work = mean_force_.dot(m.shift) + mean_torque_.dot(m.turn);
    e.work_absolute = std::abs(e.work);
    // What the rule takes: the changes of momenta times the excess of the mean velocities.
    const Vec3 dv = now_.velocity - state_.velocity;
    const Vec3 faster = m.shift / step_.h - state_.velocity - 0.5 * dv;
    const Vec3 before = state_.turn.conjugate() * angular_,
               after = now_.turn.conjugate() * now_angular_;
    e.dissipated = mass_.mass * dv.dot(faster) + (now_angular_ - angular_).dot(mean_spin_) -
                   0.5 * (after - before).dot(inverse_inertia_ * (after + before));
    if (step_.rule.filtered) {
        const TimeRule& rule = step_.rule;
        const Vec3 f0 = force(step_.start), m0 = torque(step_.start);
        memory_.force = rule.next(force(step_.end()), f0, memory_.force);
        memory_.torque = rule.next(torque(step_.end()), m0, memory_.torque);
        memory_.velocity = rule.next(now_.velocity, state_.velocity, memory_.velocity);
        memory_.angular = rule.next(after, before, memory_.angular);
    }
    contact_moment_.reset();
    angular_ = now_angular_;
    state_ = now_;
    e.kinetic = kinetic_energy();
    return e;
}

double RigidBody::kinetic_energy() const
{
    return 0.5 * mass_.mass * state_.velocity.squaredNorm() + 0.5 * state_.spin.dot(angular_);
}

Vec3 RigidBody::momentum() const
{
    return mass_.mass * state_.velocity;
}

Vec3 RigidBody::angular_momentum() const
{
    return angular_ + mass_.mass * state_.centre.cross(state_.velocity);
}

std::vector<double> RigidBody::state() const
{
    std::vector<double> s;
    const auto add = [&](const auto& v) { s.insert(s.end(), v.data(), v.data() + v.size()); };
    add(state_.centre);
    add(state_.turn.coeffs());
    add(state_.velocity);
    add(state_.spin);
    add(angular_);
    s.push_back(memory_.begun ? 1 : 0);
    for (const Vec3& v : {memory_.velocity, memory_.angular, memory_.force, memory_.torque})
        add(v);
    add(carried_before_);
    add(torque_before_);
    return s;
}

void RigidBody::set_state(std::span<const double> s)
{
    const auto take = [&](auto& v) {
        std::copy_n(s.begin(), v.size(), v.data());
        s = s.subspan(static_cast<std::size_t>(v.size()));
    };
    take(state_.centre);
    begun_ = state_.centre;
    take(state_.turn.coeffs());
    take(state_.velocity);
    take(state_.spin);
    take(angular_);
    memory_.begun = s.front() != 0;
    s = s.subspan(1);
    for (Vec3* v : {&memory_.velocity, &memory_.angular, &memory_.force, &memory_.torque})
        take(*v);
    take(carried_before_);
    take(torque_before_);
    now_ = state_;
}

} // namespace amontons
