#include "solver/body/solid_body.hpp"
#include "solver/body/node_index.hpp"

#include "mesh/base/curve.hpp"
#include "mesh/base/dense.hpp"
#include "solver/body/drive.hpp"
#include "solver/solid/face_load.hpp"
#include "solver/solid/factor_cache.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>
#include <set>

namespace amontons {

SolidBody::SolidBody(const SolidInput& input, VolumeMesh mesh, bool small,
                     std::span<const char> touching, const std::string& file)
    : model_(input, std::move(mesh), small, file)
{
    nonlinear_ = model_.nonlinear();
    size_ = model_.size;
    corotated_.exact_tangent = model_.corotational;
    if (model_.hyperelastic) {
        hyper_ = hyperelastic_part(model_);
        volumes_ = volume_loads(model_);
    }
    may_touch(touching);

    const std::size_t n = model_.mesh.nodes.size();
    state_.frame = frame_at(0);
    state_.u = Eigen::VectorXd::Zero(at3(n));
    state_.v = Eigen::VectorXd::Zero(at3(n));
    state_.x.resize(n);
    update_places(state_);
    first_.x = state_.x; // before what is prescribed at the start
    first_.frame = state_.frame;
    first_.momentum = Late<Eigen::VectorXd>([this] {
        return model_.material.density > 0 ? mass_times(model_, state_.v) : Eigen::VectorXd();
    });
    apply_holds(model_, 0, state_.u);
    update_places(state_);
    if (input.start.spin.isZero(0)) {
        for (std::size_t i = 0; i < n; ++i)
            state_.v.segment<3>(at3(i)) = input.start.velocity;
    } else {
        const Vec3 c = centre_of_mass(model_, state_.x);
        for (std::size_t i = 0; i < n; ++i)
            state_.v.segment<3>(at3(i)) =
                input.start.velocity + input.start.spin.cross(state_.x[i] - c);
    }
    now_ = state_;
    contact_.on_unknowns = contact_.held = contact_.firm = at_state_.contact = at_state_.reaction =
        Eigen::VectorXd::Zero(at3(n));
}

void SolidBody::also_touch(const Patch& patch)
{
    std::vector<char> touching(model_.mesh.nodes.size(), 0);
    for (const std::int32_t i : unknowns_.touching)
        touching[std::size_t(i)] = 1;
    for (const PatchNode& n : patch.nodes)
        touching[std::size_t(n.node)] = 1;
    may_touch(touching);
}

double SolidBody::inner_forces(const Motion& m, Eigen::VectorXd& f)
{
    const int threads = solving_.threads;
    if (model_.hyperelastic) return hyperelastic_inner(model_, threads, m, hyper_, known_, f);
    if (model_.corotational) return corotational_inner(model_, threads, m, corotated_, known_, f);
    f = stiffness_times(model_, *matrix_, threads, m.u);
    return 0.5 * m.u.dot(f);
}

void SolidBody::begin(const StepInput& step)
{
    step_ = step;
    now_ = state_;
    free_.known = false;
    contact_.held.setZero();
    if (model_.hyperelastic) begin_hyperelastic();
    if (model_.hyperelastic && !step.dynamic) { // what is prescribed moves with the first change
        if (frame_kind() == SolidFrame::driven) now_.frame = frame_at(step.end());
        Eigen::VectorXd end = now_.u;
        apply_holds(model_, step.end(), end);
        search_.pending = end - now_.u;
        if (search_.pending.isZero(0)) search_.pending.resize(0);
        update_places(now_);
        return;
    }
    if (!step.dynamic) {
        if (frame_kind() == SolidFrame::driven) now_.frame = frame_at(step.end());
        apply_holds(model_, step.end(), now_.u);
        update_places(now_);
        return;
    }
    if (at_state_.momentum.size() == 0) at_state_.momentum = *first_.momentum;
    // The iterate stands where the step starts, but for what is prescribed.
    const double h = step.h;
    if (!step.rule.filtered) {
        past_.velocity = step.rule.start * state_.v;
    } else {
        if (!memory_.begun) { // forces at the state, which are those of now_ too
            Eigen::VectorXd elastic;
            inner_forces(now_, elastic);
            const Eigen::VectorXd damping =
                damping_forces(model_, *matrix_, solving_.threads, corotated_, now_);
            begin_memory(state_.v, into_space(now_, elastic), into_space(now_, elastic + damping),
                         into_space(now_, load_forces(model_, step_, volumes_, now_, step.start)),
                         memory_);
        }
        past_ = past_shares(step.rule, memory_, state_.v);
    }
    if (frame_kind() == SolidFrame::driven) now_.frame = frame_at(step.end());
    apply_holds(model_, step.end(), now_.u);
    if (frame_kind() == SolidFrame::floating) {
        // Where the frame will be if the body turns on as it does, where the rule takes elastic
        // forces: they are linear in it, and the turn left for u is of second order.
        if (!at_state_.spin) at_state_.spin = mean_spin(model_, state_);
        const double taken = step.rule.filtered ? h : h * step.rule.end;
        const Eigen::Quaterniond turn = rotation(taken * *at_state_.spin);
        const Vec3 x = centre_of_mass(model_, state_.x),
                   X = centre_of_mass(model_, model_.mesh.nodes);
        now_.frame.turn = (turn * state_.frame.turn).normalized();
        now_.frame.shift = x - now_.frame.turn * X;
        into_frame_displacements(model_, now_);
    } else if (frame_kind() == SolidFrame::driven || !model_.conditions.held.empty()) {
        update_places(now_);
    }
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.v.segment<3>(at3(i)) =
            ((now_.x[i] - state_.x[i]) / h - Vec3(past_.velocity.segment<3>(at3(i)))) /
            step.rule.end;
}

Eigen::VectorXd SolidBody::residual(Eigen::VectorXd& scale)
{
    // Along the frame's axes. Dynamic: the change of momentum over the step that is missing.
    if (!step_.dynamic) {
        Eigen::VectorXd inner;
        inner_forces(now_, inner);
        Eigen::VectorXd f = load_forces(model_, step_, volumes_, now_, step_.end());
        scale = f.cwiseAbs() + (model_.hyperelastic ? hyper_.force_size : inner.cwiseAbs());
        last_.load = f;
        return f - inner;
    }
    return step_.rule.filtered ? filtered_residual(scale) : theta_residual(scale);
}

Eigen::VectorXd SolidBody::theta_residual(Eigen::VectorXd& scale)
{
    Eigen::VectorXd inner;
    const double h = step_.h, theta = step_.rule.end;
    Motion between;
    if (theta < 1) {
        between = now_;
        Motion& middle = between;
        middle.version = ++known_.last_version;
        for (std::size_t i = 0; i < middle.x.size(); ++i)
            middle.x[i] = (1 - theta) * state_.x[i] + theta * now_.x[i];
        if (frame_kind() == SolidFrame::driven) middle.frame = frame_at(step_.start + theta * h);
        into_frame_displacements(model_, middle);
    }
    const Motion& middle = theta < 1 ? between : now_;
    inner_forces(middle, inner);
    if (nonlinear_) last_.inner = inner;
    const Eigen::VectorXd f = load_forces(model_, step_, volumes_, middle, step_.start + theta * h);
    last_.load = f;
    Eigen::VectorXd change = now_.v - state_.v;
    Eigen::VectorXd mean_v = theta * now_.v + (1 - theta) * state_.v;
    const bool damps = model_.input.stiffness_damping > 0;
    Eigen::VectorXd rate_v = damps ? into_frame(now_, mean_v) : Eigen::VectorXd();
    if (middle.frame.turn.coeffs() != now_.frame.turn.coeffs()) {
        // Forces turn from the frame they were found in to that of the iterate.
        const Mat3 turn = (now_.frame.turn.conjugate() * middle.frame.turn).toRotationMatrix();
        Eigen::Map<Eigen::Matrix3Xd> g(inner.data(), 3, inner.size() / 3);
        g = (turn * g).eval();
        if (damps) {
            Eigen::Map<Eigen::Matrix3Xd> v(rate_v.data(), 3, rate_v.size() / 3);
            v = (turn.transpose() * v).eval();
            last_.rate_forces = rate_forces(model_, *matrix_, solving_.threads, corotated_, rate_v);
            Eigen::Map<Eigen::Matrix3Xd> d(last_.rate_forces.data(), 3, rate_v.size() / 3);
            d = (turn * d).eval();
        }
    } else if (damps) {
        last_.rate_forces = rate_forces(model_, *matrix_, solving_.threads, corotated_, rate_v);
    }
    const Eigen::VectorXd momentum = into_frame(now_, mass_times(model_, change));
    scale = momentum.cwiseAbs() + h * (f.cwiseAbs() + inner.cwiseAbs());
    Eigen::VectorXd r = h * (f - inner) - momentum;
    if (model_.input.mass_damping > 0)
        r -= h * model_.input.mass_damping * into_frame(now_, mass_times(model_, mean_v));
    if (damps) r -= h * model_.input.stiffness_damping * last_.rate_forces;
    return r;
}

Eigen::VectorXd SolidBody::filtered_residual(Eigen::VectorXd& scale)
{
    Eigen::VectorXd inner;
    inner_forces(now_, inner);
    last_.elastic = into_space(now_, inner);
    inner = step_.rule.end *
                (inner + damping_forces(model_, *matrix_, solving_.threads, corotated_, now_)) +
            into_frame(now_, past_.inner);
    last_.inner = into_space(now_, inner);
    last_.load = step_.rule.end * load_forces(model_, step_, volumes_, now_, step_.end()) +
                 into_frame(now_, past_.load);
    const Eigen::VectorXd momentum = into_frame(now_, mass_times(model_, now_.v - state_.v));
    scale = momentum.cwiseAbs() + step_.h * (last_.load.cwiseAbs() + inner.cwiseAbs());
    return step_.h * (last_.load - inner) - momentum;
}

bool SolidBody::reset_to_start()
{
    const bool prescribed = frame_kind() == SolidFrame::driven ||
                            std::ranges::any_of(model_.conditions.held, [&](const auto& h) {
                                return moves(model_.conditions, h);
                            });
    if (prescribed) now_ = state_;
    return prescribed;
}

void SolidBody::linearise()
{
    if (!prepared()) prepare();
    if (free_.known) return;
    if (model_.hyperelastic) return linearise_hyperelastic();
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    make_matrix();
    if (solving_.iterative) {
        free_.load = r;
        for (const std::int32_t dof : unknowns_.dofs.fixed)
            free_.load[dof] = 0;
        free_.change = Eigen::VectorXd::Zero(unknowns());
        free_.mode_load.resize(0);
        return;
    }
    if (model_.corotational && unknowns_.modes.cols() > 0) turn_modes(model_, now_, unknowns_);
    const Eigen::VectorXd rf = free_part(unknowns_, r);
    free_.change = with_pins(unknowns_, solved(model_, unknowns_, *matrix_, border_, rf));
    if (unknowns_.modes.cols() > 0)
        free_.mode_load = unknowns_.rigid->R.transpose() * r;
    else
        free_.mode_load.resize(0);
}

void SolidBody::update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                       const Eigen::VectorXd& force)
{
    contact_.on_unknowns.setZero();
    for (std::size_t i = 0; i < unknowns_.dof.size(); ++i)
        contact_.on_unknowns[unknowns_.dof[i]] = force[Eigen::Index(i)];
    Eigen::VectorXd whole = Eigen::VectorXd::Zero(at3(model_.mesh.nodes.size()));
    for (std::size_t i = 0; i < unknowns_.dof.size(); ++i)
        whole[unknowns_.dof[i]] = y[Eigen::Index(i)];
    if (model_.hyperelastic) return change_hyperelastic(whole, mode);
    if (!step_.dynamic) {
        now_.u += whole;
        // A linear body: the residual has changed by A y, so what is left of y_free is known. Not
        // where loads turn against the frame.
        const bool turns = frame_kind() == SolidFrame::floating &&
                           (!model_.input.loads.empty() || !step_.gravity.isZero(0));
        free_.known = !nonlinear_ && !turns && !solving_.iterative;
        if (free_.known) free_.change -= y;
        if (mode.size() > 0) {
            // Pins take the body as a whole with what they hold.
            if (frame_kind() != SolidFrame::floating) {
                const Eigen::VectorXd by_pins = mean_motion(unknowns_, whole);
                now_.u += unknowns_.rigid->R * (constrained_part(mode + by_pins) - by_pins);
            } else { // loads turn with the frame alone
                const Eigen::VectorXd in_u = mean_motion(unknowns_, now_.u);
                now_.u -= unknowns_.rigid->R * in_u;
                move_frame(model_, unknowns_, now_, constrained_part(mode + in_u));
            }
        }
        update_places(now_);
        return;
    }
    const Eigen::VectorXd dv = into_space(now_, whole);
    now_.v += dv;
    follow_velocity();
}

/// Places at the end of a dynamic step from the velocity there.
void SolidBody::follow_velocity()
{
    now_.version = ++known_.last_version;
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.x[i] = state_.x[i] + step_.h * (step_.rule.end * Vec3(now_.v.segment<3>(at3(i))) +
                                             Vec3(past_.velocity.segment<3>(at3(i))));
    into_frame_displacements(model_, now_);
}

double SolidBody::imbalance(const Eigen::VectorXd& force)
{
    if (!nonlinear_) return 0;
    if (search_.pending.size() > 0) return 1;
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    double missing = 0, size = 0;
    for (std::size_t i = 0; i < unknowns_.dof.size(); ++i) {
        const double f = force[Eigen::Index(i)];
        const double s = scale[unknowns_.dof[i]] + std::abs(f);
        const double e = r[unknowns_.dof[i]] + f;
        missing += e * e;
        size += s * s;
    }
    // What the round-off of places makes of forces, and that of velocities of momentum.
    const double places = matrix_->stiffest * size_ * (step_.dynamic ? step_.h : 1);
    const double momentum =
        step_.dynamic ? model_.lumped->maxCoeff() * now_.v.cwiseAbs().maxCoeff() : 0;
    const double floor = 1e-14 * (places + momentum) * std::sqrt(double(unknowns_.dof.size()));
    const double balance = missing > floor * floor && size > 0 ? std::sqrt(missing / size) : 0;
    search_.round_off = size > 0 ? floor / std::sqrt(size) : 0;
    const double error = std::max(balance, volumes_missing(model_, step_, volumes_, now_));
    search_.stalled = error > 0.5 * search_.last_error ? search_.stalled + 1 : 0;
    search_.last_error = error;
    return error;
}

BodyEnergy SolidBody::accept(const Eigen::VectorXd&)
{
    BodyEnergy e;
    accept_loads(e);
    if (step_.dynamic)
        accept_motion(e);
    else
        accept_rest(e);
    return e;
}

/// Loads and reactions of prescribed nodes at the end of the step, and their work.
void SolidBody::accept_loads(BodyEnergy& e)
{
    const Eigen::VectorXd before = at_state_.reaction;
    // What prescribed nodes need, beside loads, inner forces and contacts.
    if (!model_.conditions.held.empty() || (step_.dynamic && step_.rule.filtered)) {
        Eigen::VectorXd scale, missing = -residual(scale);
        if (step_.dynamic) missing /= step_.h;
        missing -= contact_.held;
        Eigen::VectorXd held = Eigen::VectorXd::Zero(missing.size());
        for (const SolidConditions::Held& h : model_.conditions.held)
            held[h.dof] = missing[h.dof];
        at_state_.reaction = into_space(now_, held);
    } else {
        at_state_.reaction.setZero(); // a hold that was there before a change of the scene
    }
    const Eigen::VectorXd load = into_space(now_, last_.load);
    if (at_state_.load.size() == 0) at_state_.load = load;
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
        const Vec3 moved = now_.x[i] - state_.x[i];
        Vec3 f = load.segment<3>(at3(i)) + at_state_.reaction.segment<3>(at3(i));
        if (!step_.dynamic) // the rule of the trapezoid
            f = 0.5 * (f + at_state_.load.segment<3>(at3(i)) + before.segment<3>(at3(i)));
        const double work = f.dot(moved);
        e.work += work;
        e.work_absolute += std::abs(work);
    }
    at_state_.load = load;
}

void SolidBody::accept_rest(BodyEnergy& e)
{
    Eigen::VectorXd inner;
    const Eigen::VectorXd contact = contact_.on_unknowns + contact_.held;
    const double contact_work = 0.5 * (contact + at_state_.contact).dot(now_.u - state_.u);
    at_state_.contact = contact;
    state_ = now_;
    e.elastic = inner_forces(now_, inner);
    if (model_.hyperelastic) {
        // Where equilibrium became unstable within the step, the work not stored was released.
        if (tangent_.indefinite && volumes_.loads.empty())
            e.dissipated = std::max(0.0, e.work + contact_work - (e.elastic - at_state_.energy));
        at_state_.energy = e.elastic;
        accept_hyperelastic();
    } else if (model_.corotational) {
        remark_ = !corotated_.not_positive ? ""
                  : contact.isZero(0)
                      ? model_.input.name + ": " + kNotStable + ": the tangent is not positive"
                      : model_.input.name + ": without its contacts it would be unstable";
    }
}

void SolidBody::accept_motion(BodyEnergy& e)
{
    Eigen::VectorXd inner, scale;
    const bool filtered = step_.rule.filtered;
    const SolidInput& input = model_.input;

    // ---- Dissipation by damping and by the rule
    double damped_power = 0; // of the rates of strain, per damping [W/s]
    if (input.stiffness_damping > 0 && !filtered) {
        const Eigen::VectorXd v =
            into_frame(now_, step_.rule.end * now_.v + step_.rule.start * state_.v);
        if (model_.corotational) residual(scale); // its forces are those of the iterate then
        damped_power =
            v.dot(model_.corotational ? last_.rate_forces
                                      : stiffness_times(model_, *matrix_, solving_.threads, v));
    }
    const Eigen::VectorXd du = now_.u - state_.u, dv = now_.v - state_.v,
                          reached = mass_times(model_, now_.v);
    double put_back = 0;
    if (model_.conditions.held.empty() && model_.conditions.supports.empty() && !input.drive.given)
        put_back = keep_angular_momentum(model_, step_, state_, at_state_, contact_,
                                         contact_moment_, at_state_.load, reached, now_);
    contact_moment_.reset();
    if (frame_kind() == SolidFrame::floating) float_frame(model_, now_);
    const Eigen::VectorXd momentum = mass_times(model_, now_.v);
    if (filtered) {
        e.dissipated = filtered_loss(state_, now_, step_.h, last_, memory_, momenta(), momentum);
        const Eigen::VectorXd start_velocity = state_.v;
        at_state_.momentum = momentum;
        state_ = now_;
        if (frame_kind() == SolidFrame::floating) at_state_.spin = mean_spin(model_, state_);
        e.elastic = inner_forces(now_, inner);
        e.kinetic = kinetic_energy();
        const Eigen::VectorXd damping =
            damping_forces(model_, *matrix_, solving_.threads, corotated_, now_);
        end_memory(step_.rule, start_velocity, now_.v, into_space(now_, inner),
                   into_space(now_, inner + damping),
                   into_space(now_, load_forces(model_, step_, volumes_, now_, step_.end())),
                   memory_);
        if (model_.hyperelastic) {
            at_state_.energy = e.elastic;
            accept_hyperelastic();
        }
        return;
    }
    // What the rule takes, (theta - 1/2) of the change's energy, and the damping.
    const double excess = step_.rule.end - 0.5;
    if (nonlinear_ && excess > 0) // the work of the forces that it took, less what they stored
        e.dissipated = excess * dv.dot(reached - at_state_.momentum) + du.dot(last_.inner);
    else if (excess > 0)
        e.dissipated = excess * (dv.dot(reached - at_state_.momentum) +
                                 du.dot(stiffness_times(model_, *matrix_, solving_.threads, du)));
    e.dissipated -= put_back;
    if (input.mass_damping > 0 || input.stiffness_damping > 0) {
        const Eigen::VectorXd v = step_.rule.end * now_.v + step_.rule.start * state_.v;
        if (input.mass_damping > 0)
            e.dissipated += step_.h * input.mass_damping * v.dot(mass_times(model_, v));
        if (input.stiffness_damping > 0)
            e.dissipated += step_.h * input.stiffness_damping * damped_power;
    }

    // ---- The iterate becomes the state
    at_state_.momentum = momentum;
    state_ = now_;
    if (frame_kind() == SolidFrame::floating) at_state_.spin = mean_spin(model_, state_);
    e.elastic = inner_forces(now_, inner);
    e.kinetic = kinetic_energy();
    if (nonlinear_) {
        if (excess > 0) e.dissipated -= e.elastic - at_state_.energy;
        at_state_.energy = e.elastic;
    }
    if (model_.hyperelastic) accept_hyperelastic();
}

} // namespace amontons
