#include "solver/step/body_stepper.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>

// Bodies that are stable by their contacts alone (hyperelastic solids,
// solver/body/solid_stabilisation.cpp; rods that are compressed beyond Euler's load along what
// yields): with their true matrices A, W = sum H A^-1 H^T is not positive, and no solver of
// contact problems takes it. With a diagonal Gamma on the rows of contacts that stay closed, r' = r
// + Gamma u is the reaction of
//   u = (1 + W Gamma)^-1 (W r' + q),
// the problem of all bodies with A + H^T Gamma H across them: where u = 0 in these rows r' = r, so
// Signorini's and Coulomb's laws are the same for both. Rows: the normal, where a contact sticks
// the tangents too. A + H^T Gamma H is positive where 1 + sqrt(Gamma) W sqrt(Gamma) has just as
// many negative eigenvalues as the bodies' matrices (inertia of a Schur complement): then contacts
// hold the bodies, and the iteration is Newton's.

namespace amontons {
namespace {

constexpr int kMostRowsHeld = 1500; // dense algebra on them
constexpr double kHolds[] = {1,   4,    16,  64,
                             256, 1024, 4096}; // Gamma, over the mean compliance of a row

} // namespace

/// Rows in which u = 0 by the last forces. @param sticking  tangents too
Eigen::VectorXd BodyStepper::closed_rows(bool sticking) const
{
    Eigen::VectorXd closed = Eigen::VectorXd::Zero(rows_.count);
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const int c = rows_.chosen[i];
        if (problem_.kind[i] == ContactKind::bilateral) {
            closed[rows_.first[i]] = 1;
            continue;
        }
        const auto known = force_.find(key(c));
        if (known == force_.end() || released_[std::size_t(c)] > 1) continue;
        const Vec3 f = list_.contact[std::size_t(c)].frame.transpose() * known->second;
        if (!(f.x() > 0)) continue;
        closed[rows_.first[i]] = 1;
        if (sticking && released_[std::size_t(c)] == 0 &&
            std::hypot(f.y(), f.z()) < kStickShare * problem_.mu[Eigen::Index(i)] * f.x())
            closed.segment(rows_.first[i], amontons::rows_of(problem_.kind[i])).setOnes();
    }
    return closed;
}

/// Where a contact that was to stay has opened or slipped, r' is not its reaction: it is released.
/// @return  whether some was, and the problem is to be made anew
bool BodyStepper::release_stabilised_rows()
{
    bool any = false;
    for (std::size_t i = 0; held_.size() > 0 && i < rows_.chosen.size(); ++i) {
        const int first = rows_.first[i], size = amontons::rows_of(problem_.kind[i]);
        if (held_[first] == 0 || problem_.kind[i] == ContactKind::bilateral) continue;
        const auto r = held_r_.segment(first, size);
        char& now = released_[std::size_t(rows_.chosen[i])];
        const char before = now;
        if (!(r[0] > 0))
            now = 2;
        else if (size > 1 && held_[first + 1] > 0 &&
                 !(std::hypot(r[1], r[2]) < kStickShare * problem_.mu[Eigen::Index(i)] * r[0]))
            now = 1;
        any |= now != before;
    }
    return any;
}

/// The contact problem with the bodies' true matrices. @param W  of each body, with its modes
/// @return  false: none is stabilised, or contacts do not hold them; the stabilised matrices are to
/// be used
bool BodyStepper::use_true_tangent(std::vector<Eigen::MatrixXd>& W,
                                   const std::vector<std::pair<int, double>>& soft)
{
    unheld_.clear();
    if (step_.dynamic || rows_.count == 0 || rows_.count > kMostRowsHeld) return false;
    std::vector<char> is_stabilised(bodies(), 0);
    int negative = 0;
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (const RodBody* rod = system_.refs[b].rod; rod && rod->negative() > 0) {
            if (rows_.row[b].empty()) return false;
            negative += rod->negative();
            unheld_ = system_.refs[b].name;
            is_stabilised[b] = 1;
            continue;
        }
        SolidBody* solid = system_.refs[b].solid;
        if (!solid || !solid->is_stabilised()) continue;
        if (rows_.row[b].empty()) return false;
        Eigen::MatrixXd more;
        const int of_body = solid->true_tangent_compliance(rows_.columns[b], more);
        if (of_body < 0) return false;
        W[b] += more;
        negative += of_body;
        is_stabilised[b] = 1;
    }
    if (std::ranges::count(is_stabilised, 1) == 0) return false;
    const Delassus sum = sum_of_bodies(rows_, W, soft);
    const Eigen::MatrixXd all = sum.is_dense() ? sum.dense() : Eigen::MatrixXd(sum.as_sparse());
    const double size = all.diagonal().cwiseAbs().mean();
    if (!(size > 0)) return false;
    for (const bool sticking : {false, true}) {
        const Eigen::VectorXd closed = closed_rows(sticking);
        for (const double hold : kHolds) {
            const Eigen::VectorXd root = (hold / size * closed).cwiseSqrt();
            const Eigen::MatrixXd right = root.asDiagonal() * all;
            Eigen::MatrixXd inner = right * root.asDiagonal();
            inner.diagonal().array() += 1;
            if (int((symmetric_eigenvalues(inner).array() < 0).count()) != negative) continue;
            const Eigen::MatrixXd taken = right.transpose() * LuFactor(inner).inverse();
            const Eigen::MatrixXd held = all - taken * right;
            problem_.W = Delassus(Eigen::MatrixXd(0.5 * (held + held.transpose())));
            taken_ = taken * root.asDiagonal();
            held_ = hold / size * closed;
            true_tangent_ = std::move(is_stabilised);
            unheld_.clear();
            return true;
        }
    }
    return false;
}

/// A rod under compression is a saddle point of a step in motion where M + h^2 K is not positive on
/// the motions that closed contacts and couplings leave free: it buckles faster than the step
/// follows, the step has other ends beside the one found, and round-off would choose. Shorter
/// steps follow it. By the inertia of a Schur complement, as above: W of the rows that hold has as
/// many negative eigenvalues as the rods have.
std::string BodyStepper::rod_that_buckles() const
{
    constexpr double kNone = 1e-13; // of the largest eigenvalue of W
    if (!step_.dynamic) return "";
    int negative = 0;
    std::string name;
    for (std::size_t b = 0; b < bodies(); ++b)
        if (const RodBody* rod = system_.refs[b].rod; rod && rod->negative() > 0) {
            negative += rod->negative();
            if (name.empty()) name = system_.refs[b].name;
        }
    if (negative == 0 || rows_.count > kMostRowsHeld) return "";
    std::vector<Eigen::Index> held;
    for (std::size_t i = 0; rows_.count > 0 && i < rows_.chosen.size(); ++i) {
        const int first = rows_.first[i], size = amontons::rows_of(problem_.kind[i]);
        const bool joint = problem_.kind[i] == ContactKind::bilateral;
        if (!joint && !(r_[first] > 0)) continue;
        const bool all =
            joint || (size > 1 && std::hypot(r_[first + 1], r_[first + 2]) <
                                      kStickShare * problem_.mu[Eigen::Index(i)] * r_[first]);
        for (int k = 0; k < (all ? size : 1); ++k)
            held.push_back(first + k);
    }
    if (!held.empty()) {
        const Eigen::VectorXd values = symmetric_eigenvalues(problem_.W.part(held));
        negative -= int((values.array() < -kNone * values.cwiseAbs().maxCoeff()).count());
    }
    return negative > 0 ? name : "";
}

/// The solution of the stabilised matrix converted to that of the true one.
Eigen::VectorXd BodyStepper::unstabilised(std::size_t b, const Eigen::VectorXd& y) const
{
    SolidBody* solid = system_.refs[b].solid;
    return true_tangent_.empty() || !true_tangent_[b] || !solid ? y : solid->unstabilised(y);
}

} // namespace amontons
