#include "mesh/base/threads.hpp"

#include <algorithm>
#include <exception>
#include <vector>

namespace amontons {

void share_out(int threads, std::size_t count,
               const std::function<void(std::size_t begin, std::size_t end)>& work)
{
    const int ranges = int(std::min(std::size_t(std::max(threads, 1)), count));
    if (ranges <= 1) {
        if (count > 0) work(0, count);
        return;
    }
    // An exception that left a parallel region would end the program.
    std::vector<std::exception_ptr> failed(static_cast<std::size_t>(ranges));
#pragma omp parallel for schedule(static, 1) num_threads(ranges)
    for (int k = 0; k < ranges; ++k) {
        const auto n = std::size_t(ranges), i = std::size_t(k);
        try {
            work(count * i / n, count * (i + 1) / n);
        } catch (...) {
            failed[i] = std::current_exception();
        }
    }
    for (const std::exception_ptr& error : failed)
        if (error) std::rethrow_exception(error);
}

} // namespace amontons
