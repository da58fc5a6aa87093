#pragma once

#include <sys/resource.h>

namespace amontons {

/// The most memory that this process has held so far [bytes].
inline double peak_memory_so_far()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * static_cast<double>(usage.ru_maxrss); // Linux counts in KiB
}

} // namespace amontons
