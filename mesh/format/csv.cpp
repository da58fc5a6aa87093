#include "mesh/format/csv.hpp"

#include "mesh/format/polyline_builder.hpp"
#include "mesh/format/text.hpp"

#include <array>

namespace amontons {
namespace {

using Cells = std::vector<std::string_view>;

/// Where in a row the numbers stand; -1 if nowhere.
struct Columns {
    std::array<int, 3> x = {0, 1, 2};
    int radius = -1;
    std::size_t count = 0; ///< cells in a row
};

std::string_view trimmed(std::string_view text)
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
            cells.push_back(trimmed(word));
        return cells;
    }
    for (;;) {
        const std::size_t end = line.find(separator);
        cells.push_back(trimmed(line.substr(0, end)));
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
    return lower_case(trimmed(cell.substr(0, cell.find_first_of("[("))));
}

Columns columns_of_header(const Cells& cells, std::size_t line, FileIssues& issues)
{
    Columns columns;
    columns.x = {-1, -1, -1};
    columns.count = cells.size();
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const std::string name = plain_name(cells[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::string paraview = "points:" + std::to_string(k);
            if (name == std::string(1, static_cast<char>('x' + k)) || name == paraview)
                columns.x[k] = static_cast<int>(i);
        }
        if (name == "radius" || name == "r" || name == "size" ||
            name == "maximuminscribedsphereradius")
            columns.radius = static_cast<int>(i);
    }
    for (std::size_t k = 0; k < 3; ++k) {
        if (columns.x[k] >= 0) continue;
        std::string header;
        for (const std::string_view cell : cells)
            header.append(header.empty() ? "" : ",").append(cell);
        issues.fatal(line_place(line), "a header " + quoted_text(header, 100),
                     "columns x, y, z and, if known, radius");
    }
    return columns;
}

Columns columns_of_numbers(const Cells& cells, std::size_t line, FileIssues& issues)
{
    if (cells.size() != 3 && cells.size() != 4)
        issues.fatal(line_place(line), std::to_string(cells.size()) + " numbers",
                     "x, y, z and, if known, the radius; or a header that names the columns");
    Columns columns;
    columns.count = cells.size();
    columns.radius = cells.size() == 4 ? 3 : -1;
    return columns;
}

void add_row(const Cells& cells, const Columns& columns, const std::string& place,
             PolylineBuilder& builder, FileIssues& issues)
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
    std::optional<double> radius;
    if (columns.radius >= 0) radius = number(columns.radius);
    if (valid) builder.add(x, radius, place);
}

} // namespace

Polyline parse_centreline_csv(std::string_view text, const std::string& file, double scale)
{
    FileIssues issues(file);
    PolylineBuilder builder(scale, issues);
    WordReader lines(without_byte_order_mark(text));
    std::optional<Columns> columns;
    char separator = ' ';
    while (!lines.at_end()) {
        const std::size_t number = lines.line();
        const std::string_view line = trimmed(lines.rest_of_line());
        if (line.empty() || line[0] == '#' || line[0] == '%') continue;
        if (!columns) {
            separator = separator_of(line);
            const Cells cells = split(line, separator);
            if (is_header(cells)) {
                columns = columns_of_header(cells, number, issues);
                continue;
            }
            columns = columns_of_numbers(cells, number, issues);
        }
        add_row(split(line, separator), *columns, line_place(number), builder, issues);
    }
    return builder.finish();
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
