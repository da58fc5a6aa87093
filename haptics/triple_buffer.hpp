#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace amontons {

/// The newest of what one thread makes, for one other thread: neither ever waits.
///
///   producer                      middle (atomic)                  consumer
///   fills back()                  index of one slot,               reads front()
///        |                        and whether it is fresh               |
///        |  publish(): exchange   +---------------+                     |
///        +----------------------> | index | fresh |  fetch(): exchange  |
///        <----------------------- +---------------+ <-------------------+
///           the slot that lay             |         ------------------->
///           there is the next back()      |           only if fresh; the old front() lies there
///
/// The three indices are a permutation of the three slots at every moment, since each thread only
/// swaps its own with the middle in one atomic step: no slot is accessible to both. The exchange is
/// acquire and release: what was written before publish() is visible after the fetch() that takes
/// it, and the returned slot is no longer read. What is published twice between two fetches is read
/// only the second time: the newest counts.
template <class T> class TripleBuffer {
public:
    /// Three copies, made here: where T holds its memory, nothing is allocated later.
    explicit TripleBuffer(const T& first = T()) : slot_{first, first, first} {}
    TripleBuffer(const TripleBuffer&) = delete;
    TripleBuffer& operator=(const TripleBuffer&) = delete;

    /// Producer only: the slot to fill. Its content is that of some earlier publication.
    T& back() { return slot_[back_]; }
    /// Producer only: publishes back().
    void publish()
    {
        back_ =
            middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) &
            kIndex;
    }

    /// Consumer only: takes what is fresh; false if nothing was published since the last call.
    bool fetch()
    {
        if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
        front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
        return true;
    }
    /// Consumer only: valid until the next fetch() that returns true.
    const T& front() const { return slot_[front_]; }

private:
    static constexpr std::uint8_t kIndex = 3, kFresh = 4;

    std::array<T, 3> slot_;
    // Each on a cache line of its own: the threads do not slow each other.
    alignas(64) std::atomic<std::uint8_t> middle_{1};
    alignas(64) std::uint8_t back_ = 0;
    alignas(64) std::uint8_t front_ = 2;
};

} // namespace amontons
