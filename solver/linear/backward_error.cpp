#include "solver/linear/backward_error.hpp"

#include <cmath>

namespace amontons {

double backward_error(const Eigen::SparseMatrix<double>& A, const Eigen::VectorXd& x,
                      const Eigen::VectorXd& b)
{
    Eigen::VectorXd residual = -b, row_sum = Eigen::VectorXd::Zero(b.size());
    for (Eigen::Index j = 0; j < A.cols(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(A, j); it; ++it) {
            const Eigen::Index i = it.row();
            if (i < j) continue;
            residual[i] += it.value() * x[j];
            row_sum[i] += std::abs(it.value());
            if (i == j) continue;
            residual[j] += it.value() * x[i];
            row_sum[j] += std::abs(it.value());
        }
    const double size = row_sum.lpNorm<Eigen::Infinity>() * x.lpNorm<Eigen::Infinity>() +
                        b.lpNorm<Eigen::Infinity>();
    return size > 0 ? residual.lpNorm<Eigen::Infinity>() / size
                    : residual.lpNorm<Eigen::Infinity>();
}

} // namespace amontons
