#include "mesh/base/file.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/tests/keep.hpp"
#include "solver/step/wire_overlap.hpp"
#include "solver/step/wire_simulation.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;

namespace {

constexpr double kTube = 4e-3, kBead = 1e-3, kBeadAt = 0.05, kWire = 4.45e-4;

/// A tube along x with a ring of 1 mm height and 2 mm length on its inside.
std::string tube_with_bead()
{
    constexpr int kAround = 48;
    std::vector<double> x;
    for (int i = 0; i < 48; ++i)
        x.push_back(1e-3 * i);
    for (int i = 0; i <= 32; ++i)
        x.push_back(kBeadAt - 2 * kBead + kBead * i / 8);
    for (int i = 1; i < 60; ++i)
        x.push_back(kBeadAt + 2 * kBead + 1e-3 * i);
    std::string obj;
    for (const double at : x) {
        const double way = std::numbers::pi * (at - kBeadAt) / kBead;
        const double height =
            std::abs(at - kBeadAt) < kBead ? 0.5 * kBead * (1 + std::cos(way)) : 0;
        for (int k = 0; k < kAround; ++k) {
            const double angle = 2 * std::numbers::pi * k / kAround;
            obj += fmt::format("v {} {} {}\n", at, (kTube - height) * std::cos(angle),
                               (kTube - height) * std::sin(angle));
        }
    }
    for (int i = 0; i + 1 < int(x.size()); ++i)
        for (int k = 0; k < kAround; ++k) {
            const int a = i * kAround + k + 1, b = i * kAround + (k + 1) % kAround + 1;
            obj += fmt::format("f {} {} {}\nf {} {} {}\n", a, a + kAround, b, b, a + kAround,
                               b + kAround);
        }
    return obj;
}

/// A bent wire pushed over the bead, which is smaller than the distance of its contact points.
struct OverBead {
    TemporaryFolder folder;
    Scene scene;

    explicit OverBead(double spacing)
    {
        write_file(folder / "tube.obj", tube_with_bead());
        scene = parse_scene(fmt::format(R"({{"schema": 1, "bodies": {{
                "tube": {{"kind": "obstacle", "side": "inside", "surface": {{"file": "{}"}}}},
                "wire": {{"kind": "beam", "contact_spacing": {}, "segments": [{{"length": 0.15,
                  "radius": {}, "EI": 5e-4, "element": 8e-3, "curvature": 20}}],
                  "introducer": {{"at": [0.001, 0, 0], "normal": [0, 1, 0]}},
                  "drive": {{"insertion": [[0, 0.01], [1, 0.09]]}}}}}},
                "contact": [{{"between": ["wire", "tube"], "friction": 0.1}}],
                "time": {{"step": 0.05, "end": 1}}}})",
                                        folder / "tube.obj", spacing, kWire),
                            "s.json", {});
    }

    WireSimulation simulation() const { return WireSimulation(scene, build_obstacles(scene)); }
};

double largest(const std::vector<StepRecord>& records, const std::string& name)
{
    double most = 0;
    for (const StepRecord& r : records)
        most = std::max(most, value(r, name));
    return most;
}

} // namespace

TEST_CASE(
    "a bead between the contact points of a wire is found and pushes as it does on close ones" *
    doctest::test_suite("slow"))
{
    std::atomic<bool> never{false};
    std::vector<double> push;
    for (const double spacing : {16e-3, 4e-3, 1e-3, 2.5e-4}) {
        CAPTURE(spacing);
        const OverBead over(spacing);
        WireSimulation simulation = over.simulation();
        Keep keep;
        const RunSummary sum = simulation.run(keep, never);
        CHECK(sum.message == "");
        CHECK(sum.warnings.empty());
        for (const StepRecord& r : keep.records)
            CHECK(r.certificate.worst_overlap.depth < 0.1 * 2 * kWire);
        push.push_back(largest(keep.records, "push_force"));
    }
    for (const double p : push)
        CHECK(p == doctest::Approx(push.back()).epsilon(1e-3));
}

TEST_CASE("a run whose contact points were put closer continues from its middle bit by bit" *
          doctest::test_suite("slow"))
{
    const OverBead over(8e-3);
    std::atomic<bool> never{false}, stop{false};
    Keep whole, first, second;
    WireSimulation through = over.simulation();
    through.run(whole, never);

    first.stop = &stop;
    first.stop_at = int(whole.records.size()) / 2;
    WireSimulation begun = over.simulation();
    begun.run(first, stop);
    WireSimulation resumed = over.simulation();
    resumed.restore(begun.save());
    resumed.run(second, never);
    REQUIRE(first.records.size() + second.records.size() == whole.records.size());
    for (std::size_t i = 0; i < second.records.size(); ++i) {
        const StepRecord& a = whole.records[first.records.size() + i];
        for (const char* name : {"push_force", "tip_x", "tip_y", "depth"})
            CHECK(value(second.records[i], name) == value(a, name));
    }
    // And back: a state of few points is put into a wire of many.
    WireSimulation again = over.simulation();
    const std::vector<std::byte> start = again.save();
    resumed.restore(start);
    CHECK(resumed.save() == start);
}
