#include "mesh/format/csv.hpp"

#include "mesh/base/text.hpp"
#include "mesh/format/polygon.hpp"
#include "mesh/format/polyline_builder.hpp"
#include "mesh/size_field.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace amontons {
namespace {

using Cells = std::vector<std::string_view>;

/// Where in a row the numbers stand; -1 if nowhere.
struct ColumnNumbers {
    std::array<int, 3> x = {0, 1, 2};
    int value = -1;        ///< the radius or size
    std::size_t count = 0; ///< cells in a row
};

/// What the number beside a place may be called, the likeliest first.
using ColumnNames = std::vector<std::string_view>;
const ColumnNames kRadius = {"radius", "r", "maximuminscribedsphereradius"};
const ColumnNames kSize = {"size", "radius", "r", "maximuminscribedsphereradius"};

std::string_view unquoted(std::string_view text)
{
    constexpr std::string_view kBlanks = " \t\r\v\f\"'"; // ParaView puts names into quotes
    const std::size_t begin = text.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

char separator_of(std::string_view line)
{
    for (const char c : {';', ','})
        if (line.find(c) != std::string_view::npos) return c;
    return ' ';
}

Cells split(std::string_view line, char separator)
{
    Cells cells;
    if (separator == ' ') {
        WordReader words(line);
        for (std::string_view word = words.next(); !word.empty(); word = words.next())
            cells.push_back(unquoted(word));
        return cells;
    }
    for (;;) {
        const std::size_t end = line.find(separator);
        cells.push_back(unquoted(line.substr(0, end)));
        if (end == std::string_view::npos) break;
        line.remove_prefix(end + 1);
    }
    if (cells.back().empty()) cells.pop_back(); // a separator at the end of the line
    return cells;
}

bool is_header(const Cells& cells)
{
    for (const std::string_view cell : cells)
        if (!parse_double(cell)) return true;
    return false;
}

/// "X [mm]" -> "x"
std::string plain_name(std::string_view cell)
{
    return lower_case(unquoted(cell.substr(0, cell.find_first_of("[("))));
}

ColumnNumbers columns_of_header(const Cells& cells, const ColumnNames& names, std::size_t line,
                                FileIssues& issues)
{
    ColumnNumbers columns;
    columns.x = {-1, -1, -1};
    columns.count = cells.size();
    std::ptrdiff_t rank = std::ssize(names);
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const std::string name = plain_name(cells[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::string paraview = "points:" + std::to_string(k);
            if (name == std::string(1, static_cast<char>('x' + k)) || name == paraview)
                columns.x[k] = static_cast<int>(i);
        }
        const std::ptrdiff_t here = std::find(names.begin(), names.end(), name) - names.begin();
        if (here >= rank) continue;
        rank = here;
        columns.value = static_cast<int>(i);
    }
    for (std::size_t k = 0; k < 3; ++k) {
        if (columns.x[k] >= 0) continue;
        std::string header;
        for (const std::string_view cell : cells)
            header.append(header.empty() ? "" : ",").append(cell);
        issues.fatal(line_place(line), "a header " + quoted_text(header, 100),
                     std::string("columns x, y, z and") +
                         (names == kSize ? " size" : ", if known, radius"));
    }
    return columns;
}

ColumnNumbers columns_of_numbers(const Cells& cells, const ColumnNames& names, std::size_t line,
                                 FileIssues& issues)
{
    if (cells.size() != 3 && cells.size() != 4)
        issues.fatal(line_place(line), std::to_string(cells.size()) + " numbers",
                     names == kSize
                         ? "x, y, z, size; or a header that names the columns"
                         : "x, y, z and, if known, the radius; or a header that names the columns");
    ColumnNumbers columns;
    columns.count = cells.size();
    columns.value = cells.size() == 4 ? 3 : -1;
    return columns;
}

template <class Add>
void add_row(const Cells& cells, const ColumnNumbers& columns, const std::string& place, Add& add,
             FileIssues& issues)
{
    if (cells.size() != columns.count) {
        issues.add(place, std::to_string(cells.size()) + " columns",
                   std::to_string(columns.count) + ", as in the first row");
        return;
    }
    bool valid = true;
    const auto number = [&](int column) {
        const std::string_view cell = cells[static_cast<std::size_t>(column)];
        const std::optional<double> value = parse_double(cell);
        if (!value) {
            valid = false;
            issues.add(place, quoted_text(cell), "a number, with a decimal point");
        }
        return value.value_or(0);
    };
    Vec3 x;
    for (std::size_t k = 0; k < 3; ++k)
        x[static_cast<int>(k)] = number(columns.x[k]);
    std::optional<double> value;
    if (columns.value >= 0) value = number(columns.value);
    if (valid) add(x, value, place);
}

/// Calls add(place in space, value if there is a column of it, place in the file) for each row.
template <class Add>
void read_rows(std::string_view text, const ColumnNames& names, FileIssues& issues, Add add)
{
    WordReader lines(without_byte_order_mark(text));
    std::optional<ColumnNumbers> columns;
    char separator = ' ';
    while (!lines.at_end()) {
        const std::size_t number = lines.line();
        const std::string_view line = unquoted(lines.rest_of_line());
        if (line.empty() || line[0] == '#' || line[0] == '%') continue;
        if (!columns) {
            separator = separator_of(line);
            const Cells cells = split(line, separator);
            if (is_header(cells)) {
                columns = columns_of_header(cells, names, number, issues);
                continue;
            }
            columns = columns_of_numbers(cells, names, number, issues);
        }
        add_row(split(line, separator), *columns, line_place(number), add, issues);
    }
}

} // namespace

Polyline parse_centreline_csv(std::string_view text, const std::string& file, double scale)
{
    FileIssues issues(file);
    PolylineBuilder builder(scale, issues);
    read_rows(text, kRadius, issues,
              [&](const Vec3& x, std::optional<double> radius, const std::string& place) {
                  builder.add(x, radius, place);
              });
    return builder.finish();
}

std::vector<SizeSource> parse_size_field_csv(std::string_view text, const std::string& file,
                                             double scale)
{
    FileIssues issues(file);
    std::vector<SizeSource> sources;
    read_rows(text, kSize, issues,
              [&](const Vec3& x, std::optional<double> size, const std::string& place) {
                  if (!size)
                      issues.fatal(place, "a place without a size",
                                   "columns x, y, z, size; or a centreline with its radius");
                  const double metres = scale * *size;
                  if (!(metres > 0 && metres <= std::numeric_limits<double>::max()))
                      issues.add(place, "size " + number_text(*size), "> 0 and finite");
                  sources.push_back({finite_point(x, scale, place, issues), metres});
              });
    if (issues.empty() && sources.empty()) issues.add("", "no places", "rows of x, y, z, size");
    issues.throw_if_any();
    return sources;
}

std::string centreline_csv(const Polyline& polyline)
{
    const bool has_radius = !polyline.radius.empty();
    std::string text = has_radius ? "x [m],y [m],z [m],radius [m]\n" : "x [m],y [m],z [m]\n";
    for (std::size_t i = 0; i < polyline.points.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            if (k > 0) text += ',';
            append_number(text, polyline.points[i][k]);
        }
        if (has_radius) {
            text += ',';
            append_number(text, polyline.radius[i]);
        }
        text += '\n';
    }
    return text;
}

} // namespace amontons
