#pragma once

#include "mesh/base/dense.hpp"
#include "solver/beam/soft_contact.hpp"
#include "solver/step/pivot_method.hpp"

#include <Eigen/SparseCore>
#include <algorithm>

// Pivoting where walls are compliant: one linearised problem with the whole derivative of wire and
// walls. Each contact has five ports, rows of the wire's unknowns: its point's motion along
// (n, t1, t2) and what the section's spin adds to the two slips; those of all points come first.
// With the motions x = U^T d of the ports, forces U p on them, reactions' changes rho, the factor
// of M = K + U R U^T at hand:
//
//     K d = -g + U (Theta x + Psi rho)      =>  (1 - T (R + Theta)) x = U^T M^-1 (-g) + T Psi rho
//     gaps and slips                        s = s_0 + L x + A rho = q + W rho
//
// T = U^T M^-1 U. Ports of many contacts share few nodes: with P the ports' rows at those and
// N = G G^T the part of M^-1 there (one solve of O(n) for each of their unknowns),
//
//     T = F F^T,  F = P G,      (1 - T A)^-1 = 1 + F (1 - F^T A F)^-1 F^T A
//
// so that only systems of the nodes' size are solved. R and Theta are of the points' ports alone.
// Statuses are then pivoted on W alone.
//
// Stability: K - U Theta U^T + the active rows' stiffness is positive definite. Written as
// M - U Sigma U^T it is, M being definite, exactly if 1 - F^T Sigma F is.

namespace amontons::pivoting {

constexpr double kRhoPorts = 10; ///< of M, relative to the wire's stiffness
constexpr double kNearContact =
    0.1; ///< gaps that matter from the start, over the radius of the wire (ratio)
constexpr double kNearSolution = 1e-3; ///< error below which stability is examined as a whole
constexpr int kCircles = 12;           ///< trials that should have been enough
constexpr int kMostTrials = 400;       ///< small dense systems: one contact at a time ends at last
constexpr int kSweeps = 200;           ///< of Gauss-Seidel's method
constexpr int kMostRounds = 4;         ///< of contacts that were not thought to matter

/// A linearised problem on reactions: s = q + W rho.
struct CompliantProblem {
    /// Response of the walls.
    CompliantContacts walls;
    Eigen::MatrixXd F;      ///< of the ports' compliance T = F F^T, 5n x unknowns of their nodes
    Eigen::MatrixXd inner;  ///< R + Theta, 3n x 3n
    Eigen::MatrixXd system; ///< 1 - F^T (R + Theta) F
    Eigen::MatrixXd FPsi;   ///< F^T Psi
    Eigen::MatrixXd LF;     ///< L F
    Eigen::MatrixXd answer; ///< system^-1 F^T Psi
    Eigen::VectorXd x0, q;  ///< 5n, 3n
    Eigen::MatrixXd W;
    bool even = true; ///< number of negative eigenvalues without any contact held
};

/// The candidate that the j-th port belongs to.
inline std::size_t contact_of_port(const CompliantProblem& p, Eigen::Index j)
{
    const auto points = 3 * Eigen::Index(p.walls.which.size());
    return std::size_t(p.walls.which[std::size_t(j < points ? j / 3 : (j - points) / 2)]);
}

/// @param port  out: 5 for each contact
template <class System>
void solve_ports(System& s, CompliantProblem& p, std::vector<typename System::Row>& port)
{
    const auto n = Eigen::Index(p.walls.which.size()), points = 3 * n;
    port.clear();
    for (const int c : p.walls.which) {
        const auto k = std::size_t(c);
        const auto t = s.point_rows(k);
        port.insert(port.end(), {s.normal(k), t[0], t[1]});
    }
    for (const int c : p.walls.which) {
        const auto k = std::size_t(c);
        const auto t = s.point_rows(k);
        for (int i = 0; i < 2; ++i)
            port.push_back(System::combine(1, s.tangent(k, i), -1, t[std::size_t(i)]));
    }

    // ---- Nodes and ports
    const auto place = [&](Eigen::Index j) { return s.place(contact_of_port(p, j)); };
    std::vector<int> node;
    for (Eigen::Index i = 0; i < n; ++i)
        node.insert(node.end(), {place(3 * i), place(3 * i) + 1});
    std::sort(node.begin(), node.end());
    node.erase(std::unique(node.begin(), node.end()), node.end());
    const auto size = 6 * Eigen::Index(node.size());
    const auto at_nodes = [&](const std::vector<Node6>& z) {
        Eigen::VectorXd values(size);
        for (Eigen::Index i = 0; i < size; ++i)
            values[i] = z[std::size_t(node[std::size_t(i / 6)])].value[i % 6];
        return values;
    };
    // P M, of ports that stand on the two nodes of an element each.
    const auto at_ports = [&](const auto& M) {
        Eigen::MatrixXd out(5 * n, M.cols());
        for (Eigen::Index j = 0; j < 5 * n; ++j) {
            const auto first =
                6 * (std::lower_bound(node.begin(), node.end(), place(j)) - node.begin());
            const auto& row = port[std::size_t(j)];
            Eigen::Matrix<double, 1, 12> values;
            for (int i = 0; i < 6; ++i) {
                values[i] = row.a.value[i];
                values[6 + i] = row.b.value[i];
            }
            out.row(j).noalias() = values * M.middleRows(first, 12);
        }
        return out;
    };

    // ---- Compliance at the nodes
    Eigen::MatrixXd N(size, size);
    std::vector<Node6> z(s.right().size());
    for (Eigen::Index j = 0; j < size; ++j) {
        const int from = node[std::size_t(j / 6)];
        for (Node6& zero : z)
            zero.column = Column6{};
        z[std::size_t(from)].value[j % 6] = 1;
        s.matrix().solve_from(z, from);
        N.col(j) = at_nodes(z);
    }
    for (int i = s.first(); i <= s.last(); ++i)
        s.right()[std::size_t(i)].column = -s.gradient()[std::size_t(i)].column;
    z = s.right();
    s.matrix().solve(z);
    const Eigen::VectorXd beta = n > 0 ? at_ports(at_nodes(z)) : Eigen::MatrixXd(0, 1);

    p.even = true;
    p.x0.resize(0);
    p.answer.resize(0, 0);
    p.inner = p.walls.follow;
    p.q.resize(points);

    // ---- Linearised problem of the contacts
    for (Eigen::Index i = 0; i < n; ++i) {
        const Candidate& c = s.contact(std::size_t(p.walls.which[std::size_t(i)]));
        p.q.segment<3>(3 * i) << c.gap, c.slip[0], c.slip[1];
        p.inner.diagonal().segment<3>(3 * i).array() += kRhoPorts * c.stiffness;
    }
    p.W.resize(points, points);
    if (n == 0) return;
    // Neighbours move almost alike: what rounding makes of N's least values may be below 0.
    p.F = at_ports(LdltFactor(N).root());
    const auto Fp = p.F.topRows(points);
    const Eigen::MatrixXd carried = p.inner * Fp;
    p.system.noalias() = -Fp.transpose() * carried;
    p.system.diagonal().array() += 1;
    p.FPsi.noalias() = Fp.transpose() * p.walls.share;
    p.LF.noalias() = p.walls.motion * Fp;
    const LuFactor lu(p.system);
    p.x0 = beta + p.F * lu.solve(Fp.transpose() * (p.inner * beta.head(points)));
    p.q += p.walls.motion * p.x0.head(points);
    for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index axis = 0; axis < 2; ++axis) { // the spin's part of reactions and slips
            const auto spin = points + 2 * i + axis, slip = 3 * i + 1 + axis;
            p.FPsi.col(slip) += p.F.row(spin).transpose();
            p.LF.row(slip) += p.F.row(spin);
            p.q[slip] += p.x0[spin];
        }
    p.answer = lu.solve_all(p.FPsi);
    p.W = p.walls.compliance;
    p.W.noalias() += p.LF * p.answer;
    p.even = lu.determinant() > 0;
}

/// Change of reactions, from statuses: rho = fixed + basis z with (row)(q + W rho) + give z = 0.
struct TrialSystem {
    /// The fixed part of the solution.
    Eigen::VectorXd fixed;
    /// Basis of the reactions in their states.
    Eigen::SparseMatrix<double> basis;
    /// Rows of the states.
    Eigen::SparseMatrix<double, Eigen::RowMajor> row;
    Eigen::VectorXd
        compliance; ///< 1 / weight: of the multipliers' method, and of slip across [m/N]
};

/// The system of the active rows of a trial.
template <class System> TrialSystem trial_system(System& s, const std::vector<int>& which)
{
    const auto n = Eigen::Index(which.size());
    TrialSystem t;
    t.fixed = Eigen::VectorXd::Zero(3 * n);
    t.compliance = Eigen::VectorXd::Zero(3 * n);
    std::vector<Eigen::Triplet<double>> basis, rows;
    int at = 0;
    const auto add = [&](Eigen::Index k, const Vec3& force, const Vec3& row, double compliance) {
        for (int i = 0; i < 3; ++i) {
            if (force[i] != 0) basis.emplace_back(int(3 * k) + i, at, force[i]);
            if (row[i] != 0) rows.emplace_back(at, int(3 * k) + i, row[i]);
        }
        t.compliance[at++] = compliance;
    };
    for (Eigen::Index k = 0; k < n; ++k) {
        const auto i = std::size_t(which[std::size_t(k)]);
        const Candidate& c = s.contact(i);
        const Trial& a = s.trial()[i];
        const Vec3 old(c.normal, c.tangential[0], c.tangential[1]);
        const double prox = 1 / (kRhoNormal * c.stiffness);
        if (a.status == 0) {
            t.fixed.segment<3>(3 * k) = -old;
        } else if (a.status == 2) {
            const Vec3 slip(0, c.mu * a.c1, c.mu * a.c2), across(0, -a.c2, a.c1);
            t.fixed.segment<3>(3 * k) = old[0] * slip - Vec3(0, old[1], old[2]);
            add(k, Vec3(1, 0, 0) + slip, Vec3(1, 0, 0), prox);
            if (a.across > 0) add(k, across, across, 1 / a.across);
        } else {
            add(k, Vec3(1, 0, 0), Vec3(1, 0, 0), prox);
            if (c.mu > 0) {
                add(k, Vec3(0, 1, 0), Vec3(0, 1, 0), prox);
                add(k, Vec3(0, 0, 1), Vec3(0, 0, 1), prox);
            }
        }
    }
    t.basis.resize(3 * n, at);
    t.basis.setFromTriplets(basis.begin(), basis.end());
    t.row.resize(at, 3 * n);
    t.row.setFromTriplets(rows.begin(), rows.end());
    t.compliance.conservativeResize(at);
    return t;
}

/// Statuses by Gauss-Seidel's method on all reactions, for where pivoting cycles: many
/// points close to one another on a wall, all of them candidates for the same force.
template <class System> void sweep_statuses(System& s, const CompliantProblem& p)
{
    const auto n = Eigen::Index(p.walls.which.size());
    Eigen::VectorXd rho = Eigen::VectorXd::Zero(3 * n), motion = p.q;
    const auto set = [&](Eigen::Index i, double value) {
        motion += p.W.col(i) * (value - rho[i]);
        rho[i] = value;
    };
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (Eigen::Index k = 0; k < n; ++k) {
            const Candidate& c = s.contact(std::size_t(p.walls.which[std::size_t(k)]));
            const auto at = 3 * k;
            const double own = p.W(at, at);
            if (!(own > 0)) return;
            set(at, std::max(0.0, c.normal + rho[at] - motion[at] / own) - c.normal);
            if (!(c.mu > 0)) continue;
            const double across = 0.5 * (p.W(at + 1, at + 1) + p.W(at + 2, at + 2));
            if (!(across > 0)) return;
            const double t1 = c.tangential[0] + rho[at + 1] - motion[at + 1] / across,
                         t2 = c.tangential[1] + rho[at + 2] - motion[at + 2] / across;
            const double size = std::hypot(t1, t2), bound = c.mu * (c.normal + rho[at]);
            const double back = size > bound ? bound / size : 1;
            set(at + 1, back * t1 - c.tangential[0]);
            set(at + 2, back * t2 - c.tangential[1]);
        }
    for (Eigen::Index k = 0; k < n; ++k) {
        const auto i = std::size_t(p.walls.which[std::size_t(k)]);
        const Candidate& c = s.contact(i);
        Trial& t = s.trial()[i];
        t.normal = c.normal + rho[3 * k];
        t.t1 = c.tangential[0] + rho[3 * k + 1];
        t.t2 = c.tangential[1] + rho[3 * k + 2];
        t.gap = motion[3 * k];
        t.v1 = motion[3 * k + 1];
        t.v2 = motion[3 * k + 2];
        t.status = t.normal > 0 ? 1 : 0;
        if (t.status == 1 && c.mu > 0 && std::hypot(t.t1, t.t2) > (1 - 1e-6) * c.mu * t.normal)
            change(c, t, Change::turn);
    }
}

/// Whether wire and walls are stable with the rows of the trials held, friction's coupling to the
/// normal reactions left out.
template <class System> bool stable_together(System& s, const CompliantProblem& p)
{
    if (p.walls.which.empty()) return true;
    const TrialSystem t = trial_system(s, p.walls.which);
    // With the held rows' reactions condensed it is symmetric: that does not depend on which number
    // stands for a reaction.
    Eigen::MatrixXd left = p.system;
    if (t.compliance.size() > 0) {
        Eigen::MatrixXd compliance = t.row * p.walls.compliance * t.row.transpose();
        compliance.diagonal() += t.compliance;
        const LuFactor held(compliance);
        if (!(held.determinant() > 0)) return false;
        left += Eigen::MatrixXd(p.FPsi * t.row.transpose()) * held.solve_all(t.row * p.LF);
    }
    left = (0.5 * (left + left.transpose())).eval();
    return is_positive_definite(std::move(left));
}

/// As pivot(), with walls that are compliant.
template <class System>
bool pivot_compliant(System& s, const Residual& res, const NewtonOptions& options, double& shift,
                     NewtonReport& report)
{
    const std::size_t n = s.contacts();
    std::vector<Trial>& trials = s.trial();
    const double force = 1e-3 * options.tolerance * res.scale;
    trials.resize(n);
    std::vector<bool> matters(n);

    // ---- Contacts that take part
    for (std::size_t k = 0; k < n; ++k) {
        initial_status(s.contact(k), trials[k]);
        matters[k] = trials[k].status != 0 || s.contact(k).gap < kNearContact * s.contact(k).radius;
    }
    const auto raise = [&] {
        shift =
            shift > 0 ? 4 * shift : std::max(kLeastShift * s.min_stiffness(), s.last_shift() / 16);
        return shift <= kLargestShift * s.min_stiffness();
    };
    CompliantProblem p;
    std::vector<typename System::Row> port;
    std::vector<Change> wrong(n);
    bool found = false;

    // ---- Rounds: pivot, then add contacts that came near
    for (int round = 0; round < kMostRounds; ++round) {
        std::vector<int> which;
        for (std::size_t k = 0; k < n; ++k)
            if (matters[k]) which.push_back(int(k));
        p.walls = s.linearise_walls(std::move(which));
        const auto m = Eigen::Index(p.walls.which.size());
        const auto factor = [&] {
            do {
                s.start_matrix(shift, s.first());
                for (const int c : p.walls.which) {
                    const auto k = std::size_t(c);
                    const double rho = kRhoPorts * s.contact(k).stiffness;
                    System::add_product(s.matrix(), s.place(k), s.normal(k), s.normal(k), rho,
                                        s.first());
                    // Also without friction: what holds a wire across a wall is its curvature,
                    // which M does not contain.
                    for (const auto& t : s.point_rows(k))
                        System::add_product(s.matrix(), s.place(k), t, t, rho, s.first());
                }
                ++report.factorisations;
                if (s.matrix().factor(s.first()) == 0) {
                    solve_ports(s, p, port);
                    return true;
                }
            } while (raise());
            return false;
        };
        if (!factor()) return false;

        StallCounter patience;
        Eigen::VectorXd rho, motion;
        found = false;
        for (int trial = 0; trial < kMostTrials && !found; ++trial) {
            if (trial == kCircles) {
                sweep_statuses(s, p);
                patience = {};
            }
            const TrialSystem t = trial_system(s, p.walls.which);
            rho = t.fixed;
            bool even = p.even;
            if (t.compliance.size() > 0) {
                Eigen::MatrixXd G = Eigen::MatrixXd(t.row * p.W) * t.basis;
                G.diagonal() += t.compliance;
                const LuFactor lu(G);
                rho -= t.basis * lu.solve(t.row * (p.q + p.W * t.fixed));
                even = even == (lu.determinant() > 0);
            }
            if (!p.walls.holds) return false;
            if (!even && !stable_together(s, p)) {
                if (!raise() || !factor()) return false;
                continue;
            }
            motion = p.q + p.W * rho;
            int count = 0;
            for (Trial& a : trials)
                a.normal = a.t1 = a.t2 = 0;
            for (Eigen::Index k = 0; k < m; ++k) {
                const auto i = std::size_t(p.walls.which[std::size_t(k)]);
                const Candidate& c = s.contact(i);
                Trial& a = trials[i];
                a.gap = motion[3 * k];
                a.v1 = motion[3 * k + 1];
                a.v2 = motion[3 * k + 2];
                a.normal = c.normal + rho[3 * k];
                a.t1 = c.tangential[0] + rho[3 * k + 1];
                a.t2 = c.tangential[1] + rho[3 * k + 2];
                wrong[i] = violation(c, a, force, force / c.stiffness);
                if (wrong[i].kind != Change::none) ++count;
            }
            if (count == 0) {
                found = true;
                if (res.error() < kNearSolution && !stable_together(s, p)) {
                    found = false;
                    if (!raise() || !factor()) return false;
                }
                continue;
            }
            flip_statuses(s, wrong, count, patience,
                          [&](std::size_t k) { change(s.contact(k), trials[k], wrong[k].kind); });
        }
        // d = M^-1 (-g + U ((R + Theta) x + Psi rho))
        Eigen::VectorXd forces(5 * m);
        if (m > 0) {
            const Eigen::VectorXd inward = p.answer * rho;
            forces.head(3 * m) =
                p.inner * (p.x0.head(3 * m) + p.F.topRows(3 * m) * inward) + p.walls.share * rho;
        }
        for (Eigen::Index i = 0; i < m; ++i)
            forces.segment<2>(3 * m + 2 * i) = rho.segment<2>(3 * i + 1);
        s.increment() = s.right();
        for (Eigen::Index j = 0; j < 5 * m; ++j)
            System::add_force(s.increment(), s.place(contact_of_port(p, j)), port[std::size_t(j)],
                              forces[j]);
        s.matrix().solve(s.increment());
        if (!found) return false;
        bool more = false;
        for (std::size_t k = 0; k < n; ++k) {
            if (matters[k]) continue;
            trials[k].gap =
                s.contact(k).gap + System::apply(s.normal(k), s.increment(), s.place(k));
            if (trials[k].gap < kNearContact * s.contact(k).radius) matters[k] = more = true;
        }
        if (!more) break;
    }
    return found;
}

} // namespace amontons::pivoting
