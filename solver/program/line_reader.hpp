#pragma once

#include <atomic>
#include <cstddef>
#include <string>

namespace amontons {

/// Lines of standard input, one at a time, waited for.
class LineReader {
public:
    enum class Got { line, too_long, end, stopped, broken, nothing };

    /// @param stop     set by a signal's handler, which ends the wait
    /// @param longest  of a line [bytes]: of a longer one the rest is passed over
    LineReader(const std::atomic<bool>& stop, std::size_t longest) : stop_(stop), longest_(longest)
    {
    }
    /// The next line, without its end; the last one may have none.
    /// @param patience  how long one is waited for [s], then `nothing` is got; negative: for ever
    Got next(std::string& line, double patience = -1);

private:
    bool fill(double patience);
    bool wait(double patience);

    const std::atomic<bool>& stop_;
    std::size_t longest_;
    std::string bytes_;
    std::size_t begin_ = 0, searched_ = 0;
    bool skipping_ = false, ended_ = false, broken_ = false, silent_ = false;
};

} // namespace amontons
