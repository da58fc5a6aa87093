#include "contact/solvers/nsgs.hpp"

#include "contact/cone.hpp"
#include "contact/solvers/local.hpp"

#include <algorithm>
#include <cmath>

// u is kept up to date: a contact reads its own u_i, solves, and adds W(:, i) dr_i to u. A contact
// that does not change thus costs a look. The published form computes row i of W r for each
// contact, which costs the same whether anything changes or not.

namespace amontons {
namespace {

/// Is r running away? Asked at these sweeps: the direction settles late. What it grew in two
/// sweeps is what it grew forward and backward.
constexpr int kFirstProof = 32;
constexpr int kProofFactor = 2;
constexpr int kProofSweeps = 2;
/// First shift of a block that has no solution alone, over its largest entry [-].
constexpr double kShift = 1e-2;

class Sweeper {
public:
    Sweeper(const ContactProblem& problem, const SolverOptions& options,
            const NaturalMapError& natural_map)
        : problem_(problem)
        , freeze_(options.nsgs.freeze)
        , natural_map_(natural_map)
        , blocks_(static_cast<std::size_t>(contact_count(problem)))
        , q_size_(natural_map.rho() * problem.q.norm())
    {
        for (int i = 0; i < contact_count(problem); ++i)
            if (kind_of(problem, i) == ContactKind::frictional) block(i) = prepare(own(i));
    }

    /// One sweep over all contacts.
    /// @param error  of the last iterate; every: visit settled contacts as well
    void sweep(Eigen::VectorXd& r, Eigen::VectorXd& u, double error, bool backward, bool every)
    {
        const int n = contact_count(problem_);
        const double worst = worst_;
        const double fair_share = error * q_size_ / std::sqrt(n);
        worst_ = 0;
        for (int k = 0; k < n; ++k) {
            const int i = backward ? n - 1 - k : k;
            if (kind_of(problem_, i) != ContactKind::frictional) {
                visit_row(i, r, u);
                continue;
            }
            const int row = natural_map_.first_row(i);
            if (u[row] >= 0 && r[row] == 0) continue; // open, and right
            // |F| grows with rho, |F| / rho falls: one map at the contact's own scale bounds
            // its share of the error at the common one.
            const double rho = natural_map_.rho(i);
            const double own = natural_map_.residual(i, r, u, rho);
            const double scaled = own / std::sqrt(rho);
            const double share = own * std::max(1.0, natural_map_.rho() / rho);
            worst_ = std::max(worst_, scaled);
            if (!every && scaled <= freeze_ * worst && share <= freeze_ * fair_share) continue;
            visit(i, r, u);
        }
    }

private:
    Mat3 own(int i) const
    {
        const int row = natural_map_.first_row(i);
        return problem_.W.block<3, 3>(row, row);
    }
    LocalBlock& block(int i) { return blocks_[static_cast<std::size_t>(i)]; }

    void visit(int i, Eigen::VectorXd& r, Eigen::VectorXd& u)
    {
        const int row = natural_map_.first_row(i);
        const Vec3 ri = r.segment<3>(row), ui = u.segment<3>(row);
        const double rt = ri.tail<2>().norm();
        const double guess = rt > 0 ? ui.tail<2>().norm() / rt : 0;
        const Vec3 b = ui - own(i) * ri;
        LocalReaction local = solve_local(block(i), problem_.mu[i], b, guess);
        if (local.state == LocalState::unsolved) local = solve_shifted(i, ri, b);
        if (local.state == LocalState::unsolved) return; // r stays: the certificate will tell

        const Vec3 change = local.r - ri;
        if (change.isZero(0)) return;
        r.segment<3>(row) = local.r;
        const Eigen::Index rows = u.size();
        const double* w0 = problem_.W.data() + row * rows;
        const double* w1 = w0 + rows;
        const double* w2 = w1 + rows;
        const double c0 = change[0], c1 = change[1], c2 = change[2];
        double* __restrict v = u.data();
        for (Eigen::Index k = 0; k < rows; ++k)
            v[k] += w0[k] * c0 + w1[k] * c1 + w2[k] * c2;
    }

    /// A proximal step: A + alpha in place of A, centred at the last reaction, so that a fixed
    /// point is one of the problem itself. For a block that has no solution alone (A_nn = 0, a
    /// wedge that locks), whose neighbours may yet help.
    LocalReaction solve_shifted(int i, const Vec3& ri, const Vec3& b) const
    {
        const Mat3 A = own(i);
        const double size = A.cwiseAbs().maxCoeff();
        double alpha = size > 0 ? kShift * size : 1 / natural_map_.rho();
        LocalReaction local;
        for (int k = 0; k < 6 && local.state == LocalState::unsolved; ++k, alpha *= 10)
            local =
                solve_local(prepare(A + alpha * Mat3::Identity()), problem_.mu[i], b - alpha * ri);
        return local;
    }

    /// Frictionless and bilateral rows.
    void visit_row(int i, Eigen::VectorXd& r, Eigen::VectorXd& u)
    {
        const int row = natural_map_.first_row(i);
        double wanted = r[row] - u[row] * natural_map_.rho(i); // rho of one row is 1 / W_ii
        if (kind_of(problem_, i) == ContactKind::frictionless) wanted = std::max(0.0, wanted);
        const double change = wanted - r[row];
        if (change == 0) return;
        worst_ = std::max(worst_, std::abs(change) / std::sqrt(natural_map_.rho(i)));
        r[row] = wanted;
        u += change * problem_.W.col(row);
    }

    const ContactProblem& problem_;
    double freeze_;
    const NaturalMapError& natural_map_;
    std::vector<LocalBlock> blocks_;
    double q_size_;
    double worst_ = 0; ///< largest residual of the last sweep, each in its own scale
};

} // namespace

SolverRun solve_nsgs(const ContactProblem& problem, const SolverOptions& options,
                     Eigen::VectorXd start)
{
    Progress progress(problem, options);
    Eigen::VectorXd r = std::move(start);
    Eigen::VectorXd u = problem.W * r + problem.q;
    Sweeper sweeper(problem, options, progress.natural_map());
    Eigen::VectorXd before = r;
    const bool symmetric = options.nsgs.order == SolverOptions::Nsgs::Order::symmetric;

    int next_proof = kFirstProof;
    while (!progress.ends(r, u)) {
        const int done = progress.iterations();
        if (done == next_proof) before = r;
        if (done == next_proof + kProofSweeps) {
            next_proof *= kProofFactor;
            if (std::optional<InfeasibilityProof> proof = prove_infeasible(problem, r - before)) {
                progress.prove(std::move(*proof));
                break;
            }
        }
        sweeper.sweep(r, u, progress.error(), symmetric && done % 2 == 1, done >= next_proof);
    }
    return std::move(progress).result();
}

} // namespace amontons
