#include "haptics/session/report.hpp"

#include "haptics/link/settings.hpp"
#include "solver/scene/json_text.hpp"

#include <fmt/format.h>

namespace amontons {
namespace {

void add_percentiles(JsonText& json, const char* name, const Percentiles& p)
{
    json.key(name).open('{').member("p50", p.p50).member("p99", p.p99).member("p999", p.p999);
    json.member("max", p.max).close('}');
}

} // namespace

std::string haptic_json(const HapticOutcome& o, const HapticSettings& set, const HandleLink& link)
{
    const HapticSummary& s = o.summary;
    JsonText json;
    json.open('{').member("status", o.status).member("rate", s.rate);
    json.member("ticks", std::int64_t(s.ticks)).key("missed").open('{');
    json.member("compute", std::int64_t(s.missed.compute));
    json.member("host", std::int64_t(s.missed.host));
    json.member("wake", std::int64_t(s.missed.wake));
    json.member("preempted", std::int64_t(s.missed.preempted));
    json.member("longest", std::int64_t(s.missed.longest)).close('}');
    add_percentiles(json, "compute", s.compute);
    add_percentiles(json, "wake", s.wake);
    if (o.real_time) {
        add_percentiles(json, "cpu", s.cpu);
        json.key("bare").open('{').member("missed", std::int64_t(o.bare_missed));
        add_percentiles(json, "wake", o.bare_wake);
        json.close('}').key("loop").open('{');
        json.member("page_faults", std::int64_t(o.page_faults));
        json.member("pages_moved", std::int64_t(o.pages_moved));
        json.member("preempted", std::int64_t(o.preempted)).close('}');
    }
    json.key("contacts").open('{').member("max", s.most_contacts);
    json.member("closed", s.most_closed).member("left_out", link.most_left_out());
    json.member("allowed", o.contacts_at_first)
        .member("allowed_at_end", o.contacts_left)
        .close('}');
    add_percentiles(json, "error", s.error);
    add_percentiles(json, "iterations", s.sweeps);
    json.member("over_tolerance", s.over_tolerance);
    json.key("force_jump").open('{').member("handover", s.handover_jump);
    json.member("contact", s.contact_jump).member("largest_change", s.largest_change);
    json.member("sent", s.largest_change_sent);
    json.member("sent_rise", s.largest_rise_sent).close('}');
    json.member("largest_force", s.largest_force);
    json.member("energy_injected", s.energy_injected).member("energy", s.energy);
    json.member("clamped_ticks", std::int64_t(s.clamped));
    json.member("slewed_ticks", std::int64_t(s.slewed));
    json.member("controlled_ticks", std::int64_t(s.controlled));
    json.key("ticks_in").open('{');
    for (int i = 0; i < kSafetyStates; ++i)
        json.member(name(static_cast<SafetyState>(i)), std::int64_t(s.ticks_in[std::size_t(i)]));
    json.close('}');
    json.member("scheduling", o.scheduling);
    json.key("operators").open('{').member("taken", std::int64_t(s.operators));
    json.member("oldest", s.oldest_operator);
    json.member("ticks_outside", std::int64_t(s.outside_validity)).close('}');
    if (o.shown) {
        json.key("view").open('{').member("frames", std::int64_t(o.shown->frames));
        json.member("seconds", o.shown->seconds).close('}');
    }
    json.key("simulation").open('{').member("steps", link.steps());
    json.member("refused", link.refused()).member("not_met", link.not_touched());
    json.member("snapping", link.snapping());
    json.member("rate", 1 / set.link.condense.period);
    if (o.step_rate > 0) json.member("rate_reached", o.step_rate);
    json.close('}');
    json.key("coupling").open('{').member("stiffness", set.link.spring.stiffness);
    json.member("damping", set.loop.coupling_damping).close('}');
    json.member("profile", std::string(set.device.name));
    json.member("state", name(s.state)).member("faults", std::int64_t(s.faults));
    json.member("fault", s.faults > 0 ? name(s.last_fault) : "");
    json.member("reason", s.faults > 0 ? reason(s.last_fault) : "");
    json.member("output", o.output).close('}');
    return json.text() + "\n";
}

std::string haptic_table(const HapticOutcome& o, const HapticSettings& set, const HandleLink& link)
{
    const HapticSummary& s = o.summary;
    std::string t = fmt::format("{}: {} ticks at {:.1f} Hz, {} steps\n", o.status, s.ticks, s.rate,
                                link.steps());
    const auto row = [&](const char* name, const std::string& value) {
        t += fmt::format("  {:<22} {}\n", name, value);
    };
    const auto micro = [](const Percentiles& p) {
        return fmt::format("p50 {:.1f}, p99 {:.1f}, p99.9 {:.1f}, max {:.1f} us", 1e6 * p.p50,
                           1e6 * p.p99, 1e6 * p.p999, 1e6 * p.max);
    };
    row("device", fmt::format("{}, spring {:g} N/m, damper {:g} N s/m", set.device.name,
                              set.link.spring.stiffness, set.loop.coupling_damping));
    row("tick", micro(s.compute));
    if (o.real_time) {
        row("  processor time", micro(s.cpu));
        row("wake-up", micro(s.wake));
        row("  of a bare timer", micro(o.bare_wake) + fmt::format("; {} late", o.bare_missed));
        row("missed",
            fmt::format(
                "{} by the loop's work, {} by the host, {} by a late wake-up, {} preempted, {} in "
                "a row left out",
                s.missed.compute, s.missed.host, s.missed.wake, s.missed.preempted,
                s.missed.longest));
        row("page faults", fmt::format("{} in the loop", o.page_faults));
        if (o.page_faults > 0 && o.pages_moved > 0)
            row("", fmt::format("meanwhile the kernel moved {} pages, locked ones, too, unless the "
                                "sysctl vm.compact_unevictable_allowed is 0",
                                o.pages_moved));
    }
    row("contacts", fmt::format("{} handed over at most, {} closed, {} left out", s.most_contacts,
                                s.most_closed, link.most_left_out()));
    if (o.contacts_left < o.contacts_at_first)
        row("reduced", fmt::format("{} contacts at most at the end, for lack of time in a tick",
                                   o.contacts_left));
    row("error", fmt::format("p50 {:.1e}, p99 {:.1e}, max {:.1e}; sweeps p50 {:g}, p99 {:g}",
                             s.error.p50, s.error.p99, s.error.max, s.sweeps.p50, s.sweeps.p99));
    row("force", fmt::format("{:.3f} N at most; jumps {:.4f} N at a hand-over, {:.4f} N at a "
                             "contact; {:.4f} N from tick to tick, {:.4f} N as sent",
                             s.largest_force, s.handover_jump, s.contact_jump, s.largest_change,
                             s.largest_change_sent));
    row("energy", fmt::format("{:.3e} J given to the hand in all, {:.3e} J at most", s.energy,
                              s.energy_injected));
    row("limits",
        fmt::format("{} ticks clamped, {} slewed, {} by passivity control; the force was not as "
                    "computed in {}",
                    s.clamped, s.slewed, s.controlled,
                    s.ticks_in[std::size_t(SafetyState::limited)]));
    row("operators", fmt::format("{} taken, oldest {:.1f} ms, {} ticks beyond their reach",
                                 s.operators, 1e3 * s.oldest_operator, s.outside_validity));
    row("simulation", fmt::format("{} tries refused, {} steps cut short, {} within a snap",
                                  link.refused(), link.not_touched(), link.snapping()));
    if (link.refused() > 0 && !link.refusal().empty()) row("last refused", link.refusal());
    row("scheduling", o.scheduling);
    if (s.faults > 0)
        row("faults", fmt::format("{}; the last: {}: {}", s.faults, name(s.last_fault),
                                  reason(s.last_fault)));
    if (!o.output.empty()) row("files", o.output);
    return t;
}

} // namespace amontons
