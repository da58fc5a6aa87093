#include "solver/linear/block_skyline.hpp"

#include "solver/linear/block_columns.hpp"

#include <algorithm>

namespace amontons {

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
        const std::size_t row = at(i, 0); // of column 0, which may lie before the row's blocks
        for (int j = first; j < i; ++j) {
            const std::size_t above = at(j, 0);
            const int start = std::max(first, top_[std::size_t(j)]);
            Columns6 c = load_columns(lower_[row + std::size_t(j)]);
            for (std::size_t k = std::size_t(start); k < std::size_t(j); ++k)
                subtract_product(c, lower_[row + k], upper_[above + k]);
            store_columns(c, lower_[row + std::size_t(j)]);
            Block6& u = upper_[row + std::size_t(j)];
            c = load_columns(u);
            for (std::size_t k = std::size_t(start); k < std::size_t(j); ++k)
                subtract_product(c, lower_[above + k], upper_[row + k]);
            store_columns(c, u);
            store_product(lower_[above + std::size_t(j)], u, u);
        }
        Columns6 d = load_columns(lower_[row + std::size_t(i)]);
        for (std::size_t k = std::size_t(first); k < std::size_t(i); ++k)
            subtract_product(d, lower_[row + k], upper_[row + k]);
        const int negative = invert_columns(d);
        store_columns(d, lower_[row + std::size_t(i)]);
        negative_[std::size_t(i) + 1] = negative_[std::size_t(i)] + negative;
        odd_[std::size_t(i) + 1] = odd_[std::size_t(i)] + negative % 2;
    }
    return negative_.back();
}

void BlockSkyline::solve(std::vector<Node6>& x) const
{
    for (int i = 0; i < size(); ++i) {
        Column2 t = load_column(x[std::size_t(i)]);
        for (int k = top_[std::size_t(i)]; k < i; ++k)
            subtract(t, product(lower_[at(i, k)], x[std::size_t(k)].value));
        Node6 sum;
        store_column(t, sum);
        store_column(product(lower_[at(i, i)], sum.value), x[std::size_t(i)]);
    }
    for (int i = size() - 1; i > 0; --i)
        for (int k = top_[std::size_t(i)]; k < i; ++k) {
            Column2 t = load_column(x[std::size_t(k)]);
            subtract(t, product(upper_[at(i, k)], x[std::size_t(i)].value));
            store_column(t, x[std::size_t(k)]);
        }
}

} // namespace amontons
