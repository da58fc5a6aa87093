#include "solver/linear/block_tridiagonal.hpp"

#include "solver/linear/block_columns.hpp"

#include <cstring>
#include <new>

namespace amontons {

void BlockTridiagonal::Free::operator()(Block6* p) const
{
    ::operator delete[](p, std::align_val_t{64});
}

BlockTridiagonal::Blocks BlockTridiagonal::allocate(int size)
{
    const std::size_t bytes = static_cast<std::size_t>(size) * sizeof(Block6);
    auto* p = static_cast<Block6*>(::operator new[](bytes, std::align_val_t{64}));
    std::memset(static_cast<void*>(p), 0, bytes);
    return Blocks(p);
}

BlockTridiagonal::BlockTridiagonal(int size)
    : size_(size)
    , diagonal_(allocate(size))
    , upper_(allocate(size))
    , lower_(allocate(size))
    , inverse_(allocate(size))
    , eliminated_(allocate(size))
    , negative_(static_cast<std::size_t>(size) + 1, 0)
    , odd_(static_cast<std::size_t>(size) + 1, 0)
{
}

void BlockTridiagonal::set_zero()
{
    const std::size_t bytes = static_cast<std::size_t>(size_ - first_) * sizeof(Block6);
    std::memset(static_cast<void*>(&diagonal_[first_]), 0, bytes);
    std::memset(static_cast<void*>(&upper_[first_]), 0, bytes);
    std::memset(static_cast<void*>(&lower_[first_]), 0, bytes);
}

void BlockTridiagonal::copy_from(const BlockTridiagonal& other, int from)
{
    first_ = other.first_;
    const std::size_t bytes = static_cast<std::size_t>(size_ - from) * sizeof(Block6);
    std::memcpy(static_cast<void*>(&diagonal_[from]), &other.diagonal_[from], bytes);
    std::memcpy(static_cast<void*>(&upper_[from]), &other.upper_[from], bytes);
    std::memcpy(static_cast<void*>(&lower_[from]), &other.lower_[from], bytes);
}

int BlockTridiagonal::factor(int from)
{
    if (from <= first_) {
        from = first_;
        negative_[static_cast<std::size_t>(first_)] = odd_[static_cast<std::size_t>(first_)] = 0;
    }
    for (int i = from; i < size_; ++i) {
        Columns6 s = load_columns(diagonal_[i]);
        if (i > first_) subtract_product(s, lower_[i - 1], eliminated_[i - 1]);
        const int negative = invert_columns(s);
        store_columns(s, inverse_[i]);
        negative_[static_cast<std::size_t>(i) + 1] =
            negative_[static_cast<std::size_t>(i)] + negative;
        odd_[static_cast<std::size_t>(i) + 1] = odd_[static_cast<std::size_t>(i)] + negative % 2;
        if (i + 1 < size_) store_product(inverse_[i], upper_[i], eliminated_[i]);
    }
    return negative_[static_cast<std::size_t>(size_)];
}

void BlockTridiagonal::solve(std::vector<Node6>& x) const
{
    solve_from(x, first_);
}

void BlockTridiagonal::solve_from(std::vector<Node6>& x, int from) const
{
    from = from < first_ ? first_ : from;
    const auto at = [&](int i) -> Node6& { return x[static_cast<std::size_t>(i)]; };
    for (int i = from; i < size_; ++i) {
        if (i > from) {
            Column2 t = load_column(at(i));
            subtract(t, product(lower_[i - 1], at(i - 1).value));
            store_column(t, at(i));
        }
        store_column(product(inverse_[i], at(i).value), at(i));
    }
    for (int i = size_ - 2; i >= first_; --i) {
        Column2 t = load_column(at(i));
        subtract(t, product(eliminated_[i], at(i + 1).value));
        store_column(t, at(i));
    }
}

} // namespace amontons
