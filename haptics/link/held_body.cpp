#include "haptics/link/held_body.hpp"

#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

HeldBody::HeldBody(const BodyRef& body, const Vec3& origin, const HandleSpring& spring)
    : body_(body)
    , inner_(*body.body)
    , origin_(origin)
    , spring_(spring)
{
    const Placement at = body.rigid ? body.rigid->placement() : body.solid->frame();
    state_ = {at * origin_, at.turn};
    now_ = device_ = state_;
    nonlinear_ = inner_.nonlinear();
    size_ = inner_.size();
}

Placement HeldBody::placement(const HandPose& pose) const
{
    return {pose.rotation, pose.position - pose.rotation * origin_};
}

void HeldBody::drive()
{
    if (body_.rigid)
        body_.rigid->drive_to(placement(now_));
    else
        body_.solid->drive_to(placement(now_));
}

void HeldBody::put(const HandPose& pose)
{
    state_ = now_ = pose;
    drive();
}

Vec6 HeldBody::spring_compliance() const
{
    const double per = step_.dynamic ? 1 / (step_.h * step_.h) : 1;
    Vec6 c;
    c.head<3>().setConstant(per / spring_.stiffness);
    c.tail<3>().setConstant(per / spring_.turn_stiffness);
    return c;
}

void HeldBody::begin(const StepInput& step)
{
    step_ = step;
    now_ = state_;
    begun_ = state_.position;
    drive();
    inner_.begin(step);
}

void HeldBody::add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                          std::vector<Eigen::Triplet<double>>& out) const
{
    inner_.add_column(at, direction, scale, column, out);
    if (at.turns) {
        for (int i = 0; i < 3; ++i)
            out.emplace_back(inner_.matrix().unknowns() + 3 + i, column, scale * direction[i]);
        return;
    }
    Vec3 moment = Vec3::Zero();
    double weight = 1;
    if (at.nodes.empty()) {
        moment = (at.point - (at.half_way ? now_.position : arm_from())).cross(direction);
    } else {
        weight = 0;
        for (const StencilEntry& e : at.nodes) {
            const Vec3 arm = body_.solid->places()[std::size_t(e.node)] - now_.position;
            moment += e.weight * arm.cross(direction);
            weight += e.weight;
        }
    }
    const int first = inner_.matrix().unknowns();
    for (int i = 0; i < 3; ++i) {
        out.emplace_back(first + i, column, scale * weight * direction[i]);
        out.emplace_back(first + 3 + i, column, scale * moment[i]);
    }
}

Eigen::VectorXd HeldBody::free_change() const
{
    const int n = inner_.matrix().unknowns();
    Eigen::VectorXd y(n + 6);
    y.head(n) = inner_.matrix().free_change();
    const double per = step_.dynamic ? 1 / step_.h : 1;
    y.tail<6>() = per * amontons::displacement(now_, device_);
    return y;
}

void HeldBody::held_compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    if (inner_.matrix().unknowns() == 0)
        W.setZero(C.cols(), C.cols());
    else
        inner_.matrix().compliance(C.topRows(inner_.matrix().unknowns()), W);
}

void HeldBody::compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    held_compliance(C, W);
    const Eigen::MatrixXd frame = C.bottomRows(6);
    const Eigen::MatrixXd moved = spring_compliance().asDiagonal() * frame;
    W.noalias() += frame.transpose() * moved;
    W = 0.5 * (W + W.transpose()).eval();
}

Eigen::VectorXd HeldBody::solve(const Eigen::VectorXd& force)
{
    const int n = inner_.matrix().unknowns();
    Eigen::VectorXd y(n + 6);
    if (n > 0) y.head(n) = inner_.matrix().solve(force.head(n));
    y.tail<6>() = spring_compliance().cwiseProduct(force.tail<6>());
    return y;
}

void HeldBody::update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                      const Eigen::VectorXd& force)
{
    const int n = inner_.matrix().unknowns();
    if (n > 0) inner_.update(y.head(n), mode, force.head(n));
    const Vec6 moved = (step_.dynamic ? step_.h : 1) * y.tail<6>();
    now_.position += moved.head<3>();
    now_.rotation = (turn(moved.tail<3>()) * now_.rotation).normalized();
    drive();
}

double HeldBody::imbalance(const Eigen::VectorXd& force)
{
    const int n = inner_.matrix().unknowns();
    const double inner = n > 0 ? inner_.imbalance(force.head(n)) : 0;
    // Springs: displacement to the device = - give * force, axis by axis.
    const Vec6 f = force.tail<6>();
    const Vec6 off = (step_.dynamic ? 1 / step_.h : 1) * amontons::displacement(device_, now_) -
                     spring_compliance().cwiseProduct(f);
    const Vec6 size = spring_compliance().cwiseProduct(f);
    // Of a handle on which nothing but round-off acts the ratio would be one of round-offs.
    constexpr double kRounding = 1e-14;
    const double per = step_.dynamic ? 1 / step_.h : 1,
                 place = std::max(now_.position.norm(), size_);
    const double shift = off.head<3>().norm(), swing = off.tail<3>().norm();
    double own = 0;
    if (shift > kRounding * per * place) own = shift / size.head<3>().norm();
    if (swing > kRounding * per) own = std::max(own, swing / size.tail<3>().norm());
    return std::max(inner, own);
}

BodyEnergy HeldBody::accept(const Eigen::VectorXd& force)
{
    const int n = inner_.matrix().unknowns();
    const BodyEnergy e = inner_.accept(force.head(n));
    state_ = now_;
    const double per = step_.dynamic ? 1 / step_.h : 1;
    force_ = {per * force.segment<3>(n), per * force.segment<3>(n + 3)};
    return e;
}

std::vector<double> HeldBody::state() const
{
    std::vector<double> s = inner_.state();
    const auto add = [&](const auto& v) { s.insert(s.end(), v.data(), v.data() + v.size()); };
    add(state_.position);
    add(state_.rotation.coeffs());
    return s;
}

void HeldBody::set_state(std::span<const double> s)
{
    inner_.set_state(s.first(s.size() - 7));
    s = s.last(7);
    std::copy_n(s.begin(), 3, state_.position.data());
    std::copy_n(s.begin() + 3, 4, state_.rotation.coeffs().data());
    now_ = state_;
    drive();
}

} // namespace amontons
