#include "mesh/base/dense.hpp"
#include "solver/body/node_index.hpp"
#include "solver/body/solid_body.hpp"

#include "mesh/base/curve.hpp"
#include "solver/body/hyperelastic_input.hpp"
#include "solver/linear/gmres.hpp"
#include "solver/solid/face_load.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

// What is its own in a hyperelastic solid. Newton's step is that of SolidBody, with
//  - a factor of the symmetric tangent; where it is not positive, nodes are made stiffer along the
//    forces of contacts on them, and if that is not enough all of it by a share of the stiffness at
//    rest; what that leaves out of the true one (the skew part of pressures that follow, the
//    shift while a volume is prescribed) is taken in by GMRES, with the factor as preconditioner;
//  - steps shortened where an element would turn inside out, or where they lead away;
//  - what is prescribed moved with the first change, as far as that is made: the places inside
//    come along instead of being run over;
//  - loads whose pressure is an unknown and whose volume is prescribed, as a border.
// Equations: docs/theory/hyperelasticity.md.

namespace amontons {
namespace {

constexpr int kMostHalvings = 12;
constexpr int kStepPatience = 4;   // iterations that do not halve the error, before steps shorten
constexpr double kOvershoot = 0.8; // slope at the end of a shortened step, of that at its start
// Of GMRES: a share of the last error, so that Newton's steps stay quadratic.
constexpr double kKrylovShare = 1e-2, kFinestKrylov = 1e-12, kCoarsestKrylov = 1e-5;
constexpr int kMostKrylov = 60;

} // namespace

/// Every step starts from the state's own internal modes, whatever was tried before.
void SolidBody::begin_hyperelastic()
{
    for (std::size_t e = 0; e < hyper_.states.size(); ++e)
        hyper_.states[e].modes = hyper_.accepted_modes[e];
    known_.version = -1;
    hyper_.tangent_u.resize(0);
    hyper_.fault.clear();
    tangent_.indefinite = false;
    search_.stalled = 0;
    search_.last_error = std::numeric_limits<double>::infinity();
    tangent_.shift = tangent_.last_shift = 0;
    search_.accepted_length = 1;
    search_.pending.resize(0);
    for (VolumeLoads::Load& v : volumes_.loads)
        v.pressure = v.state_pressure;
}

/// The matrix of a step at the iterate, with all that keeps it positive.
void SolidBody::assemble_tangent(SparseMatrix& S)
{
    tangent_.skew = assemble_hyperelastic(model_, unknowns_, step_, hyper_, volumes_, S);
    if (tangent_.shift > 0 && !volumes_.loads.empty()) {
        Elimination parts = make_elimination(S, unknowns_.dofs);
        tangent_.unshifted = std::move(parts.ff);
    } else {
        tangent_.unshifted.resize(0, 0);
    }
    if (unknowns_.modes.cols() > 0) border_.turning = S * unknowns_.rigid->R;
    if (tangent_.shift > 0) S.coeffs() += tangent_.shift * matrix_->K.coeffs();
    if (tangent_.shift != 0) stabilise(model_, unknowns_, *matrix_, step_, contact_, tangent_, S);
    if (unknowns_.modes.cols() > 0)
        support_body(model_, unknowns_, *matrix_,
                     tangent_.shift != 0 ? tangent_.stabilised : SparseColumns(), border_, S);
}

/// A^-1 f of the true tangent's free part, without the border of volumes. What contacts move is by
/// the symmetric part alone: where they push, so is this, or the two never cancel.
Eigen::VectorXd SolidBody::newton_solved(const Eigen::VectorXd& f) const
{
    const bool held = unknowns_.modes.cols() == 0; // or the factor is not that of the matrix alone
    const bool shifted = held && tangent_.unshifted.rows() > 0;
    const bool skew = held && tangent_.skew.nonZeros() > 0 && contact_.on_unknowns.isZero(0);
    if (f.size() == 0 || (!shifted && !skew))
        return solved(model_, unknowns_, *matrix_, border_, f);
    const double scale = step_.dynamic ? step_.h * step_.rule.end * step_.h * step_.rule.end : 1;
    const Eigen::SparseMatrix<double>& A = shifted ? tangent_.unshifted : matrix_->parts.ff;
    const double tolerance =
        std::clamp(kKrylovShare * search_.last_error, kFinestKrylov, kCoarsestKrylov);
    return gmres(
               [&](const Eigen::VectorXd& x) {
                   Eigen::VectorXd y = A * x;
                   if (skew) y += scale * (tangent_.skew * x);
                   return y;
               },
               [&](const Eigen::VectorXd& x) {
                   return solved(model_, unknowns_, *matrix_, border_, x);
               },
               f, tolerance, kMostKrylov)
        .x;
}

/// The pressures' border: how volumes answer to pressures.
void SolidBody::find_volumes()
{
    const auto count = Eigen::Index(volumes_.loads.size());
    volumes_.force.resize(Eigen::Index(unknowns_.dofs.free.size()), count);
    volumes_.compliance.resize(Eigen::Index(unknowns_.dofs.free.size()), count);
    for (Eigen::Index k = 0; k < count; ++k) {
        const SolidConditions::Load& load =
            model_.conditions.loads[volumes_.loads[std::size_t(k)].load];
        volumes_.force.col(k) =
            free_part(unknowns_, follower_pressure(model_.mesh, load.faces->members, now_.u, 1));
        volumes_.compliance.col(k) = newton_solved(volumes_.force.col(k));
    }
    volumes_.matrix = LuFactor(volumes_.force.transpose() * volumes_.compliance).inverse();
}

/// A held body that touches nothing, under the loads of its balance: the step begins at its end.
bool SolidBody::nothing_changed() const
{
    const bool alone = !step_.dynamic && unknowns_.touching.empty() &&
                       unknowns_.modes.cols() == 0 && volumes_.loads.empty() &&
                       frame_kind() == SolidFrame::fixed;
    if (!alone || std::isfinite(search_.last_error) || search_.pending.size() > 0 ||
        at_state_.unstable)
        return false;
    return at_state_.load.size() > 0 ? into_space(now_, last_.load) == at_state_.load
                                     : last_.load.isZero(0) && now_.u.isZero(0);
}

void SolidBody::linearise_hyperelastic()
{
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    free_.mode_load.resize(0);
    tangent_.kept = true;
    if (!hyper_.fault.empty() ||
        nothing_changed()) { // a fault is reported, the step not continued with
        free_.change = Eigen::VectorXd::Zero(Eigen::Index(unknowns_.dof.size()));
        return;
    }
    tangent_.kept = false;
    tangent_.last_shift = tangent_.shift;
    tangent_.shift = 0;
    expect_pressures(model_, hyper_);
    if (unknowns_.modes.cols() > 0) turn_modes(model_, now_, unknowns_);
    make_matrix();
    if (!hyper_.fault.empty()) {
        free_.change = Eigen::VectorXd::Zero(Eigen::Index(unknowns_.dof.size()));
        return;
    }
    if (unknowns_.modes.cols() > 0) {
        bend_modes(model_, *matrix_, unknowns_, border_);
        free_.mode_load = unknowns_.modes.transpose() * unknown_part(unknowns_, r);
    }
    search_.start_residual = free_part(unknowns_, r);
    Eigen::VectorXd rf = search_.start_residual;
    if (search_.pending.size() > 0 && !unknowns_.dofs.fixed.empty()) {
        Eigen::VectorXd moved(Eigen::Index(unknowns_.dofs.fixed.size()));
        for (std::size_t i = 0; i < unknowns_.dofs.fixed.size(); ++i)
            moved[Eigen::Index(i)] = search_.pending[unknowns_.dofs.fixed[i]];
        rf -= matrix_->parts.fc * moved;
    }
    Eigen::VectorXd y = newton_solved(rf);
    if (!volumes_.loads.empty()) {
        find_volumes();
        volumes_.change.resize(Eigen::Index(volumes_.loads.size()));
        for (std::size_t k = 0; k < volumes_.loads.size(); ++k) {
            const SolidConditions::Load& load = model_.conditions.loads[volumes_.loads[k].load];
            double missing = curve_value(load.input->volume, step_.end()) -
                             swept_volume(model_.mesh, load.faces->members, now_.u);
            if (search_.pending.size() > 0)
                missing -= follower_pressure(model_.mesh, load.faces->members, now_.u, 1)
                               .dot(search_.pending);
            volumes_.change[Eigen::Index(k)] = missing;
        }
        volumes_.change =
            (volumes_.matrix * (volumes_.change - volumes_.force.transpose() * y)).eval();
        y += volumes_.compliance * volumes_.change;
    }
    free_.change = with_pins(unknowns_, y);
}

/// Moves the iterate by as much of a change as inverts no element; by less if steps have
/// not come nearer to a balance for a while, or the matrix was not the tangent: then no further
/// than where the forces along the step have turned.
void SolidBody::change_hyperelastic(const Eigen::VectorXd& whole, const Eigen::VectorXd& mode)
{
    const Motion start = now_;
    Eigen::VectorXd move = whole;
    Eigen::VectorXd pressure = volumes_.change;
    if (!step_.dynamic) {
        if (search_.pending.size() > 0) move += search_.pending;
        if (mode.size() > 0) {
            const Eigen::VectorXd by_modes = unknowns_.modes * constrained_part(mode);
            for (std::size_t i = 0; i < unknowns_.dof.size(); ++i)
                move[unknowns_.dof[i]] += by_modes[Eigen::Index(i)];
        }
        if (!volumes_.loads.empty()) // what contacts take of the volume, pressures give back
            pressure -= volumes_.matrix * (volumes_.compliance.transpose() *
                                           free_part(unknowns_, contact_.on_unknowns));
    }
    const Eigen::VectorXd velocity = step_.dynamic ? into_space(now_, whole) : Eigen::VectorXd();
    const auto try_share = [&](double share) {
        now_ = start;
        if (step_.dynamic) {
            now_.v += share * velocity;
            follow_velocity();
        } else {
            now_.u += share * move;
            for (std::size_t k = 0; k < volumes_.loads.size(); ++k)
                volumes_.loads[k].pressure += share * pressure[Eigen::Index(k)];
            update_places(now_);
        }
        Eigen::VectorXd f;
        inner_forces(now_, f);
        return hyper_.fault.empty();
    };
    const auto back = [&](double share) {
        for (std::size_t k = 0; k < volumes_.loads.size(); ++k)
            volumes_.loads[k].pressure -= share * pressure[Eigen::Index(k)];
    };
    const Eigen::VectorXd y = free_part(unknowns_, whole),
                          force = free_part(unknowns_, contact_.on_unknowns);
    const bool search = !step_.dynamic && volumes_.loads.empty() && search_.pending.size() == 0 &&
                        mode.size() == 0 &&
                        (tangent_.shift > 0 || search_.stalled >= kStepPatience);
    const double slope = search ? y.dot(search_.start_residual + force) : 0;
    double share = 1;
    for (int k = 0; k <= kMostHalvings; ++k, share *= 0.5) {
        if (try_share(share)) {
            if (!search || !(slope > 0)) break;
            Eigen::VectorXd scale;
            if (y.dot(free_part(unknowns_, residual(scale)) + force) >= -kOvershoot * slope) break;
        }
        if (k < kMostHalvings) back(share);
    }
    search_.accepted_length = hyper_.fault.empty() ? share : 0;
    if (search_.pending.size() > 0) {
        search_.pending *= 1 - share;
        if (share == 1) search_.pending.resize(0);
    }
}

// The midpoint rule keeps the energy of a linear solid. The force half way is not what a law that
// stiffens stores on the way: the step is then too long for it.
std::string SolidBody::spurious_energy_report()
{
    constexpr double kMost = 1e-2;      // of the energy
    constexpr double kRounding = 1e-14; // of stiffness times size squared: a body at rest has none
    if (!model_.hyperelastic || !step_.dynamic) return "";
    Eigen::VectorXd inner;
    const Eigen::VectorXd momentum = mass_times(model_, now_.v), dv = now_.v - state_.v;
    const double kinetic = 0.5 * now_.v.dot(momentum),
                 before = 0.5 * state_.v.dot(at_state_.momentum);
    const double stored = inner_forces(now_, inner);
    double taken = 0;        // the work of the forces that the rule took
    if (step_.rule.filtered) // of which those are kept in space
        for (std::size_t i = 0; i < now_.x.size(); ++i)
            taken += (now_.x[i] - state_.x[i]).dot(Vec3(last_.inner.segment<3>(at3(i))));
    else
        taken = (now_.u - state_.u).dot(last_.inner);
    const double made = stored - at_state_.energy - taken -
                        (step_.rule.end - 0.5) * dv.dot(momentum - at_state_.momentum);
    const double energy = std::max(kinetic + stored, before + at_state_.energy);
    if (made <= kMost * energy + kRounding * matrix_->stiffest * size_ * size_) return "";
    return fmt::format("{}: the time integration rule generates {:.2g} J in the step",
                       model_.input.name, made);
}

void SolidBody::accept_hyperelastic()
{
    for (std::size_t e = 0; e < hyper_.states.size(); ++e)
        hyper_.accepted_modes[e] = hyper_.states[e].modes;
    for (VolumeLoads::Load& v : volumes_.loads)
        v.state_pressure = v.pressure;
    at_state_.unstable = tangent_.shift > 0 && volumes_.loads.empty();
    remark_.clear();
    const auto remark = [&](const std::string& what) {
        remark_ += (remark_.empty() ? "" : "; ") + model_.input.name + ": " + what;
    };
    if (at_state_.unstable)
        remark(std::string(kNotStable) + ": the tangent is not positive");
    else if (tangent_.shift > 0)
        remark("beyond the largest load: only the prescribed volume holds it");
    else if (tangent_.indefinite)
        remark("snapped: the tangent was not positive on the way");
    if (const std::string soft = unstable_elements(model_, state_.u); !soft.empty()) remark(soft);
}

std::vector<double> SolidBody::found_pressures() const
{
    std::vector<double> all;
    for (const VolumeLoads::Load& v : volumes_.loads)
        all.push_back(v.state_pressure);
    return all;
}

} // namespace amontons
