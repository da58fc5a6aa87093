// Time of a step of solids in contact, everything converged to 1e-8.
//
//     body_step_bench [CSV [PART]]   a table, and as a file (default docs/results/body_step.csv);
//                                    PART: only the scenes whose name contains it
//
// Blocks that slide down an incline and stand on each other are of the sizes of SOFA's scenes in
// docs/results/README.md; the pile is 30 balls that have come to rest; "mesh" is one scene on ever
// finer meshes with about the same contacts, all of whose columns are kept. Medians of CPU time of
// the thread, without what is written.

#include "mesh/base/error.hpp"
#include "mesh/base/memory.hpp"
#include "mesh/generate/plane.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fmt/format.h>
#include <random>
#include <string>
#include <vector>

using namespace amontons;

namespace {

double cpu_seconds()
{
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

struct Record : StepObserver {
    std::vector<double> seconds;
    std::vector<PhaseSeconds> phases; ///< wall times since the start of the run
    double before = 0, contacts = 0, worst = 0;
    void on_step(const StepRecord& r) override
    {
        const double now = cpu_seconds();
        if (r.step > 0) {
            seconds.push_back(now - before);
            phases.push_back(r.phases);
        }
        contacts = double(r.contacts.size());
        worst = std::max(worst, r.certificate.error);
        before = cpu_seconds();
    }
};

/// Where the time is, in wall time of a step [ms].
std::string shares(const std::vector<PhaseSeconds>& all, std::size_t skip)
{
    if (all.size() < skip + 2) return "";
    const PhaseSeconds &a = all[skip], &b = all.back();
    const double per = 1e3 / double(all.size() - 1 - skip);
    return fmt::format("{:.2f} free motion, {:.2f} detection, {:.2f} W, {:.2f} solve, {:.2f} "
                       "correction",
                       per * (b.free_motion - a.free_motion), per * (b.detection - a.detection),
                       per * (b.compliance - a.compliance),
                       per * (b.contact_solve - a.contact_solve),
                       per * (b.correction - a.correction));
}

const char* const kFloor = R"("floor": {"kind": "obstacle", "surface": {"generate": "plane"}})";
const char* const kPlain = R"("output": {"picture": false, "plots": false})";

std::string block(const std::string& name, int side, const std::string& motion, double x, double z)
{
    return fmt::format(
        R"("{0}": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.1],
        "cells": [{1}, {1}, {1}], "element": "T4"}}, "youngs_modulus": 1e5, "poisson_ratio": 0.3,
        "density": 1000, "motion": "{2}", "start": {{"place": [{3}, 0, {4}]}}}})",
        name, side - 1, motion, x, z);
}

std::string incline(int side, const std::string& motion)
{
    return fmt::format(R"("bodies": {{{}, {}}}, "gravity": [4.905, 0, -8.496],
        "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
        "time": {{"kind": "dynamic", "step": 0.01, "end": 0.5}}, {})",
                       block("block", side, motion, 0, 0.05), kFloor, kPlain);
}

std::string stack(const std::string& motion)
{
    return fmt::format(R"("bodies": {{{}, {}, {}}}, "gravity": [0, 0, -9.81],
        "contact": [{{"between": ["*", "*"], "friction": 0.5}}],
        "time": {{"kind": "dynamic", "step": 0.01, "end": 0.5}}, {})",
                       block("low", 5, motion, 0, 0.05), block("high", 5, motion, 0.01, 0.15),
                       kFloor, kPlain);
}

std::string pile(int around)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> shift(-0.01, 0.01);
    std::string bodies = kFloor;
    const char* walls[] = {"left", "right", "front", "back"};
    const double side[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    for (int w = 0; w < 4; ++w)
        bodies +=
            fmt::format(R"(, "{}": {{"kind": "obstacle", "surface": {{"generate": "plane",
            "centre": [{}, {}, 0], "axis": [{}, {}, 0]}}}})",
                        walls[w], 0.22 * side[w][0], 0.22 * side[w][1], -side[w][0], -side[w][1]);
    for (int k = 0; k < 30; ++k)
        bodies += fmt::format(R"(, "ball_{}": {{"kind": "solid", "mesh": {{"generate": "ball",
            "radius": 0.055, "around": {}, "element": "T4"}}, "youngs_modulus": 2e5,
            "poisson_ratio": 0.3, "density": 1000, "stiffness_damping": 1e-3,
            "start": {{"place": [{}, {}, {}]}}}})",
                              k, around, -0.13 + 0.13 * (k % 3) + shift(random),
                              -0.13 + 0.13 * (k / 3 % 3) + shift(random), 0.07 + 0.14 * (k / 9));
    return fmt::format(R"("bodies": {{{}}}, "gravity": [0, 0, -9.81],
        "contact": [{{"between": ["*", "*"], "friction": 0.4, "reach": 0.005}}],
        "time": {{"kind": "dynamic", "step": 0.01, "end": 1}}, {})",
                       bodies, kPlain);
}

/// A coarse foot of 49 contacts under a block of n x n cells and some layers of the same, dragged.
std::string mesh(int n, int layers, double step)
{
    const double height = double(layers) / n;
    return fmt::format(R"("bodies": {{"block": {{"kind": "solid", "mesh": {{"generate": "box",
        "size": [1, 1, {2}], "centre": [0, 0, {3}], "cells": [{0}, {0}, {4}], "element": "T4"}},
        "youngs_modulus": 1e6,
        "poisson_ratio": 0.3, "hold": [{{"set": "z_max"}}]}},
        "foot": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.5, 0.5, 0.1],
        "cells": [6, 6, 1], "element": "T4"}}, "youngs_modulus": 1e6, "poisson_ratio": 0.3,
        "start": {{"place": [0, 0, -0.55]}},
        "hold": [{{"set": "z_min", "x": [[0, 0], [1, 0.003]], "y": 0, "z": [[0, 0.001], [1, 0.002]]}}]}}}},
        "contact": [{{"between": ["foot", "block"], "surfaces": ["z_max", "z_min"], "friction": 0.3,
                      "sliding": "small"}}],
        "time": {{"step": {5}, "end": 1}}, {1})",
                       n, kPlain, height, 0.5 * (height - 1), layers, step);
}

void measure(FILE* csv, const std::string& part, const std::string& name, const std::string& rest,
             std::size_t skip)
{
    if (name.find(part) == std::string::npos) return;
    const Scene scene = parse_scene("{\"schema\": 1, " + rest + "}", name, {});
    std::vector<Obstacle> obstacles;
    for (const ObstacleInput& o : scene.obstacles)
        obstacles.push_back({o.name, make_plane({o.surface.centre, o.surface.axis, 1})});
    const std::unique_ptr<Simulation> simulation = make_simulation(scene, std::move(obstacles));
    int nodes = 0;
    for (const BodyPlan& b : simulation->plan())
        nodes += b.unknowns / 3;
    Record record;
    const std::atomic<bool> never{false};
    const RunSummary s = simulation->run(record, never);
    std::vector<double> t(record.seconds.begin() +
                              std::ptrdiff_t(std::min(skip, record.seconds.size())),
                          record.seconds.end());
    std::sort(t.begin(), t.end());
    const double median = t.empty() ? 0 : 1e3 * t[t.size() / 2];
    const double p90 = t.empty() ? 0 : 1e3 * t[t.size() * 9 / 10];
    const std::string line =
        fmt::format("{},{},{:.0f},{:.2f},{:.2f},{:.3f},{:.1e},{}\n", name, nodes, record.contacts,
                    median, p90, s.seconds.offline, record.worst, s.status);
    fmt::print("{}", line);
    fmt::print("    {}\n", shares(record.phases, skip));
    fmt::print(csv, "{}", line);
    std::fflush(stdout);
    std::fflush(csv);
}

} // namespace

int main(int argc, char** argv)
try {
    if (argc > 1 && argv[1][0] == '-') {
        fmt::print(stderr, "body_step_bench [TABLE.csv] [part of a scene's name]\n");
        return 2;
    }
    const std::string path = argc > 1 ? argv[1] : "docs/results/body_step.csv";
    const std::string part = argc > 2 ? argv[2] : "";
    FILE* csv = std::fopen(path.c_str(), "w");
    if (!csv) {
        fmt::print(stderr, "{} cannot be written\n", path);
        return 2;
    }
    const char* head = "scene,nodes,contacts,median [ms],p90 [ms],offline [s],worst error,status\n";
    fmt::print("{}", head);
    fmt::print(csv, "{}", head);
    for (const char* motion : {"linear", "corotational"})
        for (const int side : {4, 6, 8, 10})
            measure(csv, part, fmt::format("incline {}", motion), incline(side, motion), 10);
    for (const char* motion : {"linear", "corotational"})
        measure(csv, part, fmt::format("stack {}", motion), stack(motion), 10);
    measure(csv, part, "pile of 30 balls", pile(8), 50);
    measure(csv, part, "pile of 30 large balls", pile(10), 50);
    for (const int n : {16, 26, 36})
        measure(csv, part, "mesh", mesh(n, n, 0.02), 10);
    // 200,000 nodes; one at a time, as the most memory is the process's: "cube large", "slab
    // large".
    if (part == "cube large") measure(csv, part, part, mesh(58, 58, 0.02), 10);
    if (part == "slab large") measure(csv, part, part, mesh(126, 12, 0.02), 10);
    if (part.ends_with(" large"))
        fmt::print("    {:.2f} GiB at most\n", peak_memory_so_far() / 0x1p30);
    // The surfaces of these cubes, all that their steps see, on slabs whose factor takes seconds.
    for (const int n : {16, 26, 36, 58})
        measure(csv, part, fmt::format("slab of {} x {}", n, n), mesh(n, 4, 0.004), 50);
    std::fclose(csv);
    return 0;
} catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
}
