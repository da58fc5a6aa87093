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
namespace {

/// The integral of density N_i N_j, the same along each axis: nodes x nodes [kg].
SparseMatrix scalar_mass(const VolumeMesh& mesh, double density)
{
    std::vector<Eigen::Triplet<double>> entries;
    ElementMatrix M;
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        solid_mass(kind, places_of(mesh, nodes), density, M);
        for (std::size_t j = 0; j < nodes.size(); ++j)
            for (std::size_t i = 0; i < nodes.size(); ++i)
                entries.emplace_back(nodes[i], nodes[j], M(Eigen::Index(i), Eigen::Index(j)));
    });
    SparseMatrix m(Eigen::Index(mesh.nodes.size()), Eigen::Index(mesh.nodes.size()));
    m.setFromTriplets(entries.begin(), entries.end());
    return m;
}

} // namespace

SolidBody::SolidBody(const SolidInput& input, VolumeMesh mesh, bool small,
                     std::span<const char> touching, const std::string& file)
    : input_(input)
    , file_(file)
    , mesh_(std::move(mesh))
    , material_{input.youngs_modulus, input.poisson_ratio, input.density}
    , small_(small)
    , corotational_(input.motion == "corotational")
    , hyperelastic_(is_hyperelastic(input))
    , pattern_([this] { return make_pattern(mesh_); })
    , supports_([this] {
        std::vector<SparseMatrix> all;
        for (const SolidConditions::Support& s : conditions_.supports) {
            all.push_back(zero_matrix(*pattern_));
            add_support(mesh_, s.faces->members, s.input->normal, s.input->tangential, all.back());
        }
        return all;
    })
    , support_([this] {
        SparseMatrix sum;
        for (const SparseMatrix& one : *supports_)
            if (sum.size() == 0)
                sum = one;
            else
                sum.coeffs() += one.coeffs();
        return sum;
    })
    , m_([this] {
        return material_.density > 0 ? scalar_mass(mesh_, material_.density) : SparseMatrix();
    })
    , weights_([this] { return Eigen::VectorXd(*m_ * Eigen::VectorXd::Ones(m_->cols())); })
    , first_momentum_(
          [this] { return material_.density > 0 ? mass_times(state_.v) : Eigen::VectorXd(); })
    , lumped_([this] {
        SolidMaterial unit = material_;
        if (!(unit.density > 0)) unit.density = 1; // weights of the mean motion need no true mass
        return assemble_lumped_mass(mesh_, std::span(&unit, 1));
    })
    , exact_tangent_(corotational_)
{
    nonlinear_ = corotational_ || hyperelastic_;
    const std::size_t n = mesh_.nodes.size();
    conditions_ = find_conditions(input_, mesh_, file);
    if (hyperelastic_) make_hyperelastic_elements(file);
    for (const Vec3& X : mesh_.nodes)
        middle_ += X / double(n);
    for (const Vec3& X : mesh_.nodes)
        size_ = std::max(size_, (X - middle_).norm());

    may_touch(touching);
    state_.frame = frame_at(0);
    state_.u = Eigen::VectorXd::Zero(at3(n));
    state_.v = Eigen::VectorXd::Zero(at3(n));
    state_.x.resize(n);
    update_places(state_);
    first_ = state_.x; // before what is prescribed at the start
    first_frame_ = state_.frame;
    hold(state_, 0);
    update_places(state_);
    if (input.start.spin.isZero(0)) {
        for (std::size_t i = 0; i < n; ++i)
            state_.v.segment<3>(at3(i)) = input.start.velocity;
    } else {
        const Vec3 c = centre(state_.x);
        for (std::size_t i = 0; i < n; ++i)
            state_.v.segment<3>(at3(i)) =
                input.start.velocity + input.start.spin.cross(state_.x[i] - c);
    }
    now_ = state_;
    contact_ = contact_held_ = support_stiffness_ = contact_before_ = reaction_ =
        Eigen::VectorXd::Zero(at3(n));
}

void SolidBody::may_touch(std::span<const char> touching)
{
    touching_.clear();
    for (std::size_t i = 0; i < touching.size(); ++i)
        if (touching[i]) touching_.push_back(std::int32_t(i));
    rigid_ =
        Late<RigidModes>([this, avoided = std::vector<char>(touching.begin(), touching.end())] {
            std::vector<std::int32_t> prescribed;
            for (const SolidConditions::Held& h : conditions_.held)
                prescribed.push_back(h.dof);
            RigidModes found = find_rigid_modes(mesh_.nodes, *pattern_, prescribed, avoided);
            if (conditions_.supports.empty() || found.R.cols() == 0) return found;
            return not_resisted(found, *support_, avoided);
        });
}

void SolidBody::also_touch(const Patch& patch)
{
    std::vector<char> touching(mesh_.nodes.size(), 0);
    for (const std::int32_t i : touching_)
        touching[std::size_t(i)] = 1;
    for (const PatchNode& n : patch.nodes)
        touching[std::size_t(n.node)] = 1;
    may_touch(touching);
}

std::vector<LiveCurve> SolidBody::live_curves()
{
    std::vector<LiveCurve> all;
    if (input_.drive.given) add_drive(input_.name, input_.drive, all);
    for (std::size_t k = 0; k < input_.loads.size(); ++k) {
        LoadInput& l = input_.loads[k];
        const std::string load = fmt::format("{}.loads.{}.", input_.name, k);
        if (!l.pressure.empty()) all.push_back({load + "pressure", "Pa", &l.pressure});
        if (!l.volume.empty()) all.push_back({load + "volume", "m^3", &l.volume});
        if (l.traction || l.force) all.push_back({load + "over", "", &l.over, 1});
    }
    // What the scene gives a value: an axis without one is free, or at rest with all others.
    for (std::size_t k = 0; k < input_.hold.size(); ++k) {
        HoldInput& h = input_.hold[k];
        const std::string hold = fmt::format("{}.hold.{}.", input_.name, k);
        for (const auto& [name, curve] : {std::pair("x", &h.x), {"y", &h.y}, {"z", &h.z}})
            if (!curve->empty()) all.push_back({hold + name, "m", curve});
        if (!h.angle.empty()) all.push_back({hold + "angle", "rad", &h.angle});
        if (h.gradient || !h.over.empty()) all.push_back({hold + "over", "", &h.over, 1});
    }
    return all;
}

void SolidBody::hold(Motion& m, double t) const
{
    const Eigen::VectorXd u = held_displacements(conditions_, mesh_, t);
    for (std::size_t i = 0; i < conditions_.held.size(); ++i)
        m.u[conditions_.held[i].dof] = u[Eigen::Index(i)];
}

Eigen::VectorXd SolidBody::loads(const Motion& m, double t) const
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(at3(mesh_.nodes.size()));
    const auto of_frame = [&](const Vec3& v) { return Vec3(m.frame.turn.conjugate() * v); };
    for (const SolidConditions::Load& load : conditions_.loads) {
        const LoadInput& l = *load.input;
        const double factor = step_.load * (l.over.empty() ? 1 : curve_value(l.over, t));
        if (load.pressure.size() > 0) {
            const double p = step_.load * curve_value(l.pressure, t);
            if (!nonlinear_)
                f += p * load.pressure;
            else
                f += follower_pressure(mesh_, load.faces->members, m.u, p);
        }
        if (l.traction) {
            const Vec3 traction = of_frame(factor * *l.traction);
            for (const std::int32_t node : load.nodes)
                f.segment<3>(3 * node) += load.traction[node] * traction;
        }
        if (l.force)
            for (const std::int32_t node : load.nodes)
                f.segment<3>(3 * node) += of_frame(factor * *l.force) / double(load.nodes.size());
    }
    for (const VolumeLoad& v : volumes_)
        f += follower_pressure(mesh_, conditions_.loads[v.load].faces->members, m.u, v.pressure);
    if (material_.density > 0 && !step_.gravity.isZero(0))
        Eigen::Map<Eigen::Matrix3Xd>(f.data(), 3, f.size() / 3).noalias() +=
            of_frame(step_.gravity) * weights_->transpose();
    return f; // along the frame's axes
}

double SolidBody::inner_forces(const Motion& m, Eigen::VectorXd& f)
{
    f.setZero(at3(mesh_.nodes.size()));
    if (hyperelastic_) return hyperelastic_inner(m, f);
    if (!corotational_) {
        f = stiffness_times(m.u);
        return 0.5 * m.u.dot(f);
    }
    if (m.version == known_version_) { // places have not changed since
        f = known_forces_;
        return known_energy_;
    }
    double energy = 0;
    element_states_.resize(elements_.size());
    ElementPlaces x;
    ElementVector forces;
    const Mat3 back = m.frame.turn.toRotationMatrix().transpose();
    for_each_element(mesh_, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
        x.resize(3, Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            x.col(Eigen::Index(i)) = back * (m.x[std::size_t(nodes[i])] - m.frame.shift);
        CorotationalState& s = element_states_[std::size_t(e)];
        s = corotational_forces(elements_[std::size_t(e)], x, forces);
        energy += s.energy;
        for (std::size_t i = 0; i < nodes.size(); ++i)
            f.segment<3>(3 * nodes[i]) += forces.segment<3>(3 * Eigen::Index(i));
    });
    energy += add_support_forces(m.u, f);
    known_version_ = m.version;
    known_forces_ = f;
    known_energy_ = energy;
    return energy;
}

/// Adds what supports need of a displacement [N]; their energy [J].
double SolidBody::add_support_forces(const Eigen::VectorXd& u, Eigen::VectorXd& f) const
{
    if (conditions_.supports.empty()) return 0;
    const Eigen::VectorXd of_support = symmetric_times(*pattern_, *support_, u, threads_);
    f += of_support;
    return 0.5 * u.dot(of_support);
}

void SolidBody::begin(const StepInput& step)
{
    step_ = step;
    now_ = state_;
    free_known_ = false;
    contact_held_.setZero();
    if (hyperelastic_) begin_hyperelastic();
    if (hyperelastic_ && !step.dynamic) { // what is prescribed moves with the first change
        if (frame_kind() == Frame::driven) now_.frame = frame_at(step.end());
        Motion end = now_;
        hold(end, step.end());
        pending_ = end.u - now_.u;
        if (pending_.isZero(0)) pending_.resize(0);
        update_places(now_);
        return;
    }
    if (!step.dynamic) {
        if (frame_kind() == Frame::driven) now_.frame = frame_at(step.end());
        hold(now_, step.end());
        update_places(now_);
        return;
    }
    if (momentum_.size() == 0) momentum_ = *first_momentum_;
    // The iterate stands where the step starts, but for what is prescribed.
    const double h = step.h;
    if (step.rule.filtered)
        begin_memory();
    else
        past_velocity_ = step.rule.start * state_.v;
    if (frame_kind() == Frame::driven) now_.frame = frame_at(step.end());
    hold(now_, step.end());
    if (frame_kind() == Frame::floating) {
        // Where the frame will be if the body turns on as it does, where the rule takes elastic
        // forces: they are linear in it, and the turn left for u is of second order.
        if (!spin_) find_spin();
        const double taken = step.rule.filtered ? h : h * step.rule.end;
        const Eigen::Quaterniond turn = rotation(taken * *spin_);
        const Vec3 x = centre(state_.x), X = centre(mesh_.nodes);
        now_.frame.turn = (turn * state_.frame.turn).normalized();
        now_.frame.shift = x - now_.frame.turn * X;
        into_frame_displacements(now_);
    } else if (frame_kind() == Frame::driven || !conditions_.held.empty()) {
        update_places(now_);
    }
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.v.segment<3>(at3(i)) =
            ((now_.x[i] - state_.x[i]) / h - Vec3(past_velocity_.segment<3>(at3(i)))) /
            step.rule.end;
}

Eigen::VectorXd SolidBody::residual(Eigen::VectorXd& scale)
{
    // Along the frame's axes. Dynamic: the change of momentum over the step that is missing.
    Eigen::VectorXd inner;
    if (!step_.dynamic) {
        inner_forces(now_, inner);
        Eigen::VectorXd f = loads(now_, step_.end());
        scale = f.cwiseAbs() + (hyperelastic_ ? force_size_ : inner.cwiseAbs());
        last_load_ = f;
        return f - inner;
    }
    if (step_.rule.filtered) return filtered_residual(scale);
    const double h = step_.h, theta = step_.rule.end;
    Motion between;
    if (theta < 1) {
        between = now_;
        Motion& middle = between;
        middle.version = ++last_version_;
        for (std::size_t i = 0; i < middle.x.size(); ++i)
            middle.x[i] = (1 - theta) * state_.x[i] + theta * now_.x[i];
        if (frame_kind() == Frame::driven) middle.frame = frame_at(step_.start + theta * h);
        into_frame_displacements(middle);
    }
    const Motion& middle = theta < 1 ? between : now_;
    inner_forces(middle, inner);
    if (nonlinear_) last_inner_ = inner;
    const Eigen::VectorXd f = loads(middle, step_.start + theta * h);
    last_load_ = f;
    Eigen::VectorXd change = now_.v - state_.v;
    Eigen::VectorXd mean_v = theta * now_.v + (1 - theta) * state_.v;
    const bool damps = input_.stiffness_damping > 0;
    Eigen::VectorXd rate_v = damps ? into_frame(mean_v) : Eigen::VectorXd();
    if (middle.frame.turn.coeffs() != now_.frame.turn.coeffs()) {
        // Forces turn from the frame they were found in to that of the iterate.
        const Mat3 turn = (now_.frame.turn.conjugate() * middle.frame.turn).toRotationMatrix();
        Eigen::Map<Eigen::Matrix3Xd> g(inner.data(), 3, inner.size() / 3);
        g = (turn * g).eval();
        if (damps) {
            Eigen::Map<Eigen::Matrix3Xd> v(rate_v.data(), 3, rate_v.size() / 3);
            v = (turn.transpose() * v).eval();
            last_rate_forces_ = rate_forces(rate_v);
            Eigen::Map<Eigen::Matrix3Xd> d(last_rate_forces_.data(), 3, rate_v.size() / 3);
            d = (turn * d).eval();
        }
    } else if (damps) {
        last_rate_forces_ = rate_forces(rate_v);
    }
    const Eigen::VectorXd momentum = into_frame(mass_times(change));
    scale = momentum.cwiseAbs() + h * (f.cwiseAbs() + inner.cwiseAbs());
    Eigen::VectorXd r = h * (f - inner) - momentum;
    if (input_.mass_damping > 0) r -= h * input_.mass_damping * into_frame(mass_times(mean_v));
    if (damps) r -= h * input_.stiffness_damping * last_rate_forces_;
    return r;
}

bool SolidBody::reset_to_start()
{
    const bool prescribed =
        frame_kind() == Frame::driven ||
        std::ranges::any_of(conditions_.held, [&](const auto& h) { return moves(conditions_, h); });
    if (prescribed) now_ = state_;
    return prescribed;
}

void SolidBody::linearise()
{
    if (!prepared_) prepare();
    if (free_known_) return;
    if (hyperelastic_) return linearise_hyperelastic();
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    make_matrix();
    if (iterative_) {
        large_load_ = r;
        for (const std::int32_t dof : dofs_.fixed)
            large_load_[dof] = 0;
        free_change_ = Eigen::VectorXd::Zero(unknowns());
        mode_load_.resize(0);
        return;
    }
    if (corotational_ && free_modes_.cols() > 0) turn_modes();
    Eigen::VectorXd rf(Eigen::Index(dofs_.free.size()));
    for (std::size_t i = 0; i < dofs_.free.size(); ++i)
        rf[Eigen::Index(i)] = r[dofs_.free[i]];
    free_change_ = with_pins(solved(rf));
    if (free_modes_.cols() > 0)
        mode_load_ = rigid_->R.transpose() * r;
    else
        mode_load_.resize(0);
}

void SolidBody::update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                       const Eigen::VectorXd& force)
{
    contact_.setZero();
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        contact_[unknown_[i]] = force[Eigen::Index(i)];
    Eigen::VectorXd whole = Eigen::VectorXd::Zero(at3(mesh_.nodes.size()));
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        whole[unknown_[i]] = y[Eigen::Index(i)];
    if (hyperelastic_) return change_hyperelastic(whole, mode);
    if (!step_.dynamic) {
        now_.u += whole;
        // A linear body: the residual has changed by A y, so what is left of y_free is known. Not
        // where loads turn against the frame.
        const bool turns =
            frame_kind() == Frame::floating && (!input_.loads.empty() || !step_.gravity.isZero(0));
        free_known_ = !nonlinear_ && !turns && !iterative_;
        if (free_known_) free_change_ -= y;
        if (mode.size() > 0) {
            // Pins take the body as a whole with what they hold.
            if (frame_kind() != Frame::floating) {
                const Eigen::VectorXd by_pins = mean_motion(whole);
                now_.u += rigid_->R * (constrained_part(mode + by_pins) - by_pins);
            } else { // loads turn with the frame alone
                const Eigen::VectorXd in_u = mean_motion(now_.u);
                now_.u -= rigid_->R * in_u;
                move_frame(now_, constrained_part(mode + in_u));
            }
        }
        update_places(now_);
        return;
    }
    const Eigen::VectorXd dv = into_space(whole);
    now_.v += dv;
    follow_velocity();
}

/// Places at the end of a dynamic step from the velocity there.
void SolidBody::follow_velocity()
{
    now_.version = ++last_version_;
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.x[i] = state_.x[i] + step_.h * (step_.rule.end * Vec3(now_.v.segment<3>(at3(i))) +
                                             Vec3(past_velocity_.segment<3>(at3(i))));
    into_frame_displacements(now_);
}

double SolidBody::imbalance(const Eigen::VectorXd& force)
{
    if (!nonlinear_) return 0;
    if (pending_.size() > 0) return 1;
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    double missing = 0, size = 0;
    for (std::size_t i = 0; i < unknown_.size(); ++i) {
        const double f = force[Eigen::Index(i)];
        const double s = scale[unknown_[i]] + std::abs(f);
        const double e = r[unknown_[i]] + f;
        missing += e * e;
        size += s * s;
    }
    // What the round-off of places makes of forces, and that of velocities of momentum.
    const double places = stiffest_ * size_ * (step_.dynamic ? step_.h : 1);
    const double momentum = step_.dynamic ? lumped_->maxCoeff() * now_.v.cwiseAbs().maxCoeff() : 0;
    const double floor = 1e-14 * (places + momentum) * std::sqrt(double(unknown_.size()));
    const double balance = missing > floor * floor && size > 0 ? std::sqrt(missing / size) : 0;
    round_off_ = size > 0 ? floor / std::sqrt(size) : 0;
    const double error = std::max(balance, volumes_missing());
    stalled_ = error > 0.5 * last_error_ ? stalled_ + 1 : 0;
    last_error_ = error;
    return error;
}

BodyEnergy SolidBody::accept(const Eigen::VectorXd&)
{
    BodyEnergy e;
    Eigen::VectorXd inner, scale;
    const Eigen::VectorXd before = reaction_;
    const bool filtered = step_.dynamic && step_.rule.filtered;

    // ---- Reactions of prescribed nodes and their work
    // What prescribed nodes need, beside loads, inner forces and contacts.
    if (!conditions_.held.empty() || filtered) {
        Eigen::VectorXd missing = -residual(scale);
        if (step_.dynamic) missing /= step_.h;
        missing -= contact_held_;
        Eigen::VectorXd held = Eigen::VectorXd::Zero(missing.size());
        for (const SolidConditions::Held& h : conditions_.held)
            held[h.dof] = missing[h.dof];
        reaction_ = into_space(held);
    } else {
        reaction_.setZero(); // a hold that was there before a change of the scene
    }
    const Eigen::VectorXd load = into_space(last_load_);
    if (load_.size() == 0) load_ = load;
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
        const Vec3 moved = now_.x[i] - state_.x[i];
        Vec3 f = load.segment<3>(at3(i)) + reaction_.segment<3>(at3(i));
        if (!step_.dynamic) // the rule of the trapezoid
            f = 0.5 * (f + load_.segment<3>(at3(i)) + before.segment<3>(at3(i)));
        const double work = f.dot(moved);
        e.work += work;
        e.work_absolute += std::abs(work);
    }
    load_ = load;
    if (!step_.dynamic) {
        const Eigen::VectorXd contact = contact_ + contact_held_;
        const double contact_work = 0.5 * (contact + contact_before_).dot(now_.u - state_.u);
        contact_before_ = contact;
        state_ = now_;
        e.elastic = inner_forces(now_, inner);
        if (hyperelastic_) {
            // Where equilibrium became unstable within the step, the work not stored was released.
            if (indefinite_ && volumes_.empty())
                e.dissipated = std::max(0.0, e.work + contact_work - (e.elastic - state_energy_));
            state_energy_ = e.elastic;
            accept_hyperelastic();
        } else if (corotational_) {
            remark_ = !not_positive_ ? ""
                      : contact.isZero(0)
                          ? input_.name + ": " + kNotStable + ": the tangent is not positive"
                          : input_.name + ": without its contacts it would be unstable";
        }
        return e;
    }

    // ---- Dissipation by damping and by the rule
    double damped_power = 0; // of the rates of strain, per damping [W/s]
    if (input_.stiffness_damping > 0 && !filtered) {
        const Eigen::VectorXd v = into_frame(step_.rule.end * now_.v + step_.rule.start * state_.v);
        if (corotational_) residual(scale); // its forces are those of the iterate then
        damped_power = v.dot(corotational_ ? last_rate_forces_ : stiffness_times(v));
    }
    const Eigen::VectorXd du = now_.u - state_.u, dv = now_.v - state_.v,
                          reached = mass_times(now_.v);
    double put_back = 0;
    if (conditions_.held.empty() && conditions_.supports.empty() && !input_.drive.given)
        put_back = keep_angular_momentum(load, reached);
    contact_moment_.reset();
    if (frame_kind() == Frame::floating) float_frame(now_);
    const Eigen::VectorXd momentum = mass_times(now_.v);
    if (filtered) {
        e.dissipated = filtered_loss(momentum);
        const Eigen::VectorXd start_velocity = state_.v;
        momentum_ = momentum;
        state_ = now_;
        if (frame_kind() == Frame::floating) find_spin();
        e.elastic = inner_forces(now_, inner);
        e.kinetic = kinetic_energy();
        end_memory(start_velocity, inner);
        if (hyperelastic_) {
            state_energy_ = e.elastic;
            accept_hyperelastic();
        }
        return e;
    }
    // What the rule takes, (theta - 1/2) of the change's energy, and the damping.
    const double excess = step_.rule.end - 0.5;
    if (nonlinear_ && excess > 0) // the work of the forces that it took, less what they stored
        e.dissipated = excess * dv.dot(reached - momentum_) + du.dot(last_inner_);
    else if (excess > 0)
        e.dissipated = excess * (dv.dot(reached - momentum_) + du.dot(stiffness_times(du)));
    e.dissipated -= put_back;
    if (input_.mass_damping > 0 || input_.stiffness_damping > 0) {
        const Eigen::VectorXd v = step_.rule.end * now_.v + step_.rule.start * state_.v;
        if (input_.mass_damping > 0)
            e.dissipated += step_.h * input_.mass_damping * v.dot(mass_times(v));
        if (input_.stiffness_damping > 0)
            e.dissipated += step_.h * input_.stiffness_damping * damped_power;
    }

    // ---- The iterate becomes the state
    momentum_ = momentum;
    state_ = now_;
    if (frame_kind() == Frame::floating) find_spin();
    e.elastic = inner_forces(now_, inner);
    e.kinetic = kinetic_energy();
    if (nonlinear_) {
        if (excess > 0) e.dissipated -= e.elastic - state_energy_;
        state_energy_ = e.elastic;
    }
    if (hyperelastic_) accept_hyperelastic();
    return e;
}

} // namespace amontons
