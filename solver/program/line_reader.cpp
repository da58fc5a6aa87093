#include "solver/program/line_reader.hpp"

#include <cerrno>
#include <cmath>
#include <csignal>
#include <poll.h>
#include <unistd.h>

namespace amontons {

/// A signal that comes between the test of the flag and the wait would be waited past: they are
/// delivered during the wait alone.
bool LineReader::wait(double patience)
{
    sigset_t signals, before;
    ::sigemptyset(&signals);
    for (const int s : {SIGINT, SIGTERM, SIGHUP})
        ::sigaddset(&signals, s);
    ::pthread_sigmask(SIG_BLOCK, &signals, &before);
    pollfd in{STDIN_FILENO, POLLIN, 0};
    const timespec most{static_cast<time_t>(patience),
                        static_cast<long>(1e9 * (patience - std::floor(patience)))};
    int ready = 0;
    while (!stop_ && (ready = ::ppoll(&in, 1, patience < 0 ? nullptr : &most, &before)) < 0 &&
           errno == EINTR) {
    }
    silent_ = ready == 0;
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return !stop_;
}

bool LineReader::fill(double patience)
{
    constexpr std::size_t kBlock = 1 << 16;
    bytes_.erase(0, begin_);
    searched_ -= begin_;
    begin_ = 0;
    char block[kBlock];
    ssize_t n = 0;
    do {
        if (!wait(patience)) return false;
        if (silent_) return true;
        n = ::read(STDIN_FILENO, block, sizeof block);
    } while (n < 0 && (errno == EINTR || errno == EAGAIN));
    broken_ = n < 0;
    ended_ = n <= 0;
    if (n > 0) bytes_.append(block, static_cast<std::size_t>(n));
    return true;
}

LineReader::Got LineReader::next(std::string& line, double patience)
{
    while (true) {
        const std::size_t end = bytes_.find('\n', searched_);
        if (end != std::string::npos || (ended_ && (skipping_ || begin_ < bytes_.size()))) {
            const std::size_t last = end != std::string::npos ? end : bytes_.size();
            const bool whole = !skipping_ && last - begin_ <= longest_;
            line.assign(bytes_, begin_, whole ? last - begin_ : 0);
            begin_ = searched_ = end != std::string::npos ? end + 1 : last;
            skipping_ = false;
            return whole ? Got::line : Got::too_long;
        }
        if (ended_) return broken_ ? Got::broken : Got::end;
        searched_ = bytes_.size();
        if (searched_ - begin_ > longest_) { // its end alone is waited for
            skipping_ = true;
            begin_ = searched_;
        }
        if (!fill(patience)) return Got::stopped;
        if (silent_) return Got::nothing;
    }
}

} // namespace amontons
