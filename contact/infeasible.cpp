#include "contact/infeasible.hpp"

#include "contact/presolve.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/base/limits.hpp"

#include <cmath>

namespace amontons {
namespace {

/// Growth below this times the largest is noise around the direction.
constexpr double kShare = 1e-6;
/// Shift of the inverse iteration over the mean diagonal: three steps bring any part with an
/// eigenvalue above 1e-6 of the mean below round-off.
constexpr double kDiagonalShift = 1e-12;
/// Growth that W changes by more than this share of its size is no recession direction.
constexpr double kUnfelt = 1e-2;
constexpr double kProofRoundOff = 200 * kEpsilon;

} // namespace

std::optional<InfeasibilityProof> prove_infeasible(const ContactProblem& problem,
                                                   const Eigen::VectorXd& growth)
{
    const std::vector<int> offset = row_offsets(problem);
    Eigen::VectorXd full = Eigen::VectorXd::Zero(problem.q.size());
    for (int i = 0; i < contact_count(problem); ++i) {
        const int row = offset[static_cast<std::size_t>(i)];
        if (kind_of(problem, i) != ContactKind::bilateral) full[row] = growth[row];
    }
    const double largest = full.size() > 0 ? full.maxCoeff() : 0;
    if (!(largest > 0) || !std::isfinite(largest)) return {};
    full = (full.array() > kShare * largest).select(full / largest, 0);
    if ((problem.W * full).norm() > kUnfelt * problem.W.absolute_times(full).norm()) return {};

    std::vector<Eigen::Index> rows;
    std::vector<int> contacts;
    for (int i = 0; i < contact_count(problem); ++i)
        if (const int row = offset[static_cast<std::size_t>(i)]; full[row] > 0) {
            contacts.push_back(i);
            rows.push_back(row);
        }
    Eigen::VectorXd d = full(rows);
    Eigen::MatrixXd W = problem.W.part(rows);
    const double mean = W.trace() / static_cast<double>(rows.size());
    if (mean > 0) {
        W = (W + W.transpose()).eval() / 2;
        W.diagonal().array() += kDiagonalShift * mean;
        const LdltFactor factor(W);
        for (int k = 0; k < 3; ++k) {
            const Eigen::VectorXd next = factor.solve(d);
            const double size = next.maxCoeff();
            if (!next.allFinite() || !(size > 0)) return {};
            d = next / size;
        }
    }
    d = (d.array() > kShare).select(d, 0); // the tests below use the remaining direction

    full(rows) = d;
    const Eigen::VectorXd image = problem.W.transpose_times(full);
    const Eigen::VectorXd size = problem.W.absolute_times(full); // symmetric enough for a size
    const double closing = -problem.q.dot(full);
    const double closing_size = problem.q.cwiseAbs().dot(full);
    if (image.norm() > kProofRoundOff * size.norm() || !(closing > kProofRoundOff * closing_size))
        return {};

    InfeasibilityProof proof;
    proof.direction = Eigen::VectorXd::Zero(contact_count(problem));
    for (std::size_t k = 0; k < rows.size(); ++k)
        if (const double value = d[static_cast<Eigen::Index>(k)]; value > 0) {
            proof.direction[contacts[k]] = value;
            proof.contacts.push_back(contacts[k]);
        }
    proof.closing = closing;
    proof.holds_up_to =
        image.norm() > 0 ? closing / image.norm() : std::numeric_limits<double>::infinity();
    return proof;
}

ContactProblem softened_normals(const ContactProblem& problem, double compliance,
                                std::vector<Eigen::Index>& normal_rows)
{
    const std::vector<int> offset = row_offsets(problem);
    normal_rows.clear();
    ContactProblem normals;
    for (int i = 0; i < contact_count(problem); ++i) {
        normal_rows.push_back(offset[static_cast<std::size_t>(i)]);
        normals.kind.push_back(kind_of(problem, i) == ContactKind::bilateral
                                   ? ContactKind::bilateral
                                   : ContactKind::frictionless);
    }
    const auto n = static_cast<Eigen::Index>(normal_rows.size());
    normals.mu.setZero(n);
    normals.level = problem.level;
    normals.q = problem.q(normal_rows);

    const Eigen::VectorXd diagonal = problem.W.diagonal()(normal_rows);
    const double mean = n > 0 ? diagonal.cwiseAbs().mean() : 0;
    const double soft = compliance * (mean > 0 ? mean : 1);
    if (problem.W.is_of_bodies()) {
        const DelassusOfBodies& W = problem.W.of_bodies();
        DelassusOfBodies picked = of_rows(W, normal_rows);
        picked.compliance.array() += soft;
        normals.W = std::move(picked);
    } else if (problem.W.is_sparse()) {
        Delassus::Sparse pick(n, problem.q.size()), shift(n, n);
        for (Eigen::Index k = 0; k < n; ++k)
            pick.insert(k, normal_rows[static_cast<std::size_t>(k)]) = 1;
        shift.setIdentity();
        const Delassus::Sparse picked =
            pick * problem.W.sparse() * Delassus::Sparse(pick.transpose());
        normals.W = Delassus::Sparse(picked + soft * shift);
    } else {
        Eigen::MatrixXd W = problem.W.part(normal_rows);
        W.diagonal().array() += soft;
        normals.W = std::move(W);
    }
    return normals;
}

} // namespace amontons
