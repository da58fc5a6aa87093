#pragma once

#include <mutex>

namespace amontons {

/// Held during a call of METIS, which draws from the C library's rand(): of two threads each would
/// take numbers of the other, and the order that is found, with the last bits of what follows, would
/// depend on their times.
inline std::mutex& metis_mutex()
{
    static std::mutex mutex;
    return mutex;
}

} // namespace amontons
