#include "contact/cone.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/step/body_stepper.hpp"

#include <algorithm>
#include <cmath>

// Quasi-static steps of rods alone: the contact problem without W (rod_problem), and the error of
// its solution.

namespace amontons {
namespace {

constexpr double kNear = 1e-3; // an error below which Newton's method does not alternate

} // namespace

/// Only rods can move.
bool BodyStepper::rods_alone() const
{
    return !step_.dynamic && options_.solver == ContactSolver::automatic && system_.rods_alone();
}

/// Newton's motion of all rods with the states of all contacts that are near.
bool BodyStepper::solve_rods()
{
    const Stopwatch watch;
    const int n = int(list_.contact.size()), joints = int(system_.couplings.size());
    rows_.chosen.resize(std::size_t(n + joints));

    // ---- Contacts and couplings
    for (int c = 0; c < n + joints; ++c)
        rows_.chosen[std::size_t(c)] = c;
    number_rows(contacts(), rows_);
    problem_ = {};
    problem_.mu.setZero(n + joints);
    problem_.kind.assign(std::size_t(n + joints), ContactKind::bilateral);
    std::vector<RodContactState> states(static_cast<std::size_t>(n));
    for (int c = 0; c < n; ++c) {
        const BodyContact& k = list_.contact[std::size_t(c)];
        RodContactState& s = states[std::size_t(c)];
        s.contact = &k;
        s.a = list_.place_a(k);
        s.b = list_.place_b(k);
        s.value = value_[std::size_t(c)];
        const auto known = force_.find(key(c));
        if (known != force_.end()) s.force = k.frame.transpose() * known->second;
        const auto stuck = sticks_.find(key(c));
        s.sticks = stuck != sticks_.end() && stuck->second;
        s.friction = problem_.mu[c] = friction_of(system_.finder.pairs(), k);
        problem_.kind[std::size_t(c)] =
            s.friction > 0 ? ContactKind::frictional : ContactKind::frictionless;
    }
    rods_.rods.clear();
    for (const BodyRef& b : system_.refs)
        rods_.rods.push_back(b.rod);
    const bool medium = std::ranges::any_of(
        system_.refs, [](const BodyRef& b) { return b.rod && b.rod->has_drag(); });
    // Slips may take long to find their directions, and the state where a run begins has no shorter
    // step.
    rods_.hasty = medium && step_.h > 0 && problem_.mu.isZero(0);
    rods_.stop = options_.stop;
    std::vector<double> joint_force(static_cast<std::size_t>(joints), 0);
    for (int c = 0; c < joints; ++c)
        if (const auto known = force_.find(key(n + c)); known != force_.end())
            joint_force[std::size_t(c)] = known->second.x();
    rods_.joints = rod_joints(system_.refs, system_.couplings, joints_, joint_force);
    RodAnswer answer;

    // ---- The sparse problem
    if (n + joints == 0)
        answer.motion = free_;
    else
        answer = solve_rod_contacts(rods_, states, options_.tolerance);
    report_.iterations += answer.factorisations;
    if (rods_.hasty && !answer.fits) {
        report_.refusal = "no consistent open-stick-slip assignment of the contacts";
        return false;
    }

    // ---- Reactions and motion
    r_ = Eigen::VectorXd::Zero(rows_.count);
    force_.clear();
    motion_.clear();
    sticks_.clear();
    for (int c = 0; c < n; ++c) {
        const Vec3& r = answer.force[std::size_t(c)];
        const int rows = amontons::rows_of(problem_.kind[std::size_t(c)]);
        r_.segment(rows_.first[std::size_t(c)], rows) = r.head(rows);
        if (!r.isZero(0)) force_[key(c)] = list_.contact[std::size_t(c)].frame * r;
        motion_[key(c)] = answer.value[std::size_t(c)];
        sticks_[key(c)] = answer.sticks[std::size_t(c)] != 0;
    }
    for (int c = n; c < n + joints; ++c) {
        const std::size_t joint = std::size_t(c - n);
        r_[rows_.first[std::size_t(c)]] = answer.joint_force[joint];
        force_[key(c)] = Vec3(answer.joint_force[joint], 0, 0);
        motion_[key(c)] = Vec3(answer.joint_value[joint], 0, 0);
    }
    report_.contact_solve += watch.seconds();
    y_ = answer.motion;
    mode_.assign(bodies(), {});
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (!system_.refs[b].rod) y_[b] = Eigen::VectorXd::Zero(body(b).matrix().unknowns());
        if (!y_[b].allFinite()) {
            report_.refusal = "the tangent of " + system_.refs[b].name + " is singular";
            return false;
        }
    }
    swung_ = swung_ || (medium && swings());
    if (swung_ && errors_.back() > kNear) {
        // For contacts that alternate between stick and slip: half of the motion, except for what
        // is prescribed.
        for (std::size_t b = 0; b < bodies(); ++b)
            if (const RodBody* rod = system_.refs[b].rod) y_[b] = 0.5 * (y_[b] + rod->prescribed());
    }
    if (exceeds_motion_bound()) return false;
    left_out_ = 0;
    for (std::size_t b = 0; b < bodies(); ++b) // a rod's motion is known, and nothing else moves
        body(b).update(y_[b], mode_[b], system_.refs[b].rod ? Eigen::VectorXd() : y_[b]);
    return true;
}

/// Newton's method of rods alone alternates.
bool BodyStepper::swings() const
{
    const std::size_t n = errors_.size();
    return n >= 4 && errors_[n - 1] > 0.5 * errors_[n - 3] && errors_[n - 2] > 0.5 * errors_[n - 4];
}

/// The natural map of each contact at this motion, of the largest force (or load, or EI / length^2)
/// in the scene; a gap of a radius counts as much as that force. Sets the values of the report.
void BodyStepper::certify_rods(const Eigen::VectorXd& u)
{
    double force = 0, radius = std::numeric_limits<double>::infinity();
    for (const BodyRef& b : system_.refs) {
        if (!b.rod) continue;
        force = std::max(force, b.rod->force_scale());
        for (const double r : b.rod->model().radius)
            radius = std::min(radius, r);
    }
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i)
        force = std::max(force, problem_.kind[i] == ContactKind::bilateral
                                    ? std::abs(r_[rows_.first[i]])
                                    : r_[rows_.first[i]]);
    const double rho = force / radius;
    double most = 0;
    report_.penetration = report_.cone = 0;
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const int row = rows_.first[i];
        if (problem_.kind[i] == ContactKind::bilateral) {
            most = std::max(most, rho * std::abs(u[row]));
            continue;
        }
        report_.penetration = std::max(report_.penetration, -u[row]);
        if (problem_.kind[i] == ContactKind::frictional) {
            const double mu = problem_.mu[Eigen::Index(i)];
            const Vec3 r = r_.segment<3>(row);
            most = std::max(most, natural_map(r, u.segment<3>(row), mu, rho).norm());
            report_.cone = std::max(report_.cone, r.tail<2>().norm() - mu * r[0]);
        } else {
            most = std::max(most, std::abs(std::min(r_[row], rho * u[row])));
        }
        report_.cone = std::max(report_.cone, -r_[row]);
    }
    report_.error = most / force;
    report_.threshold = options_.tolerance;
    nothing_ = false;
}

ContactProblem rods_problem(BodySystem& system, const BodyStepReport& report,
                            Eigen::VectorXd& reaction)
{
    const std::vector<CouplingRow> no_joints;
    const Contacts k{system.refs, system.finder.pairs(), report.contacts, no_joints,
                     system.couplings};
    Rows rows;
    const int n = int(report.contacts.contact.size());
    ContactProblem problem;
    problem.mu.resize(n);
    for (int c = 0; c < n; ++c) {
        rows.chosen.push_back(c);
        const double friction = friction_of(k.pairs, report.contacts.contact[std::size_t(c)]);
        problem.mu[c] = friction;
        problem.kind.push_back(friction > 0 ? ContactKind::frictional : ContactKind::frictionless);
    }
    make_rows(k, rows);
    std::vector<Eigen::MatrixXd> W(system.refs.size());
    for (std::size_t b = 0; b < system.refs.size(); ++b)
        if (!rows.row[b].empty()) system.refs[b].body->matrix().compliance(rows.columns[b], W[b]);
    problem.W = sum_of_bodies(rows, W, {});
    reaction.resize(rows.count);
    Eigen::VectorXd u(rows.count);
    for (int c = 0; c < n; ++c) {
        const BodyContact& contact = report.contacts.contact[std::size_t(c)];
        const int row = rows.first[std::size_t(c)], size = rows_of(problem.kind[std::size_t(c)]);
        Vec3 own = contact.frame.transpose() * report.slip[std::size_t(c)];
        own[0] = contact.gap;
        u.segment(row, size) = own.head(size);
        const Vec3 r = contact.frame.transpose() * report.force[std::size_t(c)];
        reaction.segment(row, size) = r.head(size);
    }
    problem.q = u - problem.W * reaction;
    return problem;
}

} // namespace amontons
