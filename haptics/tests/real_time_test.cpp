#include "haptics/device/recorded.hpp"
#include "haptics/device/udp.hpp"
#include "haptics/tests/count_allocations.hpp"
#include "haptics/time/real_time.hpp"
#include "haptics/time/summary.hpp"
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include "haptics/tests/count_locks.hpp"
#else
namespace amontons::test {
inline thread_local long locks = 0;
}
#endif
#include "haptics/tests/scenes.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <atomic>
#include <chrono>
#include <doctest/doctest.h>
#include <functional>
#include <stdexcept>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

using namespace amontons;
using namespace amontons::test;

// In real time, but nothing here depends on how well the host keeps it: a run ends when what it is
// to show has happened, or after a minute.

namespace {

/// A device on a circle in the bed, which reads the counter of its thread.
struct Circle final : Device {
    long reads = 0, first = -1, last = -1, writes = 0;
    long first_locks = -1, last_locks = -1;
    double force = 0;                 // last [N]
    double most_off = 0;              // that one write took away [N]
    std::atomic<bool> pressed{false}; // a force was felt
    std::atomic<bool> stop{false};
    std::function<bool()> enough = [] { return false; }; // after a write
    DeviceSpec spec() const override { return {}; }
    DeviceSample read(double t) noexcept override
    {
        if (++reads == 30) {
            first = allocations;
            first_locks = locks;
        }
        last = allocations;
        last_locks = locks;
        DeviceSample s;
        s.time = t;
        s.valid = true;
        s.pose.position = {0.01 * std::cos(5 * t), 0.01 * std::sin(5 * t), -0.001};
        return s;
    }
    void write(const Wrench& w, double) noexcept override
    {
        ++writes;
        most_off = std::max(most_off, force - w.force.norm());
        force = w.force.norm();
        if (force > 0.1) pressed = true;
        if (enough()) stop = true;
    }
};

/// Between two ticks.
double largest_drop(const RealTimeRun& run)
{
    double most = 0;
    for (std::size_t k = 1; k < run.records.size(); ++k)
        most =
            std::max(most, run.records[k - 1].sent.force.norm() - run.records[k].sent.force.norm());
    return most;
}

struct Fixture {
    Bed bed;
    RealTimeOptions options;
    Circle device;
    std::atomic<int> published{0};

    Fixture()
    {
        bed.points = grid(16, 5e-3);
        bed.shear = 1e5;
        bed.margin = 0.01;
        options.duration = 60;
        options.stop = &device.stop;
    }
    /// Force at once: no ramp, no control.
    static HapticOptions plain()
    {
        HapticOptions o;
        o.safety.ramp_up = 0;
        o.passivity.control = false;
        return o;
    }
    /// @param fails  called before each publication; from then on there are none, or it throws
    RealTimeRun run(
        const HapticOptions& settings = {}, std::function<bool()> fails = [] { return false; },
        bool throws = false)
    {
        HapticLoop<float> loop(16, settings);
        const Publisher<float> publish = [&, sim = BedSimulation(bed), failed = false](
                                             ReducedOperator<float>& op, const HandPose& pose,
                                             double time, std::uint64_t sequence) mutable {
            failed = failed || fails();
            if (failed && throws) throw std::runtime_error("out of memory");
            if (failed) return false;
            sim.step(op, pose, time, sequence);
            ++published;
            return true;
        };
        return run_in_real_time<float>(loop, device, 16, publish, options);
    }
};

} // namespace

TEST_CASE(
    "the loop ticks in real time and takes operators and neither allocates nor locks nor faults")
{
    Fixture f;
    // A force that is felt after five periods is not of the first operator: that one is stale.
    f.device.enough = [&] {
        return f.device.reads > 100 && f.published > 5 && f.device.force > 0.1;
    };
    HapticOptions settings = Fixture::plain();
    settings.passivity.control = true;
    settings.passivity.allowance = 1; // [J]: what the hand did not give
    const RealTimeRun run = f.run(settings);
    REQUIRE(run.records.size() > 100);
    CHECK(f.device.reads == static_cast<long>(run.records.size()));
    CHECK(f.device.writes >= f.device.reads);
    CHECK(f.device.last == f.device.first); // allocations of the loop's thread
    CHECK(f.device.first >= 0);
    CHECK(f.device.last_locks == f.device.first_locks);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    CHECK(run.page_faults == 0);
#endif
    CHECK(run.steps > 3);
    CHECK(run.failed_steps == 0);
    CHECK(run.scheduling != "");
    CHECK_FALSE(run.bare_wake.empty());
    int taken = 0;
    for (std::size_t k = 1; k < run.records.size(); ++k) {
        const TickRecord &a = run.records[k - 1], &b = run.records[k];
        REQUIRE(b.time > a.time); // ticks that are missed are not made up for
        REQUIRE(b.wake >= 0);
        taken += b.proxy.new_operator;
    }
    CHECK(taken > 0);
    CHECK(f.device.pressed);
}

TEST_CASE("devices are read and written without an allocation")
{
    RecordedDevice recorded(parse_trajectory("time,x,y,z\n0,0,0,0\n1,1,0,0\n", "path.csv"));
    UdpDevice udp("0");
    const int from = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(udp.port()));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const long before = allocations;
    for (int k = 1; k <= 100; ++k) {
        const double t = 1e-3 * k;
        const UdpPacket p = pose_packet({std::uint32_t(k), k * 1000000, {t, 0, 0}, {0, 0, 0}});
        ::sendto(from, p.data(), p.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
        for (Device* device : {static_cast<Device*>(&recorded), static_cast<Device*>(&udp)}) {
            device->read(t);
            device->write({{0, 0, 1}, {0, 0, 0}}, t);
        }
    }
    CHECK(allocations == before);
    CHECK(udp.received() == 100);
    ::close(from);
}

TEST_CASE("a simulation that publishes no more takes the force away and the reason is reported")
{
    Fixture f;
    std::vector<SafetyState> reported;
    std::atomic<bool> stale{false};
    f.options.on_state = [&](SafetyState state) {
        reported.push_back(state);
        if (state == SafetyState::stale_operator) stale = true;
    };
    f.device.enough = [&] { return f.device.pressed && f.device.force == 0 && stale; };
    const RealTimeRun run = f.run(Fixture::plain(), [&] { return f.device.pressed.load(); });
    CHECK(run.failed_steps > 0);
    CHECK(run.records.back().state == SafetyState::stale_operator);
    CHECK(run.records.back().sent.force.norm() == 0);
    CHECK(f.device.pressed);
    CHECK(reported.back() == SafetyState::stale_operator);
}

TEST_CASE("a simulation slower than requested is reported once while the run lasts")
{
    // It can be no faster than it is: a thousand steps a second are requested, fifty made at most.
    Fixture f;
    std::vector<double> reported;
    f.options.operator_period = 1e-3;
    f.options.on_slow = [&](double rate) { reported.push_back(rate); };
    std::atomic<int> requested{0};
    f.device.enough = [&] { return requested > 70; };
    const RealTimeRun run = f.run(Fixture::plain(), [&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        ++requested;
        return false;
    });
    REQUIRE(reported.size() == 1);
    CHECK(reported[0] > 0);
    CHECK(reported[0] < 51);
    CHECK(run.step_rate < 51);
}

TEST_CASE(
    "a simulation that ends with an exception takes the force away and the reason is reported")
{
    Fixture f;
    std::atomic<bool> stopped{false};
    f.options.on_state = [&](SafetyState state) {
        if (state == SafetyState::simulation_stopped) stopped = true;
    };
    f.device.enough = [&] { return stopped && f.device.force == 0; };
    const RealTimeRun run = f.run(
        Fixture::plain(), [&] { return f.device.pressed.load(); }, true);
    CHECK(run.stopped == "out of memory");
    CHECK(run.records.back().state == SafetyState::simulation_stopped);
    CHECK(run.records.back().sent.force.norm() == 0);
    CHECK(f.device.force == 0);
}

TEST_CASE("whatever ends a run the last force tends to zero evenly")
{
    Fixture f;
    f.device.enough = [&] { return f.device.reads > 100 && f.device.force > 0.1; };
    const RealTimeRun run = f.run(Fixture::plain());
    const double last = run.records.back().sent.force.norm();
    CHECK(last > 0.1);
    CHECK(f.device.force == 0);
    CHECK(f.device.writes == static_cast<long>(run.records.size()) + 50);
    CHECK(f.device.most_off < 1.01 * std::max(last / 50, largest_drop(run)));
}

TEST_CASE("ticks that end for lack of time are reported to the simulation")
{
    Fixture f;
    HapticOptions settings;
    settings.proxy.budget = f.options.budget = 1e-9; // no sweep fits
    double most = 0;
    std::atomic<bool> enough{false};
    f.options.on_overload = [&](double share) {
        most = std::max(most, share);
        if (most > 0.1) enough = true;
    };
    f.device.enough = [&] { return enough.load(); };
    const RealTimeRun run = f.run(settings);
    CHECK(most > 0.1);
    for (const TickRecord& r : run.records)
        CHECK(r.proxy.sweeps == 0);
}

TEST_CASE("a run that is stopped ends soon")
{
    Fixture f;
    f.device.stop = true;
    CHECK(f.run().records.size() <= 1);
}

TEST_CASE("a tick that is missed is reported by what made it late")
{
    const auto tick = [](double wake, double cpu, double compute, long products = 500) {
        TickRecord r;
        r.proxy.products = products;
        r.wake = wake;
        r.cpu = cpu;
        r.compute = compute;
        return r;
    };
    const std::vector<TickRecord> records = {
        tick(1e-5, 3e-4, 4e-4),         // in time
        tick(1e-5, 1.1e-3, 2e-3, 4000), // our own work
        tick(1e-5, 5e-3, 5e-3, 225),    // the machine below stood
        tick(9e-4, 3e-4, 3e-4),         // begun late
        tick(3e-3, 3e-4, 3e-4),         // begun later still
        tick(1e-5, 3e-4, 2e-3),         // others had the processor
    };
    const HapticLoop<float> loop(1, {});
    const HapticSummary s = summarise<float>(records, loop, 1e-3, true);
    CHECK(s.missed.compute == 1);
    CHECK(s.missed.host == 1);
    CHECK(s.missed.wake == 2);
    CHECK(s.missed.preempted == 1);
}

TEST_CASE(
    "a force that control takes away in a tick is reported though none was computed to change")
{
    std::vector<TickRecord> records(5);
    for (std::size_t k = 0; k < records.size(); ++k) {
        records[k].time = 1e-3 * double(k);
        records[k].state = SafetyState::running;
        records[k].computed.force = {0, 0, 0.8};
        records[k].sent.force = {0, 0, k == 2 ? 0.14 : 0.8};
    }
    const HapticLoop<float> loop(1, {});
    const HapticSummary s = summarise<float>(records, loop, 1e-3, false);
    CHECK(s.largest_change == 0);
    CHECK(s.largest_change_sent == doctest::Approx(0.66));
    // What a fault takes is felt, too; and what comes after a tick that was missed.
    records[4].state = SafetyState::too_fast;
    records[4].computed.force = records[4].sent.force = {0, 0, 0};
    CHECK(summarise<float>(records, loop, 1e-3, false).largest_change_sent == doctest::Approx(0.8));
    CHECK(s.largest_rise_sent == doctest::Approx(0.66));
    CHECK(s.ticks_in[std::size_t(SafetyState::running)] == 5);
    records.erase(records.begin() + 3);
    CHECK(summarise<float>(records, loop, 1e-3, false).largest_change_sent ==
          doctest::Approx(0.66));
}

TEST_CASE("percentiles are numbers that occur")
{
    std::vector<double> x;
    for (int i = 1; i <= 1000; ++i)
        x.push_back(i);
    const Percentiles p = percentiles(x);
    CHECK(p.p50 == 500);
    CHECK(p.p99 == 990);
    CHECK(p.p999 == 999);
    CHECK(p.max == 1000);
    CHECK(percentiles({}).max == 0);
}
