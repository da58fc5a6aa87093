#include "validation/report.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/limits.hpp"
#include "solver/scene/json_input.hpp"
#include "solver/scene/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace amontons::validation {
namespace {

/// Also of a row that misses.
bool was_measured(const Measured& m)
{
    return !std::isnan(m.tolerance);
}

const char* verdict(const Measured& m)
{
    if (m.failed()) return "FAILED";
    return m.left_out.empty() ? "passed" : was_measured(m) ? "missed" : "left out";
}

/// What the row specifies in words: its note, and why it does not count.
std::string words(const Measured& m)
{
    return m.note + (m.note.empty() || m.left_out.empty() ? "" : "; ") + m.left_out;
}

void add_rows(JsonText& out, const CaseResult& r)
{
    const auto head = [&] {
        out.open('{').member("case", r.name).member("suite", r.suite);
        out.member("source", r.source);
        if (!r.verified.empty()) out.member("verified", r.verified);
        if (!r.about.empty()) out.member("about", r.about);
    };
    if (!r.left_out.empty()) {
        head();
        out.member("quantity", "").key("reference").json("null").key("value").json("null");
        out.key("error").json("null").key("tolerance").json("null");
        out.member("passed", true).member("left_out", r.left_out);
        out.member("seconds", r.seconds).member("note", "").close('}');
        return;
    }
    const auto numbers = [&](const char* name, const std::vector<double>& values) {
        out.key(name).open('[');
        for (const double v : values)
            out.value(v);
        out.close(']');
    };
    for (const Measured& m : r.rows) {
        head();
        out.member("quantity", m.quantity).member("reference", m.reference);
        out.member("value", m.value).member("error", m.error).member("tolerance", m.tolerance);
        const bool passed = m.passed() || (!m.left_out.empty() && !was_measured(m));
        out.member("passed", passed).member("left_out", m.left_out).member("seconds", r.seconds);
        out.member("note", m.note);
        if (!m.curve.x.empty()) {
            out.key("curve").open('{').member("x_label", m.curve.x_label);
            out.member("y_label", m.curve.y_label);
            numbers("x", m.curve.x);
            numbers("reference", m.curve.reference);
            numbers("value", m.curve.value);
            out.close('}');
        }
        out.close('}');
    }
}

double number_at(const Json& row, const char* name)
{
    const auto at = row.find(name);
    return at != row.end() && at->is_number() ? at->get<double>() : kNaN;
}

std::string text_at(const Json& row, const char* name)
{
    const auto at = row.find(name);
    return at != row.end() && at->is_string() ? at->get<std::string>() : "";
}

std::vector<double> numbers_at(const Json& row, const char* name)
{
    std::vector<double> out;
    const auto at = row.find(name);
    if (at == row.end() || !at->is_array()) return out;
    for (const Json& v : *at)
        out.push_back(v.is_number() ? v.get<double>() : kNaN);
    return out;
}

std::string in_csv(const std::string& text)
{
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string out = "\"";
    for (const char c : text)
        out += c == '"' ? "\"\"" : std::string(1, c);
    return out + "\"";
}

std::string in_html(const std::string& text)
{
    std::string out;
    for (const char c : text)
        out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    return out;
}

/// Within single quotes of gnuplot.
std::string label(const std::string& text)
{
    std::string out;
    for (const char c : text)
        out += c == '\'' ? "''" : c == '\n' ? " " : std::string(1, c);
    return out;
}

std::string cell(double x, const char* format)
{
    return std::isfinite(x) ? fmt::format(fmt::runtime(format), x) : "";
}

std::string head_of(const std::string& name, int width, int height)
{
    return fmt::format("set terminal svg size {1},{2} font 'Helvetica,13' background rgb 'white'\n"
                       "set output '{0}.svg'\nset grid\n",
                       name, width, height);
}

std::string curve_script(const std::string& name, const ReferenceCurve& c)
{
    std::string s = head_of(name, 640, 440);
    for (const auto& [block, values] :
         {std::pair{"$reference", &c.reference}, {"$result", &c.value}}) {
        s += fmt::format("{} << END\n", block);
        for (std::size_t i = 0; i < c.x.size(); ++i)
            if (std::isfinite(c.x[i]) && i < values->size() && std::isfinite((*values)[i]))
                s += fmt::format("{} {}\n", c.x[i], (*values)[i]);
        s += "END\n";
    }
    s += fmt::format("set key outside top center horizontal\n"
                     "set xlabel '{}' noenhanced\nset ylabel '{}' noenhanced\n",
                     label(c.x_label), label(c.y_label));
    // A reference that is known at some places only is no line.
    bool sparse = false;
    for (std::size_t i = 0; i < std::min(c.value.size(), c.reference.size()); ++i)
        sparse |= std::isfinite(c.value[i]) && !std::isfinite(c.reference[i]);
    const char* const reference = "$reference with {} lc rgb 'black' title 'reference'";
    const char* const result = "$result with points {} lc rgb '#c03000' title 'amontons'";
    if (sparse)
        return s + "plot " + fmt::format(fmt::runtime(result), "pt 7 ps 0.3") + ", " +
               fmt::format(fmt::runtime(reference), "points pt 4 ps 1.5 lw 2") + "\n";
    return s + "plot " + fmt::format(fmt::runtime(reference), "lines lw 2") + ", " +
           fmt::format(fmt::runtime(result), "pt 6") + "\n";
}

} // namespace

const char* const kHeading = "         quantity                                                   "
                             "    reference        result     error tolerance\n";

std::string json_of(const std::vector<CaseResult>& results)
{
    JsonText out;
    out.open('[');
    for (const CaseResult& r : results)
        add_rows(out, r);
    out.close(']');
    return out.text() + "\n";
}

std::vector<CaseResult> read_results(std::string_view text, const std::string& file)
{
    std::vector<Issue> issues;
    const Json json = parse_json(text, file, issues);
    if (!json.is_array()) issues.push_back({file, "", shown(json), "a list [...]"});
    if (!issues.empty()) throw InputError(issues);
    std::vector<CaseResult> results;
    for (const Json& row : json) {
        if (!row.is_object()) throw InputError({{file, "", shown(row), "an object {...}"}});
        if (results.empty() || results.back().name != text_at(row, "case")) {
            results.emplace_back();
            CaseResult& r = results.back();
            r.name = text_at(row, "case");
            r.suite = text_at(row, "suite");
            r.source = text_at(row, "source");
            r.verified = text_at(row, "verified");
            r.about = text_at(row, "about");
            if (text_at(row, "quantity").empty()) r.left_out = text_at(row, "left_out");
            r.seconds = number_at(row, "seconds");
        }
        if (text_at(row, "quantity").empty() && !results.back().left_out.empty()) continue;
        Measured m;
        m.quantity = text_at(row, "quantity");
        m.reference = number_at(row, "reference");
        m.value = number_at(row, "value");
        m.error = number_at(row, "error");
        m.tolerance = number_at(row, "tolerance");
        m.note = text_at(row, "note");
        m.left_out = text_at(row, "left_out");
        if (const auto curve = row.find("curve"); curve != row.end() && curve->is_object()) {
            m.curve.x_label = text_at(*curve, "x_label");
            m.curve.y_label = text_at(*curve, "y_label");
            m.curve.x = numbers_at(*curve, "x");
            m.curve.reference = numbers_at(*curve, "reference");
            m.curve.value = numbers_at(*curve, "value");
            m.curve.reference.resize(m.curve.x.size(), kNaN);
            m.curve.value.resize(m.curve.x.size(), kNaN);
        }
        results.back().rows.push_back(std::move(m));
    }
    return results;
}

std::string text_of(const CaseResult& r)
{
    std::string t = fmt::format("{} ({}; {:.2f} s): {}\n", r.name, r.suite, r.seconds, r.source);
    if (!r.left_out.empty()) return t + "  left out: " + r.left_out + "\n";
    for (const Measured& m : r.rows) {
        if (was_measured(m) || m.left_out.empty())
            t += fmt::format("  {:<6} {:<58} {:>13.9g} {:>13.9g} {:>9.2e} {:>8.1e}\n",
                             m.passed() ? "ok" : verdict(m), m.quantity, m.reference, m.value,
                             m.error, m.tolerance);
        else
            t += fmt::format("  left out: {}\n", m.quantity);
        if (!words(m).empty()) t += fmt::format("         {}\n", words(m));
    }
    return t;
}

std::string csv_of(const std::vector<CaseResult>& results)
{
    std::string t =
        "case,suite,source,quantity,reference,result,error,tolerance,verdict,seconds [s],note\n";
    for (const CaseResult& r : results) {
        const std::string head = in_csv(r.name) + "," + r.suite + "," + in_csv(r.source);
        if (!r.left_out.empty())
            t += head + ",,,,,,left out,0," + in_csv(r.left_out) + "\n";
        else
            for (const Measured& m : r.rows)
                t += head + fmt::format(",{},{},{},{},{},{},{:.3f},{}\n", in_csv(m.quantity),
                                        cell(m.reference, "{}"), cell(m.value, "{}"),
                                        cell(m.error, "{:.3g}"), cell(m.tolerance, "{:g}"),
                                        verdict(m), r.seconds, in_csv(words(m)));
    }
    return t;
}

std::string left_out_text(const std::vector<CaseResult>& results)
{
    std::size_t cases = 0, parts = 0, misses = 0;
    for (const CaseResult& r : results) {
        cases += !r.left_out.empty();
        for (const Measured& m : r.rows)
            if (!m.left_out.empty()) ++(was_measured(m) ? misses : parts);
    }
    return fmt::format("{} cases left out, {} parts of cases left out, {} rows that miss the "
                       "tolerance of their source; each gives the reason",
                       cases, parts, misses);
}

std::string markdown_of(const std::vector<CaseResult>& results)
{
    std::string t = "# Published cases\n\n`amontons validate`\n\n"
                    "| case | quantity | reference | result | error | tolerance | |\n"
                    "|---|---|---|---|---|---|---|\n";
    for (const CaseResult& r : results) {
        if (!r.left_out.empty())
            t += fmt::format("| {} | left out: {} | | | | | |\n", r.name, r.left_out);
        for (const Measured& m : r.rows)
            t += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", r.name, m.quantity,
                             cell(m.reference, "{:.9g}"), cell(m.value, "{:.9g}"),
                             cell(m.error, "{:.2e}"), cell(m.tolerance, "{:.1e}"),
                             m.failed()           ? "**failed**"
                             : m.left_out.empty() ? ""
                                                  : verdict(m) + (": " + m.left_out));
    }
    t += "\n| case | source | seconds |\n|---|---|---|\n";
    for (const CaseResult& r : results)
        t += fmt::format("| {} | {} | {:.2f} |\n", r.name, r.source, r.seconds);
    return t;
}

std::vector<PlotScript> plots_of(const std::vector<CaseResult>& results)
{
    std::vector<PlotScript> plots;
    // Error over tolerance of every row, a column of points for each case.
    std::string tics, points;
    int column = 0;
    for (const CaseResult& r : results) {
        if (r.rows.empty()) continue;
        tics += fmt::format("{}'{}' {}", column ? "," : "", label(r.name), column);
        for (const Measured& m : r.rows) {
            // What is exact stands at the bottom; what may not miss at all, or is no number, on
            // top.
            if (!m.left_out.empty() && !was_measured(m)) continue;
            const double share = m.error == 0 ? 0 : m.error / m.tolerance;
            points += fmt::format("{} {:.4g} {}\n", column,
                                  std::clamp(std::isnan(share) ? 1e3 : share, 1e-8, 1e3),
                                  m.passed() ? 0 : 1);
        }
        ++column;
    }
    if (column > 0)
        plots.emplace_back(
            "errors",
            "$rows << END\n" + points + "END\n" +
                head_of("errors", std::max(480, 130 + 20 * column), 520) +
                fmt::format("set logscale y\nset format y '10^{{%T}}'\nset yrange [5e-9:2e3]\n"
                            "set xrange [-1:{}]\nset xtics rotate by 90 right noenhanced ({})\n"
                            "set ylabel 'error over tolerance'\nset key outside top\n"
                            "plot 1 with lines lw 2 lc rgb '#999999' title 'tolerance', "
                            "$rows using 1:($3 == 0 ? $2 : NaN) with points pt 7 ps 0.5 lc rgb "
                            "'#207040' title 'passed', $rows using 1:($3 == 1 ? $2 : NaN) with "
                            "points pt 5 ps 0.7 lc rgb '#c00000' title 'failed or missed'\n",
                            column, tics));
    for (const CaseResult& r : results) {
        int k = 0;
        for (const Measured& m : r.rows) {
            if (m.curve.x.empty()) continue;
            const std::string name = fmt::format("{}-{}", r.name, ++k);
            plots.emplace_back(name, curve_script(name, m.curve));
        }
    }
    return plots;
}

std::string html_of(const std::vector<CaseResult>& results, const std::string& about,
                    const std::vector<std::string>& drawn)
{
    std::size_t rows = 0, failed = 0;
    for (const CaseResult& r : results)
        for (const Measured& m : r.rows) {
            rows += m.left_out.empty();
            failed += m.failed();
        }
    const auto plot = [&](const std::string& name) -> std::string {
        if (std::find(drawn.begin(), drawn.end(), name) == drawn.end()) return "";
        return fmt::format("<p><img src=\"plots/{0}.svg\" alt=\"{0}\"></p>\n", in_html(name));
    };
    std::string t =
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<title>amontons validate</title>\n<style>body{font:15px sans-serif;margin:2em;"
        "max-width:75em}table{border-collapse:collapse}td,th{padding:.15em .6em;text-align:left;"
        "border-bottom:1px solid #ddd}td.n{text-align:right;font-variant-numeric:tabular-nums}"
        "tr.failed td{background:#fdd}small{color:#555}</style></head><body>\n"
        "<h1>amontons validate</h1>\n";
    t += fmt::format("<p>{}</p>\n", in_html(about));
    t += fmt::format("<p>{} cases, {} rows, {} failed; {}</p>\n", results.size(), rows, failed,
                     left_out_text(results));
    t += plot("errors");
    for (const CaseResult& r : results) {
        t += fmt::format("<h2 id=\"{0}\">{0}</h2>\n<p>{1}. {2}{3} <small>{4:.2f} s</small></p>\n",
                         in_html(r.name), in_html(r.suite), in_html(r.source),
                         r.verified.empty() ? "" : "; verified: " + in_html(r.verified), r.seconds);
        if (!r.about.empty()) t += "<p>" + in_html(r.about) + "</p>\n";
        if (!r.left_out.empty()) {
            t += "<p>Left out: " + in_html(r.left_out) + "</p>\n";
            continue;
        }
        t += "<table><tr><th>quantity</th><th>reference</th><th>result</th><th>error</th>"
             "<th>tolerance</th><th>verdict</th></tr>\n";
        int k = 0;
        std::string plots;
        for (const Measured& m : r.rows) {
            t += fmt::format("<tr{}><td>{}{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
                             "<td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>\n",
                             m.failed() ? " class=\"failed\"" : "", in_html(m.quantity),
                             words(m).empty() ? "" : "<br><small>" + in_html(words(m)) + "</small>",
                             cell(m.reference, "{:.9g}"), cell(m.value, "{:.9g}"),
                             cell(m.error, "{:.2e}"), cell(m.tolerance, "{:.1e}"),
                             m.failed() ? "failed" : verdict(m));
            if (!m.curve.x.empty()) plots += plot(fmt::format("{}-{}", r.name, ++k));
        }
        t += "</table>\n" + plots;
    }
    return t + "</body></html>\n";
}

} // namespace amontons::validation
