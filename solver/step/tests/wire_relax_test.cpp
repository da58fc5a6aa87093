#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/wire_simulation.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("a jump as long as eighty fine elements comes to rest and its energy is accounted for" *
          doctest::test_suite("slow"))
{
    // A J-tipped wire in an aortic arch, whose loop falls over.
    const Scene scene = parse_scene(R"({"schema": 1, "bodies": {
        "aorta": {"kind": "obstacle", "surface": {"generate": "vessel",
          "centre": [0, 0, 0], "axis": [0, 0, 1], "arch_towards": [1, 0, 0],
          "descending_length": 0.12, "descending_diameter": [0.02, 0.024], "arch_radius": 0.038,
          "arch_angle": 3.141592653589793, "arch_diameter": [0.024, 0.028], "ascending_length": 0.06,
          "ascending_diameter": 0.028, "blend": 0.002, "branches": [
            {"name": "a", "at": 0.036, "diameter": [0.012, 0.010], "length": 0.045, "angle": 1.0471975511965976},
            {"name": "b", "at": 0.052, "diameter": 0.008, "length": 0.1, "angle": 1.3962634015954636},
            {"name": "c", "at": 0.068, "diameter": 0.009, "length": 0.07, "angle": 1.5707963267948966}]}},
        "wire": {"kind": "beam", "instrument": "guidewire-stiff", "element": 8e-4,
          "introducer": {"at": [0, 0, 0], "direction": [0, 0, 1], "normal": [1, 0, 0], "length": 0.06},
          "drive": {"insertion": [[0, 0], [15, 0.3]]}}},
        "contact": [{"between": ["wire", "aorta"], "friction": 0.05}],
        "time": {"step": 0.1, "end": 9.8}})",
                                    "s.json");
    WireSimulation simulation(scene, build_obstacles(scene));
    struct Nothing : StepObserver {
        void on_step(const StepRecord&) override {}
    } nothing;
    const std::atomic<bool> never{false};
    const RunSummary sum = simulation.run(nothing, never);
    INFO(sum.message);
    CHECK(sum.status == "done");
    CHECK(sum.snaps.size() > 0);
    CHECK(sum.energy.released > 0.01 * sum.energy.work_absolute); // [regression] our own run
    CHECK(std::abs(sum.energy.error()) < 5e-3 * sum.energy.work_absolute);
}
