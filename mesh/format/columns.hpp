#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace amontons {

/// A table of numbers with a name over each column: history.csv, reference curves.
struct Columns {
    /// Heading of each column.
    std::vector<std::string> names;
    std::vector<std::vector<double>> values; ///< column by column, all of the same length

    /// @return  null if there is no such column
    const std::vector<double>* find(const std::string& name) const;
};

/// Reads comma-separated text: a header, then numbers. Lines that are empty or begin with # are
/// passed over; an empty cell is NaN.
/// @throws InputError  naming the lines
Columns parse_columns(std::string_view text, const std::string& file);

/// y at x, linear between neighbours: the first piece of the curve that reaches x. NaN if none
/// does [unit of y].
double value_at(const std::vector<double>& x, const std::vector<double>& y, double at);

} // namespace amontons
