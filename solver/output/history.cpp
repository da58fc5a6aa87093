#include "solver/output/history.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <iterator>
#include <limits>
#include <unistd.h>

namespace amontons {
namespace {

struct Column {
    const char* name;
    double (*value)(const StepRecord& r);
};

// The fixed columns; those of the simulation's own quantities stand between the two groups.
constexpr Column kFirst[] = {
    {"step", [](const StepRecord& r) { return static_cast<double>(r.step); }},
    {"time [s]", [](const StepRecord& r) { return r.time; }},
};
constexpr Column kLast[] = {
    {"contacts", [](const StepRecord& r) { return static_cast<double>(r.contacts.size()); }},
    {"certificate_error", [](const StepRecord& r) { return r.certificate.error; }},
    {"certificate_tolerance", [](const StepRecord& r) { return r.certificate.tolerance; }},
    {"worst_penetration [m]", [](const StepRecord& r) { return r.certificate.worst_penetration; }},
    {"worst_overlap [m]", [](const StepRecord& r) { return r.certificate.worst_overlap.depth; }},
    {"worst_cone_violation [N]",
     [](const StepRecord& r) { return r.certificate.worst_cone_violation; }},
    {"work [J]", [](const StepRecord& r) { return r.energy.work; }},
    {"work_absolute [J]", [](const StepRecord& r) { return r.energy.work_absolute; }},
    {"elastic [J]", [](const StepRecord& r) { return r.energy.elastic; }},
    {"kinetic [J]", [](const StepRecord& r) { return r.energy.kinetic; }},
    {"friction [J]", [](const StepRecord& r) { return r.energy.friction; }},
    {"released [J]", [](const StepRecord& r) { return r.energy.released; }},
    {"energy_error [J]", [](const StepRecord& r) { return r.energy.error(); }},
    {"step_length [s]", [](const StepRecord& r) { return r.step_length; }},
    {"iterations", [](const StepRecord& r) { return static_cast<double>(r.iterations); }},
    {"factorisations", [](const StepRecord& r) { return static_cast<double>(r.factorisations); }},
    {"retries", [](const StepRecord& r) { return static_cast<double>(r.retries); }},
    {"seconds [s]", [](const StepRecord& r) { return r.seconds; }},
    {"free_motion_seconds [s]", [](const StepRecord& r) { return r.phases.free_motion; }},
    {"detection_seconds [s]", [](const StepRecord& r) { return r.phases.detection; }},
    {"compliance_seconds [s]", [](const StepRecord& r) { return r.phases.compliance; }},
    {"contact_solve_seconds [s]", [](const StepRecord& r) { return r.phases.contact_solve; }},
    {"correction_seconds [s]", [](const StepRecord& r) { return r.phases.correction; }},
};

/// A file that a link names is never written.
void write_file_in_place_of_link(const std::string& path, std::string_view bytes)
{
    std::error_code error;
    if (std::filesystem::is_symlink(path, error))
        write_file(path, bytes, Flush::to_system, Links::replace);
}

/// Each line's hash takes in the hash of the lines before it.
std::uint64_t chained(std::uint64_t before, std::string_view line)
{
    std::uint64_t both[2] = {before, hash_bytes(line)};
    return hash_bytes({reinterpret_cast<const char*>(both), sizeof both});
}

} // namespace

std::string csv_text(const std::string& text)
{
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text)
        quoted.append(c == '"' ? 2 : 1, c);
    return quoted + '"';
}

History::~History()
{
    if (file_ >= 0) ::close(file_);
}

void History::start(const std::string& path, const std::string& until_renamed)
{
    path_ = path;
    const std::string& name = until_renamed.empty() ? path : until_renamed;
    drop_link(name);
    file_ = ::open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file_ < 0) throw WriteError(path, std::strerror(errno));
}

void History::resume(const std::string& path, std::uint64_t bytes, std::uint64_t hash)
{
    const std::string text = read_file(path);
    std::uint64_t found = 0;
    for (std::size_t at = 0; at < bytes && at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
        found = chained(found, std::string_view(text).substr(at, end - at));
        at = end;
    }
    if (text.size() < bytes || found != hash)
        throw InputError({{path, "", "not the history that the checkpoint continues with",
                           "the files as the run left them"}});
    path_ = path;
    write_file_in_place_of_link(path, text);
    file_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file_ < 0 || ::ftruncate(file_, static_cast<off_t>(bytes)) != 0 ||
        ::lseek(file_, 0, SEEK_END) < 0)
        throw WriteError(path, std::strerror(errno));
    bytes_ = bytes;
    hash_ = hash;
    read_extremes_(std::string_view(text).substr(0, bytes));
}

void History::note_(std::size_t quantity, double value)
{
    Extremes& e = extremes_[quantity];
    e.least = std::min(e.least, value);
    e.largest = std::max(e.largest, value);
    last_[quantity].value = value;
}

/// Of lines as append() has written them: no number of them holds a comma.
void History::read_extremes_(std::string_view lines)
{
    constexpr std::size_t kOthers = std::size(kFirst) + std::size(kLast) + 1; // and the remark
    extremes_.clear();
    last_.clear();
    bool header = true;
    for (std::size_t at = 0; at < lines.size(); header = false) {
        const std::size_t end = std::min(lines.find('\n', at), lines.size());
        const std::string_view line = lines.substr(at, end - at);
        at = end + 1;
        std::size_t cell = 0;
        for (std::size_t start = 0; start <= line.size(); ++cell) {
            if (!header && cell >= std::size(kFirst) + extremes_.size()) break;
            std::string name;
            std::size_t stop = start;
            if (header && start < line.size() && line[start] == '"') { // as csv_text has it
                for (stop = start + 1; stop < line.size(); ++stop) {
                    if (line[stop] == '"' && (stop + 1 == line.size() || line[++stop] != '"'))
                        break;
                    name += line[stop];
                }
            } else {
                stop = std::min(line.find(',', start), line.size());
                name = line.substr(start, stop - start);
            }
            start = stop + 1;
            if (cell < std::size(kFirst)) continue;
            if (header) {
                constexpr double kNone = std::numeric_limits<double>::infinity();
                const std::size_t at_unit = name.find(" [");
                const std::string unit =
                    at_unit == name.npos ? "" : name.substr(at_unit + 2, name.size() - at_unit - 3);
                extremes_.push_back({name.substr(0, at_unit), kNone, -kNone});
                last_.push_back({extremes_.back().name, unit, 0});
            } else {
                note_(cell - std::size(kFirst), std::strtod(name.c_str(), nullptr));
            }
        }
        if (header) {
            extremes_.resize(cell > kOthers ? cell - kOthers : 0);
            last_.resize(extremes_.size());
        }
    }
}

void History::write_line_()
{
    std::size_t done = 0;
    while (done < line_.size()) {
        const ssize_t n = ::write(file_, line_.data() + done, line_.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            const int error = errno;
            if (::ftruncate(file_, static_cast<off_t>(bytes_)) != 0) { /* a half line stays */
            }
            throw WriteError(path_, std::strerror(error));
        }
        done += static_cast<std::size_t>(n);
    }
    bytes_ += line_.size();
    hash_ = chained(hash_, line_);
}

void History::append(const StepRecord& r)
{
    line_.clear();
    if (bytes_ == 0) {
        for (const Column& c : kFirst)
            line_ += fmt::format("{},", c.name);
        extremes_.clear();
        last_ = r.quantities;
        for (const Quantity& q : r.quantities) {
            extremes_.push_back({q.name, q.value, q.value});
            line_ +=
                csv_text(q.unit.empty() ? q.name : fmt::format("{} [{}]", q.name, q.unit)) + ',';
        }
        for (const Column& c : kLast)
            line_ += fmt::format("{},", c.name);
        line_ += "remark\n";
        write_line_();
        line_.clear();
    }
    for (const Column& c : kFirst)
        line_ += fmt::format("{},", c.value(r));
    for (std::size_t k = 0; k < std::min(r.quantities.size(), extremes_.size()); ++k)
        note_(k, r.quantities[k].value);
    for (const Quantity& q : r.quantities)
        line_ += fmt::format("{},", q.value);
    for (const Column& c : kLast)
        line_ += fmt::format("{},", c.value(r));
    if (!r.remark.empty()) {
        line_ += '"';
        for (const char c : r.remark)
            line_ += c == '"' ? '\'' : c == '\n' ? ' ' : c;
        line_ += '"';
    }
    line_ += '\n';
    write_line_();
}

} // namespace amontons
