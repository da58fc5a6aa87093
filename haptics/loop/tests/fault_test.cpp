#include "haptics/loop/haptic_loop.hpp"
#include "haptics/tests/scenes.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <optional>

using namespace amontons;
using namespace amontons::test;

// The whole tick, from sample to force, where something fails. Virtual time.

namespace {

constexpr double kTick = 1e-3;
constexpr double kMostForce = 12; // [N]

/// A point on a spring over a rigid floor at z = 0, operators at 50 Hz for where the loop has it.
struct Rig {
    Bed bed;
    HapticLoop<double> loop;
    TripleBuffer<ReducedOperator<double>> buffer{ReducedOperator<double>(1)};
    int k = 0;
    double validity = 0; // of the operators [m]
    HandPose device;
    TickRecord record;

    static HapticOptions options(bool control)
    {
        HapticOptions o;
        o.period = kTick;
        o.clutch = true;
        o.limiter.max_force = kMostForce;
        o.limiter.max_slew = kMostForce / 2e-3;
        o.passivity.control = control;
        o.passivity.max_damping = 30;
        o.passivity.resolution = 1e-5;
        o.passivity.least_mass = 0.2;
        return o;
    }
    explicit Rig(bool control) : loop(1, options(control))
    {
        bed.points = {{0, 0, 0}};
        bed.k = 1000;
    }
    double time() const { return k * kTick; }
    void hand_over(const HandPose& handle)
    {
        publish(buffer.back(), bed, handle, time(), std::uint64_t(k + 1));
        buffer.back().validity = validity;
        buffer.publish();
    }
    /// @param z  of the device, null: no sample [m]
    double tick(std::optional<double> z)
    {
        if (k % 20 == 0) hand_over(loop.handle_of(device));
        DeviceSample sample;
        sample.time = time();
        sample.valid = z.has_value();
        if (z) sample.pose.position[2] = device.position[2] = *z;
        record = loop.tick(sample, buffer, time());
        ++k;
        return record.sent.force[2];
    }
    /// Down to -depth until t = 0.6 s, there until `end`.
    void press(double depth, double end)
    {
        while (time() < end)
            tick(-depth * std::min(1.0, time() / 0.6));
    }
};

} // namespace

TEST_CASE("a device that sends nothing while its motion is damped gets no force")
{
    // Away at 0.95 m/s: what was earned does not pay for that, and the motion is damped.
    Rig rig(true);
    while (rig.time() < 0.02)
        rig.tick(-0.009 * rig.time() / 0.02);
    while (rig.time() < 0.8)
        rig.tick(-0.009);
    double last = 0;
    for (int n = 1; n <= 7; ++n)
        last = rig.tick(-0.009 + 0.00095 * n);
    CHECK(last < -0.5); // damped, or this shows nothing
    for (int n = 0; n < 200; ++n) {
        const double f = rig.tick({});
        CHECK(std::abs(f) <= std::abs(last) + 1e-12);
        if (n >= 60) REQUIRE(f == 0);
        last = f;
    }
    CHECK(rig.record.state == SafetyState::device_lost);
}

TEST_CASE("in every fault the controller reduces the force and adds nothing")
{
    Rig rig(true);
    while (rig.time() < 0.02)
        rig.tick(-0.009 * rig.time() / 0.02);
    while (rig.time() < 0.8)
        rig.tick(-0.009);
    double last = std::abs(rig.tick(-0.00805)), z = -0.00805;
    for (int n = 0; n < 200; ++n) { // too fast now, on and on
        const double f = std::abs(rig.tick(z += 1.2e-3));
        REQUIRE(rig.record.state == SafetyState::too_fast);
        CHECK(f <= last + 1e-12);
        if (n >= 50) REQUIRE(f == 0);
        last = f;
    }
}

TEST_CASE("after a jump of the device the handle is where it was and the force comes back slowly")
{
    for (const double jump : {-1.0, 1.0, -0.06}) {
        CAPTURE(jump);
        Rig rig(false);
        rig.press(0.004, 0.8);
        const HandPose before = rig.record.handle;
        const double held = rig.record.sent.force[2];
        CHECK(held == doctest::Approx(4));
        double last = held;
        const double z = -0.004 + jump;
        while (rig.time() < 2) {
            const double f = rig.tick(z);
            CHECK(f <= held + 1e-9);
            CHECK(f - last <= held * kTick / 0.5 + 1e-9);
            if (rig.time() > 0.86 && rig.time() < 0.99) CHECK(f == 0);
            last = f;
        }
        CHECK(rig.record.state == SafetyState::running);
        CHECK((rig.record.handle.position - before.position).norm() < 1e-12);
        CHECK(last == doctest::Approx(held));
        // And it moves on with the device.
        while (rig.time() < 2.1)
            last = rig.tick(z - 1e-5 * (rig.time() - 2) / kTick);
        CHECK(last == doctest::Approx(5).epsilon(0.01));
        CHECK(rig.loop.safety().faults() == 1);
    }
}

TEST_CASE("a force above the device's largest returns as a ramp up to the device's limit")
{
    // Through the floor too fast to be a jump: the handle is 60 mm below, 60 N are computed.
    for (const bool control : {false, true}) {
        CAPTURE(control);
        Rig rig(control);
        rig.press(0.004, 0.8);
        for (int n = 1; n <= 10; ++n)
            rig.tick(-0.004 - 0.0056 * n);
        REQUIRE(rig.record.state == SafetyState::too_fast);
        double last = 0;
        while (rig.time() < 1)
            last = rig.tick(-0.06);
        CHECK(last == 0);
        while (rig.time() < 3) {
            const double f = rig.tick(-0.06);
            CHECK(f - last <= kMostForce * kTick / 0.5 + 1e-9);
            last = f;
        }
        CHECK(rig.record.computed.force[2] == doctest::Approx(60).epsilon(0.01));
        if (control)
            CHECK(last < 0.1); // what the hand gave before the fault does not pay for it
        else
            CHECK(last == doctest::Approx(kMostForce));
    }
}

TEST_CASE("credit is kept over an operator that arrives late")
{
    Rig rig(true);
    rig.press(0.004, 0.8);
    const double held = rig.record.sent.force[2];
    TripleBuffer<ReducedOperator<double>> silent{ReducedOperator<double>(1)};
    DeviceSample sample;
    sample.valid = true;
    sample.pose.position[2] = -0.004;
    for (int n = 0; n < 200; ++n, ++rig.k)
        rig.record = rig.loop.tick(sample, silent, rig.time());
    REQUIRE(rig.record.state == SafetyState::stale_operator);
    CHECK(rig.record.sent.force.norm() == 0);
    const double end = rig.time() + 1;
    while (rig.time() < end)
        rig.tick(-0.004);
    CHECK(rig.record.sent.force[2] == doctest::Approx(held).epsilon(0.01));
}

TEST_CASE("operators that arrive before the device's first pose lose no force")
{
    // At the origin, where the loop's pose is before there is one, the tool would be in the floor:
    // an operator for elsewhere has jumped, the loop solved it by itself there, and the hand was to
    // feel the difference to no force fade.
    Rig rig(false);
    rig.bed.points = {{0, 0, -0.005}};
    rig.validity = 1e-3;
    DeviceSample sample;
    for (; rig.k < 400; ++rig.k) {
        if (rig.k % 20 == 0) rig.hand_over({{0, 0, 0.011}, {1, 0, 0, 0}});
        sample.time = rig.time();
        sample.valid = rig.k >= 50;
        rig.record = rig.loop.tick(sample, rig.buffer, rig.time());
        REQUIRE(rig.record.computed.force.norm() < 1e-12);
    }
    CHECK(rig.record.state == SafetyState::starting);
}
