#include "solver/linear/block_skyline.hpp"

#include "solver/linear/block_invert.hpp"

#include <algorithm>

namespace amontons {
namespace {

/// c -= a b
inline void subtract_product(Block6& c, const Block6& a, const Block6& b)
{
    for (int j = 0; j < 6; ++j) {
        Column6 sum = c.column[j];
        for (int k = 0; k < 6; ++k)
            sum -= a.column[k] * splat6(b(k, j));
        c.column[j] = sum;
    }
}

inline Block6 product(const Block6& a, const Block6& b)
{
    Block6 c;
    for (int j = 0; j < 6; ++j) {
        Column6 sum = a.column[0] * splat6(b(0, j));
        for (int k = 1; k < 6; ++k)
            sum += a.column[k] * splat6(b(k, j));
        c.column[j] = sum;
    }
    return c;
}

} // namespace

void BlockSkyline::set_pattern(const std::vector<int>& top)
{
    top_ = top;
    start_.resize(top.size());
    std::size_t blocks = 0;
    for (std::size_t i = 0; i < top.size(); ++i) {
        start_[i] = blocks;
        blocks += i - std::size_t(top[i]) + 1;
    }
    for (auto* all : {&lower_, &upper_})
        all->assign(blocks, Block6{});
    negative_.assign(top.size() + 1, 0);
    odd_.assign(top.size() + 1, 0);
}

void BlockSkyline::set_zero()
{
    std::fill(lower_.begin(), lower_.end(), Block6{});
    std::fill(upper_.begin(), upper_.end(), Block6{});
}

void BlockSkyline::copy_from(const BlockSkyline& other, int from)
{
    const auto begin = std::ptrdiff_t(start_[std::size_t(from)]);
    std::copy(other.lower_.begin() + begin, other.lower_.end(), lower_.begin() + begin);
    std::copy(other.upper_.begin() + begin, other.upper_.end(), upper_.begin() + begin);
}

// A = L (1 + E): L_ij = A_ij - sum_k L_ik E_kj for j <= i, E_ji = L_jj^-1 (A_ji - sum_k L_jk E_ki).
int BlockSkyline::factor(int from)
{
    for (int i = from; i < size(); ++i) {
        const int first = top_[std::size_t(i)];
        for (int j = first; j < i; ++j) {
            Block6 l = lower_[at(i, j)], u = upper_[at(i, j)];
            for (int k = std::max(first, top_[std::size_t(j)]); k < j; ++k) {
                subtract_product(l, lower_[at(i, k)], upper_[at(j, k)]);
                subtract_product(u, lower_[at(j, k)], upper_[at(i, k)]);
            }
            lower_[at(i, j)] = l;
            upper_[at(i, j)] = product(lower_[at(j, j)], u);
        }
        Block6 d = lower_[at(i, i)];
        for (int k = first; k < i; ++k)
            subtract_product(d, lower_[at(i, k)], upper_[at(i, k)]);
        const int negative = invert_block(d);
        lower_[at(i, i)] = d;
        negative_[std::size_t(i) + 1] = negative_[std::size_t(i)] + negative;
        odd_[std::size_t(i) + 1] = odd_[std::size_t(i)] + negative % 2;
    }
    return negative_.back();
}

void BlockSkyline::solve(std::vector<Node6>& x) const
{
    for (int i = 0; i < size(); ++i) {
        Node6 t = x[std::size_t(i)];
        for (int k = top_[std::size_t(i)]; k < i; ++k)
            t.column -= multiply(lower_[at(i, k)], x[std::size_t(k)]);
        x[std::size_t(i)].column = multiply(lower_[at(i, i)], t);
    }
    for (int i = size() - 1; i > 0; --i)
        for (int k = top_[std::size_t(i)]; k < i; ++k)
            x[std::size_t(k)].column -= multiply(upper_[at(i, k)], x[std::size_t(i)]);
}

} // namespace amontons
