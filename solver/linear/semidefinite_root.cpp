#include "solver/linear/semidefinite_root.hpp"

#include <cmath>

namespace amontons {
namespace {

constexpr double kRoundOff = 1e-14; // of the largest diagonal entry

} // namespace

Eigen::MatrixXd semidefinite_root(const Eigen::MatrixXd& W)
{
    const Eigen::Index n = W.rows();
    if (n == 0) return Eigen::MatrixXd(0, 0);
    Eigen::VectorXd left = W.diagonal();
    const double least = kRoundOff * left.maxCoeff();
    Eigen::MatrixXd columns(n, n); // of G^T
    Eigen::Index k = 0, pivot = 0;
    for (double largest = left.maxCoeff(&pivot); k < n && largest > least;
         largest = left.maxCoeff(&pivot)) {
        const double root = std::sqrt(largest);
        auto own = columns.col(k);
        own = W.col(pivot);
        own.noalias() -= columns.leftCols(k) * columns.row(pivot).head(k).transpose();
        own /= root;
        own[pivot] = root;
        left -= own.cwiseAbs2();
        left[pivot] = 0; // and what round-off leaves of it
        ++k;
    }
    return columns.leftCols(k).transpose();
}

} // namespace amontons
