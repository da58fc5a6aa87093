#include "solver/linear/block_refine.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

double symmetrise(BlockTridiagonal& A)
{
    double worst = 0;
    const auto average = [&](Block6& a, Block6& b) { // b is the transposed of a, or should be
        double difference = 0, size = 0;
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) {
                const double mean = 0.5 * (a(i, j) + b(j, i));
                difference += std::pow(a(i, j) - b(j, i), 2);
                size += std::pow(a(i, j), 2) + std::pow(b(j, i), 2);
                a(i, j) = b(j, i) = mean;
            }
        if (size > 0) worst = std::max(worst, std::sqrt(difference / size));
    };
    for (int i = A.first(); i < A.size(); ++i) {
        average(A.diagonal(i), A.diagonal(i));
        if (i + 1 < A.size()) average(A.upper(i), A.lower(i));
    }
    return worst;
}

std::vector<Node6> residual(const BlockTridiagonal& A, const std::vector<Node6>& right,
                            const std::vector<Node6>& x)
{
    std::vector<Node6> r = right;
    for (int i = A.first(); i < A.size(); ++i) {
        const auto k = static_cast<std::size_t>(i);
        r[k].column -= multiply(A.diagonal(i), x[k]);
        if (i + 1 < A.size()) {
            r[k].column -= multiply(A.upper(i), x[k + 1]);
            r[k + 1].column -= multiply(A.lower(i), x[k]);
        }
    }
    return r;
}

} // namespace amontons
