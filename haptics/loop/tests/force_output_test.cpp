#include "haptics/loop/haptic_loop.hpp"
#include "haptics/tests/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <random>
#include <string>

using namespace amontons;
using namespace amontons::test;

// What is sent, whatever comes: random poses, clocks, operators and faults.

namespace {

constexpr double kLawTick = 1e-3;

struct RandomNumbers {
    std::mt19937 rng;
    double operator()(double low, double high)
    {
        return std::uniform_real_distribution<double>(low, high)(rng);
    }
    bool chance(double p) { return (*this)(0, 1) < p; }
};

/// The laws of ForceOutput, from what a tick reports.
struct Laws {
    HapticOptions options;
    Vec3 before{0, 0, 0}, computed_before{0, 0, 0};
    SafetyState state_before = SafetyState::no_operator;
    double largest_rise = 0;

    static bool is_fault(SafetyState s)
    {
        return s == SafetyState::stale_operator || s == SafetyState::device_lost ||
               s == SafetyState::too_fast || s == SafetyState::pose_jump ||
               s == SafetyState::not_a_number || s == SafetyState::simulation_stopped;
    }
    /// @param step  of the device in this tick, zero: no new pose [m]
    void check(const TickRecord& r, bool new_pose, const Vec3& step)
    {
        const Vec3 &s = r.sent.force, &c = r.computed.force;
        const double tiny = 1e-9;
        REQUIRE_FALSE(is_broken(r.sent));
        CHECK(s.norm() <= options.limiter.max_force + tiny);
        // It rises by at most 0.2 N more than what is computed, and does not turn over.
        const double rise = s.norm() - before.norm(),
                     computed_rise = std::max(0.0, c.norm() - computed_before.norm());
        CHECK(rise <= 0.2 + computed_rise + tiny);
        largest_rise = std::max(largest_rise, rise - computed_rise);
        if (s.dot(before) <= 0) CHECK(s.norm() <= 0.2 + (c - computed_before).norm() + tiny);
        // In a fault, and without a pose, it does not grow.
        if (is_fault(r.state) || !new_pose) CHECK(s.norm() <= before.norm() + tiny);
        // It exceeds neither what is computed nor what was sent, but for damping, which opposes the
        // motion.
        const double most = std::max(c.norm(), before.norm());
        if (s.norm() > most + tiny) {
            REQUIRE(new_pose);
            REQUIRE(step.norm() > 0);
            const Vec3 along = step.normalized();
            CHECK(s.dot(along) < 0);
            // Some damping taken away leaves a force within: the shortest such is across the
            // motion.
            CHECK((s - s.dot(along) * along).norm() <= most + tiny);
        }
        if (r.state == SafetyState::running) {
            CHECK(r.sent.force == r.computed.force);
            CHECK(r.sent.torque == r.computed.torque);
        }
        before = s;
        computed_before = c;
        state_before = r.state;
    }
};

} // namespace

TEST_CASE("whatever poses clocks operators and faults do a force never jumps up")
{
    double largest = 0;
    int limited = 0, faults = 0, damped = 0;
    for (unsigned seed = 1; seed <= 150; ++seed) {
        CAPTURE(seed);
        RandomNumbers random{std::mt19937(seed)};
        Laws laws;
        HapticOptions& o = laws.options;
        o.period = kLawTick;
        o.clutch = random.chance(0.8);
        o.safety.ramp_up = random.chance(0.5) ? 0.5 : random(0, 0.1);
        o.limiter.max_force = random.chance(0.5) ? 3.3 : 12;
        o.limiter.max_slew = random.chance(0.5) ? o.limiter.max_force / 2e-3 : 1e9;
        o.passivity.control = random.chance(0.8);
        o.passivity.max_damping = 30;
        o.passivity.resolution = 1e-5;
        o.passivity.least_mass = 0.05;
        o.passivity.horizon = random.chance(0.5) ? 1 : 4;
        HapticLoop<double> loop(1, o);
        TripleBuffer<ReducedOperator<double>> buffer{ReducedOperator<double>(1)};
        Bed bed;
        bed.points = {{0, 0, 0}};
        bed.mu = 0.4;
        double time = 0, operators_until = 0, silent_until = 0, next_operator = 0;
        double slow = random.chance(0.3) ? 1e-2 : 0; // from pose to pose
        double measured = -1;
        Vec3 x{0, 0, 0.002}, v{0, 0, 0}, target = x, last_sent_pose = x, last_step{0, 0, 0};
        HandPose reported;
        for (int k = 0; k < 1500; ++k) {
            time += kLawTick * (random.chance(0.02) ? std::floor(random(2, 20)) : 1);
            if (random.chance(0.01))
                target = {random(-0.01, 0.01), random(-0.01, 0.01), random(-0.008, 0.004)};
            const Vec3 accelerate = 900 * (target - x) - 30 * v;
            v += kLawTick * accelerate;
            x += kLawTick * v;
            if (random.chance(0.001)) x += 0.2 * Vec3(random(-1, 1), random(-1, 1), random(-1, 1));
            // Operators: late, none for a while, of another stiffness.
            if (random.chance(0.002)) operators_until = time + random(0.02, 0.4);
            if (time >= next_operator && time >= operators_until) {
                bed.k = random(200, 4000);
                publish(buffer.back(), bed, loop.handle_of(reported), time, std::uint64_t(k + 1));
                buffer.publish();
                next_operator = time + 0.02;
            }
            // Poses: none for a while, one that is missing, one that is no number.
            if (random.chance(0.003)) silent_until = time + random(0.001, 0.05);
            const bool silent = time < silent_until, missing = random.chance(0.01);
            DeviceSample sample;
            if (!silent && time - measured >= slow) {
                measured = time;
                reported.position = x;
            }
            const bool repeats = silent && time - measured < 0.01 && random.chance(0.9);
            sample.time = measured;
            sample.pose = reported;
            sample.valid = (!silent || repeats) && !missing;
            const bool broken = seed % 10 == 0 && k == 1200;
            if (broken) sample.pose.position[0] = std::nan("");
            const bool new_pose = sample.valid && !broken && measured == time;
            const Vec3 step = new_pose ? Vec3(reported.position - last_sent_pose) : Vec3(0, 0, 0);
            if (new_pose) last_sent_pose = reported.position;
            const TickRecord r = loop.tick(sample, buffer, time, seed % 10 == 5 && k > 1300);
            laws.check(r, new_pose, step);
            limited += r.state == SafetyState::limited;
            damped += r.sent.force.norm() > r.computed.force.norm() + 1e-6;
        }
        // The end of the run.
        double last = laws.before.norm();
        for (int n = 50; n > 0; --n) {
            const double f = loop.fade_out(double(n - 1) / n).force.norm();
            CHECK(f <= last);
            last = f;
        }
        CHECK(last == 0);
        largest = std::max(largest, laws.largest_rise);
        faults += int(loop.safety().faults());
    }
    CHECK(largest > 0.19); // the law is what holds it
    CHECK(limited > 1000);
    CHECK(damped > 100);
    CHECK(faults > 100);
}

TEST_CASE("poses that stop and poses that jump raise no force that control limits")
{
    // Pressed before the force was earned: control holds it down. Then the device falls silent, or
    // jumps.
    for (const bool jumps : {false, true})
        for (const bool repeated : {false, true}) {
            CAPTURE(jumps);
            CAPTURE(repeated);
            HapticOptions o;
            o.period = kLawTick;
            o.clutch = true;
            o.safety.ramp_up = 0;
            o.passivity.resolution = 5.5e-5;
            o.passivity.least_mass = 0.05;
            HapticLoop<double> loop(1, o);
            TripleBuffer<ReducedOperator<double>> buffer{ReducedOperator<double>(1)};
            Bed bed;
            bed.points = {
                {0, 0, -0.002}}; // the tool begins 2 mm inside: nothing of that was earned
            bed.k = 1000;
            double before = 0;
            DeviceSample sample;
            for (int k = 0; k < 300; ++k) {
                const double time = k * kLawTick;
                if (k % 20 == 0) {
                    publish(buffer.back(), bed, HandPose(), time, std::uint64_t(k + 1));
                    buffer.publish();
                }
                if (k < 200 || jumps) {
                    sample.time = time;
                    sample.valid = true;
                    sample.pose.position = {0, 0, (k % 2 ? 5.5e-5 : 0) + (k < 200 ? 0 : 0.2)};
                } else {
                    sample.valid = repeated && k < 210;
                }
                const TickRecord r = loop.tick(sample, buffer, time);
                const double f = r.sent.force.norm();
                if (k == 199) CHECK(f < 0.5 * r.computed.force.norm()); // held down
                if (k >= 200) CHECK(f <= before + 1e-12);
                before = f;
            }
        }
}

TEST_CASE("a force that is ramped up generates no energy without control either")
{
    // In and out twice a second from the start: 8.6 mJ if the ramp did not care.
    for (const bool ramp : {true, false}) {
        HapticOptions o;
        o.period = kLawTick;
        o.passivity.control = false;
        if (!ramp) o.safety.ramp_up = 0;
        HapticLoop<double> loop(1, o);
        TripleBuffer<ReducedOperator<double>> buffer{ReducedOperator<double>(1)};
        Bed bed;
        bed.points = {{0, 0, 0}};
        bed.k = 1000;
        DeviceSample sample;
        sample.valid = true;
        TickRecord r;
        int starting = 0;
        for (int k = 0; k < 600; ++k) {
            sample.time = k * kLawTick;
            sample.pose.position[2] = -0.004 * (1 - std::cos(4 * 3.14159265 * sample.time));
            if (k % 20 == 0) {
                publish(buffer.back(), bed, sample.pose, sample.time, std::uint64_t(k + 1));
                buffer.publish();
            }
            r = loop.tick(sample, buffer, sample.time);
            starting += r.state == SafetyState::starting;
        }
        if (ramp)
            CHECK(loop.passivity().most_energy() <= 1e-5); // else the tick's delay gives 0.3 mJ
        CHECK((starting > 490) == ramp);
        CHECK(r.sent.force.norm() > 0.2);
    }
}
