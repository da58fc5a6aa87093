#pragma once

#include <cstddef>
#include <functional>

namespace amontons {

/// Calls work(begin, end) for ranges that together are [0, count), each by one of up to `threads`
/// threads (of OpenMP; without it there is one). Work must give the same for any cut: ranges are on
/// their own, and sums are made afterwards in one order.
///
/// @throws what work throws, from the lowest range that threw: work that takes its range in
///         ascending order fails at the same index for any number of threads
void share_out(int threads, std::size_t count,
               const std::function<void(std::size_t begin, std::size_t end)>& work);

} // namespace amontons
