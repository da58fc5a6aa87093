#include "haptics/session/link_changes.hpp"

#include "mesh/base/error.hpp"

#include <chrono>

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
        const Scene scene = read(c.overrides);
        c.obstacles = make(scene);
        c.link = make_link(scene, c.obstacles, options);
    } catch (const InputError& error) {
        c.refusal = std::string("not set: ") + error.what();
    }
    return c;
}

} // namespace

void LinkChanges::ask(std::vector<std::string> lines)
{
    for (std::string& line : lines)
        asked_.push_back(std::move(line));
}

ChangedLink LinkChanges::next(const HandleLink& now,
                              const std::function<void(const std::string&)>& say)
{
    if (!pending_.valid() && !asked_.empty()) {
        pending_ = std::async(std::launch::async, build_changed_link, read_, make_, overrides_,
                              asked_.front(), options_);
        asked_.pop_front();
    }
    ChangedLink c;
    if (!pending_.valid() ||
        (!waits_ && pending_.wait_for(std::chrono::seconds(0)) != std::future_status::ready))
        return c;
    c = pending_.get();
    if (c.link && !c.link->take_over(now)) {
        c.refusal = "not set, the bodies would be others: " + c.line;
        c.link.reset();
    }
    if (c.link) overrides_ = c.overrides;
    say(c.link ? "set " + c.line : c.refusal);
    return c;
}

void LinkChanges::end(const std::function<void(const std::string&)>& say)
{
    if (pending_.valid()) asked_.push_front(pending_.get().line);
    for (const std::string& line : asked_)
        say("not set, the run ended before: " + line);
    asked_.clear();
}

} // namespace amontons
