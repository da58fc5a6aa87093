#include "haptics/time/summary.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace amontons {
namespace {

constexpr std::size_t kAbout = 3; // ticks before and after one, where motion is much the same

bool is_event(const TickRecord& before, const TickRecord& now)
{
    return now.proxy.new_operator || now.proxy.closed != before.proxy.closed;
}

bool is_computed(const TickRecord& r)
{
    return r.state == SafetyState::running || r.state == SafetyState::limited ||
           r.state == SafetyState::starting || r.state == SafetyState::aged_operator;
}

/// Whether that much work usually takes less than half a period.
bool is_usual(const TickRecord& tick, std::span<const TickRecord> records, double period)
{
    std::vector<double> cpu;
    for (const TickRecord& r : records)
        if (r.proxy.products >= tick.proxy.products) cpu.push_back(r.cpu);
    return percentiles(std::move(cpu)).p50 < 0.5 * period;
}

} // namespace

Percentiles percentiles(std::vector<double> x)
{
    if (x.empty()) return {};
    std::sort(x.begin(), x.end());
    const auto at = [&](double share) {
        const double n = static_cast<double>(x.size());
        return x[static_cast<std::size_t>(std::clamp(std::ceil(share * n) - 1, 0.0, n - 1))];
    };
    return {at(0.5), at(0.99), at(0.999), x.back()};
}

template <class Real>
HapticSummary summarise(std::span<const TickRecord> records, const HapticLoop<Real>& loop,
                        double period, bool real_time)
{
    HapticSummary s;
    s.ticks = static_cast<long>(records.size());
    if (records.empty()) return s;
    std::vector<double> compute, wake, cpu, error, sweeps;
    long over = 0;
    for (const TickRecord& r : records) {
        compute.push_back(r.compute);
        wake.push_back(r.wake);
        s.oldest_operator = std::max(s.oldest_operator, r.operator_age);
        s.largest_force = std::max(s.largest_force, r.sent.force.norm());
        s.operators += r.proxy.new_operator;
        ++s.ticks_in[static_cast<std::size_t>(r.state)];
        s.outside_validity += !r.proxy.valid;
        s.most_closed = std::max(s.most_closed, r.proxy.closed);
        s.most_contacts = std::max(s.most_contacts, r.proxy.contacts);
        if (r.proxy.contacts > 0 && is_computed(r)) {
            error.push_back(r.proxy.error);
            sweeps.push_back(r.proxy.sweeps);
            over += !r.proxy.converged;
        }
        if (!real_time) continue;
        cpu.push_back(r.cpu);
        if (r.cpu > period) // too long though it had begun in time
            ++(is_usual(r, records, period) ? s.missed.host : s.missed.compute);
        else if (r.wake + r.cpu > period)
            ++s.missed.wake;
        else if (r.wake + r.compute > period)
            ++s.missed.preempted;
    }
    s.over_tolerance = error.empty() ? 0 : double(over) / double(error.size());
    s.compute = percentiles(std::move(compute));
    s.wake = percentiles(std::move(wake));
    s.cpu = percentiles(std::move(cpu));
    s.error = percentiles(std::move(error));
    s.sweeps = percentiles(std::move(sweeps));
    const double took = records.back().time - records.front().time + period;
    s.rate = static_cast<double>(records.size()) / took;

    std::vector<double> change(records.size(), 0);
    std::vector<bool> event(records.size(), true); // or not to be counted
    for (std::size_t k = 1; k < records.size(); ++k) {
        const TickRecord &a = records[k - 1], &b = records[k];
        const long gap = std::lround((b.time - a.time) / period);
        s.missed.longest = std::max(s.missed.longest, gap - 1);
        s.largest_change_sent =
            std::max(s.largest_change_sent, (b.sent.force - a.sent.force).norm());
        s.largest_rise_sent =
            std::max(s.largest_rise_sent,
                     b.sent.force.norm() - a.sent.force.norm() -
                         std::max(0.0, b.computed.force.norm() - a.computed.force.norm()));
        if (!is_computed(a) || !is_computed(b)) continue;
        const auto ticks = static_cast<double>(std::max(gap, 1L));
        change[k] = (b.computed.force - a.computed.force).norm() / ticks;
        event[k] = is_event(a, b);
        s.largest_change = std::max(s.largest_change, change[k]);
    }
    for (std::size_t k = 1; k < records.size(); ++k) {
        if (!event[k] || change[k] == 0) continue;
        double usual = 0;
        const std::size_t from = k > kAbout ? k - kAbout : 1,
                          to = std::min(records.size() - 1, k + kAbout);
        for (std::size_t j = from; j <= to; ++j)
            if (!event[j]) usual = std::max(usual, change[j]);
        double& jump = records[k].proxy.new_operator ? s.handover_jump : s.contact_jump;
        jump = std::max(jump, change[k] - usual);
    }

    s.energy = loop.passivity().energy();
    s.energy_injected = std::max(0.0, loop.passivity().most_energy());
    s.clamped = loop.limiter().ticks_clamped();
    s.slewed = loop.limiter().ticks_slewed();
    s.interpolated = loop.limiter().ticks_interpolated();
    s.controlled = loop.passivity().ticks_controlled();
    s.faults = loop.safety().faults();
    s.last_fault = loop.safety().last_fault();
    s.state = records.back().state;
    return s;
}

std::string trace_csv(std::span<const TickRecord> records)
{
    std::string out =
        "time [s],x [m],y [m],z [m],turn_x [rad],turn_y [rad],turn_z [rad],"
        "computed_x [N],computed_y [N],computed_z [N],computed_torque_x [N m],"
        "computed_torque_y [N m],computed_torque_z [N m],sent_x [N],sent_y [N],sent_z [N],"
        "sent_torque_x [N m],sent_torque_y [N m],sent_torque_z [N m],state,contacts,closed,sweeps,"
        "error,new_operator,operator_age [s],distance [m],energy [J],compute [s],wake [s],"
        "cpu [s],products\n";
    char line[1024];
    for (const TickRecord& r : records) {
        const Vec3 turned = turn_vector(r.handle.rotation);
        const Vec3 &x = r.handle.position, &c = r.computed.force, &m = r.computed.torque,
                   &f = r.sent.force, &t = r.sent.torque;
        const int n = std::snprintf(
            line, sizeof line,
            "%.6f,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.7g,%.7g,%.7g,%.7g,%.7g,%.7g,%.7g,%.7g,%.7g,%.7g,"
            "%.7g,%.7g,%s,%d,%d,%d,%.3e,%d,%.6f,%.4e,%.6e,%.3e,%.3e,%.3e,%ld\n",
            r.time, x[0], x[1], x[2], turned[0], turned[1], turned[2], c[0], c[1], c[2], m[0], m[1],
            m[2], f[0], f[1], f[2], t[0], t[1], t[2], name(r.state), r.proxy.contacts,
            r.proxy.closed, r.proxy.sweeps, r.proxy.error, int(r.proxy.new_operator),
            r.operator_age, r.proxy.distance, r.energy, r.compute, r.wake, r.cpu, r.proxy.products);
        out.append(line, static_cast<std::size_t>(std::clamp(n, 0, int(sizeof line) - 1)));
    }
    return out;
}

template HapticSummary summarise(std::span<const TickRecord>, const HapticLoop<float>&, double,
                                 bool);
template HapticSummary summarise(std::span<const TickRecord>, const HapticLoop<double>&, double,
                                 bool);

} // namespace amontons
