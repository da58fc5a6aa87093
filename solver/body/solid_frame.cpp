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

Vec3 SolidBody::centre(const std::vector<Vec3>& x) const
{
    const Eigen::VectorXd& lumped = *lumped_;
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        sum += lumped[at3(i)] * x[i];
        total += lumped[at3(i)];
    }
    return sum / total;
}

void SolidBody::drive_to(const Placement& frame)
{
    driven_to_ = frame;
    now_.frame = frame;
    place_in_frame(now_);
}

Placement SolidBody::frame_at(double t) const
{
    if (driven_to_) return *driven_to_;
    const Placement start = start_placement(input_.start);
    return input_.drive.given ? driven_placement(input_.drive, start, middle_, t) : start;
}

double SolidBody::prescribed_motion(double from, double to) const
{
    Vec3 held = Vec3::Zero(); // along each axis
    const Eigen::VectorXd moved =
        held_displacements(conditions_, mesh_, to) - held_displacements(conditions_, mesh_, from);
    for (std::size_t i = 0; i < conditions_.held.size(); ++i) {
        double& most = held[conditions_.held[i].dof % 3];
        most = std::max(most, std::abs(moved[Eigen::Index(i)]));
    }
    if (!input_.drive.given) return held.norm();
    const Placement a = frame_at(from), b = frame_at(to);
    return held.norm() + (b * middle_ - a * middle_).norm() +
           a.turn.angularDistance(b.turn) * 2 * size_;
}

std::vector<Vec3> SolidBody::at_touching() const
{
    std::vector<Vec3> u;
    for (const std::int32_t node : touching_)
        u.push_back(now_.u.segment<3>(3 * node));
    return u;
}

SolidBody::Unstrained SolidBody::unstrained() const
{
    Unstrained whole{now_.frame, Vec3::Zero()};
    Vec3 sum = Vec3::Zero(), count = Vec3::Zero();
    // What is held where nothing touches is not kept in u.
    const Eigen::VectorXd held = held_displacements(conditions_, mesh_, step_.end());
    for (std::size_t i = 0; i < conditions_.held.size(); ++i) {
        sum[conditions_.held[i].dof % 3] += held[Eigen::Index(i)];
        count[conditions_.held[i].dof % 3] += 1;
    }
    for (int k = 0; k < 3; ++k)
        if (count[k] > 0) whole.shift[k] = sum[k] / count[k];
    // Only its own state determines where it would be. Of a condensed body only the places that
    // touch are known; its frame floats with it.
    if (count.isZero(0) && !input_.drive.given && !condensed()) {
        Motion floating = now_;
        float_frame(floating);
        whole.frame = floating.frame;
    }
    return whole;
}

void SolidBody::update_places(Motion& m)
{
    m.version = ++last_version_;
    const Mat3 R = m.frame.turn.toRotationMatrix();
    for (std::size_t i = 0; i < m.x.size(); ++i)
        m.x[i] = R * (mesh_.nodes[i] + Vec3(m.u.segment<3>(at3(i)))) + m.frame.shift;
}

/// u from the places in the present frame.
void SolidBody::into_frame_displacements(Motion& m) const
{
    const Mat3 back = m.frame.turn.toRotationMatrix().transpose();
    for (std::size_t i = 0; i < m.x.size(); ++i)
        m.u.segment<3>(at3(i)) = back * (m.x[i] - m.frame.shift) - mesh_.nodes[i];
}

void SolidBody::float_frame(Motion& m) const
{
    const Vec3 X = centre(mesh_.nodes), x = centre(m.x);
    const Mat3 R = nearest_turn(mesh_.nodes, m.x, X, x, *lumped_);
    m.frame.turn = Eigen::Quaterniond(R).normalized();
    m.frame.shift = x - m.frame.turn * X;
    into_frame_displacements(m);
}

Eigen::VectorXd SolidBody::into_frame(const Eigen::VectorXd& f) const
{
    if (now_.frame.turn.coeffs() == Eigen::Quaterniond::Identity().coeffs()) return f;
    return turned(now_.frame.turn.toRotationMatrix().transpose(), f);
}

Eigen::VectorXd SolidBody::into_space(const Eigen::VectorXd& f) const
{
    if (now_.frame.turn.coeffs() == Eigen::Quaterniond::Identity().coeffs()) return f;
    return turned(now_.frame.turn.toRotationMatrix(), f);
}

std::string SolidBody::mode_name(const Eigen::VectorXd& a) const
{
    const WholeMotion motion = nearest_motion(mesh_.nodes, middle_, rigid_->R * a);
    return name_of_motion(motion.shift, size_ * motion.turn);
}

std::vector<std::string> SolidBody::free_motions() const
{
    constexpr Eigen::Index kAll = 6; // their axes would be any
    if (conditions_.held.empty() && rigid_->R.cols() == kAll) return {"every shift and turn"};
    std::vector<std::string> names;
    for (Eigen::Index m = 0; m < rigid_->R.cols(); ++m)
        names.push_back(mode_name(Eigen::VectorXd::Unit(rigid_->R.cols(), m)));
    return names;
}

Eigen::VectorXd SolidBody::mean_motion(const Eigen::VectorXd& u) const
{
    return (rigid_->R.transpose() * u).cwiseQuotient(rigid_->R.colwise().squaredNorm().transpose());
}

Eigen::VectorXd SolidBody::constrained_part(const Eigen::VectorXd& mode) const
{
    if (unconstrained_.rows() != mode.size()) return mode;
    return mode - unconstrained_ * (unconstrained_.transpose() * mode);
}

void SolidBody::move_frame(Motion& m, const Eigen::VectorXd& mode) const
{
    const WholeMotion motion = nearest_motion(mesh_.nodes, middle_, rigid_->R * mode);
    const Eigen::Quaterniond turn = rotation(motion.turn);
    // x = frame (turn (X + u - middle) + middle + shift)
    m.frame.shift = m.frame * (middle_ + motion.shift - turn * middle_);
    m.frame.turn = (m.frame.turn * turn).normalized();
}

Eigen::VectorXd SolidBody::stiffness_times(const Eigen::VectorXd& u) const
{
    return symmetric_times(*pattern_, matrix_->K, u, threads_);
}

Eigen::VectorXd SolidBody::mass_times(const Eigen::VectorXd& v) const
{
    Eigen::VectorXd out(v.size());
    Eigen::Map<Eigen::Matrix3Xd>(out.data(), 3, v.size() / 3).noalias() =
        Eigen::Map<const Eigen::Matrix3Xd>(v.data(), 3, v.size() / 3) * *m_;
    return out;
}

double SolidBody::kinetic_energy() const
{
    if (momentum_.size() == 0 && state_.v.isZero(0)) return 0; // the mass is not needed
    const Eigen::VectorXd& p = momenta();
    return p.size() > 0 ? 0.5 * state_.v.dot(p) : 0;
}

/// The turn of the whole that has the velocities' angular momentum, by lumped masses.
void SolidBody::find_spin()
{
    const Eigen::VectorXd& lumped = *lumped_;
    const Vec3 x = centre(state_.x);
    Vec3 momentum = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
    for (std::size_t i = 0; i < state_.x.size(); ++i) {
        const Vec3 arm = state_.x[i] - x;
        const double m = lumped[at3(i)];
        momentum += m * arm.cross(Vec3(state_.v.segment<3>(at3(i))));
        inertia += m * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    spin_ = solve_symmetric(inertia, momentum);
}

/// The rules of time-stepping lose some angular momentum of a body that turns; what loads and
/// contacts gave it is exact, and the difference is put back as a turn of the whole. All of it
/// about the body's own centre: a load that passes there turns nothing, however fast the body
/// flies.
/// @param reached  momentum of the iterate's velocities
/// @return  the energy that the turn brings [J]
double SolidBody::keep_angular_momentum(const Eigen::VectorXd& load, const Eigen::VectorXd& reached)
{
    // Damping takes some, too: not that of rates of strain, whose forces have no moment.
    if (input_.mass_damping > 0 || (input_.stiffness_damping > 0 && !corotational_)) return 0;
    const double h = step_.h, end = step_.rule.end, theta = step_.rule.filtered ? 0.5 : end;
    const auto sum = [](const Eigen::VectorXd& v) {
        return Vec3(Eigen::Map<const Eigen::Matrix3Xd>(v.data(), 3, v.size() / 3).rowwise().sum());
    };
    // The centre of the consistent mass: a turn about it has no momentum.
    const double mass = weights_->sum();
    const auto centre_of = [&](const std::vector<Vec3>& x) {
        return Vec3(Eigen::Map<const Eigen::Matrix3Xd>(x.front().data(), 3, weights_->size()) *
                    *weights_ / mass);
    };
    const Vec3 x0 = centre_of(state_.x), x1 = centre_of(now_.x);
    const Eigen::VectorXd contact = into_space(contact_);
    Eigen::VectorXd arms(now_.v.size());
    Vec3 own = Vec3::Zero(), missing = Vec3::Zero(); // own: of contacts where the nodes move
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
        const Vec3 arm = now_.x[i] - x1, before = state_.x[i] - x0;
        missing += before.cross(Vec3(momentum_.segment<3>(at3(i)))) +
                   ((1 - theta) * before + theta * arm).cross(h * Vec3(load.segment<3>(at3(i)))) -
                   arm.cross(Vec3(reached.segment<3>(at3(i))));
        own += arm.cross(Vec3(contact.segment<3>(at3(i))));
        arms.segment<3>(at3(i)) = arm;
    }
    // As a rigid body: the centre continues to x1 with a share of the end velocity, whose momentum
    // has no moment about it.
    const Vec3 passed = x1 - h * end / mass * sum(reached);
    missing += contact_moment_ ? Vec3(*contact_moment_ - passed.cross(sum(contact))) : own;
    const Eigen::VectorXd weighted = mass_times(arms);
    Mat3 S = Mat3::Zero();
    Vec3 momentum = Vec3::Zero();
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
        const Vec3 arm = arms.segment<3>(at3(i));
        S += arm * weighted.segment<3>(at3(i)).transpose();
        momentum += arm.cross(Vec3(reached.segment<3>(at3(i))));
    }
    const Mat3 inertia = S.trace() * Mat3::Identity() - 0.5 * (S + S.transpose());
    const Vec3 spin = inertia.inverse() * missing;
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.v.segment<3>(at3(i)) += spin.cross(Vec3(arms.segment<3>(at3(i))));
    return spin.dot(momentum + 0.5 * missing);
}

std::vector<double> SolidBody::velocities() const
{
    return {state_.v.data(), state_.v.data() + state_.v.size()};
}

void SolidBody::swap_velocities(std::vector<double>& velocities)
{
    velocities.resize(std::size_t(state_.v.size()));
    std::ranges::swap_ranges(velocities, std::span(state_.v.data(), velocities.size()));
    if (material_.density > 0) momentum_ = mass_times(state_.v);
    spin_.reset();
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
