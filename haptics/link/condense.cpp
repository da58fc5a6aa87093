#include "haptics/link/condense.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_rows.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

// At the end of a step, with the device at d0 and the handle where spring and contacts hold it, the
// contacts have forces r0 and gaps g. For forces r and a device at d near them
//
//     u = g n + W (r - r0) + J (d - d0),      W = W_bodies + J diag(1/k, 1/k_turn) J^T,
//
// with slip counted from the end of the step: u_t(r0, d0) = 0. So q = g n - W r0. W_bodies holds
// the handle still; J is the motion of the contact point with the handle, the device's own when the
// spring's force does not change. Joints are rows with u = 0 at all times: they are eliminated,
// W <- W - W_cj W_jj^-1 W_jc. Contacts without friction have no tangential rows; they get some of
// their own that nothing is coupled to.

namespace amontons {
namespace {

using Contacts6 = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// Contacts beyond what is predicted in full: enough to stop a handle that moves faster.
constexpr std::size_t kMostFar = 32;

/// One number for (pair, identity): the same in every step.
std::int64_t identity(const BodyContact& c)
{
    std::uint64_t z = static_cast<std::uint64_t>(c.id) +
                      0x9e3779b97f4a7c15u * static_cast<std::uint64_t>(c.pair + 1);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u; // a step of splitmix64: one to one
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<std::int64_t>(z ^ (z >> 31));
}

/// Bodies that contacts within reach tie to the handle.
std::vector<bool> tied_bodies(const BodySystem& system, int handle, const std::vector<int>& near,
                              const BodyContacts& all)
{
    std::vector<bool> tied(system.refs.size(), false);
    tied[std::size_t(handle)] = true;
    const auto join = [&](int a, int b) {
        if (a < 0 || b < 0 || tied[std::size_t(a)] == tied[std::size_t(b)]) return false;
        tied[std::size_t(a)] = tied[std::size_t(b)] = true;
        return true;
    };
    for (bool more = true; more;) {
        more = false;
        for (const int c : near)
            more |= join(all.contact[std::size_t(c)].a, all.contact[std::size_t(c)].b);
        for (const Coupling& j : system.couplings)
            more |= join(j.a.body, j.b.body);
    }
    return tied;
}

/// By importance for the hand: with force, on the handle, near.
void sort_by_participation(std::vector<int>& contacts, int handle, const BodyStepReport& report)
{
    const auto rank = [&](int c) {
        const BodyContact& k = report.contacts.contact[std::size_t(c)];
        const bool on_handle = k.a == handle || k.b == handle;
        const double force = report.force[std::size_t(c)].norm();
        return std::tuple(force == 0, !on_handle, -force, k.gap, c);
    };
    std::sort(contacts.begin(), contacts.end(), [&](int x, int y) { return rank(x) < rank(y); });
}

} // namespace

Condensed condense(BodySystem& system, int handle, HeldBody& held, const StepInput& step,
                   const BodyStepReport& report, const ReductionOptions& options)
{
    Condensed out;
    const BodyContacts& all = report.contacts;
    const std::vector<ContactPair>& pairs = system.finder.pairs();
    const int n_contacts = int(all.contact.size());

    // ---- Candidates: closed, near, then far ones
    out.reach = options.reach();
    std::vector<int> near, far;
    for (int c = 0; c < n_contacts; ++c) {
        const BodyContact& k = all.contact[std::size_t(c)];
        if (!report.force[std::size_t(c)].isZero() || k.gap <= out.reach)
            near.push_back(c);
        else if ((k.a == handle || k.b == handle) && k.gap <= options.farthest())
            far.push_back(c);
    }
    std::sort(far.begin(), far.end(), [&](int x, int y) {
        return std::pair(all.contact[std::size_t(x)].gap, x) <
               std::pair(all.contact[std::size_t(y)].gap, y);
    });
    far.resize(std::min(far.size(), kMostFar));
    near.insert(near.end(), far.begin(), far.end());
    std::sort(near.begin(), near.end());
    for (const ContactPair& p : pairs) // gaps beyond were not examined
        if ((p.a == handle || p.b == handle) && !p.small) out.reach = std::min(out.reach, p.reach);
    const std::vector<bool> tied = tied_bodies(system, handle, near, all);
    std::erase_if(near, [&](int c) { return !tied[std::size_t(all.contact[std::size_t(c)].a)]; });
    if (int(near.size()) > options.most_contacts) {
        sort_by_participation(near, handle, report);
        out.left_out = int(near.size()) - options.most_contacts;
        near.resize(std::size_t(options.most_contacts));
        std::sort(near.begin(), near.end());
    }

    // ---- Rows of contacts and couplings
    std::vector<CouplingRow> joints;
    for (const Coupling& j : system.couplings)
        joints.push_back(coupling_row(system.refs, j));
    const amontons::Contacts rows_of_all{system.refs, pairs, all, joints, system.couplings};
    Rows rows;
    rows.chosen = near;
    for (std::size_t j = 0; j < joints.size(); ++j) {
        const Coupling& c = system.couplings[j];
        const int body = c.a.body >= 0 ? c.a.body : c.b.body;
        if (body >= 0 && tied[std::size_t(body)]) rows.chosen.push_back(n_contacts + int(j));
    }
    make_rows(rows_of_all, rows);

    // ---- W and J of all rows
    // W of all rows, the handle held; J of all rows.
    const double per = step.dynamic ? step.h * step.h : 1; // from impulse and velocity
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(rows.count, rows.count), own;
    Contacts6 J = Contacts6::Zero(rows.count, 6);
    for (std::size_t b = 0; b < system.refs.size(); ++b) {
        if (rows.row[b].empty()) continue;
        if (int(b) == handle) {
            held.held_compliance(rows.columns[b], own);
            const Eigen::MatrixXd frame = rows.columns[b].bottomRows(6);
            for (std::size_t i = 0; i < rows.row[b].size(); ++i)
                J.row(rows.row[b][i]) = frame.col(Eigen::Index(i)).transpose();
        } else {
            system.refs[b].body->matrix().compliance(rows.columns[b], own);
        }
        for (std::size_t j = 0; j < rows.row[b].size(); ++j)
            for (std::size_t i = 0; i < rows.row[b].size(); ++i)
                W(rows.row[b][i], rows.row[b][j]) += per * own(Eigen::Index(i), Eigen::Index(j));
    }

    // ---- Elimination of the couplings
    const int n = int(near.size());
    const Eigen::Index contact_rows =
        n < int(rows.chosen.size()) ? rows.first[std::size_t(n)] : rows.count;
    const Eigen::Index joint_rows = rows.count - contact_rows;
    if (joint_rows > 0) {
        for (std::size_t i = std::size_t(n); i < rows.chosen.size(); ++i)
            W(rows.first[i], rows.first[i]) +=
                system.couplings[std::size_t(rows.chosen[i] - n_contacts)].softness;
        // The handle may be held by joints too: then its own spring is eliminated with them.
        const HandleSpring& spring = held.spring();
        Eigen::MatrixXd with = W;
        add_coupling(with, J, spring.stiffness, spring.turn_stiffness);
        const LdltFactor factor(with.bottomRightCorner(joint_rows, joint_rows));
        const Eigen::MatrixXd cross = with.bottomLeftCorner(joint_rows, contact_rows);
        const Eigen::MatrixXd solved = factor.solve_all(cross);
        // J after the elimination of joints; the rest of W is W less the part of the spring.
        const Contacts6 through =
            J.topRows(contact_rows) - solved.transpose() * J.bottomRows(joint_rows);
        Eigen::MatrixXd whole = with.topLeftCorner(contact_rows, contact_rows);
        whole.noalias() -= cross.transpose() * solved;
        Eigen::MatrixXd spring_part = Eigen::MatrixXd::Zero(contact_rows, contact_rows);
        add_coupling(spring_part, through, spring.stiffness, spring.turn_stiffness);
        W = whole - spring_part;
        J = through;
    }

    // ---- Output: three rows for each contact, the spring of the handle
    // Three rows for every contact.
    out.W = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    Contacts6 J3 = Contacts6::Zero(3 * n, 6);
    std::vector<Eigen::Index> place(static_cast<std::size_t>(contact_rows));
    Eigen::VectorXd r0 = Eigen::VectorXd::Zero(3 * n);
    out.contact.resize(std::size_t(n));
    for (int i = 0; i < n; ++i) {
        const BodyContact& k = all.contact[std::size_t(near[std::size_t(i)])];
        const int count = rows_of(pairs, k);
        for (int a = 0; a < count; ++a)
            place[std::size_t(rows.first[std::size_t(i)] + a)] = 3 * i + a;
        CandidateContact& c = out.contact[std::size_t(i)];
        c = {};
        c.id = identity(k);
        c.mu = friction_of(pairs, k);
        c.q = {k.gap, 0, 0};
        c.r = k.frame.transpose() * report.force[std::size_t(near[std::size_t(i)])];
        if (count == 1) c.r.tail<2>().setZero();
        r0.segment<3>(3 * i) = c.r;
        // Seen from the side of the handle: all axes change their sign, u and r do not.
        c.frame = k.b == handle ? Mat3(-k.frame) : k.frame;
    }
    for (Eigen::Index j = 0; j < contact_rows; ++j) {
        J3.row(place[std::size_t(j)]) = J.row(j);
        for (Eigen::Index i = 0; i < contact_rows; ++i)
            out.W(place[std::size_t(i)], place[std::size_t(j)]) = 0.5 * (W(i, j) + W(j, i));
    }
    const HandleSpring& spring = held.spring();
    Eigen::VectorXd moved = out.W * r0; // spring and all
    const Vec6 pull = J3.transpose() * r0;
    Vec6 spring_compliance;
    spring_compliance << Vec3::Constant(1 / spring.stiffness),
        Vec3::Constant(1 / spring.turn_stiffness);
    moved += J3 * spring_compliance.cwiseProduct(pull);
    add_coupling(out.W, J3, spring.stiffness + options.damper_spring, spring.turn_stiffness);
    for (int i = 0; i < n; ++i) {
        const BodyContact& k = all.contact[std::size_t(near[std::size_t(i)])];
        CandidateContact& c = out.contact[std::size_t(i)];
        if (rows_of(pairs, k) == 1) {
            const double w = out.W(3 * i, 3 * i);
            out.W(3 * i + 1, 3 * i + 1) = out.W(3 * i + 2, 3 * i + 2) = w;
        }
        c.q -= moved.segment<3>(3 * i);
        c.J = J3.middleRows<3>(3 * i);
        if (joint_rows > 0 || (k.a != handle && k.b != handle)) continue;
        // Rigidly carried, if the weights of its nodes sum to one: then turns are exact.
        const BodyPlace at = k.a == handle ? all.place_a(k) : all.place_b(k);
        double weight = at.nodes.empty() ? 1 : 0;
        c.arm = at.nodes.empty() ? Vec3(at.point - held.arm_from()) : Vec3(Vec3::Zero());
        for (const StencilEntry& e : at.nodes) {
            const Vec3& x = system.refs[std::size_t(handle)].solid->places()[std::size_t(e.node)];
            weight += e.weight;
            c.arm += e.weight * (x - held.pose().position);
        }
        c.rigid = std::abs(weight - 1) < 1e-9;
    }
    return out;
}

} // namespace amontons
