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
    if (chain.size() == 0) return 0;
    const Blocks blocks{&chain.diagonal(0), &chain.upper(0), &chain.lower(0), 1, chain.size()};
    return factor(blocks, first, first);
}

int ChainBand::factor(const Blocks& chain, int first, int from)
{
    const int rows = 6 * (chain.size - first);
    if (first != first_ || rows != rows_ || from < first) from = first;
    first_ = first;
    rows_ = rows;
    const int begin = 6 * (from - first); // row
    rows_of_band_.resize(std::size_t(rows_ + 1) * kWidth);
    std::fill(rows_of_band_.begin() + std::ptrdiff_t(begin) * kWidth, rows_of_band_.end(), 0.0);
    negative_.resize(std::size_t(chain.size - first) + 1, 0);
    odd_.resize(negative_.size(), 0);
    const auto diagonal = [&](int row) {
        return rows_of_band_.data() + std::size_t(row) * kWidth + kSide;
    };
    const auto at = [&](const Block6* b, int node) -> const Block6& {
        return b[std::ptrdiff_t(node) * chain.stride];
    };
    for (int i = from; i < chain.size; ++i) {
        const int row = 6 * (i - first);
        for (int k = 0; k < 6; ++k)
            for (int j = 0; j < 6; ++j) {
                diagonal(row + j)[k - j] = at(chain.diagonal, i)(j, k);
                if (i + 1 < chain.size) diagonal(row + j)[6 + k - j] = at(chain.upper, i)(j, k);
                if (i > first) diagonal(row + j)[k - 6 - j] = at(chain.lower, i - 1)(j, k);
            }
    }
    // What stands before `from` is there; its last rows are still to be taken from those behind.
    for (int k = std::max(begin - kReach, 0); k < rows_; ++k) {
        const double pivot = *diagonal(k);
        const Side behind = Eigen::Map<const Side>(diagonal(k) + 1);
        const int last = std::min(rows_ - 1, k + kReach);
        for (int i = std::max(k + 1, begin); i <= last; ++i) {
            double* entry = diagonal(i) + (k - i);
            *entry /= pivot;
            Eigen::Map<Side>(entry + 1) -= *entry * behind;
        }
    }
    for (std::size_t i = std::size_t(from - first); i + 1 < negative_.size(); ++i) {
        int negative = 0;
        for (int k = 0; k < 6; ++k)
            if (!(*diagonal(6 * int(i) + k) > 0)) ++negative;
        negative_[i + 1] = negative_[i] + negative;
        odd_[i + 1] = odd_[i] + negative % 2;
    }
    return negative_.back();
}

void ChainBand::solve(std::vector<Node6>& x) const
{
    // Number by number, and the value that is found last is used last: a vector that is loaded from
    // what has just been stored in parts would wait for all of them.
    const auto diagonal = [&](int row) {
        return rows_of_band_.data() + std::size_t(row) * kWidth + kSide;
    };
    const auto node = [&](int i) { return x[std::size_t(first_ + i)].value; };
    const int nodes = rows_ / 6;
    const double zero[6] = {};
    for (int i = 0; i < nodes; ++i) {
        const double* const before = i > 0 ? node(i - 1) : zero;
        double* const v = node(i);
#pragma GCC unroll 6
        for (int j = 0; j < 6; ++j) {
            const double* const a = diagonal(6 * i + j) - j - 6; // by the first of the node before
            double even = v[j], odd = 0;
#pragma GCC unroll 6
            for (int k = 0; k < 6; ++k)
                (k % 2 == 0 ? even : odd) -= a[k] * before[k];
#pragma GCC unroll 6
            for (int k = 0; k + 1 < j; ++k)
                (k % 2 == 0 ? even : odd) -= a[6 + k] * v[k];
            v[j] = even + odd;
            if (j > 0) v[j] -= a[6 + j - 1] * v[j - 1];
        }
    }
    for (int i = nodes - 1; i >= 0; --i) {
        const double* const behind = i + 1 < nodes ? node(i + 1) : zero;
        double* const v = node(i);
#pragma GCC unroll 6
        for (int j = 5; j >= 0; --j) {
            const double* const a = diagonal(6 * i + j) - j; // by the first of the node
            double even = v[j], odd = 0;
#pragma GCC unroll 6
            for (int k = 0; k < 6; ++k)
                (k % 2 == 0 ? even : odd) -= a[6 + k] * behind[k];
#pragma GCC unroll 6
            for (int k = 5; k > j + 1; --k)
                (k % 2 == 0 ? even : odd) -= a[k] * v[k];
            double sum = even + odd;
            if (j < 5) sum -= a[j + 1] * v[j + 1];
            v[j] = sum / a[j];
        }
    }
}

} // namespace amontons
