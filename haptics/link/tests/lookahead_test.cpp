#include "haptics/link/settings.hpp"
#include "haptics/loop/proxy_loop.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// Of the example's rod, pressed 30 mm, which it lies on loosely: friction alone holds it along its
/// axis, so that in W a contact moves by 20 m for a newton. Then the hand moves on, an operator
/// each 10 ms; the full simulation continues in steps of a tick from where that was made.
struct Predicted {
    double worst = 0; ///< error of a tick
    int wrong = 0;    ///< ticks above 1 %
    double fall = 0;  ///< largest change of the full force in a tick, while it moves on [N]
};

template <class Shift> Predicted predict(const Shift& shift)
{
    const Scene scene = read_scene(AMONTONS_SOURCE_DIR "/examples/haptic_rod/scene.json");
    const std::vector<Obstacle> balls = build_obstacles(scene);
    const HapticSettings set = make_settings(scene.haptic, device_profile(scene.haptic.device), 0);
    LinkOptions by_periods = set.link, by_ticks = set.link;
    by_periods.condense.latency = 0;
    by_ticks.condense.period = set.loop.period;
    const auto link = make_link(scene, balls, by_periods);
    ProxyOptions exact;
    exact.tolerance = 1e-8;
    exact.max_sweeps = 5000;
    constexpr int press = 100, last = 500;
    const auto device = [&](int tick) {
        HandPose pose = link->start();
        pose.position.z() -= 3e-2 * std::min(tick, press) / press;
        pose.position += shift(std::max(0, tick - press));
        return pose;
    };
    Predicted out;
    for (int k = 0; k < last; k += 10) {
        REQUIRE(link->step(device(k)));
        ReducedOperator<double> op(300);
        REQUIRE(link->publish(op, 0, 1));
        const auto full = make_link(scene, balls, by_ticks);
        REQUIRE(full->take_over(*link));
        ProxyLoop<double> loop(300, exact);
        REQUIRE(loop.take(op, 0));
        Vec3 before = full->force().force;
        for (int i = 1; i <= 10; ++i) {
            const Vec3 force = loop.tick(device(k + i), 1e-3 * i).wrench.force;
            REQUIRE(full->step(device(k + i)));
            const Vec3 now = full->force().force;
            const double error = (force - now).norm() / std::max(now.norm(), 0.1);
            out.worst = std::max(out.worst, error);
            out.wrong += error > 0.01;
            if (k >= press) out.fall = std::max(out.fall, (now - before).norm());
            before = now;
        }
    }
    MESSAGE("error " << out.worst << ", " << out.wrong << " ticks above 1 %, full force falls by "
                     << out.fall << " N in a tick");
    return out;
}

} // namespace

TEST_CASE("a rod among balls is predicted in each tick where it falls and where the hand turns" *
          doctest::test_suite("slow"))
{
    // Along its axis, across, and back, with as long a displacement in a tick as between two samples.
    const auto leg = [](int tick, int from, int to) {
        return 1e-4 * std::clamp(tick - from, 0, to - from);
    };
    const Predicted f = predict([&](int tick) {
        return Vec3(leg(tick, 0, 200) - leg(tick, 300, 350), leg(tick, 200, 300), 0);
    });
    CHECK(f.fall > 0.01);
    CHECK(f.worst < 0.01);
}

TEST_CASE("a rod among balls is predicted on an arc but for the tick in which it falls" *
          doctest::test_suite("slow"))
{
    // Where it falls a tick sooner or later the whole fall is the error.
    constexpr double radius = 0.02, way = 9e-5;
    const Predicted f = predict([&](int tick) -> Vec3 {
        const double angle = way * tick / radius;
        return radius * Vec3(std::sin(angle), 1 - std::cos(angle), 0);
    });
    CHECK(f.fall > 0.01);
    CHECK(f.wrong <= 3); // [regression] our own run
}
