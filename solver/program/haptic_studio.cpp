#include "solver/program/haptic_studio.hpp"

#include "haptics/time/summary.hpp"
#include "solver/program/serve_request.hpp"
#include "solver/scene/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace amontons {
namespace {

constexpr double kHealthPause = 0.1;  // between two events [s]
constexpr double kWatchedSeconds = 1; // of the loop
constexpr std::size_t kLongestRequest = std::size_t(1) << 24;

void write_vector(JsonText& json, const char* name, const Vec3& x)
{
    json.key(name).open('[').value(x.x()).value(x.y()).value(x.z()).close(']');
}

} // namespace

LoopHealth LoopWatch::update(std::span<const TickRecord> ticks, bool by_clock)
{
    LoopHealth h;
    if (ticks.empty()) return h;
    for (; seen_ < ticks.size(); ++seen_)
        if (ticks[seen_].cpu > period_) ++by_work_;
    h.last = ticks.back();
    h.time = h.last.time;
    h.ticks = static_cast<long>(ticks.size());
    h.missed_by_work = by_work_;
    const auto from = std::ranges::find_if(
        ticks, [&](const TickRecord& t) { return t.time > h.time - kWatchedSeconds; });
    const std::span<const TickRecord> watched(from, ticks.end());
    if (watched.size() > 1 && watched.back().time > watched.front().time)
        h.rate =
            static_cast<double>(watched.size() - 1) / (watched.back().time - watched.front().time);
    std::vector<double> compute, late;
    for (const TickRecord& t : watched) {
        compute.push_back(t.compute);
        late.push_back(t.wake);
    }
    h.p99 = percentiles(std::move(compute)).p99;
    if (!by_clock) return h;
    h.missed = std::max(0L, std::lround((h.time - h.last.wake) / period_) + 1 - h.ticks);
    h.late_p99 = percentiles(std::move(late)).p99;
    return h;
}

HapticStudio::HapticStudio(int frames, Session& session, std::atomic<bool>& stop, double period,
                           double step_rate)
    : stream_(frames)
    , session_(session)
    , stop_(stop)
    , lines_(stop, kLongestRequest)
    , watch_(period)
    , period_(period)
    , step_rate_(step_rate)
{
    session_.print("{\"event\":\"ready\"}\n");
}

std::vector<HapticStudio::Change> HapticStudio::take(const std::string& scene)
{
    std::vector<Change> changes;
    std::string line;
    while (!stop_) {
        const LineReader::Got got = lines_.next(line, 0);
        if (got == LineReader::Got::line) {
            answer(line, scene, changes);
        } else {
            // Without the server this run would not end.
            if (got == LineReader::Got::end || got == LineReader::Got::broken) stop_ = true;
            if (got != LineReader::Got::too_long) break;
        }
    }
    return changes;
}

void HapticStudio::answer(const std::string& line, const std::string& scene,
                          std::vector<Change>& changes)
{
    using What = ServeRequest::What;
    ServeRequest r = read_request(line, true);
    JsonText json(false);
    json.open('{').key("id").json(r.id);
    if (r.issues.empty()) switch (r.what) {
        case What::frame:
            frames_.request_frame(r.after, r.whole);
            json.member("ok", true);
            break;
        case What::set:
            changes.push_back({r.path, r.value});
            json.member("ok", true).member("pending", true);
            break;
        case What::scene:
            json.member("ok", true);
            json.key("scene").json(nlohmann::ordered_json::parse(scene).dump());
            break;
        case What::inputs:
            json.member("ok", true).key("inputs").open('[').close(']');
            break;
        case What::quit:
            stop_ = true;
            json.member("ok", true);
            break;
        default:
            r.issues.push_back({"", "do", "a haptic run, which continues by itself",
                                "set, scene, inputs, frame, or its end"});
        }
    if (!r.issues.empty()) {
        json.member("ok", false).member("status", "bad_input");
        write_issues(json, "issues", r.issues);
    }
    session_.print(json.close('}').text() + "\n");
}

void HapticStudio::report_change(const std::string& line, double time, const std::string& refusal)
{
    JsonText json(false);
    json.open('{').member("event", "set").member("line", line).member("ok", refusal.empty());
    json.member("time", time).member("found", refusal);
    session_.print(json.close('}').text() + "\n");
}

bool HapticStudio::frame_requested()
{
    frames_.changed();
    return frames_.due();
}

void HapticStudio::send(ViewFrame frame, bool whole, const HandleLink& link)
{
    const std::string bytes =
        frames_.take(std::move(frame), whole, link.steps() - 1, link.time(), false);
    if (!send_frame(stream_, bytes)) stop_ = true;
}

void HapticStudio::report_health(std::span<const TickRecord> ticks, const HandleLink& link,
                                 double stiffness, bool by_clock)
{
    ++steps_;
    const double seconds = since_health_.seconds();
    if (ticks.empty() || (reported_ && seconds < kHealthPause)) return;
    const LoopHealth h = watch_.update(ticks, by_clock);
    JsonText json(false);
    json.open('{').member("event", "haptic").member("time", h.time);
    json.member("rate", h.rate).member("rate_aim", 1 / period_);
    json.member("ticks", std::int64_t(h.ticks)).member("missed", std::int64_t(h.missed));
    json.member("missed_by_work", std::int64_t(h.missed_by_work));
    json.member("p99", h.p99).member("late_p99", h.late_p99);
    json.member("energy", h.last.energy).member("state", name(h.last.state));
    json.member("reason", h.last.state == SafetyState::running ? "" : reason(h.last.state));
    if (reported_) json.member("step_rate", (steps_ - steps_before_) / seconds);
    json.member("step_rate_aim", step_rate_).member("refused_steps", link.refused());
    json.member("contacts", h.last.proxy.contacts);
    write_vector(json, "force", h.last.sent.force);
    write_vector(json, "torque", h.last.sent.torque);
    write_vector(json, "device", h.last.handle.position);
    // The spring between them carries the force.
    write_vector(json, "handle", link.device().position + link.force().force / stiffness);
    session_.print(json.close('}').text() + "\n");
    steps_before_ = steps_;
    since_health_ = {};
    reported_ = true;
}

void HapticStudio::write_report_event(const std::string& text)
{
    JsonText json(false);
    json.open('{').member("event", "report").member("text", text);
    session_.print(json.close('}').text() + "\n");
}

} // namespace amontons
