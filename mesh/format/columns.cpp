#include "mesh/format/columns.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/limits.hpp"
#include "mesh/base/text.hpp"

#include <algorithm>
#include <charconv>

namespace amontons {
namespace {

constexpr std::size_t kMostOfTable = 10, kMostColumns = 100000;

std::string_view without_blanks(std::string_view text)
{
    const std::size_t first = text.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line)
{
    std::vector<std::string_view> cells;
    for (std::size_t start = 0; start <= line.size();) {
        const std::size_t end = std::min(line.find(',', start), line.size());
        std::string_view cell = without_blanks(line.substr(start, end - start));
        if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
            cell = cell.substr(1, cell.size() - 2);
        cells.push_back(cell);
        start = end + 1;
    }
    return cells;
}

} // namespace

const std::vector<double>* Columns::find(const std::string& name) const
{
    const auto at = std::find(names.begin(), names.end(), name);
    return at == names.end() ? nullptr : &values[std::size_t(at - names.begin())];
}

Columns parse_columns(std::string_view text, const std::string& file)
{
    Columns table;
    std::vector<Issue> issues;
    int number = 0;
    for (std::size_t start = 0; start < text.size() && issues.size() < kMostOfTable;) {
        const std::size_t end = std::min(text.find('\n', start), text.size());
        const std::string_view line = without_blanks(text.substr(start, end - start));
        start = end + 1;
        ++number;
        if (line.empty() || line.front() == '#') continue;
        const std::vector<std::string_view> cells = cells_of(line);
        const std::string place = line_place(std::size_t(number));
        if (table.names.empty()) {
            if (cells.size() > kMostColumns)
                throw InputError({{file, place, "more than 100000 columns", "fewer"}});
            for (const std::string_view c : cells)
                table.names.emplace_back(c);
            table.values.resize(cells.size());
            continue;
        }
        if (cells.size() != table.names.size()) {
            issues.push_back({file, place, std::to_string(cells.size()) + " cells",
                              std::to_string(table.names.size()) + ", as in the header"});
            continue;
        }
        for (std::size_t i = 0; i < cells.size(); ++i) {
            double v = kNaN;
            if (!cells[i].empty()) {
                const auto read =
                    std::from_chars(cells[i].data(), cells[i].data() + cells[i].size(), v);
                if (read.ec != std::errc() || read.ptr != cells[i].data() + cells[i].size())
                    issues.push_back({file, place, quoted_text(cells[i]), "a number"});
            }
            table.values[i].push_back(v);
        }
    }
    if (table.names.empty() || table.values[0].empty())
        issues.push_back({file, "", "no numbers", "a header and lines of numbers"});
    if (!issues.empty()) throw InputError(issues);
    return table;
}

double value_at(const std::vector<double>& x, const std::vector<double>& y, double at)
{
    for (std::size_t i = 0; i < x.size(); ++i)
        if (x[i] == at) return y[i];
    for (std::size_t i = 1; i < x.size(); ++i)
        if ((x[i - 1] < at) != (x[i] < at))
            return y[i - 1] + (at - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1]);
    return kNaN;
}

} // namespace amontons
