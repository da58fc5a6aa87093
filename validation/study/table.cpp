#include "validation/study/table.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/limits.hpp"
#include "solver/scene/json_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

namespace amontons::study {
namespace {

bool is_done(const Row& r)
{
    return r.status == "done" && std::isfinite(r.value);
}

double time_of(const Table& t, const Row& r)
{
    return t.by_cpu ? r.cpu_seconds : r.seconds;
}

bool has_error(const Row& r)
{
    return is_done(r) && !r.is_reference && std::isfinite(r.error);
}

/// Least-squares slope of y over x; NaN with fewer than two different x.
double slope(const std::vector<std::pair<double, double>>& points)
{
    double mx = 0, my = 0, xx = 0, xy = 0;
    for (const auto& [x, y] : points) {
        mx += x / double(points.size());
        my += y / double(points.size());
    }
    for (const auto& [x, y] : points) {
        xx += (x - mx) * (x - mx);
        xy += (x - mx) * (y - my);
    }
    return xx > 0 ? xy / xx : kNaN;
}

/// +1 if a larger value of the parameter is the finer one, else -1.
double finer(const Table& t, const std::vector<std::size_t>& rows)
{
    for (double Row::*size : {&Row::unknowns, &Row::steps}) {
        std::vector<std::pair<double, double>> points;
        for (const std::size_t k : rows) {
            const Row& r = t.rows[k];
            const double x =
                size_of(t.sweeps[std::size_t(t.refined)], r.point.values[std::size_t(t.refined)]);
            if (x > 0 && r.*size > 0) points.emplace_back(std::log(x), std::log(r.*size));
        }
        const double s = slope(points);
        if (std::abs(s) > 1e-3) return s > 0 ? 1 : -1;
    }
    return -1;
}

void find_reference(Table& t)
{
    t.reference = kNaN;
    std::tuple<double, double, int> best{-1, -1, -1};
    std::size_t which = t.rows.size();
    for (std::size_t k = 0; k < t.rows.size(); ++k) {
        const Row& r = t.rows[k];
        if (!is_done(r)) continue;
        const std::tuple<double, double, int> here{std::isfinite(r.unknowns) ? r.unknowns : 0,
                                                   std::isfinite(r.steps) ? r.steps : 0, int(k)};
        if (here > best) {
            best = here;
            which = k;
        }
    }
    if (which == t.rows.size()) return;
    t.rows[which].is_reference = true;
    t.reference = t.rows[which].value;
}

void find_front(Table& t)
{
    for (Row& a : t.rows) {
        a.on_front = has_error(a) && std::none_of(t.rows.begin(), t.rows.end(), [&](const Row& b) {
                         return has_error(b) && b.error <= a.error &&
                                time_of(t, b) <= time_of(t, a) &&
                                (b.error < a.error || time_of(t, b) < time_of(t, a));
                     });
    }
}

void find_series(Table& t)
{
    t.refined = -1;
    for (std::size_t s = t.sweeps.size(); s-- > 0;) {
        const Sweep& sweep = t.sweeps[s];
        if (sweep.values.size() > 1 &&
            std::all_of(sweep.values.begin(), sweep.values.end(),
                        [&](const std::string& v) { return size_of(sweep, v) > 0; }))
            t.refined = int(s);
    }
    t.series.clear();
    std::map<std::vector<std::string>, std::size_t> places;
    for (std::size_t k = 0; k < t.rows.size(); ++k) {
        std::vector<std::string> others = t.rows[k].point.values;
        std::string name;
        for (std::size_t s = 0; s < t.sweeps.size(); ++s)
            if (int(s) == t.refined)
                others[s].clear();
            else if (t.sweeps[s].values.size() > 1)
                name += (name.empty() ? "" : ", ") + t.sweeps[s].name() + "=" + others[s];
        const auto [at, fresh] = places.emplace(others, t.series.size());
        if (fresh) t.series.push_back({name, {}, kNaN, {}});
        t.series[at->second].rows.push_back(k);
    }
    t.order = kNaN;
    if (t.refined < 0) return;
    const Sweep& sweep = t.sweeps[std::size_t(t.refined)];
    for (Series& series : t.series) {
        const double sign = finer(t, series.rows);
        std::vector<std::pair<double, double>> points;
        for (const std::size_t k : series.rows) {
            const Row& r = t.rows[k];
            const double x = size_of(sweep, r.point.values[std::size_t(t.refined)]);
            if (has_error(r) && r.error > 0) points.emplace_back(std::log(x), std::log(r.error));
        }
        series.order = -sign * slope(points);
        std::sort(points.begin(), points.end());
        for (std::size_t i = 1; i < points.size(); ++i)
            series.orders.push_back(-sign * slope({points[i - 1], points[i]}));
        if (sign < 0) std::reverse(series.orders.begin(), series.orders.end());
        // A slope through errors that rise and fall is no order.
        series.falls = std::all_of(series.orders.begin(), series.orders.end(),
                                   [](double order) { return order > 0; });
        if (!series.falls) series.order = kNaN;
    }
    if (t.series.size() == 1) t.order = t.series[0].order;
}

std::string in_csv(const std::string& text)
{
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string out = "\"";
    for (const char c : text)
        out += c == '"' ? "\"\"" : std::string(1, c);
    return out + "\"";
}

std::string in_words(const std::string& text)
{
    return text.empty() ? "none" : text;
}

std::string number(double x)
{
    return std::isfinite(x) ? fmt::format("{}", x) : "";
}

const char* name_of(ReferenceKind kind)
{
    return kind == ReferenceKind::value ? "value" : kind == ReferenceKind::file ? "file" : "finest";
}

/// Within single quotes of gnuplot, without its markup.
std::string label(const std::string& text)
{
    std::string out;
    for (const char c : text)
        out += c == '\'' ? "''" : std::string(1, c);
    return out;
}

} // namespace

Row make_row(const Point& point, const PointRecord& record, const std::string& quantity)
{
    Row r;
    r.point = point;
    r.status = record.status;
    r.reason = record.reason;
    r.seconds = record.seconds;
    r.cpu_seconds = record.cpu_seconds;
    r.unknowns = find(record.numbers, "unknowns").value_or(kNaN);
    r.steps = find(record.numbers, "steps").value_or(kNaN);
    r.value = r.error = kNaN;
    if (r.status != "done") return r;
    // An answer that is not certified is none: it takes no part in orders, front and reference.
    if (find(record.numbers, "certificate.uncertified_steps").value_or(0) > 0)
        r.status = "uncertified";
    Numbers all = record.numbers;
    all.emplace_back("cpu_seconds", record.cpu_seconds);
    const std::optional<double> value = find(all, quantity);
    if (value) {
        r.value = *value;
        if (!std::isfinite(*value))
            r.reason += (r.reason.empty() ? "" : "; ") + std::string("the quantity is not finite");
    } else if ((r.text = find(record.texts, quantity))) {
        // nothing to measure
    } else {
        r.status = "no_quantity";
        r.reason = "the run reports no " + quantity;
    }
    return r;
}

void evaluate(Table& t)
{
    for (Row& r : t.rows)
        r.is_reference = false;
    if (t.kind == ReferenceKind::finest) find_reference(t);
    for (Row& r : t.rows)
        r.error = !is_done(r) ? kNaN
                              : std::abs(r.value - t.reference) /
                                    (t.reference != 0 ? std::abs(t.reference) : 1);
    for (AddedRow& a : t.added)
        if (std::isfinite(a.value) && std::isfinite(t.reference))
            a.error =
                std::abs(a.value - t.reference) / (t.reference != 0 ? std::abs(t.reference) : 1);
    find_front(t);
    find_series(t);
}

namespace {

/// The cells of a line, without their quotes; commas within quotes do not separate.
std::vector<std::string> cells_of(const std::string& line)
{
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
        if (c == '"')
            quoted = !quoted;
        else if (c == ',' && !quoted)
            cells.emplace_back();
        else
            cells.back() += c;
    }
    for (std::string& cell : cells) {
        cell.erase(0, cell.find_first_not_of(' '));
        cell.erase(cell.find_last_not_of(' ') + 1);
    }
    return cells;
}

} // namespace

std::vector<AddedRow> read_added(std::string_view text, const std::string& file,
                                 const std::string& quantity, bool by_cpu)
{
    std::vector<AddedRow> rows;
    std::vector<std::string> names;
    std::vector<Issue> issues;
    int line_number = 0;
    for (std::size_t at = 0; at < text.size(); ++line_number) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::string line(text.substr(at, end - at));
        at = end + 1;
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line.empty() || line[0] == '#') continue;
        const std::vector<std::string> cells = cells_of(line);
        if (names.empty()) {
            for (const std::string& c : cells)
                names.push_back(c.substr(0, c.find(" [")));
            continue;
        }
        AddedRow r;
        r.value = r.error = r.seconds = r.unknowns = kNaN;
        const std::string place = "line " + std::to_string(line_number + 1);
        // A table of amontons study has no names: its folder's, and the values of what was varied.
        const bool ours = names[0] == "point";
        if (ours) r.name = std::filesystem::absolute(file).parent_path().filename().string();
        bool parameter = ours, done = true;
        for (std::size_t i = 0; i < std::min(cells.size(), names.size()); ++i) {
            if (names[i] == "name") {
                r.name = cells[i];
                continue;
            }
            parameter = parameter && names[i] != quantity && names[i] != "error";
            if (parameter && i > 0) r.name += (i > 1 ? ", " : " ") + cells[i];
            if (ours && names[i] == "status") done = cells[i] == "done";
            double* to = names[i] == "seconds"                         ? &r.seconds
                         : names[i] == "cpu_seconds" && by_cpu         ? &r.seconds
                         : names[i] == "value" || names[i] == quantity ? &r.value
                         : names[i] == "error"                         ? &r.error
                         : names[i] == "unknowns"                      ? &r.unknowns
                                                                       : nullptr;
            if (!to || cells[i].empty()) continue;
            const char* last = cells[i].data() + cells[i].size();
            const auto read = std::from_chars(cells[i].data(), last, *to);
            if (read.ec != std::errc() || read.ptr != last)
                issues.push_back({file, place, names[i] + " " + quoted_text(cells[i]), "a number"});
        }
        if (!done) continue;
        if (!(r.seconds > 0)) issues.push_back({file, place, "no seconds", "a time > 0 [s]"});
        if (std::isnan(r.value) && std::isnan(r.error))
            issues.push_back({file, place, "neither value nor error", "one of them"});
        rows.push_back(std::move(r));
    }
    if (rows.empty() && issues.empty())
        issues.push_back(
            {file, "", "no rows", "a heading (name, seconds, value or error, unknowns), and rows"});
    if (!issues.empty()) throw InputError(std::move(issues));
    return rows;
}

std::vector<std::pair<std::string, int>> text_counts(const Table& t)
{
    std::map<std::string, int> counts;
    for (const Row& r : t.rows)
        if (r.text) ++counts[*r.text];
    std::vector<std::pair<std::string, int>> out(counts.begin(), counts.end());
    std::stable_sort(out.begin(), out.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    return out;
}

std::string csv_of(const Table& t)
{
    std::string out = "point";
    for (const Sweep& s : t.sweeps)
        out += "," + in_csv(s.name());
    out += "," + in_csv(t.quantity) +
           ",error,seconds [s],cpu_seconds [s],unknowns,steps,status,pareto,reference,reason\n";
    for (const Row& r : t.rows) {
        out += fmt::format("{}", r.point.index);
        for (const std::string& v : r.point.values)
            out += "," + in_csv(v);
        out += fmt::format(",{},{},{:.6g},{:.6g},{},{},{},{},{},{}\n",
                           r.text ? in_csv(*r.text) : number(r.value), number(r.error), r.seconds,
                           r.cpu_seconds, number(r.unknowns), number(r.steps), r.status,
                           int(r.on_front), int(r.is_reference), in_csv(r.reason));
    }
    return out;
}

std::string json_of(const Table& t)
{
    JsonText out;
    const auto add_parameters = [&](const Row& r) {
        for (std::size_t s = 0; s < t.sweeps.size(); ++s)
            for (const std::string& path : t.sweeps[s].paths) {
                const std::string& v = r.point.values[s];
                out.key(path);
                if (nlohmann::json::accept(v))
                    out.json(v);
                else
                    out.value(v);
            }
    };
    out.open('{').member("quantity", t.quantity).key("rows").open('[');
    for (const Row& r : t.rows) {
        out.open('{').member("point", r.point.index);
        add_parameters(r);
        out.key("parameters").open('{');
        add_parameters(r);
        out.close('}');
        if (r.text)
            out.member("value", *r.text);
        else
            out.member("value", r.value);
        out.member("error", r.error);
        out.member("seconds", r.seconds).member("cpu_seconds", r.cpu_seconds);
        out.member("unknowns", r.unknowns).member("steps", r.steps);
        out.member("status", r.status).member("reason", r.reason);
        out.member("pareto", r.on_front).member("is_reference", r.is_reference).close('}');
    }
    out.close(']').key("counts").open('{');
    for (const auto& [text, count] : text_counts(t))
        out.member(text, count);
    out.close('}').member("order", t.order).member("reference", t.reference);
    out.member("reference_kind", name_of(t.kind));
    out.key("order_of");
    if (t.refined < 0)
        out.json("null");
    else
        out.value(t.sweeps[std::size_t(t.refined)].name());
    out.key("series").open('[');
    for (const Series& s : t.series) {
        out.open('{').member("name", s.name).member("order", s.order).key("orders").open('[');
        for (const double o : s.orders)
            out.value(o);
        out.close(']').key("points").open('[');
        for (const std::size_t k : s.rows)
            out.value(t.rows[k].point.index);
        out.close(']').close('}');
    }
    return out.close(']').close('}').text() + "\n";
}

std::string tex_of(const Table& t)
{
    const auto plain = [](const std::string& text) { // what TeX would read as its own
        std::string out;
        for (const char c : text)
            out += std::string_view("_%&#$").find(c) != std::string_view::npos
                       ? std::string("\\") + c
                   : c == '{' || c == '}' ? std::string("\\") + c
                                          : std::string(1, c);
        return out;
    };
    const auto exponent = [](double x, const char* format) {
        if (!std::isfinite(x)) return std::string("--");
        std::string text = fmt::format(fmt::runtime(format), x);
        const std::size_t e = text.find('e');
        if (e == std::string::npos) return text;
        return "$" + text.substr(0, e) + "\\cdot 10^{" +
               std::to_string(std::stoi(text.substr(e + 1))) + "}$";
    };
    std::string columns(t.sweeps.size(), 'l'), head;
    for (const Sweep& s : t.sweeps)
        head +=
            plain(s.paths.size() == 1 ? s.paths[0].substr(s.paths[0].rfind('.') + 1) : s.name()) +
            " & ";
    // Words have no errors.
    const bool words =
        std::ranges::any_of(t.rows, [](const Row& r) { return r.text.has_value(); }) &&
        std::ranges::none_of(t.rows, [](const Row& r) { return std::isfinite(r.value); });
    std::string out =
        fmt::format("% {} of amontons study; needs the package booktabs\n"
                    "\\begin{{tabular}}{{{}{}}}\n\\toprule\n"
                    "{}{} & {}{} [s] & unknowns \\\\\n\\midrule\n",
                    t.quantity, columns, words ? "lrr" : "rrrr", head, plain(t.quantity),
                    words ? "" : "error & ", t.by_cpu ? "processor time" : "wall time");
    for (const Row& r : t.rows) {
        for (const std::string& v : r.point.values)
            out += plain(v) + " & ";
        out += (r.text ? plain(in_words(*r.text)) : exponent(r.value, "{:.6g}")) + " & ";
        if (!words) out += (r.is_reference ? "reference" : exponent(r.error, "{:.1e}")) + " & ";
        out += fmt::format("{} & {} \\\\\n", exponent(time_of(t, r), "{:.3g}"),
                           exponent(r.unknowns, "{:.0f}"));
    }
    for (const AddedRow& a : t.added) {
        std::string first = plain(a.name);
        for (std::size_t i = 0; i < t.sweeps.size(); ++i)
            first += " & ";
        out += fmt::format("{}{} & {}{} & {} \\\\\n", first, exponent(a.value, "{:.6g}"),
                           words ? "" : exponent(a.error, "{:.1e}") + " & ",
                           exponent(a.seconds, "{:.3g}"), exponent(a.unknowns, "{:.0f}"));
    }
    return out + "\\bottomrule\n\\end{tabular}\n";
}

std::string text_of(const Table& t)
{
    std::string out;
    std::size_t width = 10;
    for (const Row& r : t.rows) {
        std::size_t w = 0;
        for (const std::string& v : r.point.values)
            w += v.size() + 2;
        width = std::max(width, w);
    }
    std::string names;
    for (const Sweep& s : t.sweeps)
        names += (names.empty() ? "" : "; ") + s.name();
    const std::vector<std::pair<std::string, int>> counts = text_counts(t);
    out += counts.empty() ? fmt::format("{} against {} ({}: {:.9g})\n", t.quantity, names,
                                        name_of(t.kind), t.reference)
                          : fmt::format("{} against {}\n", t.quantity, names);
    out += fmt::format("  {:<{}} {:>15} {:>10} {:>10} {:>9}\n", "", width, "value",
                       counts.empty() ? "error" : "", t.by_cpu ? "cpu s" : "seconds", "unknowns");
    for (const Row& r : t.rows) {
        std::string values;
        for (const std::string& v : r.point.values)
            values += (values.empty() ? "" : ", ") + v;
        out += fmt::format(
            "  {:<{}} {:>15} {:>10} {:>10.3g} {:>9.9g}{}{}\n", values, width,
            r.text ? in_words(*r.text) : fmt::format("{:.9g}", r.value),
            r.text ? "" : fmt::format("{:.3g}", r.error), time_of(t, r), r.unknowns,
            r.is_reference ? "  reference"
            : r.on_front   ? "  front"
                           : "",
            r.status != "done" || !r.reason.empty() ? "  " + r.status + ": " + r.reason : "");
    }
    for (const AddedRow& a : t.added)
        out += fmt::format("  {:<{}} {:>15.9g} {:>10.3g} {:>10.3g} {:>9.9g}  added\n", a.name,
                           width, a.value, a.error, a.seconds, a.unknowns);
    for (const Series& s : t.series)
        if (std::isfinite(s.order))
            out += fmt::format("  observed order{}{}: {:.2f}\n", s.name.empty() ? "" : ", ", s.name,
                               s.order);
        else if (!s.falls)
            out += fmt::format("  no order{}{}: errors do not fall monotonically\n",
                               s.name.empty() ? "" : ", ", s.name);
    for (const auto& [text, count] : counts)
        out += fmt::format("  {:>{}} of {}  {}\n", count, width, t.rows.size(), in_words(text));
    return out;
}

std::string plot_script(const Table& t, const std::string& name)
{
    struct Panel {
        std::string x, y;
        bool log_x = true, log_y = true;
        bool exponents = false; ///< under the x axis: plain numbers would run into each other
        std::vector<std::string> blocks, titles; // of data
        std::string front;
    };
    // ---- A panel: blocks of numbers, with its axes
    const auto panel = [&](std::string x_label, std::string y_label, auto x_of, auto y_of,
                           bool must_be_positive) {
        Panel p;
        p.x = std::move(x_label);
        p.y = std::move(y_label);
        double least[2] = {INFINITY, INFINITY}, most[2] = {0, 0};
        std::vector<std::vector<std::pair<double, double>>> lines;
        for (const Series& s : t.series) {
            lines.emplace_back();
            for (const std::size_t k : s.rows) {
                const double x = x_of(t.rows[k]), y = y_of(t.rows[k]);
                if (!std::isfinite(x) || !std::isfinite(y)) continue;
                if (must_be_positive && !(x > 0 && y > 0)) continue;
                lines.back().emplace_back(x, y);
                least[0] = std::min(least[0], x);
                least[1] = std::min(least[1], y);
                most[0] = std::max(most[0], x);
                most[1] = std::max(most[1], y);
            }
            if (!must_be_positive) std::sort(lines.back().begin(), lines.back().end());
        }
        if (least[0] == most[0]) lines.clear(); // nothing to see
        p.exponents = least[0] > 0 && most[0] >= 1e4 * least[0];
        if (!must_be_positive) {
            p.log_x = least[0] > 0 && most[0] >= 10 * least[0];
            p.log_y = least[1] > 0 && most[1] >= 30 * least[1];
        }
        for (std::size_t i = 0; i < lines.size(); ++i) {
            if (lines[i].empty()) continue;
            std::string block;
            for (const auto& [x, y] : lines[i])
                block += fmt::format("{} {}\n", x, y);
            p.blocks.push_back(block);
            p.titles.push_back(t.series[i].name.empty() ? t.quantity : t.series[i].name);
        }
        return p;
    };
    // ---- Panels: error over time with the front, error over unknowns, value over the swept field
    const auto error = [](const Row& r) { return has_error(r) ? r.error : kNaN; };
    const std::string of = t.reference == 0 ? "error of " : "relative error of ";
    std::vector<Panel> panels;
    panels.push_back(panel(
        t.by_cpu ? "processor time [s]" : "wall time [s]", of + t.quantity,
        [&](const Row& r) { return time_of(t, r); }, error, true));
    std::vector<std::pair<double, double>> front;
    for (const Row& r : t.rows)
        if (r.on_front && r.error > 0 && time_of(t, r) > 0)
            front.emplace_back(time_of(t, r), r.error);
    std::sort(front.begin(), front.end());
    for (const auto& [x, y] : front)
        panels[0].front += fmt::format("{} {}\n", x, y);
    panels.push_back(panel(
        "unknowns", of + t.quantity, [](const Row& r) { return r.unknowns; }, error, true));
    std::map<std::string, std::array<std::string, 2>> added; // blocks by name: over time, unknowns
    for (const AddedRow& a : t.added) {
        if (!(a.error > 0)) continue;
        added[a.name][0] += fmt::format("{} {}\n", a.seconds, a.error);
        if (a.unknowns > 0) added[a.name][1] += fmt::format("{} {}\n", a.unknowns, a.error);
    }
    for (const auto& [of_program, blocks] : added)
        for (std::size_t k = 0; k < 2; ++k)
            if (!blocks[k].empty()) {
                panels[k].blocks.push_back(blocks[k]);
                panels[k].titles.push_back(of_program.empty() ? "added" : of_program);
            }
    if (t.refined >= 0) {
        const std::size_t s = std::size_t(t.refined);
        panels.push_back(panel(
            t.sweeps[s].name(), t.quantity,
            [&](const Row& r) { return size_of(t.sweeps[s], r.point.values[s]); },
            [](const Row& r) { return is_done(r) ? r.value : kNaN; }, false));
    }
    std::erase_if(panels, [](const Panel& p) { return p.blocks.empty(); });
    if (panels.empty()) return "";

    // ---- The script
    std::string out =
        fmt::format("# Draw again: gnuplot {0}.gp, in this folder.\n"
                    "set terminal svg size {1},{2} font 'Helvetica,13' background rgb 'white'\n"
                    "set output '{0}.svg'\n",
                    name, 480 * panels.size(), 440 + 18 * t.series.size());
    for (std::size_t i = 0; i < panels.size(); ++i) {
        for (std::size_t k = 0; k < panels[i].blocks.size(); ++k)
            out += fmt::format("$p{}_{} << END\n{}END\n", i, k, panels[i].blocks[k]);
        if (!panels[i].front.empty()) out += fmt::format("$front << END\n{}END\n", panels[i].front);
    }
    out += fmt::format("set multiplot layout 1,{}\nset grid\n"
                       "set key outside top center vertical maxcols 1 noenhanced\n",
                       panels.size());
    for (std::size_t i = 0; i < panels.size(); ++i) {
        const Panel& p = panels[i];
        out += fmt::format("unset logscale\nset format '%g'\nset xlabel '{}' noenhanced\n"
                           "set ylabel '{}' noenhanced\n",
                           label(p.x), label(p.y));
        if (p.log_x) out += "set logscale x\n";
        if (p.log_x && p.exponents) out += "set format x '10^{%T}'\n";
        if (p.log_y) out += "set logscale y\nset format y '10^{%T}'\n";
        out += "plot";
        if (!p.front.empty())
            out += " $front with lines lw 5 lc rgb '#dddddd' title 'Pareto front',";
        for (std::size_t k = 0; k < p.blocks.size(); ++k)
            out += fmt::format("{} $p{}_{} with linespoints lw 1.5 lc {} pt {} title '{}'",
                               k ? "," : "", i, k, k + 1, k % 12 + 4, label(p.titles[k]));
        out += "\n";
    }
    return out + "unset multiplot\n";
}

} // namespace amontons::study
