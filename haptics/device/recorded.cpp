#include "haptics/device/recorded.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace amontons {
namespace {

constexpr double kLongest = 3600;       // [s]: what one run may last
constexpr std::size_t kMostIssues = 10; // of one file: more add no information
constexpr const char* kColumns[] = {"time", "x", "y", "z", "turn_x", "turn_y", "turn_z"};
constexpr const char* kUnits[] = {"s", "m", "m", "m", "rad", "rad", "rad"};

std::string_view trimmed(std::string_view s)
{
    while (!s.empty() && (s.front() == ' ' || s.front() == '\t'))
        s.remove_prefix(1);
    while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r'))
        s.remove_suffix(1);
    return s;
}

/// The part before the next `separator`, which is taken off with it.
std::string_view next_part(std::string_view& rest, char separator)
{
    const std::size_t at = rest.find(separator);
    const std::string_view part = rest.substr(0, at);
    rest = at == std::string_view::npos ? std::string_view() : rest.substr(at + 1);
    return part;
}

bool read_number(std::string_view text, double& value)
{
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

/// Of a heading "name [unit]"; "" where there is none.
std::string_view unit_of(std::string_view heading)
{
    const std::size_t open = heading.find('['), close = heading.find(']');
    if (open == std::string_view::npos || close == std::string_view::npos || close < open)
        return "";
    return trimmed(heading.substr(open + 1, close - open - 1));
}

std::string short_number(double x)
{
    std::array<char, 32> text;
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), x);
    return {text.data(), error == std::errc() ? end : text.data()};
}

} // namespace

Trajectory parse_trajectory(std::string_view text, const std::string& file)
{
    std::vector<Issue> issues;
    std::array<int, 7> column;
    column.fill(-1);
    std::string_view rest = text;
    if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3); // spreadsheets begin UTF-8 so
    if (trimmed(rest).empty())
        throw InputError({{file, "", "an empty file",
                           "time,x,y,z[,turn_x,turn_y,turn_z] and a line "
                           "of numbers for each time"}});
    std::string_view header = next_part(rest, '\n');

    // ---- Heading
    int headings = 0;
    for (; !header.empty(); ++headings) {
        const std::string_view heading = next_part(header, ',');
        const std::string_view name = trimmed(heading.substr(0, heading.find('['))),
                               unit = unit_of(heading);
        for (std::size_t k = 0; k < column.size(); ++k) {
            if (name != kColumns[k]) continue;
            if (column[k] >= 0)
                issues.push_back(
                    {file, "line 1", std::string(kColumns[k]) + " twice", "each column once"});
            if (!unit.empty() && unit != kUnits[k])
                issues.push_back({file, "line 1", quoted_text(trimmed(heading)),
                                  std::string(kColumns[k]) + " [" + kUnits[k] + "]"});
            column[k] = headings;
        }
    }
    for (std::size_t k = 0; k < 4; ++k)
        if (column[k] < 0)
            issues.push_back({file, "line 1", std::string("no column ") + kColumns[k],
                              "time,x,y,z[,turn_x,turn_y,turn_z]"});
    const bool turns = column[4] >= 0 && column[5] >= 0 && column[6] >= 0;
    for (std::size_t k = 4; k < column.size() && !turns; ++k)
        if (column[k] >= 0)
            issues.push_back({file, "line 1", std::string(kColumns[k]) + " without the others",
                              "all of turn_x, turn_y, turn_z, or none"});
    if (!issues.empty()) throw InputError(std::move(issues));

    // ---- Rows
    Trajectory path;
    for (int line = 2; !rest.empty() && issues.size() < kMostIssues; ++line) {
        std::string_view row = next_part(rest, '\n');
        if (trimmed(row).empty()) continue;
        std::array<double, 7> value{};
        std::array<bool, 7> known{};
        bool good = true;
        int cells = 0;
        for (int c = 0; !row.empty() && good; ++c, ++cells) {
            const std::string_view cell = trimmed(next_part(row, ','));
            for (std::size_t k = 0; k < column.size(); ++k) {
                if (column[k] != c || (k >= 4 && !turns)) continue;
                known[k] = read_number(cell, value[k]);
                if (!known[k]) {
                    issues.push_back({file, "line " + std::to_string(line),
                                      std::string(kColumns[k]) + " " + quoted_text(cell),
                                      "a finite number"});
                    good = false;
                }
            }
        }
        for (std::size_t k = 0; k < (turns ? 7u : 4u) && good; ++k)
            if (!known[k]) {
                issues.push_back({file, "line " + std::to_string(line),
                                  std::string("no ") + kColumns[k], "a number in each column"});
                good = false;
            }
        if (good && cells > headings) { // as commas in numbers make them
            issues.push_back({file, "line " + std::to_string(line),
                              std::to_string(cells) + " values",
                              std::to_string(headings) + ", one for each column"});
            good = false;
        }
        if (!good) continue;
        if (!path.time.empty() && !(value[0] > path.time.back())) {
            issues.push_back(
                {file, "line " + std::to_string(line),
                 "time " + short_number(value[0]) + " after " + short_number(path.time.back()),
                 "time that increases from line to line [s]"});
            continue;
        }
        if (!path.time.empty() && !(value[0] - path.time.front() <= kLongest)) {
            issues.push_back({file, "line " + std::to_string(line), short_number(value[0]) + " s",
                              "a time at most 3600 s after the first"});
            break;
        }
        path.time.push_back(value[0]);
        path.pose.push_back({{value[1], value[2], value[3]}, turn({value[4], value[5], value[6]})});
    }
    if (issues.empty() && path.time.empty())
        issues.push_back({file, "", "no points", "at least one line of numbers"});
    if (!issues.empty()) throw InputError(std::move(issues));
    return path;
}

DeviceSpec RecordedDevice::spec() const
{
    DeviceSpec spec;
    spec.name = "recorded";
    spec.free.fill(true);
    return spec;
}

DeviceSample RecordedDevice::read(double time) noexcept
{
    DeviceSample sample;
    sample.time = time;
    const std::vector<double>& t = trajectory_.time;
    const double now = t.front() + std::max(time, 0.0);
    if (now > t.back()) return sample;
    if (at_ >= t.size() || t[at_] > now) at_ = 0;
    while (at_ + 1 < t.size() && t[at_ + 1] <= now)
        ++at_;
    sample.valid = true;
    sample.pose = trajectory_.pose[at_];
    if (at_ + 1 == t.size()) return sample;
    const double share = (now - t[at_]) / (t[at_ + 1] - t[at_]);
    const Vec6 d = displacement(sample.pose, trajectory_.pose[at_ + 1]);
    sample.pose.position += share * d.head<3>();
    sample.pose.rotation = (turn(share * d.tail<3>()) * sample.pose.rotation).normalized();
    return sample;
}

} // namespace amontons
