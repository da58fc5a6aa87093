#pragma once

#include <chrono>

namespace amontons {

/// Wall time since it was made [s].
class Stopwatch {
public:
    /// Wall time since it was made [s].
    double seconds() const
    {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Adds the wall time of its own life to one phase: `const PhaseTimer t(seconds.detection);`.
///
/// The phases are the named fields of the caller's struct. Phases that nest both count: give
/// the inner one a sum of its own, or do not nest. Costs two readings of the clock (50 ns).
class PhaseTimer {
public:
    explicit PhaseTimer(double& seconds) : seconds_(seconds) {}
    PhaseTimer(const PhaseTimer&) = delete;
    PhaseTimer& operator=(const PhaseTimer&) = delete;
    ~PhaseTimer() { seconds_ += watch_.seconds(); }

private:
    double& seconds_;
    Stopwatch watch_;
};

} // namespace amontons
