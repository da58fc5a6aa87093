#include "contact/analysis.hpp"

#include "mesh/base/dense.hpp"

#include <Eigen/SparseCholesky>
#include <cmath>

namespace amontons {
namespace {

/// Eigenvalues this small, beside a diagonal of one, are zero up to the round-off of what W was
/// computed from.
constexpr double kZero = 1e-10;

/// Does S + shift have positive eigenvalues only?
bool is_positive(Eigen::MatrixXd S, double shift)
{
    S.diagonal().array() += shift;
    return is_positive_definite(std::move(S));
}

bool is_positive(Delassus::Sparse S, double shift)
{
    for (Eigen::Index i = 0; i < S.rows(); ++i)
        S.coeffRef(i, i) += shift;
    return Eigen::SimplicialLLT<Delassus::Sparse>(S).info() == Eigen::Success;
}

} // namespace

DelassusAnalysis analyse(const ContactProblem& problem)
{
    DelassusAnalysis result;
    if (problem.W.is_matrix_free()) return result;
    result.known = true;
    // Each row in its own scale: a stiff contact's eigenvalue is small, not zero.
    const Eigen::VectorXd scale = problem.W.diagonal().unaryExpr(
        [](double d) { return d != 0 ? 1 / std::sqrt(std::abs(d)) : 1; });
    const auto both = [&](const auto& S) {
        result.rank_deficient = !is_positive(S, -kZero);
        result.indefinite = result.rank_deficient && !is_positive(S, kZero);
    };
    if (problem.W.is_dense()) {
        const Eigen::MatrixXd W = scale.asDiagonal() * problem.W.dense() * scale.asDiagonal();
        both(Eigen::MatrixXd((W + W.transpose()) / 2));
    } else {
        const Delassus::Sparse W = scale.asDiagonal() * problem.W.as_sparse() * scale.asDiagonal();
        both(Delassus::Sparse((W + Delassus::Sparse(W.transpose())) / 2));
    }
    return result;
}

} // namespace amontons
