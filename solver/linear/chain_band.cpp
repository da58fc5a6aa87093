#include "solver/linear/chain_band.hpp"

#include <algorithm>

namespace amontons {
namespace {

// A row holds what is up to 11 places before and behind its diagonal. One zero in front makes both
// sides twelve long (of the side behind the next row's zero is the last), so that loops have a
// length that is known.
constexpr int kReach = 11, kSide = kReach + 1, kWidth = 2 * kSide;
using Side = Eigen::Matrix<double, kSide, 1>;

} // namespace

int ChainBand::factor(const BlockTridiagonal& chain, int first)
{
    first_ = first;
    rows_ = 6 * (chain.size() - first);
    rows_of_band_.assign(std::size_t(rows_ + 1) * kWidth, 0.0);
    const auto diagonal = [&](int row) {
        return rows_of_band_.data() + std::size_t(row) * kWidth + kSide;
    };
    for (int i = first; i < chain.size(); ++i) {
        const int row = 6 * (i - first);
        for (int k = 0; k < 6; ++k)
            for (int j = 0; j < 6; ++j) {
                diagonal(row + j)[k - j] = chain.diagonal(i)(j, k);
                if (i + 1 == chain.size()) continue;
                diagonal(row + j)[6 + k - j] = chain.upper(i)(j, k);
                diagonal(row + 6 + j)[k - 6 - j] = chain.lower(i)(j, k);
            }
    }
    int negative = 0;
    for (int k = 0; k < rows_; ++k) {
        const double pivot = *diagonal(k);
        if (!(pivot > 0)) ++negative;
        const Side behind = Eigen::Map<const Side>(diagonal(k) + 1);
        const int last = std::min(rows_ - 1, k + kReach);
        for (int i = k + 1; i <= last; ++i) {
            double* entry = diagonal(i) + (k - i);
            *entry /= pivot;
            Eigen::Map<Side>(entry + 1) -= *entry * behind;
        }
    }
    return negative;
}

void ChainBand::solve(std::vector<Node6>& x) const
{
    std::vector<double> values(std::size_t(rows_ + 2 * kSide), 0.0); // zeros before and behind
    double* v = values.data() + kSide;
    for (int i = 0; i < rows_; ++i)
        v[i] = x[std::size_t(first_ + i / 6)].value[i % 6];
    const auto diagonal = [&](int row) {
        return rows_of_band_.data() + std::size_t(row) * kWidth + kSide;
    };
    using Map = Eigen::Map<const Side>;
    for (int i = 0; i < rows_; ++i)
        v[i] -= Map(diagonal(i) - kSide).dot(Map(v + i - kSide));
    for (int i = rows_ - 1; i >= 0; --i)
        v[i] = (v[i] - Map(diagonal(i) + 1).dot(Map(v + i + 1))) / *diagonal(i);
    for (int i = 0; i < rows_; ++i)
        x[std::size_t(first_ + i / 6)].value[i % 6] = v[i];
}

} // namespace amontons
