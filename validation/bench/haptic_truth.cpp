// How true is the reduced operator? A handle is moved at 0.1 m/s: pressed and dragged, or, of a
// wire, brought to a time of the scene's path and pushed on. Forces of the full simulation, stepped
// at every tick, against those of operators made at 100 and at 25 Hz, by the distance from the pose
// they were made for: |F_haptic - F_full| / max(|F_full|, 0.1 N). F_full is that of a full
// simulation that continues from where the operator was made (what the reduction misses), or that
// was stepped at every tick from the start (and what steps of a period miss, too: slip depends on the history
// them).
//
//   build/release/bin/haptic_truth examples/hapco/hexa.json [depth [m]]
//   build/release/bin/haptic_truth examples/haptic_catheter/scene.json [from [s]]
//
// With the trace of a run (amontons haptic SCENE --virtual-time --output DIR) instead: the full
// simulation at every tick's pose, and how the force changes from tick to tick in both.
//
//   build/release/bin/haptic_truth examples/haptic_rod/scene.json DIR/haptics.csv

#include "haptics/link/settings.hpp"
#include "haptics/time/summary.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <numeric>
#include <string>
#include <string_view>

using namespace amontons;

namespace {

constexpr double kTick = 1e-3, kSpeed = 0.1; // [s], [m/s]
constexpr int kPress = 100, kDrag = 300;     // ticks
constexpr double kWrong = 0.01;              // error that is counted [-]
constexpr double kJump = 0.02; // of the full force in a tick of 0.1 mm, by the same measure [-]

struct World {
    Scene scene;
    std::vector<Obstacle> obstacles;
    double depth = 0; ///< pressed [m]; of a wire: from that time on [s]

    HapticSettings settings(int ticks) const
    {
        HapticInput input = scene.haptic;
        input.simulation_rate = 1 / (ticks * kTick);
        HapticSettings s = make_settings(input, device_profile(input.device), 0);
        s.link.condense.latency = 0;
        return s;
    }
    std::unique_ptr<HandleLink> link(int ticks) const
    {
        return make_link(scene, obstacles, settings(ticks).link);
    }
    /// Down to the depth, then along x; of a wire: along it.
    HandPose device_at(const HandleLink& link, int tick) const
    {
        HandPose pose = link.start();
        if (!link.axis().isZero()) {
            const Vec6 x = link.path(depth);
            pose.position += x.head<3>() + kSpeed * kTick * tick * link.axis();
            pose.rotation = turn(x.tail<3>());
            return pose;
        }
        pose.position.z() -= depth * std::min(1.0, tick / static_cast<double>(kPress));
        pose.position.x() += kSpeed * kTick * std::max(0, tick - kPress);
        return pose;
    }
    /// To where the motion begins.
    void approach(HandleLink& link) const
    {
        link.step(link.start());
        if (link.axis().isZero()) return;
        for (double t = 0; t < depth; t += scene.time.step) {
            const Vec6 x = link.path(std::min(t + scene.time.step, depth));
            HandPose pose = link.start();
            pose.position += x.head<3>();
            pose.rotation = turn(x.tail<3>());
            if (!link.step(pose)) std::printf("%g s: %s\n", t, link.refusal().c_str());
        }
    }
};

std::vector<Vec3> full_forces(const World& world)
{
    const std::unique_ptr<HandleLink> link = world.link(1);
    world.approach(*link);
    std::vector<Vec3> force;
    for (int k = 0; k <= kPress + kDrag; ++k) {
        if (!link->step(world.device_at(*link, k)))
            std::printf("tick %d: %s\n", k, link->refusal().c_str());
        force.push_back(link->force().force);
    }
    return force;
}

void print_errors(double distance, std::vector<double> error)
{
    if (error.empty()) return;
    std::sort(error.begin(), error.end());
    const auto at = [&](double share) {
        return error[static_cast<std::size_t>(share * static_cast<double>(error.size() - 1))];
    };
    const auto above =
        std::count_if(error.begin(), error.end(), [](double e) { return e > kWrong; });
    std::printf("  %8.2f     %.2e   %.2e   %.2e   %5.1f %%\n", distance, at(0.5), at(0.9),
                error.back(),
                100.0 * static_cast<double>(above) / static_cast<double>(error.size()));
}

/// Whether the full simulation snaps between two ticks: contacts released, or the wire does.
bool snaps(const std::vector<Vec3>& full, int from, int to)
{
    for (auto i = static_cast<std::size_t>(from) + 1; i <= static_cast<std::size_t>(to); ++i)
        if ((full[i] - full[i - 1]).norm() > kJump * std::max(full[i - 1].norm(), 0.1)) return true;
    return false;
}

/// Errors by distance, in ticks; and of the periods in which nothing snaps.
struct Errors {
    std::vector<std::vector<double>> by_tick;
    std::vector<double> smooth;
    int snapped = 0;

    explicit Errors(int ticks) : by_tick(static_cast<std::size_t>(ticks) + 1) {}
    /// @param loop, full  forces in a period, at its ends, too
    void add(const std::vector<Vec3>& loop, const std::vector<Vec3>& full)
    {
        const bool jumps = snaps(full, 0, static_cast<int>(full.size()) - 1);
        snapped += jumps;
        for (std::size_t j = 0; j < loop.size(); ++j) {
            if (full[j].norm() == 0 && loop[j].norm() == 0) continue;
            const double wrong = (loop[j] - full[j]).norm() / std::max(full[j].norm(), 0.1);
            by_tick[j].push_back(wrong);
            if (j > 0 && !jumps) smooth.push_back(wrong);
        }
    }
    void print(const char* against, int periods) const
    {
        const std::size_t ticks = by_tick.size() - 1;
        std::printf(" against the full simulation %s\n"
                    "  distance [mm]   median      p90        max   above 1 %%\n",
                    against);
        const double way = 1e3 * kSpeed * kTick;
        for (std::size_t j = 0; j <= ticks; j += std::max<std::size_t>(1, ticks / 10))
            print_errors(way * static_cast<double>(j), by_tick[j]);
        // All ticks but those at the poses of operators, which are the next one's.
        std::vector<double> all;
        for (std::size_t j = 1; j <= ticks; ++j)
            all.insert(all.end(), by_tick[j].begin(), by_tick[j].end());
        std::printf("  of all %zu ticks:\n", all.size());
        print_errors(way * static_cast<double>(ticks), std::move(all));
        std::printf(
            "  of the %zu in periods without a jump of the full force (%d of %d have one):\n",
            smooth.size(), snapped, periods);
        print_errors(way * static_cast<double>(ticks), smooth);
    }
};

void compare(const World& world, int ticks, const std::vector<Vec3>& full)
{
    const int most = world.scene.haptic.contacts;
    const std::unique_ptr<HandleLink> link = world.link(ticks);
    world.approach(*link);
    Errors from_start(ticks), from_here(ticks);
    int none = 0, not_solved = 0, contacts = 0, periods = 0;
    for (int k = 0; k + ticks <= kPress + kDrag; k += ticks) {
        link->step(world.device_at(*link, k));
        ReducedOperator<double> op(most);
        if (!link->publish(op, k * kTick, std::uint64_t(k) + 1)) {
            ++none;
            continue;
        }
        ++periods;
        contacts = std::max(contacts, op.contacts);
        const std::unique_ptr<HandleLink> onward = world.link(1); // from here
        onward->take_over(*link);
        ProxyOptions options;
        options.tolerance = 1e-9;
        options.max_sweeps = 1000;
        ProxyLoop<double> loop(most, options);
        loop.take(op, k * kTick);
        std::vector<Vec3> reduced, here;
        for (int j = 0; j <= ticks; ++j) {
            const HandPose device = world.device_at(*link, k + j);
            const ProxyTick tick = loop.tick(device, (k + j) * kTick);
            not_solved += !tick.converged;
            reduced.push_back(tick.wrench.force);
            if (j > 0 && !onward->step(device))
                std::printf("tick %d from %d: %s\n", k + j, k, onward->refusal().c_str());
            here.push_back((j > 0 ? *onward : *link).force().force);
        }
        from_here.add(reduced, here);
        from_start.add(reduced, {full.begin() + k, full.begin() + k + ticks + 1});
    }
    std::printf("operators at %g Hz: %d contacts at most, %d not published, %d ticks not solved\n",
                1 / (ticks * kTick), contacts, none, not_solved);
    from_here.print("that continues from the operator's state", periods);
    from_start.print("of steps of a tick from the start", periods);
}

struct TracedTick {
    double time = 0;
    HandPose handle;
    Vec3 force;
};

std::vector<TracedTick> read_trace(const char* file)
{
    std::vector<TracedTick> ticks;
    std::ifstream in(file);
    std::string line;
    std::getline(in, line); // names
    while (std::getline(in, line)) {
        double v[10];
        const char* at = line.c_str();
        for (double& x : v) {
            char* end = nullptr;
            x = std::strtod(at, &end);
            at = end + (*end == ',');
        }
        ticks.push_back({v[0], {}, Vec3(v[7], v[8], v[9])});
        ticks.back().handle.position = Vec3(v[1], v[2], v[3]);
        ticks.back().handle.rotation = turn(Vec3(v[4], v[5], v[6]));
    }
    if (ticks.empty()) throw InputError({{file, "", "no tick", "a trace of amontons haptic"}});
    return ticks;
}

void compare_changes(const World& world, const std::vector<TracedTick>& ticks)
{
    const std::unique_ptr<HandleLink> link = world.link(1);
    int refused = 0;
    Vec3 before = Vec3::Zero();
    std::vector<double> of_full(ticks.size(), 0), of_loop(ticks.size(), 0);
    for (std::size_t k = 0; k < ticks.size(); ++k) {
        refused += !link->step(ticks[k].handle);
        const Vec3 now = link->force().force;
        if (k > 0) {
            of_full[k] = (now - before).norm();
            of_loop[k] = (ticks[k].force - ticks[k - 1].force).norm();
        }
        before = now;
    }
    std::printf("%zu ticks, %d refused by the full simulation\n"
                "  largest changes of the force from tick to tick [N], and when [s]\n"
                "      full                    loop\n",
                ticks.size(), refused);
    const auto by_size = [&](const std::vector<double>& change) {
        std::vector<std::size_t> order(change.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::ranges::sort(order, std::greater{}, [&](std::size_t k) { return change[k]; });
        return order;
    };
    const std::vector<std::size_t> full = by_size(of_full), loop = by_size(of_loop);
    for (std::size_t i = 0; i < std::min<std::size_t>(10, ticks.size()); ++i)
        std::printf("  %9.5f at %7.3f    %9.5f at %7.3f\n", of_full[full[i]], ticks[full[i]].time,
                    of_loop[loop[i]], ticks[loop[i]].time);
}

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::fprintf(stderr, "haptic_truth SCENE [depth, or time of a wire's path, or a trace]\n");
        return 2;
    }
    try {
        World world;
        world.scene = read_scene(argv[1]);
        place_introducers(world.scene);
        world.obstacles = build_obstacles(world.scene);
        if (argc > 2 && std::string_view(argv[2]).ends_with(".csv")) {
            compare_changes(world, read_trace(argv[2]));
            return 0;
        }
        world.depth = argc > 2 ? std::atof(argv[2]) : 0.004;
        const std::vector<Vec3> full = full_forces(world);
        double most = 0;
        for (const Vec3& f : full)
            most = std::max(most, f.norm());
        std::printf("full force %.4f N at tick %d, %.4f N at the end, %.4f N at most\n",
                    full[kPress].norm(), kPress, full.back().norm(), most);
        for (const int ticks : {10, 40})
            compare(world, ticks, full);
    } catch (const InputError& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
    return 0;
}
