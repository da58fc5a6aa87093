#include "mesh/base/curve.hpp"
#include "mesh/base/dense.hpp"
#include "solver/body/node_index.hpp"
#include "solver/body/solid_body.hpp"

#include "solver/body/drive.hpp"

#include <Eigen/LU>

// The frame that carries a solid, its motion as a whole and its momenta.

namespace amontons {
namespace {

/// The turn that brings the shape X nearest to x, both about their centres, weighted by mass.
Mat3 nearest_turn(const std::vector<Vec3>& X, const std::vector<Vec3>& x, const Vec3& X_centre,
                  const Vec3& x_centre, const Eigen::VectorXd& weight)
{
    Mat3 F = Mat3::Zero();
    for (std::size_t i = 0; i < X.size(); ++i)
        F += weight[at3(i)] * (x[i] - x_centre) * (X[i] - X_centre).transpose();
    return polar_rotation(F);
}

struct WholeMotion {
    Vec3 shift, turn;
};

/// The shift of the middle and the small turn about it that are nearest to the nodes' motion.
WholeMotion nearest_motion(const std::vector<Vec3>& X, const Vec3& middle,
                           const Eigen::VectorXd& motion)
{
    Vec3 shift = Vec3::Zero(), moment = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
    for (std::size_t i = 0; i < X.size(); ++i) {
        const Vec3 arm = X[i] - middle, d = motion.segment<3>(at3(i));
        shift += d / double(X.size());
        moment += arm.cross(d);
        inertia += arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose();
    }
    return {shift, solve_symmetric(inertia, moment)};
}

/// Forces or motions of all nodes, turned.
Eigen::VectorXd turned(const Mat3& R, const Eigen::VectorXd& f)
{
    Eigen::VectorXd out(f.size());
    Eigen::Map<Eigen::Matrix3Xd>(out.data(), 3, f.size() / 3).noalias() =
        R * Eigen::Map<const Eigen::Matrix3Xd>(f.data(), 3, f.size() / 3);
    return out;
}

} // namespace

Placement frame_at(const SolidModel& model, double t)
{
    const Placement start = start_placement(model.input.start);
    return model.input.drive.given ? driven_placement(model.input.drive, start, model.middle, t)
                                   : start;
}

void place_nodes(const SolidModel& model, SolidMotion& m)
{
    const Mat3 R = m.frame.turn.toRotationMatrix();
    for (std::size_t i = 0; i < m.x.size(); ++i)
        m.x[i] = R * (model.mesh.nodes[i] + Vec3(m.u.segment<3>(at3(i)))) + m.frame.shift;
}

Vec3 centre_of_mass(const SolidModel& model, const std::vector<Vec3>& x)
{
    const Eigen::VectorXd& lumped = *model.lumped;
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        sum += lumped[at3(i)] * x[i];
        total += lumped[at3(i)];
    }
    return sum / total;
}

void into_frame_displacements(const SolidModel& model, SolidMotion& m)
{
    const Mat3 back = m.frame.turn.toRotationMatrix().transpose();
    for (std::size_t i = 0; i < m.x.size(); ++i)
        m.u.segment<3>(at3(i)) = back * (m.x[i] - m.frame.shift) - model.mesh.nodes[i];
}

void float_frame(const SolidModel& model, SolidMotion& m)
{
    const Vec3 X = centre_of_mass(model, model.mesh.nodes), x = centre_of_mass(model, m.x);
    const Mat3 R = nearest_turn(model.mesh.nodes, m.x, X, x, *model.lumped);
    m.frame.turn = Eigen::Quaterniond(R).normalized();
    m.frame.shift = x - m.frame.turn * X;
    into_frame_displacements(model, m);
}

Eigen::VectorXd into_frame(const SolidMotion& of, const Eigen::VectorXd& f)
{
    if (of.frame.turn.coeffs() == Eigen::Quaterniond::Identity().coeffs()) return f;
    return turned(of.frame.turn.toRotationMatrix().transpose(), f);
}

Eigen::VectorXd into_space(const SolidMotion& of, const Eigen::VectorXd& f)
{
    if (of.frame.turn.coeffs() == Eigen::Quaterniond::Identity().coeffs()) return f;
    return turned(of.frame.turn.toRotationMatrix(), f);
}

void move_frame(const SolidModel& model, const SolidUnknowns& unknowns, SolidMotion& m,
                const Eigen::VectorXd& mode)
{
    const WholeMotion motion =
        nearest_motion(model.mesh.nodes, model.middle, unknowns.rigid->R * mode);
    const Eigen::Quaterniond turn = rotation(motion.turn);
    // x = frame (turn (X + u - middle) + middle + shift)
    m.frame.shift = m.frame * (model.middle + motion.shift - turn * model.middle);
    m.frame.turn = (m.frame.turn * turn).normalized();
}

Vec3 mean_spin(const SolidModel& model, const SolidMotion& of)
{
    const Eigen::VectorXd& lumped = *model.lumped;
    const Vec3 x = centre_of_mass(model, of.x);
    Vec3 momentum = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
    for (std::size_t i = 0; i < of.x.size(); ++i) {
        const Vec3 arm = of.x[i] - x;
        const double m = lumped[at3(i)];
        momentum += m * arm.cross(Vec3(of.v.segment<3>(at3(i))));
        inertia += m * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    return solve_symmetric(inertia, momentum);
}

std::string mode_name_of(const SolidModel& model, const SolidUnknowns& unknowns,
                         const Eigen::VectorXd& a)
{
    const WholeMotion motion =
        nearest_motion(model.mesh.nodes, model.middle, unknowns.rigid->R * a);
    return name_of_motion(motion.shift, model.size * motion.turn);
}

void SolidBody::drive_to(const Placement& frame)
{
    driven_to_ = frame;
    now_.frame = frame;
    place_in_frame(now_);
}

double SolidBody::prescribed_motion(double from, double to) const
{
    Vec3 held = Vec3::Zero(); // along each axis
    const Eigen::VectorXd moved = held_displacements(model_.conditions, model_.mesh, to) -
                                  held_displacements(model_.conditions, model_.mesh, from);
    for (std::size_t i = 0; i < model_.conditions.held.size(); ++i) {
        double& most = held[model_.conditions.held[i].dof % 3];
        most = std::max(most, std::abs(moved[Eigen::Index(i)]));
    }
    if (!model_.input.drive.given) return held.norm();
    const Placement a = frame_at(from), b = frame_at(to);
    return held.norm() + (b * model_.middle - a * model_.middle).norm() +
           a.turn.angularDistance(b.turn) * 2 * size_;
}

std::vector<Vec3> SolidBody::at_touching() const
{
    std::vector<Vec3> u;
    for (const std::int32_t node : unknowns_.touching)
        u.push_back(now_.u.segment<3>(3 * node));
    return u;
}

SolidBody::Unstrained SolidBody::unstrained() const
{
    Unstrained whole{now_.frame, Vec3::Zero()};
    Vec3 sum = Vec3::Zero(), count = Vec3::Zero();
    // What is held where nothing touches is not kept in u.
    const Eigen::VectorXd held = held_displacements(model_.conditions, model_.mesh, step_.end());
    for (std::size_t i = 0; i < model_.conditions.held.size(); ++i) {
        sum[model_.conditions.held[i].dof % 3] += held[Eigen::Index(i)];
        count[model_.conditions.held[i].dof % 3] += 1;
    }
    for (int k = 0; k < 3; ++k)
        if (count[k] > 0) whole.shift[k] = sum[k] / count[k];
    // Only its own state determines where it would be. Of a condensed body only the places that
    // touch are known; its frame floats with it.
    if (count.isZero(0) && !model_.input.drive.given && !condensed()) {
        Motion floating = now_;
        float_frame(model_, floating);
        whole.frame = floating.frame;
    }
    return whole;
}

std::vector<std::string> SolidBody::free_motions() const
{
    constexpr Eigen::Index kAll = 6; // their axes would be any
    if (model_.conditions.held.empty() && unknowns_.rigid->R.cols() == kAll)
        return {"every shift and turn"};
    std::vector<std::string> names;
    for (Eigen::Index m = 0; m < unknowns_.rigid->R.cols(); ++m)
        names.push_back(mode_name(Eigen::VectorXd::Unit(unknowns_.rigid->R.cols(), m)));
    return names;
}

Eigen::VectorXd SolidBody::constrained_part(const Eigen::VectorXd& mode) const
{
    if (unconstrained_.rows() != mode.size()) return mode;
    return mode - unconstrained_ * (unconstrained_.transpose() * mode);
}

double SolidBody::kinetic_energy() const
{
    if (at_state_.momentum.size() == 0 && state_.v.isZero(0)) return 0; // the mass is not needed
    const Eigen::VectorXd& p = momenta();
    return p.size() > 0 ? 0.5 * state_.v.dot(p) : 0;
}

std::vector<double> SolidBody::velocities() const
{
    return {state_.v.data(), state_.v.data() + state_.v.size()};
}

void SolidBody::swap_velocities(std::vector<double>& velocities)
{
    velocities.resize(std::size_t(state_.v.size()));
    std::ranges::swap_ranges(velocities, std::span(state_.v.data(), velocities.size()));
    if (model_.material.density > 0) at_state_.momentum = mass_times(model_, state_.v);
    at_state_.spin.reset();
}

double SolidBody::speed() const
{
    if (!step_.dynamic || state_.v.size() == 0) return 0;
    return Eigen::Map<const Eigen::Matrix3Xd>(state_.v.data(), 3, state_.v.size() / 3)
        .colwise()
        .norm()
        .maxCoeff();
}

Vec3 SolidBody::momentum() const
{
    const Eigen::VectorXd& of_nodes = momenta();
    Vec3 p = Vec3::Zero();
    for (Eigen::Index i = 0; i < of_nodes.size(); i += 3)
        p += of_nodes.segment<3>(i);
    return p;
}

Vec3 SolidBody::angular_momentum() const
{
    const Eigen::VectorXd& of_nodes = momenta();
    Vec3 L = Vec3::Zero();
    for (Eigen::Index i = 0; i < of_nodes.size(); i += 3)
        L += state_.x[std::size_t(i / 3)].cross(Vec3(of_nodes.segment<3>(i)));
    return L;
}

} // namespace amontons
