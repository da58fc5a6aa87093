#include "contact/units.hpp"

#include <cmath>

namespace amontons {
namespace {

constexpr double kSmallest = 1e-60, kLargest = 1e60;

bool is_harmless(double largest)
{
    return largest == 0 || (largest >= kSmallest && largest <= kLargest);
}

int exponent_of(double largest)
{
    return is_harmless(largest) || !std::isfinite(largest) ? 0 : std::ilogb(largest);
}

double largest_of(const Eigen::VectorXd& x)
{
    return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0;
}

/// Of a semidefinite W no entry is larger than the largest of the diagonal, which a sparse one has
/// to search for.
double largest_of(const Delassus& W)
{
    if (W.is_sparse()) return W.sparse().nonZeros() > 0 ? W.sparse().coeffs().abs().maxCoeff() : 0;
    const double own = largest_of(Eigen::VectorXd(W.diagonal()));
    if ((own > 0 && is_harmless(own)) || W.rows() == 0 || !W.is_dense()) return own;
    return W.dense().cwiseAbs().maxCoeff();
}

} // namespace

Units units_of(const ContactProblem& problem)
{
    return {exponent_of(largest_of(problem.W)), exponent_of(largest_of(problem.q))};
}

Eigen::VectorXd times_power(const Eigen::VectorXd& x, int exponent)
{
    // 2^exponent itself may be out of range where the result is not.
    return x.unaryExpr([exponent](double value) { return std::ldexp(value, exponent); });
}

ContactProblem in_units(const ContactProblem& problem, const Units& units)
{
    const auto scaled = [&](double value) { return std::ldexp(value, -units.W); };
    ContactProblem result = problem;
    result.q = times_power(problem.q, -units.q);
    if (problem.W.is_dense()) {
        result.W = Eigen::MatrixXd(problem.W.dense().unaryExpr(scaled));
    } else if (!problem.W.is_matrix_free()) {
        result.W = Delassus::Sparse(problem.W.as_sparse().unaryExpr(scaled));
    } else {
        MatrixFreeDelassus function = problem.W.matrix_free();
        function.blocks = problem.W.matrix_free().blocks.unaryExpr(scaled);
        function.apply = [apply = problem.W.matrix_free().apply,
                          exponent = -units.W](const Eigen::VectorXd& r, Eigen::VectorXd& out) {
            apply(r, out);
            out = times_power(out, exponent);
        };
        result.W = std::move(function);
    }
    return result;
}

Eigen::VectorXd normal_units(const ContactProblem& problem, double most)
{
    if (problem.W.is_matrix_free() || !(problem.mu.size() > 0 && problem.mu.maxCoeff() > most))
        return {};
    Eigen::VectorXd D = Eigen::VectorXd::Ones(problem.q.size());
    const std::vector<int> first = row_offsets(problem);
    for (int i = 0; i < contact_count(problem); ++i)
        if (kind_of(problem, i) == ContactKind::frictional && problem.mu[i] > most)
            D[first[static_cast<std::size_t>(i)]] =
                std::ldexp(1, -std::ilogb(problem.mu[i] / most) - 1);
    return D;
}

ContactProblem in_normal_units(const ContactProblem& problem, const Eigen::VectorXd& D)
{
    ContactProblem other = problem;
    if (problem.W.is_dense())
        other.W.dense() = D.asDiagonal() * problem.W.dense() * D.asDiagonal();
    else
        other.W = Delassus::Sparse(D.asDiagonal() * problem.W.as_sparse() * D.asDiagonal());
    other.q = D.cwiseProduct(problem.q);
    const std::vector<int> first = row_offsets(problem);
    for (int i = 0; i < contact_count(problem); ++i)
        if (kind_of(problem, i) == ContactKind::frictional)
            other.mu[i] *= D[first[static_cast<std::size_t>(i)]];
    return other;
}

} // namespace amontons
