#include "haptics/session/link_changes.hpp"

#include "mesh/base/error.hpp"

#include <chrono>
#include <deque>
#include <future>

namespace amontons {
namespace {

/// Reads, meshes and factors it.
ChangedLink build_changed_link(const ReadAgain& read, const MakeObstacles& make,
                               std::vector<std::string> overrides, std::string line,
                               const LinkOptions& options)
{
    ChangedLink c;
    overrides.push_back(line);
    c.line = std::move(line);
    c.overrides = std::move(overrides);
    try {
        c.scene = read(c.overrides);
        c.obstacles = make(c.scene);
        c.link = make_link(c.scene, c.obstacles, options);
    } catch (const InputError& error) {
        c.refusal = error.what();
    }
    return c;
}

} // namespace

struct LinkChanges::State {
    ReadAgain read;
    MakeObstacles make;
    LinkOptions options;
    bool waits = false;
    std::vector<std::string> overrides;
    std::deque<std::string> requested;
    std::future<ChangedLink> pending;
};

LinkChanges::LinkChanges(ReadAgain read, MakeObstacles make, const LinkOptions& options, bool waits)
    : state_(std::make_unique<State>())
{
    state_->read = std::move(read);
    state_->make = std::move(make);
    state_->options = options;
    state_->waits = waits;
}

LinkChanges::~LinkChanges() = default;

void LinkChanges::request(std::vector<std::string> lines)
{
    State& s = *state_;
    for (std::string& line : lines)
        s.requested.push_back(std::move(line));
}

ChangedLink LinkChanges::next(const HandleLink& now, const ReportChange& report)
{
    State& s = *state_;
    if (!s.pending.valid() && !s.requested.empty()) {
        s.pending = std::async(std::launch::async, build_changed_link, s.read, s.make, s.overrides,
                               s.requested.front(), s.options);
        s.requested.pop_front();
    }
    ChangedLink c;
    if (!s.pending.valid() ||
        (!s.waits && s.pending.wait_for(std::chrono::seconds(0)) != std::future_status::ready))
        return c;
    c = s.pending.get();
    if (c.link && !c.link->take_over(now)) {
        c.refusal = "other bodies would be needed";
        c.link.reset();
    }
    if (c.link) s.overrides = c.overrides;
    report(c.line, c.refusal);
    return c;
}

void LinkChanges::end(const std::function<void(const std::string&)>& print_line)
{
    State& s = *state_;
    if (s.pending.valid()) s.requested.push_front(s.pending.get().line);
    for (const std::string& line : s.requested)
        print_line("not set, the run ended before: " + line);
    s.requested.clear();
}

} // namespace amontons
