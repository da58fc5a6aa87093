#include "solver/step/body_stepper.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/rigid_body.hpp"

#include <algorithm>
#include <cmath>
#include <map>

// Rigid bodies suspended from joints and springs, at rest.
//
// A rotation about a joint is no motion along its rows: the stiffness of a pendulum is geometric,
// since the joint's force F does not rotate with its arm p from the body's centre to the joint.
// With a rotation t the moment p x F changes by (t x p) x F, so that loads on the modes change by
// -S t with
//
//   S = (p . F) 1 - (p F^T + F p^T) / 2
//
// (its skew part is half the moment, which other forces balance). The second derivatives of a joint
// on motions that its rows allow are this of both its bodies. A force f along the line between two
// places, of length l, adds -f / l J^T (1 - e e^T) J: J of the motion of one place against the
// other. Away from the balance S need not be positive; there |S| of each body plus the unbalanced
// force times the arm reduces the energy from any start.

namespace amontons {
namespace {

constexpr double kNearBalance = 0.1; // out of balance, of |F| |p|: S itself leads there
constexpr double kSupport = 1e-6; // of |F| |p|: stiffness against rotations without rows and loads

/// The motion of a place on a rigid body by its six unknowns; its last three columns are what a
/// turn does by the arm p from the centre.
Eigen::MatrixXd motion_at(const Body& body, const BodyPlace& at)
{
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 6);
    std::vector<Eigen::Triplet<double>> column;
    for (int i = 0; i < 3; ++i) {
        column.clear();
        body.add_column(at, Vec3::Unit(i), 1, 0, column);
        for (const auto& entry : column)
            J(i, entry.row()) += entry.value();
    }
    return J;
}

Mat3 stiffness_of_arm(const Vec3& p, const Vec3& F)
{
    const Mat3 product = p * F.transpose();
    return p.dot(F) * Mat3::Identity() - 0.5 * (product + product.transpose());
}

Mat3 magnitude(const Mat3& S)
{
    const SymmetricEigen e = symmetric_eigen(Eigen::MatrixXd(S));
    return e.vectors * e.values.cwiseAbs().asDiagonal() * e.vectors.transpose();
}

} // namespace

/// Some joint leaves a free rigid body turns that its rows do not see.
bool BodyStepper::hangs() const
{
    if (step_.dynamic || system_.couplings.empty()) return false;
    std::map<int, int> rows; // of each of the scene's couplings
    for (const Coupling& c : system_.couplings)
        ++rows[c.input];
    constexpr int kWeld = 6;
    const auto free = [&](int b) {
        return b >= 0 && system_.refs[std::size_t(b)].rigid && !fixed(std::size_t(b));
    };
    return std::ranges::any_of(system_.couplings, [&](const Coupling& c) {
        const bool turn_spring = c.turns && !c.square;
        return rows[c.input] < kWeld && !c.slides && !turn_spring &&
               (free(c.a.body) || free(c.b.body));
    });
}

/// Rows are those of joints alone, of bodies whose modes are all that moves: the iteration is
/// Newton's.
bool BodyStepper::only_hangs() const
{
    if (hanging_.empty()) return false;
    if (!rows_.chosen.empty() && rows_.chosen.front() < int(list_.contact.size())) return false;
    for (std::size_t b = 0; b < bodies(); ++b)
        if (!rows_.row[b].empty() && !fixed(b) && !system_.refs[b].rigid) return false;
    return true;
}

/// Derivative of the loads on the modes by the modes at the iterate, with the known forces.
void BodyStepper::find_hanging()
{
    hanging_ = {};
    if (hangs()) find_hanging_on_joints();
    if (rolls_) find_rolling();
}

/// S of all modes by the last forces, its replacement where it is not positive, and the support of
/// rotations without a load. Before the first forces the loads are used.
void BodyStepper::find_hanging_on_joints()
{
    const std::vector<Eigen::Index> first = first_modes();
    const Eigen::Index modes = first.back();
    const auto free = [&](std::size_t b) {
        return system_.refs[b].rigid && mode_load_[b].size() > 0;
    };
    double load = 0, pull = 0; // of all bodies and joints [N]
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (mode_load_[b].size() == 0) continue;
        if (stressed(b)) return;
        if (system_.refs[b].rigid) load += mode_load_[b].head<3>().norm();
    }
    constexpr Eigen::Index kMostModes = 1200; // dense algebra on them
    if (modes > kMostModes) return;
    const int contacts_here = int(list_.contact.size());
    std::vector<Mat3> own(bodies(), Mat3::Zero());
    std::vector<double> passing(bodies(), 0), longest(bodies(), 0); // |F| |p| [N m]; |p| [m]
    std::vector<ActingForce> acting;
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(modes, modes), pulls = S;

    // ---- Forces of joints and springs at their arms
    for (int c = 0; c < contacts_here + int(system_.couplings.size()); ++c) {
        const auto known = force_.find(key(c));
        if (c < contacts_here) {
            if (known != force_.end()) {
                const BodyContact& contact = list_.contact[std::size_t(c)];
                const int n = rows_of(system_.finder.pairs(), contact);
                const Vec3 f = contact.frame.transpose() * known->second;
                acting.push_back({c, contact.frame.leftCols(n) * f.head(n)});
            }
            continue;
        }
        const Coupling& coupling = system_.couplings[std::size_t(c - contacts_here)];
        const CouplingRow& row = joints_[std::size_t(c - contacts_here)];
        double f = 0;
        if (known != force_.end())
            f = known->second.x();
        else if (coupling.softness > 0 && !coupling.turns)
            f = -row.value / coupling.softness;
        pull = coupling.turns ? pull : pull + std::abs(f);
        if (f != 0) acting.push_back({c, f * row.direction});
        Eigen::MatrixXd apart = Eigen::MatrixXd::Zero(3, modes);
        for (const Side& side : sides_of(contacts(), c)) {
            if (side.body < 0) continue;
            const auto b = std::size_t(side.body);
            if (!free(b)) continue;
            if (coupling.square) { // f arm a . b
                const Mat3 product = row.axis_a * row.axis_b.transpose();
                own[b] -= 0.5 * f * coupling.arm * (product + product.transpose());
            }
            if (side.place.turns) continue;
            const Eigen::MatrixXd J = motion_at(body(b), side.place);
            const Vec3 p(J(1, 5), J(2, 3), J(0, 4)); // t x p
            longest[b] = std::max(longest[b], p.norm());
            passing[b] += std::abs(f) * p.norm();
            if (!coupling.slides) own[b] += stiffness_of_arm(p, side.sign * f * row.direction);
            apart.middleCols(first[b], 6) += side.sign * J * body(b).matrix().modes();
        }
        if (!coupling.along_line || !(row.length > 0)) continue;
        const Mat3 across = Mat3::Identity() - row.direction * row.direction.transpose();
        const Eigen::MatrixXd turned = 1 / row.length * apart.transpose() * across * apart;
        S -= f * turned;
        pulls += std::max(-f, load) * turned;
    }
    if (!(load + pull > 0)) return;

    // ---- S, what replaces it, and what supports turns that nothing loads
    std::vector<Eigen::VectorXd> forces;
    forces_on_bodies(contacts(), acting, forces);
    hanging_.away = pulls;
    hanging_.support = Eigen::VectorXd::Zero(modes);
    bool near = !acting.empty();
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (!free(b) || !(longest[b] > 0)) continue;
        const Eigen::MatrixXd turns = body(b).matrix().modes().bottomRightCorner(3, 3);
        const bool known = passing[b] > 0;
        const double size = known ? passing[b] : load * longest[b];
        const Eigen::VectorXd left =
            mode_load_[b] + body(b).matrix().modes().transpose() * forces[b];
        const double moment =
            known ? std::min((turns.inverse() * left.tail(3)).norm(), size) : size;
        near &= known && moment <= kNearBalance * size;
        const auto to_modes = [&](const Mat3& stiffness) {
            return Eigen::MatrixXd(turns.transpose() * stiffness * turns);
        };
        S.block(first[b] + 3, first[b] + 3, 3, 3) += to_modes(own[b]);
        hanging_.away.block(first[b] + 3, first[b] + 3, 3, 3) +=
            to_modes(magnitude(own[b]) + moment * Mat3::Identity());
        hanging_.support.segment(first[b] + 3, 3) =
            to_modes(kSupport * size * Mat3::Identity()).diagonal();
    }
    hanging_.stiffness = S;
    hanging_.used = near ? S : hanging_.away;
    hanging_.load = load + pull;
}

/// Of the modes of a body that no row constrains, those that do not change the loads on it either.
Eigen::MatrixXd BodyStepper::unloaded_modes(std::size_t b,
                                            const Eigen::MatrixXd& unconstrained) const
{
    constexpr double kNoChange = 1e-5; // of S
    if (hanging_.empty() || unconstrained.cols() == 0) return unconstrained;
    const Eigen::MatrixXd S = of_body(hanging_.stiffness, b);
    const SymmetricEigen e =
        symmetric_eigen(Eigen::MatrixXd(unconstrained.transpose() * S * unconstrained));
    std::vector<Eigen::Index> unloaded;
    for (Eigen::Index i = 0; i < e.values.size(); ++i)
        if (!(std::abs(e.values[i]) > kNoChange * S.norm())) unloaded.push_back(i);
    return unconstrained * e.vectors(Eigen::all, unloaded);
}

/// An unstable balance of bodies that hang, as of one above its joint, is left along its lowest
/// mode. K = S + B^T W^-1 B with the elastic W of what holds them.
/// @return  whether they were; never where they touch something, whose surfaces S leaves out
bool BodyStepper::leave_unstable_balance()
{
    constexpr double kAside = 0.1;  // rad
    constexpr double kStiff = 1e-9; // of the rows' compliance: what rigid bodies hold by
    constexpr double kMargin = 1e-3;
    if (hanging_.empty() || left_unstable_ || nothing_) return false;
    for (int c = 0; c < int(list_.contact.size()); ++c)
        if (force_.count(key(c)) > 0) return false;
    find_hanging();
    if (hanging_.empty()) return false;
    const std::vector<Eigen::Index> seen = seen_modes();
    const Eigen::MatrixXd S = hanging_.stiffness(seen, seen);
    Eigen::MatrixXd held = elastic_W_;
    if (held.rows() != coupled_B_.rows() || coupled_B_.cols() != S.cols()) return false;
    const double largest = coupled_B_.cwiseAbs2().rowwise().sum().maxCoeff();
    const double stiff = S.norm() > 0 ? largest / S.norm() : 0;
    held.diagonal().array() += kStiff * std::max(held.diagonal().cwiseAbs().mean(), stiff);
    const Eigen::MatrixXd root = cholesky_root(held);
    if (root.size() == 0) return false;
    const Eigen::MatrixXd half = root.transpose().triangularView<Eigen::Lower>().solve(coupled_B_);
    const SymmetricEigen e = symmetric_eigen(Eigen::MatrixXd(S + half.transpose() * half));
    if (!e.converged || !(e.values[0] < -kMargin * S.norm())) return false;
    left_unstable_ = true;
    Eigen::VectorXd way = Eigen::VectorXd::Zero(hanging_.stiffness.cols());
    way(seen) = e.vectors.col(0);
    double longest = 0;
    const std::vector<Eigen::Index> first = first_modes();
    const auto of = [&](std::size_t b) { return way.segment(first[b], mode_load_[b].size()); };
    for (std::size_t b = 0; b < bodies(); ++b)
        if (mode_load_[b].size() > 0) longest = std::max(longest, of(b).norm() / body(b).size());
    for (std::size_t b = 0; b < bodies(); ++b)
        if (system_.refs[b].rigid && mode_load_[b].size() > 0)
            body(b).update(Eigen::VectorXd::Zero(body(b).matrix().unknowns()),
                           kAside / longest * of(b), body_force_[b]);
    return true;
}

/// Of each body, the number of its first mode among those of all; behind them the number of all.
std::vector<Eigen::Index> BodyStepper::first_modes() const
{
    std::vector<Eigen::Index> first{0};
    for (const Eigen::VectorXd& load : mode_load_)
        first.push_back(first.back() + load.size());
    return first;
}

/// The block of a body's own modes.
Eigen::MatrixXd BodyStepper::of_body(const Eigen::MatrixXd& all, std::size_t b) const
{
    const Eigen::Index first = first_modes()[b], size = mode_load_[b].size();
    return all.block(first, first, size, size);
}

/// Of the modes of all bodies, those of bodies with chosen rows.
std::vector<Eigen::Index> BodyStepper::seen_modes() const
{
    std::vector<Eigen::Index> seen;
    const std::vector<Eigen::Index> first = first_modes();
    for (std::size_t b = 0; b < bodies(); ++b)
        for (Eigen::Index i = 0; i < B_[b].cols(); ++i)
            seen.push_back(first[b] + i);
    return seen;
}

/// Change of the loads on a body's modes with the amplitudes of all modes.
Eigen::VectorXd BodyStepper::change_by_hanging(std::size_t b) const
{
    Eigen::VectorXd all = Eigen::VectorXd::Zero(hanging_.used.cols());
    const std::vector<Eigen::Index> first = first_modes();
    for (std::size_t k = 0; k < bodies(); ++k)
        if (mode_[k].size() > 0) all.segment(first[k], mode_[k].size()) = mode_[k];
    Eigen::VectorXd change = hanging_.used.middleRows(first[b], mode_load_[b].size()) * all;
    if (hanging_.pull.size() > 0) change -= hanging_.pull.segment(first[b], mode_load_[b].size());
    return change;
}

/// How far rigid bodies that hang are from balance, of the forces on them, at the iterate.
double BodyStepper::hanging_imbalance(const std::vector<Eigen::VectorXd>& forces) const
{
    double worst = 0;
    if (hanging_.empty()) return worst;
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (!system_.refs[b].rigid || mode_load_[b].size() == 0 || rows_.row[b].empty()) continue;
        const Eigen::MatrixXd& R = body(b).matrix().modes();
        const double size =
            mode_load_[b].norm() +
            (R.transpose() * (rows_.columns[b].cwiseAbs() * own(rows_, r_, b).cwiseAbs())).norm();
        const Eigen::VectorXd left = mode_load_[b] + R.transpose() * forces[b];
        if (size > 0) worst = std::max(worst, left.norm() / size);
    }
    return worst;
}

} // namespace amontons
