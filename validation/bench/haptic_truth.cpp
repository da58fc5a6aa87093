// How true is the reduced operator? A handle is pressed and dragged at 0.1 m/s. Forces of the full
// simulation, stepped at every tick, against those of operators made at 100 and at 25 Hz, by the
// distance from the pose they were made for: |F_haptic - F_full| / max(|F_full|, 0.1 N).
//
//   build/release/bin/haptic_truth examples/hapco/hexa.json [depth [m]]

#include "haptics/link/settings.hpp"
#include "haptics/summary.hpp"
#include "solver/scene/build.hpp"
#include "solver/scene/read.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

using namespace amontons;

namespace {

constexpr double kTick = 1e-3, kSpeed = 0.1; // [s], [m/s]
constexpr int kPress = 100, kDrag = 300;     // ticks

/// Down to the depth, then along x.
HandPose device_at(const HandPose& start, double depth, int tick)
{
    HandPose pose = start;
    pose.position.z() -= depth * std::min(1.0, tick / static_cast<double>(kPress));
    pose.position.x() += kSpeed * kTick * std::max(0, tick - kPress);
    return pose;
}

HapticSettings settings(const Scene& scene, int ticks)
{
    HapticInput input = scene.haptic;
    input.simulation_rate = 1 / (ticks * kTick);
    HapticSettings s = make_settings(input, device_profile(input.device), 0);
    s.link.condense.latency = 0;
    return s;
}

std::vector<Vec3> full_forces(const Scene& scene, const std::vector<Obstacle>& obstacles,
                              double depth)
{
    BodyLink link(scene, obstacles, settings(scene, 1).link);
    std::vector<Vec3> force;
    for (int k = 0; k <= kPress + kDrag; ++k) {
        if (!link.step(device_at(link.start(), depth, k)))
            std::printf("tick %d: %s\n", k, link.report().refusal.c_str());
        force.push_back(link.held().force().force);
    }
    return force;
}

void compare(const Scene& scene, const std::vector<Obstacle>& obstacles, double depth, int ticks,
             const std::vector<Vec3>& full)
{
    const int most = scene.haptic.contacts;
    BodyLink link(scene, obstacles, settings(scene, ticks).link);
    std::vector<std::vector<double>> error(static_cast<std::size_t>(ticks) + 1);
    for (int k = 0; k + ticks <= kPress + kDrag; k += ticks) {
        link.step(device_at(link.start(), depth, k));
        ReducedOperator<double> op(most);
        link.publish(op, k * kTick, std::uint64_t(k) + 1);
        ProxyOptions options;
        options.tolerance = 1e-9;
        options.max_sweeps = 1000;
        ProxyLoop<double> loop(most, options);
        loop.take(op, k * kTick);
        for (int j = 0; j <= ticks; ++j) {
            const ProxyTick tick =
                loop.tick(device_at(link.start(), depth, k + j), (k + j) * kTick);
            const Vec3& exact = full[static_cast<std::size_t>(k + j)];
            if (exact.norm() > 0 || tick.wrench.force.norm() > 0)
                error[static_cast<std::size_t>(j)].push_back((tick.wrench.force - exact).norm() /
                                                             std::max(exact.norm(), 0.1));
        }
    }
    std::printf("operators at %g Hz\n  distance [mm]   median      p99        max\n",
                1 / (ticks * kTick));
    for (int j = 0; j <= ticks; j += std::max(1, ticks / 10)) {
        const Percentiles p = percentiles(error[static_cast<std::size_t>(j)]);
        std::printf("  %8.2f     %.2e   %.2e   %.2e\n", 1e3 * kSpeed * kTick * j, p.p50, p.p99,
                    p.max);
    }
}

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::fprintf(stderr, "haptic_truth SCENE [depth]\n");
        return 2;
    }
    try {
        const Scene scene = read_scene(argv[1]);
        const double depth = argc > 2 ? std::atof(argv[2]) : 0.004;
        const std::vector<Obstacle> obstacles = build_obstacles(scene);
        const std::vector<Vec3> full = full_forces(scene, obstacles, depth);
        std::printf("full force at the end of pressing %.4f N, of dragging %.4f N\n",
                    full[kPress].norm(), full.back().norm());
        for (const int ticks : {10, 40})
            compare(scene, obstacles, depth, ticks, full);
    } catch (const InputError& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
    return 0;
}
