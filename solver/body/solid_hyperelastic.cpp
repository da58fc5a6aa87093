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

void SolidBody::make_hyperelastic_elements(const std::string& file)
{
    law_ = hyperelastic_of(input_, file);
    material_.youngs_modulus = youngs_modulus(law_);
    material_.poissons_ratio = poissons_ratio(law_);
    hyper_ = hyperelastic_elements(input_, law_, mesh_, file);
    for (const HyperelasticElement& e : hyper_)
        state_modes_.push_back(e.kind == ElementKind::H8
                                   ? InternalModes(InternalModes::Zero(kMostInternalModes))
                                   : InternalModes());
    hyper_states_.resize(hyper_.size());
    force_size_ = Eigen::VectorXd::Zero(at3(mesh_.nodes.size()));
    for (std::size_t i = 0; i < conditions_.loads.size(); ++i)
        if (!conditions_.loads[i].input->volume.empty()) volumes_.push_back({i, 0, 0});
}

Eigen::VectorXd SolidBody::free_part(const Eigen::VectorXd& all) const
{
    Eigen::VectorXd part(Eigen::Index(dofs_.free.size()));
    for (std::size_t i = 0; i < dofs_.free.size(); ++i)
        part[Eigen::Index(i)] = all[dofs_.free[i]];
    return part;
}

Eigen::VectorXd SolidBody::unknown_part(const Eigen::VectorXd& all) const
{
    Eigen::VectorXd part(Eigen::Index(unknown_.size()));
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        part[Eigen::Index(i)] = all[unknown_[i]];
    return part;
}

double SolidBody::hyperelastic_inner(const Motion& m, Eigen::VectorXd& f)
{
    if (m.version == known_version_) {
        f = known_forces_;
        return known_energy_;
    }
    double energy = 0;
    ElementPlaces x;
    ElementVector forces;
    force_size_.setZero();
    known_version_ = -1;
    fault_.clear();
    for_each_element(mesh_, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
        if (!fault_.empty()) return;
        x = displaced_places(mesh_, nodes, m.u);
        HyperelasticState& s = hyper_states_[std::size_t(e)];
        const ElementFault fault = hyperelastic_forces(hyper_[std::size_t(e)], law_, x, s, forces);
        if (fault != ElementFault::none) {
            fault_ = fmt::format("{}: {} {}", input_.name, element_place(mesh_, e),
                                 fault == ElementFault::inverted ? "would be inverted"
                                                                 : "buckles within itself");
            return;
        }
        energy += s.energy;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            const Eigen::Index at = 3 * Eigen::Index(i);
            f.segment<3>(3 * nodes[i]) += forces.segment<3>(at);
            force_size_.segment<3>(3 * nodes[i]) += forces.segment<3>(at).cwiseAbs();
        }
    });
    if (!fault_.empty()) return 0;
    if (!conditions_.supports.empty()) {
        Eigen::VectorXd of_support = Eigen::VectorXd::Zero(f.size());
        energy += add_support_forces(m.u, of_support);
        f += of_support;
        force_size_ += of_support.cwiseAbs();
    }
    known_version_ = m.version;
    known_forces_ = f;
    known_energy_ = energy;
    known_u_ = m.u;
    return energy;
}

/// Every step starts from the state's own internal modes, whatever was tried before.
void SolidBody::begin_hyperelastic()
{
    for (std::size_t e = 0; e < hyper_states_.size(); ++e)
        hyper_states_[e].modes = state_modes_[e];
    known_version_ = -1;
    tangent_u_.resize(0);
    fault_.clear();
    indefinite_ = false;
    stalled_ = 0;
    last_error_ = std::numeric_limits<double>::infinity();
    shift_ = last_shift_ = 0;
    accepted_step_length_ = 1;
    pending_.resize(0);
    for (VolumeLoad& v : volumes_)
        v.pressure = v.state_pressure;
}

/// The elements' tangents, and the symmetric part of that of pressures; the rest into skew_.
void SolidBody::assemble_tangent(SparseMatrix& S)
{
    std::vector<std::vector<std::pair<std::int32_t, double>>> pressed; // of each element: face, p
    const auto press = [&](const FaceSet& faces, double p) {
        if (p == 0) return;
        pressed.resize(hyper_.size());
        for (const FaceRef& face : faces.members)
            pressed[std::size_t(face.element)].emplace_back(face.face, p);
    };
    const double t = step_.dynamic ? step_.start + step_.rule.end * step_.h : step_.end();
    for (const SolidConditions::Load& load : conditions_.loads)
        if (!load.input->pressure.empty())
            press(*load.faces, step_.load * curve_value(load.input->pressure, t));
    for (const VolumeLoad& v : volumes_)
        press(*conditions_.loads[v.load].faces, v.pressure);

    std::vector<Eigen::Triplet<double>> skew;
    std::vector<Mat3> blocks;
    assemble(
        mesh_, *pattern_,
        [&](std::int32_t e, ElementKind kind, std::span<const std::int32_t> nodes,
            ElementMatrix& K) {
            const ElementPlaces x = displaced_places(mesh_, nodes, known_u_);
            hyperelastic_tangent(hyper_[std::size_t(e)], law_, x, hyper_states_[std::size_t(e)], K);
            if (pressed.empty()) return;
            for (const auto& [face, p] : pressed[std::size_t(e)]) {
                const LocalFace& local = shape_of(kind).faces[std::size_t(face)];
                const auto on = local.nodes();
                const auto n = Eigen::Index(on.size());
                FaceForces y(3, n);
                for (Eigen::Index i = 0; i < n; ++i)
                    y.col(i) = x.col(on[std::size_t(i)]);
                const FaceTangent T = pressure_tangent(y, p);
                for (Eigen::Index j = 0; j < n; ++j)
                    for (Eigen::Index i = 0; i < n; ++i) {
                        const Mat3 ij = T.block<3, 3>(3 * i, 3 * j),
                                   ji = T.block<3, 3>(3 * j, 3 * i);
                        const Eigen::Index a = 3 * on[std::size_t(i)], b = 3 * on[std::size_t(j)];
                        K.block<3, 3>(a, b) -= 0.5 * (ij + ji.transpose());
                        const Mat3 rest = 0.5 * (ji.transpose() - ij);
                        for (int c = 0; c < 3; ++c)
                            for (int r = 0; r < 3; ++r) {
                                const std::int32_t row = dofs_.number[std::size_t(
                                                       3 * nodes[std::size_t(a / 3)] + r)],
                                                   column = dofs_.number[std::size_t(
                                                       3 * nodes[std::size_t(b / 3)] + c)];
                                if (row >= 0 && column >= 0)
                                    skew.emplace_back(row, column, rest(r, c));
                            }
                    }
            }
        },
        S);
    if (!conditions_.supports.empty()) S.coeffs() += support_->coeffs();
    const auto free = Eigen::Index(dofs_.free.size());
    skew_.resize(free, free);
    skew_.setFromTriplets(skew.begin(), skew.end());
    // Inside a set of faces the skew parts cancel: what is left is of its rim.
    const double size = skew_.nonZeros() > 0 ? S.coeffs().cwiseAbs().maxCoeff() : 0;
    skew_.prune([&](Eigen::Index, Eigen::Index, double v) { return std::abs(v) > 1e-14 * size; });
    if (shift_ > 0 && !volumes_.empty()) {
        Elimination parts = make_elimination(S, dofs_);
        true_part_ = std::move(parts.ff);
    } else {
        true_part_.resize(0, 0);
    }
    if (free_modes_.cols() > 0) turning_ = S * rigid_->R;
    if (shift_ > 0) S.coeffs() += shift_ * matrix_->K.coeffs();
    if (shift_ != 0) stabilise(S);
    if (free_modes_.cols() > 0) support_body(S);
}

/// A^-1 f of the true tangent's free part, without the border of volumes. What contacts move is by
/// the symmetric part alone: where they push, so is this, or the two never cancel.
Eigen::VectorXd SolidBody::newton_solved(const Eigen::VectorXd& f) const
{
    const bool held = free_modes_.cols() == 0; // or the factor is not that of the matrix alone
    const bool shifted = held && true_part_.rows() > 0;
    const bool skew = held && skew_.nonZeros() > 0 && contact_.isZero(0);
    if (f.size() == 0 || (!shifted && !skew)) return solved(f);
    const double scale = step_.dynamic ? step_.h * step_.rule.end * step_.h * step_.rule.end : 1;
    const Eigen::SparseMatrix<double>& A = shifted ? true_part_ : matrix_->parts.ff;
    const double tolerance = std::clamp(kKrylovShare * last_error_, kFinestKrylov, kCoarsestKrylov);
    return gmres(
               [&](const Eigen::VectorXd& x) {
                   Eigen::VectorXd y = A * x;
                   if (skew) y += scale * (skew_ * x);
                   return y;
               },
               [&](const Eigen::VectorXd& x) { return solved(x); }, f, tolerance, kMostKrylov)
        .x;
}

/// The pressures' border: how volumes answer to pressures.
void SolidBody::find_volumes()
{
    const auto count = Eigen::Index(volumes_.size());
    volume_force_.resize(Eigen::Index(dofs_.free.size()), count);
    volume_compliance_.resize(Eigen::Index(dofs_.free.size()), count);
    for (Eigen::Index k = 0; k < count; ++k) {
        const SolidConditions::Load& load = conditions_.loads[volumes_[std::size_t(k)].load];
        volume_force_.col(k) = free_part(follower_pressure(mesh_, load.faces->members, now_.u, 1));
        volume_compliance_.col(k) = newton_solved(volume_force_.col(k));
    }
    volume_matrix_ = LuFactor(volume_force_.transpose() * volume_compliance_).inverse();
}

/// Newton's method on places and mean pressures together, of which the tangent at places has taken
/// the pressures out: a matrix is made with the pressures that the last one led to, not with those
/// that the places answer with.
void SolidBody::expect_pressures()
{
    ElementPlaces x, move;
    for_each_element(mesh_, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
        double& pressure = hyper_states_[std::size_t(e)].pressure;
        pressure = std::numeric_limits<double>::quiet_NaN();
        if (tangent_u_.size() == 0) return;
        x = displaced_places(mesh_, nodes, tangent_u_);
        move = displaced_places(mesh_, nodes, known_u_) - x;
        pressure = pressure_after(hyper_[std::size_t(e)], law_, x, move);
    });
    tangent_u_ = known_u_;
}

/// A held body that touches nothing, under the loads of its balance: the step begins at its end.
bool SolidBody::nothing_changed() const
{
    const bool alone = !step_.dynamic && touching_.empty() && free_modes_.cols() == 0 &&
                       volumes_.empty() && frame_kind() == Frame::fixed;
    if (!alone || std::isfinite(last_error_) || pending_.size() > 0 || unstable_) return false;
    return load_.size() > 0 ? into_space(last_load_) == load_
                            : last_load_.isZero(0) && now_.u.isZero(0);
}

void SolidBody::linearise_hyperelastic()
{
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    mode_load_.resize(0);
    matrix_kept_ = true;
    if (!fault_.empty() || nothing_changed()) { // a fault is reported, the step not continued with
        free_change_ = Eigen::VectorXd::Zero(Eigen::Index(unknown_.size()));
        return;
    }
    matrix_kept_ = false;
    last_shift_ = shift_;
    shift_ = 0;
    expect_pressures();
    if (free_modes_.cols() > 0) turn_modes();
    make_matrix();
    if (!fault_.empty()) {
        free_change_ = Eigen::VectorXd::Zero(Eigen::Index(unknown_.size()));
        return;
    }
    if (free_modes_.cols() > 0) {
        bend_modes();
        mode_load_ = free_modes_.transpose() * unknown_part(r);
    }
    start_residual_ = free_part(r);
    Eigen::VectorXd rf = start_residual_;
    if (pending_.size() > 0 && !dofs_.fixed.empty()) {
        Eigen::VectorXd moved(Eigen::Index(dofs_.fixed.size()));
        for (std::size_t i = 0; i < dofs_.fixed.size(); ++i)
            moved[Eigen::Index(i)] = pending_[dofs_.fixed[i]];
        rf -= matrix_->parts.fc * moved;
    }
    Eigen::VectorXd y = newton_solved(rf);
    if (!volumes_.empty()) {
        find_volumes();
        volume_change_.resize(Eigen::Index(volumes_.size()));
        for (std::size_t k = 0; k < volumes_.size(); ++k) {
            const SolidConditions::Load& load = conditions_.loads[volumes_[k].load];
            double missing = curve_value(load.input->volume, step_.end()) -
                             swept_volume(mesh_, load.faces->members, now_.u);
            if (pending_.size() > 0)
                missing -= follower_pressure(mesh_, load.faces->members, now_.u, 1).dot(pending_);
            volume_change_[Eigen::Index(k)] = missing;
        }
        volume_change_ = (volume_matrix_ * (volume_change_ - volume_force_.transpose() * y)).eval();
        y += volume_compliance_ * volume_change_;
    }
    free_change_ = with_pins(y);
}

/// Moves the iterate by as much of a change as inverts no element; by less if steps have
/// not come nearer to a balance for a while, or the matrix was not the tangent: then no further
/// than where the forces along the step have turned.
void SolidBody::change_hyperelastic(const Eigen::VectorXd& whole, const Eigen::VectorXd& mode)
{
    const Motion start = now_;
    Eigen::VectorXd move = whole;
    Eigen::VectorXd pressure = volume_change_;
    if (!step_.dynamic) {
        if (pending_.size() > 0) move += pending_;
        if (mode.size() > 0) {
            const Eigen::VectorXd by_modes = free_modes_ * constrained_part(mode);
            for (std::size_t i = 0; i < unknown_.size(); ++i)
                move[unknown_[i]] += by_modes[Eigen::Index(i)];
        }
        if (!volumes_.empty()) // what contacts take of the volume, pressures give back
            pressure -= volume_matrix_ * (volume_compliance_.transpose() * free_part(contact_));
    }
    const Eigen::VectorXd velocity = step_.dynamic ? into_space(whole) : Eigen::VectorXd();
    const auto try_share = [&](double share) {
        now_ = start;
        if (step_.dynamic) {
            now_.v += share * velocity;
            follow_velocity();
        } else {
            now_.u += share * move;
            for (std::size_t k = 0; k < volumes_.size(); ++k)
                volumes_[k].pressure += share * pressure[Eigen::Index(k)];
            update_places(now_);
        }
        Eigen::VectorXd f;
        inner_forces(now_, f);
        return fault_.empty();
    };
    const auto back = [&](double share) {
        for (std::size_t k = 0; k < volumes_.size(); ++k)
            volumes_[k].pressure -= share * pressure[Eigen::Index(k)];
    };
    const Eigen::VectorXd y = free_part(whole), force = free_part(contact_);
    const bool search = !step_.dynamic && volumes_.empty() && pending_.size() == 0 &&
                        mode.size() == 0 && (shift_ > 0 || stalled_ >= kStepPatience);
    const double slope = search ? y.dot(start_residual_ + force) : 0;
    double share = 1;
    for (int k = 0; k <= kMostHalvings; ++k, share *= 0.5) {
        if (try_share(share)) {
            if (!search || !(slope > 0)) break;
            Eigen::VectorXd scale;
            if (y.dot(free_part(residual(scale)) + force) >= -kOvershoot * slope) break;
        }
        if (k < kMostHalvings) back(share);
    }
    accepted_step_length_ = fault_.empty() ? share : 0;
    if (pending_.size() > 0) {
        pending_ *= 1 - share;
        if (share == 1) pending_.resize(0);
    }
}

// The midpoint rule keeps the energy of a linear solid. The force half way is not what a law that
// stiffens stores on the way: the step is then too long for it.
std::string SolidBody::spurious_energy_report()
{
    constexpr double kMost = 1e-2;      // of the energy
    constexpr double kRounding = 1e-14; // of stiffness times size squared: a body at rest has none
    if (!hyperelastic_ || !step_.dynamic) return "";
    Eigen::VectorXd inner;
    const Eigen::VectorXd momentum = mass_times(now_.v), dv = now_.v - state_.v;
    const double kinetic = 0.5 * now_.v.dot(momentum), before = 0.5 * state_.v.dot(momentum_);
    const double stored = inner_forces(now_, inner);
    double taken = 0;        // the work of the forces that the rule took
    if (step_.rule.filtered) // of which those are kept in space
        for (std::size_t i = 0; i < now_.x.size(); ++i)
            taken += (now_.x[i] - state_.x[i]).dot(Vec3(last_inner_.segment<3>(at3(i))));
    else
        taken = (now_.u - state_.u).dot(last_inner_);
    const double made =
        stored - state_energy_ - taken - (step_.rule.end - 0.5) * dv.dot(momentum - momentum_);
    const double energy = std::max(kinetic + stored, before + state_energy_);
    if (made <= kMost * energy + kRounding * stiffest_ * size_ * size_) return "";
    return fmt::format("{}: the time integration rule generates {:.2g} J in the step", input_.name,
                       made);
}

void SolidBody::accept_hyperelastic()
{
    for (std::size_t e = 0; e < hyper_states_.size(); ++e)
        state_modes_[e] = hyper_states_[e].modes;
    for (VolumeLoad& v : volumes_)
        v.state_pressure = v.pressure;
    unstable_ = shift_ > 0 && volumes_.empty();
    remark_.clear();
    const auto remark = [&](const std::string& what) {
        remark_ += (remark_.empty() ? "" : "; ") + input_.name + ": " + what;
    };
    if (unstable_)
        remark(std::string(kNotStable) + ": the tangent is not positive");
    else if (shift_ > 0)
        remark("beyond the largest load: only the prescribed volume holds it");
    else if (indefinite_)
        remark("snapped: the tangent was not positive on the way");
    if (const std::string soft = unstable_material_report(state_.u); !soft.empty()) remark(soft);
}

/// Where a law that loses its stiffness under pressure has lost it; "" if nowhere.
std::string SolidBody::unstable_material_report(const Eigen::VectorXd& u) const
{
    if (!hyperelastic_ || !(law_.law->least_stretch > 0)) return "";
    double least = 1;
    std::int32_t where = 0;
    for_each_element(mesh_, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const ElementPlaces X = places_of(mesh_, nodes), x = displaced_places(mesh_, nodes, u);
        const Vec3 centre = kind == ElementKind::H8 ? Vec3(0, 0, 0) : Vec3(0.25, 0.25, 0.25);
        const ShapeGradients d = shape_gradients(kind, centre);
        const Mat3 J = X * d.transpose(), F = x * (J.inverse().transpose() * d).transpose();
        const double l =
            std::sqrt(std::max(0.0, symmetric_eigenvalues(Mat3(F.transpose() * F))[0]));
        if (l < least) {
            least = l;
            where = e;
        }
    });
    if (least >= law_.law->least_stretch) return "";
    return fmt::format("{} is pressed to {:.3g} of its length, below {:.3g}: {} is unstable there",
                       element_place(mesh_, where), least, law_.law->least_stretch, law_.law->name);
}

/// How far the volumes are from what is prescribed, relative to it [-].
double SolidBody::volumes_missing() const
{
    constexpr double kSmall = 1e-6; // of the body's size, cubed: a volume of 0 has no scale
    double worst = 0;
    for (const VolumeLoad& v : volumes_) {
        const SolidConditions::Load& load = conditions_.loads[v.load];
        const double target = curve_value(load.input->volume, step_.end());
        const double scale = std::abs(target) + kSmall * size_ * size_ * size_;
        worst = std::max(
            worst, std::abs(target - swept_volume(mesh_, load.faces->members, now_.u)) / scale);
    }
    return worst;
}

std::vector<double> SolidBody::found_pressures() const
{
    std::vector<double> all;
    for (const VolumeLoad& v : volumes_)
        all.push_back(v.state_pressure);
    return all;
}

} // namespace amontons
