#include "solver/step/body_stepper.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/rigid_body.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

// Rigid bodies on curved surfaces, at rest.
//
// The rows of a contact see nothing of a body that rolls, or slides without friction. What holds a
// ball at the bottom of a bowl is that its contact comes to stand aside of its centre of mass, on a
// surface that is inclined there. With normal reactions r as they are, the loads on the modes
// change by
//
//   -S a,   S = -d(R^T H_n^T(a) r) / da = -sum r_i d^2 gap_i / da^2
//
// where the motion a of the modes moves the places of contacts and turns their normals. It is taken
// by differences of contacts found at two places. Friction is left out: of what rolls in balance it
// is small, and its moment about the normal, which a point contact cannot have, would make the body
// spin. Only contacts between rigid bodies, and of these with obstacles, count.

namespace amontons {

/// A rigid body of whose chosen contacts one is with, or of, a round surface.
bool BodyStepper::touches_round(int b) const
{
    if (!system_.refs[std::size_t(b)].rigid) return false;
    const auto round = [&](int body) {
        const RigidBody* rigid = body < 0 ? nullptr : system_.refs[std::size_t(body)].rigid;
        return rigid && is_round(rigid->shape());
    };
    return std::ranges::any_of(rows_.chosen, [&](int c) {
        if (c >= int(list_.contact.size())) return false;
        const BodyContact& k = list_.contact[std::size_t(c)];
        if (k.a != b && k.b != b) return false;
        return round(k.a) || round(k.b) ||
               (k.b < 0 && !system_.finder.pairs()[std::size_t(k.pair)].plane);
    });
}

/// Rigid bodies that the last contact problem left unbalanced: whether their loads become less as
/// they roll. From then on, to the end of the step, that change is in the problem.
bool BodyStepper::roll()
{
    constexpr double kCurved = 1e-6; // of the load per size: flat surfaces leave rounding
    if (rolls_ || step_.dynamic || rows_.count == 0 || unbalanced_.size() == 0) return false;
    if (!touches_round(int(unbalanced_body_))) return false;
    const std::map<BodySystem::Key, Vec3> known = force_;
    const int contacts_here = int(list_.contact.size());
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const int c = rows_.chosen[i];
        if (c >= contacts_here) continue;
        const int rows = amontons::rows_of(problem_.kind[i]);
        force_[key(c)] =
            list_.contact[std::size_t(c)].frame.leftCols(rows) * r_.segment(rows_.first[i], rows);
    }
    const Hanging before = hanging_;
    hanging_ = {};
    rolls_ = true;
    find_rolling();
    // A block that tips over an edge is not held by what it rolls to.
    if (!hanging_.empty() &&
        unbalanced_.dot(of_body(hanging_.stiffness, unbalanced_body_) * unbalanced_) >
            kCurved * unbalanced_.squaredNorm() * hanging_.load / body(unbalanced_body_).size()) {
        rolled_.clear();
        find_hanging();
        modes_coupled_ = !modes_apart_;
        if (modes_coupled_) return true;
    }
    rolls_ = false;
    hanging_ = before;
    force_ = known;
    return false;
}

/// S of the modes of all bodies, by the normal forces that are known on rigid bodies with contacts
/// between these and with obstacles. Empty: no such force, or more than dense algebra is for.
Eigen::MatrixXd BodyStepper::rolling_stiffness()
{
    constexpr double kStep = 1e-4;           // of the body's size
    constexpr double kNoise = 1e-7;          // of S: rounding of what was found, by the step
    constexpr Eigen::Index kMostModes = 600; // dense algebra on them
    const std::vector<Eigen::Index> first = first_modes();
    const Eigen::Index modes = first.back();
    if (modes > kMostModes) return {};
    const auto free = [&](int b) { return b >= 0 && mode_load_[std::size_t(b)].size() > 0; };

    // ---- Contacts with forces between free rigid bodies, or these and what is rigid, by pair
    std::map<int, std::vector<const BodyContact*>> of_pair;
    for (int c = 0; c < int(list_.contact.size()); ++c) {
        const BodyContact& k = list_.contact[std::size_t(c)];
        const auto known = force_.find(key(c));
        if (known == force_.end() || known->second.isZero(0)) continue;
        const bool rigid = system_.refs[std::size_t(k.a)].rigid &&
                           (k.b < 0 || system_.refs[std::size_t(k.b)].rigid);
        if (rigid && (free(k.a) || free(k.b))) of_pair[k.pair].push_back(&k);
    }
    if (of_pair.empty()) return {};
    // The loads on the modes of both bodies by the contacts of a pair, found at the iterate.
    BodyContacts found;
    std::vector<Eigen::Triplet<double>> column;
    const auto loads = [&](int pair) {
        found.contact.clear();
        found.stencil.clear();
        system_.finder.find_rigid(system_.refs, pair, std::numeric_limits<double>::infinity(),
                                  found);
        Eigen::VectorXd on = Eigen::VectorXd::Zero(modes);
        for (const BodyContact* k : of_pair.at(pair)) {
            const auto at = std::ranges::find(found.contact, k->id, &BodyContact::id);
            if (at == found.contact.end()) continue;
            const double normal = k->frame.col(0).dot(force_.at({k->pair, k->id}));
            for (const auto& [b, sign] : {std::pair{k->a, normal}, {k->b, -normal}}) {
                if (!free(b)) continue;
                const Body& body = this->body(std::size_t(b));
                column.clear();
                body.add_column({{}, at->point}, at->frame.col(0), sign, 0, column);
                const Eigen::MatrixXd& R = body.matrix().modes();
                for (const auto& entry : column)
                    on.segment(first[std::size_t(b)], R.cols()) +=
                        entry.value() * R.row(entry.row()).transpose();
            }
        }
        return on;
    };

    // ---- Differences
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(modes, modes);
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (!free(int(b))) continue;
        RigidBody& rigid = *system_.refs[b].rigid;
        const Eigen::VectorXd still = Eigen::VectorXd::Zero(rigid.unknowns());
        const auto iterate = rigid.iterate();
        for (const auto& [pair, contacts] : of_pair) {
            if (contacts.front()->a != int(b) && contacts.front()->b != int(b)) continue;
            for (Eigen::Index m = 0; m < mode_load_[b].size(); ++m)
                for (const double way : {kStep * rigid.size(), -kStep * rigid.size()}) {
                    rigid.update(still, way * Eigen::VectorXd::Unit(mode_load_[b].size(), m), {});
                    S.col(first[b] + m) -= loads(pair) / (2 * way);
                    rigid.set_iterate(iterate);
                }
        }
    }
    S = 0.5 * (S + S.transpose()).eval();
    return (S.array().abs() > kNoise * S.cwiseAbs().maxCoeff()).select(S, 0);
}

/// Adds S to the changes of the loads.
void BodyStepper::find_rolling()
{
    constexpr double kNear = 10; // of -S: what is not stable stays near
    double load = 0;             // [N]
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (mode_load_[b].size() == 0) continue;
        if (!system_.refs[b].rigid) return; // the balance of others is not examined once more
        load += mode_load_[b].norm();
    }
    const Eigen::MatrixXd S = rolling_stiffness();
    if (S.size() == 0) return;
    if (hanging_.empty()) {
        hanging_.stiffness = hanging_.used = hanging_.away =
            Eigen::MatrixXd::Zero(S.rows(), S.cols());
        hanging_.support = Eigen::VectorXd::Zero(S.rows());
    }
    const SymmetricEigen e = symmetric_eigen(S);
    hanging_.stiffness += S;
    hanging_.used += S;
    hanging_.away += e.vectors * e.values.cwiseAbs().asDiagonal() * e.vectors.transpose();
    hanging_.load = std::max(hanging_.load, load);
    hanging_.support.array() += kNear * std::max(0.0, -e.values.minCoeff());
    pull_back(load);
}

/// What no force determines stays where the step starts, as far as contacts permit: a spring there,
/// which fades as the iterate settles, and is zero in the end.
void BodyStepper::pull_back(double load)
{
    constexpr double kFirst = 1e-2, kFades = 0.1, kLeast = 1e-9; // of the load over a size
    constexpr double kSettled = 1e-3;                            // of the size, in an iteration
    const std::vector<Eigen::Index> first = first_modes();
    const bool begins = rolled_.empty();
    rolled_.resize(bodies(), Vec3::Zero());
    double farthest = 0;
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (mode_load_[b].size() == 0) continue;
        const Vec3 moved = body(b).displacement({{}, system_.refs[b].rigid->iterate().first});
        farthest = std::max(farthest, (moved - rolled_[b]).norm() / body(b).size());
        rolled_[b] = moved;
    }
    if (begins)
        pull_back_ = kFirst;
    else if (farthest <= kSettled)
        pull_back_ *= kFades;
    if (pull_back_ < kLeast) pull_back_ = 0;
    hanging_.pull = Eigen::VectorXd::Zero(first.back());
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (mode_load_[b].size() == 0) continue;
        const double stiffness = pull_back_ * load / body(b).size();
        hanging_.pull.segment<3>(first[b]) = -stiffness * rolled_[b];
        for (Eigen::MatrixXd* K : {&hanging_.used, &hanging_.away})
            K->diagonal().segment<3>(first[b]).array() += stiffness;
    }
}

/// Motions that no row sees and that change no load, as a ball's spin: rounding would lead far.
/// @param T  of what rows hold; such motions get this stiffness in it
void BodyStepper::hold_unseen(Eigen::MatrixXd& T, const Eigen::MatrixXd& S, double stiffness) const
{
    constexpr double kUnseen = 1e-9; // of the stiffest
    const SymmetricEigen e = symmetric_eigen(Eigen::MatrixXd(T + S));
    const double least = kUnseen * e.values.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < e.values.size(); ++i)
        if (std::abs(e.values[i]) <= least)
            T += stiffness * e.vectors.col(i) * e.vectors.col(i).transpose();
}

/// Of each chosen row, what its force would be over this length [N/m]: a body that rolls before
/// something elastic moves far, and is held by no more than what touches it exerts.
Eigen::VectorXd BodyStepper::stiffness_by_forces(double length) const
{
    constexpr double kLeast = 1e-6; // of all loads: a contact that is new
    Eigen::VectorXd most =
        Eigen::VectorXd::Constant(rows_.count, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        if (problem_.kind[i] == ContactKind::bilateral) continue;
        const auto known = force_.find(key(rows_.chosen[i]));
        const double force =
            std::max(known == force_.end() ? 0 : known->second.norm(), kLeast * hanging_.load);
        most[rows_.first[i]] = force / length;
        if (problem_.kind[i] == ContactKind::frictional)
            most.segment<2>(rows_.first[i] + 1)
                .setConstant(problem_.mu[Eigen::Index(i)] * force / length);
    }
    return most;
}

} // namespace amontons
