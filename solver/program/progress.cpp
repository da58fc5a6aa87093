#include "solver/program/progress.hpp"

#include <algorithm>
#include <cstdio>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr double kBarPause = 0.1;                    // [s]
constexpr double kLinePause = 5, kShortestPause = 1; // [s]
constexpr double kLineEvery = 0.1;                   // of the run
constexpr int kBarWidth = 30;

} // namespace

Progress::Progress(const Session& session, double end)
    : session_(session)
    , end_(end)
    , bar_(progress_on_terminal() && !session.quiet)
{
}

void Progress::step(const StepRecord& r)
{
    if (session_.quiet) return;
    if (first_ < 0) first_ = r.time;
    const double now = watch_.seconds();
    const double pause = now - last_seconds_;
    const double fraction = end_ > 0 ? std::min(1.0, r.time / end_) : 1;
    const double done = end_ > first_ ? (r.time - first_) / (end_ - first_) : 1; // of this process
    const bool due = bar_ ? pause >= kBarPause
                          : pause >= kLinePause || (pause >= kShortestPause &&
                                                    fraction - last_fraction_ >= kLineEvery);
    if (!due) return;
    last_seconds_ = now;
    last_fraction_ = fraction;
    const std::string left = done > 0 ? fmt::format("{:.0f} s left", now * (1 - done) / done) : "";
    if (bar_) {
        const int full = static_cast<int>(fraction * kBarWidth);
        const std::string text =
            fmt::format("\r\033[K[{:#<{}}{:.<{}}] {:3.0f} %, step {}, {} contacts, {}", "", full,
                        "", kBarWidth - full, 100 * fraction, r.step, r.contacts.size(), left);
        std::fwrite(text.data(), 1, text.size(), stderr);
    } else {
        session_.print_line(fmt::format("{:3.0f} %: step {}, t = {:.4g} s, {} contacts, {}",
                                        100 * fraction, r.step, r.time, r.contacts.size(), left));
    }
}

void Progress::end()
{
    if (bar_) std::fputs("\r\033[K", stderr);
}

} // namespace amontons
