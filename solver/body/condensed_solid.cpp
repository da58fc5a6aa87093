#include "solver/body/condensed_solid.hpp"
#include "solver/body/node_index.hpp"

#include "mesh/base/curve.hpp"
#include "solver/body/drive.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// Calls with the same columns after which A^-1 C is made: it costs as much as ten solves and more.
constexpr int kSameColumns = 20;
constexpr double kFewer = 2;                  ///< times fewer numbers, or it is not worth it
constexpr std::size_t kMostMotions = 8000000; ///< numbers

} // namespace

void CondensedSolid::make_ready(const StepInput& step, const std::string& cache,
                                std::vector<std::string>& messages)
{
    SolidBody::make_ready(step, cache, messages);
    touching_number_.assign(model_.mesh.nodes.size(), -1);
    for (std::size_t k = 0; k < unknowns_.touching.size(); ++k)
        touching_number_[std::size_t(unknowns_.touching[k])] = std::int32_t(k);
    unknown_of_.assign(3 * unknowns_.touching.size(), -1);
    free_touching_.clear();
    for (std::size_t k = 0; k < unknowns_.touching.size(); ++k)
        for (int axis = 0; axis < 3; ++axis)
            if (unknowns_.number[3 * std::size_t(unknowns_.touching[k]) + std::size_t(axis)] >= 0) {
                unknown_of_[3 * k + std::size_t(axis)] = std::int32_t(free_touching_.size());
                free_touching_.push_back(std::int32_t(3 * k) + axis);
            }
    const Eigen::Index modes = unknowns_.rigid->R.cols();
    modes_at_touching_.resize(at3(unknowns_.touching.size()), modes);
    for (std::size_t k = 0; k < unknowns_.touching.size() && modes > 0; ++k)
        modes_at_touching_.middleRows<3>(at3(k)) =
            unknowns_.rigid->R.middleRows<3>(3 * unknowns_.touching[k]);
    unknowns_.modes.resize(unknowns(), modes);
    for (std::size_t i = 0; i < free_touching_.size() && modes > 0; ++i)
        unknowns_.modes.row(Eigen::Index(i)) = modes_at_touching_.row(free_touching_[i]);
    make_parts();
    constexpr double kSolvesPerStep = 3;
    if (matrix_->constant) matrix_->constant->expect(kSolvesPerStep * solving_.expected_steps);
    const Eigen::Index n = Eigen::Index(parts_of_u_.size());
    if (amount_.size() == 0) {
        amount_ = loaded_ = held_force_ = Eigen::VectorXd::Zero(n);
        on_touching_ = Eigen::VectorXd::Zero(at3(unknowns_.touching.size()));
        mode_ = Eigen::VectorXd::Zero(modes);
        // What is prescribed at the start is part of the first places.
        for (Eigen::Index i = 0; i < n; ++i)
            if (parts_of_u_[std::size_t(i)].prescribed) amount_[i] = amounts(0)[i];
    }
    amount_now_ = amount_;
    on_touching_now_ = on_touching_;
    mode_now_ = mode_;
}

void CondensedSolid::make_parts()
{
    parts_of_u_.clear();
    const Eigen::Index size = at3(model_.mesh.nodes.size());

    // ---- Loads, holds and weight as vectors
    const auto load = [&](std::size_t input, int axis, Eigen::VectorXd force) {
        Part p;
        p.input = input;
        p.axis = axis;
        p.force = std::move(force);
        parts_of_u_.push_back(std::move(p));
    };
    for (std::size_t i = 0; i < model_.conditions.loads.size(); ++i) {
        const SolidConditions::Load& at = model_.conditions.loads[i];
        const LoadInput& l = *at.input;
        if (at.pressure.size() > 0) load(i, -1, at.pressure);
        for (int axis = 0; axis < 3; ++axis) {
            Eigen::VectorXd f = Eigen::VectorXd::Zero(size);
            if (l.traction)
                for (const std::int32_t node : at.nodes)
                    f[3 * node + axis] = at.traction[node];
            if (l.traction) load(i, axis, f);
            f.setZero();
            if (l.force)
                for (const std::int32_t node : at.nodes)
                    f[3 * node + axis] = 1 / double(at.nodes.size());
            if (l.force) load(i, 3 + axis, f);
        }
    }
    if (model_.material.density > 0 && !step_.gravity.isZero(0))
        for (int axis = 0; axis < 3; ++axis) {
            Eigen::VectorXd f = Eigen::VectorXd::Zero(size);
            for (Eigen::Index i = 0; i < model_.weights->size(); ++i)
                f[3 * i + axis] = (*model_.weights)[i];
            load(model_.input.loads.size(), axis, f);
        }
    for (std::size_t k = 0; k < model_.input.hold.size(); ++k)
        for (int axis = 0; axis < 3; ++axis) {
            Part p;
            p.prescribed = true;
            p.input = k;
            p.axis = axis;
            for (const SolidConditions::Held& h : model_.conditions.held)
                if (h.hold == k && h.dof % 3 == axis) p.dofs.push_back(h.dof);
            if (!p.dofs.empty()) parts_of_u_.push_back(std::move(p));
        }

    // ---- Responses, all solved at once
    // What each does, everywhere; kept at the touching nodes and as products. After them, forces
    // that give the mean motion (A is symmetric), and turns of the holds, whose forces are
    // moments. All are solved for at once.
    const Eigen::Index n = Eigen::Index(parts_of_u_.size()), modes = unknowns_.rigid->R.cols(),
                       turns = 3 * Eigen::Index(model_.input.hold.size());
    Eigen::MatrixXd U = Eigen::MatrixXd::Zero(size, n + modes + turns);
    Eigen::MatrixXd free(Eigen::Index(unknowns_.dofs.free.size()), n + modes + turns);
    const std::vector<Vec3> centres = centres_of_holds(model_, {});
    Eigen::MatrixXd held_turn = Eigen::MatrixXd::Zero(size, turns);
    for (const SolidConditions::Held& h : model_.conditions.held)
        for (int axis = 0; axis < 3; ++axis)
            held_turn(h.dof, 3 * Eigen::Index(h.hold) + axis) = Vec3::Unit(axis).cross(
                model_.mesh.nodes[std::size_t(h.dof / 3)] - centres[h.hold])[h.dof % 3];
    for (Eigen::Index j = 0; j < n + modes + turns; ++j) {
        Eigen::VectorXd f;
        if (j >= n + modes) {
            U.col(j) = held_turn.col(j - n - modes);
            f = -(matrix_->K * U.col(j));
        } else if (j >= n)
            f = unknowns_.rigid->R.col(j - n) / unknowns_.rigid->R.col(j - n).squaredNorm();
        else if (const Part& p = parts_of_u_[std::size_t(j)]; p.prescribed) {
            for (const std::int32_t dof : p.dofs)
                U(dof, j) = 1;
            f = -(matrix_->K * U.col(j));
        } else
            f = p.force;
        free.col(j) = free_part(unknowns_, f);
    }
    solve_all(model_, unknowns_, *matrix_, border_, free);
    for (Eigen::Index j = 0; j < n + modes + turns; ++j)
        for (std::size_t i = 0; i < unknowns_.dofs.free.size(); ++i)
            U(unknowns_.dofs.free[i], j) = free(Eigen::Index(i), j);

    // ---- Responses at touching nodes, and between the parts
    const auto at_touching = [&](Eigen::Index j) {
        Eigen::VectorXd u(at3(unknowns_.touching.size()));
        for (std::size_t k = 0; k < unknowns_.touching.size(); ++k)
            u.segment<3>(at3(k)) = U.col(j).segment<3>(3 * unknowns_.touching[k]);
        return u;
    };
    between_.resize(n, n);
    moment_of_part_.resize(turns, n);
    moment_of_contact_.resize(at3(unknowns_.touching.size()), turns);
    for (Eigen::Index k = 0; k < turns; ++k)
        moment_of_contact_.col(k) = -at_touching(n + modes + k);
    for (Eigen::Index j = 0; j < n; ++j) {
        Part& p = parts_of_u_[std::size_t(j)];
        Eigen::VectorXd held = matrix_->K * U.col(j);
        if (!p.prescribed) held -= p.force;
        moment_of_part_.col(j) = held_turn.transpose() * held;
        p.at_touching = at_touching(j);
        p.on_modes = Eigen::VectorXd::Zero(modes);
        if (!p.prescribed && modes > 0) p.on_modes = unknowns_.rigid->R.transpose() * p.force;
        p.mean_motion = mean_motion(unknowns_, U.col(j));
        for (Eigen::Index i = 0; i < n; ++i) {
            const Part& by = parts_of_u_[std::size_t(i)];
            between_(i, j) = by.prescribed ? 0 : by.force.dot(U.col(j));
            for (const std::int32_t dof : by.dofs)
                between_(i, j) += held[dof];
        }
    }
    mean_of_force_.resize(at3(unknowns_.touching.size()), modes);
    for (Eigen::Index m = 0; m < modes; ++m)
        mean_of_force_.col(m) = at_touching(n + m);
}

Eigen::VectorXd CondensedSolid::amounts(double t) const
{
    Eigen::VectorXd c(Eigen::Index(parts_of_u_.size()));
    for (std::size_t i = 0; i < parts_of_u_.size(); ++i) {
        const Part& p = parts_of_u_[i];
        double value = 0;
        if (p.prescribed) {
            const HoldInput& h = model_.input.hold[p.input];
            const CurvePoints* curve[] = {&h.x, &h.y, &h.z};
            const CurvePoints& own = *curve[p.axis];
            value = own.empty() ? 0 : curve_value(own, t);
        } else if (p.input == model_.input.loads.size()) {
            value = Vec3(now_.frame.turn.conjugate() * step_.gravity)[p.axis];
        } else {
            const LoadInput& l = model_.input.loads[p.input];
            if (p.axis < 0) {
                value = step_.load * curve_value(l.pressure, t);
            } else {
                const Vec3 v = p.axis < 3 ? *l.traction : *l.force;
                const double factor = step_.load * (l.over.empty() ? 1 : curve_value(l.over, t));
                value = factor * Vec3(now_.frame.turn.conjugate() * v)[p.axis % 3];
            }
        }
        c[Eigen::Index(i)] = value;
    }
    return c;
}

Eigen::VectorXd CondensedSolid::parts_at_touching(const Eigen::VectorXd& c) const
{
    Eigen::VectorXd u = Eigen::VectorXd::Zero(at3(unknowns_.touching.size()));
    for (std::size_t i = 0; i < parts_of_u_.size(); ++i)
        if (c[Eigen::Index(i)] != 0) u += c[Eigen::Index(i)] * parts_of_u_[i].at_touching;
    return u;
}

void CondensedSolid::place_touching(Motion& m)
{
    const Mat3 R = m.frame.turn.toRotationMatrix();
    for (const std::int32_t node : unknowns_.touching)
        m.x[std::size_t(node)] =
            R * (model_.mesh.nodes[std::size_t(node)] + Vec3(m.u.segment<3>(3 * node))) +
            m.frame.shift;
}

void CondensedSolid::begin(const StepInput& step)
{
    step_ = step;
    now_.frame = frame_kind() == SolidFrame::driven ? frame_at(step.end()) : state_.frame;
    for (const std::int32_t node : unknowns_.touching)
        now_.u.segment<3>(3 * node) = state_.u.segment<3>(3 * node);
    amount_now_ = amounts(step.end());
    on_touching_now_ = on_touching_;
    mode_now_ = mode_;
    mean_now_ = mean_with_pins(amount_, on_touching_);
    rigid_work_ = 0;
    // Prescribed places are those of the end of the step.
    const Eigen::VectorXd u = parts_at_touching(amount_now_);
    for (std::size_t k = 0; k < unknowns_.touching.size(); ++k)
        for (int axis = 0; axis < 3; ++axis)
            if (unknown_of_[3 * k + std::size_t(axis)] < 0) {
                now_.u[3 * unknowns_.touching[k] + axis] = u[at3(k) + axis];
                on_touching_now_[at3(k) + axis] = 0; // until add_reaction()
            }
    place_touching(now_);
}

void CondensedSolid::begin_at(std::span<const Vec3> touching)
{
    const Eigen::VectorXd u = parts_at_touching(amount_now_);
    for (const std::int32_t k : free_touching_) {
        const auto node = std::size_t(k / 3);
        now_.u[3 * unknowns_.touching[node] + k % 3] =
            touching.empty() ? u[k] : touching[node][k % 3];
    }
    place_touching(now_);
}

void CondensedSolid::linearise()
{
    if (frame_kind() == SolidFrame::floating)
        amount_now_ = amounts(step_.end()); // loads turn against it
    Eigen::VectorXd u = parts_at_touching(amount_now_);
    if (mode_now_.size() > 0) u += modes_at_touching_ * mode_now_;
    free_.change.resize(unknowns());
    for (std::size_t i = 0; i < free_touching_.size(); ++i) {
        const std::int32_t k = free_touching_[i];
        free_.change[Eigen::Index(i)] =
            u[k] - now_.u[3 * unknowns_.touching[std::size_t(k / 3)] + k % 3];
    }
    free_.mode_load = load_on_modes(amount_now_);
}

Eigen::VectorXd CondensedSolid::load_on_modes(const Eigen::VectorXd& amounts) const
{
    Eigen::VectorXd load = Eigen::VectorXd::Zero(unknowns_.rigid->R.cols());
    for (std::size_t i = 0; i < parts_of_u_.size() && load.size() > 0; ++i)
        load += amounts[Eigen::Index(i)] * parts_of_u_[i].on_modes;
    return load;
}

void CondensedSolid::add_column(const BodyPlace& at, const Vec3& direction, double scale,
                                int column, std::vector<Eigen::Triplet<double>>& out) const
{
    const Vec3 d = now_.frame.turn.conjugate() * direction;
    for (const StencilEntry& e : at.nodes)
        for (int axis = 0; axis < 3; ++axis) {
            const std::int32_t k = touching_number_[std::size_t(e.node)];
            const std::int32_t unknown = unknown_of_[std::size_t(3 * k + axis)];
            if (unknown >= 0) out.emplace_back(unknown, column, scale * e.weight * d[axis]);
        }
}

void CondensedSolid::compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    if (!matrix_->constant) return SolidBody::compliance(C, W);
    if (kept_W(*matrix_, kept_, C, W)) {
        ++same_columns_;
        return;
    }
    // The same columns among all free unknowns.
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(std::size_t(C.nonZeros()));
    for (Eigen::Index j = 0; j < C.cols(); ++j)
        for (SparseColumns::InnerIterator at(C, j); at; ++at) {
            const std::int32_t k = free_touching_[std::size_t(at.row())];
            const std::int32_t dof = 3 * unknowns_.touching[std::size_t(k / 3)] + k % 3;
            const std::int32_t free = unknowns_.dofs.number[std::size_t(dof)];
            if (free >= 0) entries.emplace_back(free, int(j), at.value()); // else a pin
        }
    SparseColumns whole(Eigen::Index(unknowns_.dofs.free.size()), C.cols());
    whole.setFromTriplets(entries.begin(), entries.end());
    motions_.reset();
    // A run that continues counts as the one that was stopped.
    same_columns_ = make_W(*matrix_, kept_, C, whole, W) ? same_columns_ + 1 : 0;
    keep_W(*matrix_, kept_, C, W);
}

/// A^-1 C, where that is fewer numbers than the columns of A^-1 that C takes; as soon as these are
/// there.
void CondensedSolid::make_motions(const SparseColumns& C)
{
    std::vector<char> acts(unknowns_.touching.size(), 0);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(std::size_t(C.nonZeros()));
    for (Eigen::Index j = 0; j < C.cols(); ++j)
        for (SparseColumns::InnerIterator at(C, j); at; ++at) {
            const std::int32_t k = free_touching_[std::size_t(at.row())];
            acts[std::size_t(k / 3)] = 1;
            entries.emplace_back(k, int(j), at.value());
        }
    if (kFewer * double(C.cols()) > 3 * double(std::count(acts.begin(), acts.end(), char(1))) ||
        std::size_t(unknowns()) * std::size_t(C.cols()) > kMostMotions) {
        motions_.emplace();
        return;
    }
    SparseColumns on_touching(at3(unknowns_.touching.size()), C.cols());
    on_touching.setFromTriplets(entries.begin(), entries.end());
    Eigen::MatrixXd Y;
    if (!matrix_->constant->surface_displacements(on_touching, Y)) return;
    motions_.emplace(unknowns(), C.cols());
    for (Eigen::Index i = 0; i < unknowns(); ++i)
        motions_->row(i) = Y.row(free_touching_[std::size_t(i)]);
}

Eigen::VectorXd CondensedSolid::solve(const SparseColumns& C, const Eigen::VectorXd& r)
{
    if (matrix_->constant && same_columns_ >= kSameColumns && C.cols() == kept_.columns.cols() &&
        !motions_)
        make_motions(C);
    if (motions_ && motions_->cols() == C.cols() && C.cols() > 0) return *motions_ * r;
    return solve(Eigen::VectorXd(C * r));
}

Eigen::VectorXd CondensedSolid::solve(const Eigen::VectorXd& force)
{
    Eigen::VectorXd on_touching = Eigen::VectorXd::Zero(at3(unknowns_.touching.size()));
    for (std::size_t i = 0; i < free_touching_.size(); ++i)
        on_touching[free_touching_[i]] = force[Eigen::Index(i)];
    const Eigen::VectorXd moved = matrix_->constant->surface_displacement(on_touching);
    Eigen::VectorXd y(unknowns());
    for (std::size_t i = 0; i < free_touching_.size(); ++i)
        y[Eigen::Index(i)] = moved[free_touching_[i]];
    return y;
}

void CondensedSolid::update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                            const Eigen::VectorXd& force)
{
    for (std::size_t i = 0; i < free_touching_.size(); ++i) {
        const std::int32_t k = free_touching_[i];
        now_.u[3 * unknowns_.touching[std::size_t(k / 3)] + k % 3] += y[Eigen::Index(i)];
        on_touching_now_[k] = force[Eigen::Index(i)];
    }
    if (mode.size() > 0) move_as_a_whole(mode);
    place_touching(now_);
}

Eigen::VectorXd CondensedSolid::mean_with_pins(const Eigen::VectorXd& amounts,
                                               const Eigen::VectorXd& on_touching) const
{
    Eigen::VectorXd mean = mean_of_force_.transpose() * on_touching;
    for (std::size_t i = 0; i < parts_of_u_.size(); ++i)
        mean += amounts[Eigen::Index(i)] * parts_of_u_[i].mean_motion;
    return mean;
}

/// Pins take the body as a whole with what they hold. Loads turn with the frame alone: where it
/// floats it takes over what u has of such a motion.
void CondensedSolid::move_as_a_whole(const Eigen::VectorXd& mode)
{
    const Eigen::VectorXd mean = mean_with_pins(amount_now_, on_touching_now_);
    Eigen::VectorXd in_u; // what the modes' part of u changes by
    if (frame_kind() == SolidFrame::floating) {
        in_u = -(mean + mode_now_);
        const Eigen::VectorXd motion = constrained_part(mode - in_u);
        // By the rule of the trapezoid.
        rigid_work_ += 0.5 * (load_on_modes(amount_) + free_.mode_load).dot(motion);
        move_frame(model_, unknowns_, now_, motion);
    } else {
        const Eigen::VectorXd by_pins = mean - mean_now_;
        in_u = constrained_part(mode + by_pins) - by_pins;
    }
    mean_now_ = mean;
    mode_now_ += in_u;
    const Eigen::VectorXd moved = modes_at_touching_ * in_u;
    for (std::size_t k = 0; k < unknowns_.touching.size(); ++k)
        now_.u.segment<3>(3 * unknowns_.touching[k]) += moved.segment<3>(at3(k));
}

/// By reciprocity what a hold needs against them, and the work of it, follow as of other nodes:
/// there a prescribed part moves by one.
void CondensedSolid::add_reaction(const BodyPlace& at, const Vec3& force)
{
    const Vec3 f = now_.frame.turn.conjugate() * force;
    for (const StencilEntry& e : at.nodes) {
        const std::int32_t k = touching_number_[std::size_t(e.node)];
        for (int axis = 0; axis < 3; ++axis)
            if (unknown_of_[std::size_t(3 * k + axis)] < 0)
                on_touching_now_[3 * k + axis] += e.weight * f[axis];
    }
}

BodyEnergy CondensedSolid::accept(const Eigen::VectorXd&)
{
    BodyEnergy e;
    const Eigen::Index n = Eigen::Index(parts_of_u_.size());
    Eigen::VectorXd from_contact(n), on_modes = Eigen::VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Part& p = parts_of_u_[std::size_t(i)];
        from_contact[i] = p.at_touching.dot(on_touching_now_);
        if (!p.prescribed && mode_now_.size() > 0) on_modes[i] = p.on_modes.dot(mode_now_);
    }
    // Loads: force of size one times u. Prescribed: the force that holds, of size one.
    Eigen::VectorXd elastic = between_ * amount_now_ + from_contact;
    for (Eigen::Index i = 0; i < n; ++i)
        if (parts_of_u_[std::size_t(i)].prescribed) elastic[i] -= 2 * from_contact[i];
    for (Eigen::Index i = 0; i < n; ++i) {
        const bool prescribed = parts_of_u_[std::size_t(i)].prescribed;
        e.elastic += 0.5 * amount_now_[i] * elastic[i];
        double work = 0; // by the rule of the trapezoid
        if (prescribed) {
            work = 0.5 * (held_force_[i] + elastic[i]) * (amount_now_[i] - amount_[i]);
            held_force_[i] = elastic[i];
        } else {
            work = 0.5 * (amount_[i] + amount_now_[i]) * (elastic[i] + on_modes[i] - loaded_[i]);
            loaded_[i] = elastic[i] + on_modes[i];
        }
        e.work += work;
        e.work_absolute += std::abs(work);
    }
    Eigen::VectorXd rigid = Eigen::VectorXd::Zero(at3(unknowns_.touching.size()));
    if (mode_now_.size() > 0) rigid = modes_at_touching_ * mode_now_;
    double drive = 0;
    const Mat3 now = now_.frame.turn.toRotationMatrix(),
               before = state_.frame.turn.toRotationMatrix();
    for (std::size_t k = 0; k < unknowns_.touching.size(); ++k) {
        const Vec3 f = on_touching_now_.segment<3>(at3(k)), old = on_touching_.segment<3>(at3(k));
        const Vec3 u = now_.u.segment<3>(3 * unknowns_.touching[k]);
        e.elastic += 0.5 * f.dot(u - rigid.segment<3>(at3(k)));
        if (frame_kind() == SolidFrame::driven && (!f.isZero(0) || !old.isZero(0))) {
            // What drives the frame balances the contacts on its way.
            const Vec3 X = model_.mesh.nodes[std::size_t(unknowns_.touching[k])] + u;
            const Vec3 moved = now_.frame * X - state_.frame * X;
            drive -= 0.5 * (now * f + before * old).dot(moved);
        }
    }
    e.work += drive + rigid_work_;
    e.work_absolute += std::abs(drive) + std::abs(rigid_work_);
    amount_ = amount_now_;
    on_touching_ = on_touching_now_;
    mode_ = mode_now_;
    state_.frame = now_.frame;
    for (const std::int32_t node : unknowns_.touching) {
        state_.u.segment<3>(3 * node) = now_.u.segment<3>(3 * node);
        state_.x[std::size_t(node)] = now_.x[std::size_t(node)];
    }
    complete_ = false;
    return e;
}

std::vector<Vec3> CondensedSolid::reactions() const
{
    std::vector<Vec3> sums(model_.input.hold.size(), Vec3::Zero());
    for (std::size_t i = 0; i < parts_of_u_.size(); ++i)
        if (parts_of_u_[i].prescribed)
            sums[parts_of_u_[i].input][parts_of_u_[i].axis] += held_force_[Eigen::Index(i)];
    for (Vec3& f : sums)
        f = state_.frame.turn * f;
    return sums;
}

std::vector<Vec3> CondensedSolid::moments() const
{
    std::vector<Vec3> sums(model_.input.hold.size(), Vec3::Zero());
    if (sums.empty() || moment_of_part_.cols() != amount_.size()) return sums;
    const Eigen::VectorXd all =
        moment_of_part_ * amount_ + moment_of_contact_.transpose() * on_touching_;
    for (std::size_t k = 0; k < sums.size(); ++k)
        sums[k] = state_.frame.turn * Vec3(all.segment<3>(at3(k)));
    return sums;
}

void CondensedSolid::complete()
{
    if (complete_) return;
    const Eigen::Index size = at3(model_.mesh.nodes.size());
    Eigen::VectorXd f = Eigen::VectorXd::Zero(size), u = f;
    for (std::size_t i = 0; i < parts_of_u_.size(); ++i) {
        const Part& p = parts_of_u_[i];
        const double c = amount_[Eigen::Index(i)];
        if (!p.prescribed) f += c * p.force;
        for (const std::int32_t dof : p.dofs)
            u[dof] = c;
    }
    for (std::size_t k = 0; k < unknowns_.touching.size(); ++k)
        f.segment<3>(3 * unknowns_.touching[k]) += on_touching_.segment<3>(at3(k));
    f -= matrix_->K * u;
    Eigen::VectorXd free(Eigen::Index(unknowns_.dofs.free.size()));
    for (std::size_t i = 0; i < unknowns_.dofs.free.size(); ++i)
        free[Eigen::Index(i)] = f[unknowns_.dofs.free[i]];
    free = solved(model_, unknowns_, *matrix_, border_, free);
    for (std::size_t i = 0; i < unknowns_.dofs.free.size(); ++i)
        u[unknowns_.dofs.free[i]] = free[Eigen::Index(i)];
    if (mode_.size() > 0) u += unknowns_.rigid->R * mode_;
    // Touching nodes keep the bits that the steps gave them.
    for (const std::int32_t node : unknowns_.touching)
        u.segment<3>(3 * node) = state_.u.segment<3>(3 * node);
    state_.u = u;
    update_places(state_);
    now_ = state_;
    complete_ = true;
}

std::vector<double> CondensedSolid::state() const
{
    std::vector<double> s;
    const auto add = [&](const auto& v) { s.insert(s.end(), v.data(), v.data() + v.size()); };
    add(state_.frame.turn.coeffs());
    add(state_.frame.shift);
    for (const std::int32_t node : unknowns_.touching)
        add(Vec3(state_.u.segment<3>(3 * node)));
    add(amount_);
    add(on_touching_);
    add(mode_);
    add(loaded_);
    add(held_force_);
    s.push_back(same_columns_);
    const std::vector<double> columns = kept_columns(*matrix_, kept_, unknowns_);
    s.insert(s.end(), columns.begin(), columns.end());
    return s;
}

/// The state is made of what each hold and load does: it contains no others.
std::vector<double> CondensedSolid::state_from(const Body& before) const
{
    const auto* solid = dynamic_cast<const CondensedSolid*>(&before);
    if (!solid || solid->unknowns_.touching != unknowns_.touching ||
        solid->model_.mesh.nodes != model_.mesh.nodes ||
        solid->parts_of_u_.size() != parts_of_u_.size())
        return {};
    for (std::size_t i = 0; i < parts_of_u_.size(); ++i) {
        const Part &a = parts_of_u_[i], &b = solid->parts_of_u_[i];
        if (a.prescribed != b.prescribed || a.axis != b.axis || a.dofs != b.dofs ||
            a.force.size() != b.force.size() || a.force != b.force)
            return {};
    }
    return before.state();
}

void CondensedSolid::set_state(std::span<const double> s)
{
    const auto take = [&](auto& v) {
        std::copy_n(s.begin(), v.size(), v.data());
        s = s.subspan(std::size_t(v.size()));
    };
    take(state_.frame.turn.coeffs());
    take(state_.frame.shift);
    for (const std::int32_t node : unknowns_.touching) {
        Vec3 u;
        take(u);
        state_.u.segment<3>(3 * node) = u;
    }
    take(amount_);
    take(on_touching_);
    take(mode_);
    take(loaded_);
    take(held_force_);
    same_columns_ = int(s[0]);
    keep_columns(*matrix_, kept_, s.subspan(1));
    motions_.reset();
    place_touching(state_);
    now_ = state_;
    complete_ = false;
}

} // namespace amontons
