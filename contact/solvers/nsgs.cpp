#include "contact/solvers/nsgs.hpp"

#include "contact/cone.hpp"
#include "contact/solvers/columns.hpp"
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
    Sweeper(const ContactProblem& problem, const NaturalMapError& natural_map)
        : problem_(problem)
        , natural_map_(natural_map)
        , columns_(problem)
        , own_(static_cast<std::size_t>(contact_count(problem)))
        , blocks_(static_cast<std::size_t>(contact_count(problem)))
        , own_weight_(contact_count(problem))
        , weight_(contact_count(problem))
    {
        for (int i = 0; i < contact_count(problem); ++i) {
            if (kind_of(problem, i) == ContactKind::frictional) {
                own(i) = problem.W.block(natural_map.first_row(i), 3);
                block(i) = prepare(own(i));
            }
            const double rho = natural_map.rho(i);
            own_weight_[i] = 1 / std::sqrt(rho);
            // ||F|| grows with rho, by no more than rho does.
            weight_[i] = std::max(1.0, natural_map.rho() / rho);
        }
    }

    /// One sweep over all contacts but the settled ones: those whose residual, with the u that
    /// the sweep has reached, is below `freeze` times the error's mean share at the common scale
    /// and the worst of the last sweep at their own.
    /// @param residuals  ||F_i|| before the sweep, n [N]
    void sweep(Eigen::VectorXd& r, Eigen::VectorXd& u, const Eigen::VectorXd& residuals,
               double freeze, bool backward)
    {
        const int n = contact_count(problem_);
        const double settled = freeze * residuals.norm() / std::sqrt(n);
        const double own_settled = freeze * worst_;
        worst_ = 0;
        for (int k = 0; k < n; ++k) {
            const int i = backward ? n - 1 - k : k;
            const double own = natural_map_.residual(i, r, u, natural_map_.rho(i));
            worst_ = std::max(worst_, own * own_weight_[i]);
            if (own * weight_[i] < settled && own * own_weight_[i] < own_settled) continue;
            if (kind_of(problem_, i) == ContactKind::frictional)
                visit(i, r, u);
            else
                visit_row(i, r, u);
        }
    }

private:
    Mat3& own(int i) { return own_[static_cast<std::size_t>(i)]; }
    const Mat3& own(int i) const { return own_[static_cast<std::size_t>(i)]; }
    LocalBlock& block(int i) { return blocks_[static_cast<std::size_t>(i)]; }

    void visit(int i, Eigen::VectorXd& r, Eigen::VectorXd& u)
    {
        const int row = natural_map_.first_row(i);
        if (u[row] >= 0 && r[row] == 0) return; // open, and right
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
        columns_.add(i, change.data(), u);
    }

    /// A proximal step: A + alpha in place of A, centred at the last reaction, so that a fixed
    /// point is one of the problem itself. For a block that has no solution alone (A_nn = 0, a
    /// wedge that locks), whose neighbours may yet help.
    LocalReaction solve_shifted(int i, const Vec3& ri, const Vec3& b) const
    {
        const Mat3& A = own(i);
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
        r[row] = wanted;
        columns_.add(i, &change, u);
    }

    const ContactProblem& problem_;
    const NaturalMapError& natural_map_;
    const Columns columns_;
    std::vector<Mat3> own_; ///< diagonal blocks of frictional contacts
    std::vector<LocalBlock> blocks_;
    Eigen::VectorXd own_weight_, weight_; ///< of a residual: its own scale, the common one
    double worst_ = 0; ///< largest residual met in the last sweep, each at its own scale
};

} // namespace

SolverRun solve_nsgs(const ContactProblem& problem, const SolverOptions& options,
                     Eigen::VectorXd start)
{
    Progress progress(problem, options);
    Eigen::VectorXd r = std::move(start);
    Eigen::VectorXd u = problem.W * r + problem.q;
    Sweeper sweeper(problem, progress.natural_map());
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
        const double freeze = done >= next_proof ? 0 : options.nsgs.freeze; // growth of all
        sweeper.sweep(r, u, progress.residuals(), freeze, symmetric && done % 2 == 1);
    }
    return std::move(progress).result();
}

} // namespace amontons
