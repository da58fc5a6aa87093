#pragma once

#include "solver/record/step_record.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace amontons {

/// A text as a field of a CSV file (RFC 4180): in quotes where it needs them.
std::string csv_text(const std::string& text);

/// history.csv: one line a step, its units in the first line.
///
/// A line is one write(2): however the process ends, the lines of all finished steps are complete.
/// A line cut off by a full disk is removed.
class History {
public:
    History() = default;
    History(const History&) = delete;
    History& operator=(const History&) = delete;
    ~History();

    /// Begins a new file. @throws WriteError
    /// @param until_renamed  its name until it is renamed; "": the same
    void start(const std::string& path, const std::string& until_renamed = "");

    /// Continues with a file: what stands after its first `bytes` is cut off.
    /// @throws InputError  if the file is missing, shorter, or these bytes are not `hash`
    void resume(const std::string& path, std::uint64_t bytes, std::uint64_t hash);

    /// @throws WriteError  and leaves the file with the lines before this one
    void append(const StepRecord& record);

    std::uint64_t bytes() const { return bytes_; }
    std::uint64_t hash() const { return hash_; } ///< of the whole file, line by line
    /// Of the quantities, over all lines, in the order of the columns.
    const std::vector<Extremes>& extremes() const { return extremes_; }
    /// Those of the last line.
    const std::vector<Quantity>& last() const { return last_; }

private:
    void write_line_();
    void note_(std::size_t quantity, double value);
    void read_extremes_(std::string_view lines);

    std::string path_;
    std::string line_; ///< kept for its capacity
    int file_ = -1;
    std::uint64_t bytes_ = 0, hash_ = 0;
    std::vector<Extremes> extremes_;
    std::vector<Quantity> last_;
};

} // namespace amontons
