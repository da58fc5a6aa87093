#include "validation/study/sweep.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/limits.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <set>

namespace amontons::study {
namespace {

constexpr std::size_t kMostPoints = 100000;

[[noreturn]] void refuse(const std::string& text, const std::string& found,
                         const std::string& allowed)
{
    throw InputError({{"--sweep " + quoted_text(text, 200), "", found, allowed}});
}

/// The parts of a text between its commas, but for those within brackets and quotes.
std::vector<std::string> split(const std::string& text, const std::string& whole)
{
    std::vector<std::string> parts(1);
    int depth = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quoted && c == '\\' && i + 1 < text.size()) {
            parts.back() += c;
            parts.back() += text[++i];
            continue;
        }
        if (c == '"') quoted = !quoted;
        if (!quoted && (c == '[' || c == '{')) ++depth;
        if (!quoted && (c == ']' || c == '}')) --depth;
        if (depth < 0) refuse(whole, std::string("a closing ") + c + " too many", "pairs");
        if (c == ',' && depth == 0 && !quoted)
            parts.emplace_back();
        else
            parts.back() += c;
    }
    if (depth != 0 || quoted) refuse(whole, "a bracket or quote that is not closed", "pairs");
    return parts;
}

/// The numbers of a value: one, or those of a list; empty if it is something else.
std::vector<double> numbers_in(const std::string& value)
{
    const nlohmann::json v = nlohmann::json::parse(value, nullptr, false);
    std::vector<double> out;
    if (v.is_number()) return {v.get<double>()};
    if (!v.is_array()) return out;
    for (const nlohmann::json& x : v) {
        if (!x.is_number()) return {};
        out.push_back(x.get<double>());
    }
    return out;
}

} // namespace

std::string Sweep::name() const
{
    return text.substr(0, text.find('='));
}

Sweep parse_sweep(const std::string& text)
{
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        refuse(text, "no PATH=VALUES", "e.g. time.step=0.1,0.05,0.025");
    Sweep s;
    s.text = text;
    s.paths = split(text.substr(0, equals), text);
    s.values = split(text.substr(equals + 1), text);
    for (const std::string& p : s.paths)
        if (p.empty()) refuse(text, "an empty path", "the path of a field");
    std::set<std::string> seen;
    for (const std::string& v : s.values) {
        if (v.empty()) refuse(text, "an empty value", "values with commas between them");
        if (!seen.insert(v).second) refuse(text, quoted_text(v) + " twice", "each value once");
    }
    return s;
}

std::vector<Point> all_points(const std::vector<Sweep>& sweeps)
{
    std::set<std::string> paths;
    std::size_t count = 1;
    for (const Sweep& s : sweeps) {
        for (const std::string& p : s.paths)
            if (!paths.insert(p).second)
                refuse(s.text, quoted_text(p) + " twice", "each path once");
        count *= s.values.size();
        if (count > kMostPoints)
            refuse(s.text, "more than 100000 combinations", "fewer values, or several studies");
    }
    std::vector<Point> points(count);
    for (std::size_t k = 0; k < count; ++k) {
        points[k].index = int(k);
        points[k].values.resize(sweeps.size());
        std::size_t rest = k;
        for (std::size_t s = sweeps.size(); s-- > 0; rest /= sweeps[s].values.size())
            points[k].values[s] = sweeps[s].values[rest % sweeps[s].values.size()];
    }
    return points;
}

std::vector<std::string> overrides(const std::vector<Sweep>& sweeps, const Point& point)
{
    std::vector<std::string> list;
    for (std::size_t s = 0; s < sweeps.size(); ++s)
        for (const std::string& path : sweeps[s].paths)
            list.push_back(path + "=" + point.values[s]);
    return list;
}

double size_of(const Sweep& sweep, const std::string& value)
{
    const std::vector<double> mine = numbers_in(value);
    std::vector<bool> varies(mine.size(), sweep.values.size() == 1);
    for (const std::string& v : sweep.values) {
        const std::vector<double> other = numbers_in(v);
        if (other.size() != mine.size()) return kNaN;
        for (std::size_t i = 0; i < mine.size(); ++i)
            if (other[i] != mine[i]) varies[i] = true;
    }
    if (mine.size() == 1) return mine[0];
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < mine.size(); ++i)
        if (varies[i]) {
            sum += std::log(mine[i]);
            ++n;
        }
    return n > 0 ? std::exp(sum / n) : kNaN;
}

Shard parse_shard(const std::string& text)
{
    Shard s;
    const char *from = text.data(), *end = from + text.size();
    const auto first = std::from_chars(from, end, s.i);
    const bool slash = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
    const auto second = slash ? std::from_chars(first.ptr + 1, end, s.n) : first;
    if (!slash || second.ec != std::errc() || second.ptr != end || s.i < 1 || s.n < s.i)
        throw InputError({{"--shard", "", quoted_text(text), "i/n with 1 <= i <= n, e.g. 2/4"}});
    return s;
}

} // namespace amontons::study
