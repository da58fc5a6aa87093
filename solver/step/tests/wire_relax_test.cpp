#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/wire_simulation.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <string>

using namespace amontons;

namespace {

/// A wire pushed into an aortic arch. @param wire  segments and drive
RunSummary pushed_into_arch(const std::string& wire, double friction, const std::string& time)
{
    const Scene scene = parse_scene(R"({"schema": 1, "bodies": {
        "aorta": {"kind": "obstacle", "surface": {"generate": "vessel",
          "centre": [0, 0, 0], "axis": [0, 0, 1], "arch_towards": [1, 0, 0],
          "descending_length": 0.12, "descending_diameter": [0.02, 0.024], "arch_radius": 0.038,
          "arch_angle": 3.141592653589793, "arch_diameter": [0.024, 0.028], "ascending_length": 0.06,
          "ascending_diameter": 0.028, "blend": 0.002, "branches": [
            {"name": "a", "at": 0.036, "diameter": [0.012, 0.010], "length": 0.045, "angle": 1.0471975511965976},
            {"name": "b", "at": 0.052, "diameter": 0.008, "length": 0.1, "angle": 1.3962634015954636},
            {"name": "c", "at": 0.068, "diameter": 0.009, "length": 0.07, "angle": 1.5707963267948966}]}},
        "wire": {"kind": "beam",
          "introducer": {"at": [0, 0, 0], "direction": [0, 0, 1], "normal": [1, 0, 0], "length": 0.06},)" +
                                        wire + R"(}},
        "contact": [{"between": ["wire", "aorta"], "friction": )" +
                                        std::to_string(friction) + R"(}],
        "time": )" + time + "}",
                                    "s.json");
    WireSimulation simulation(scene, build_obstacles(scene));
    struct Nothing : StepObserver {
        void on_step(const StepRecord&) override {}
    } nothing;
    const std::atomic<bool> never{false};
    return simulation.run(nothing, never);
}

} // namespace

TEST_CASE("a jump as long as eighty fine elements comes to rest and its energy is accounted for" *
          doctest::test_suite("slow"))
{
    // A J-tipped wire, whose loop falls over.
    const RunSummary sum = pushed_into_arch(R"("instrument": "guidewire-stiff", "element": 8e-4,
          "drive": {"insertion": [[0, 0], [15, 0.3]]})",
                                            0.05, R"({"step": 0.1, "end": 9.8})");
    INFO(sum.message);
    CHECK(sum.status == "done");
    CHECK(sum.snaps.size() > 0);
    CHECK(sum.energy.released > 0.01 * sum.energy.work_absolute); // [regression] our own run
    CHECK(std::abs(sum.energy.error()) < 5e-3 * sum.energy.work_absolute);
}

TEST_CASE("a jump over many places of contact comes to rest however often they open and close")
{
    const auto run = [](double spacing) {
        return pushed_into_arch(
            R"("segments": [
            {"length": 0.4200, "radius": 4.445e-4, "EI": 5.2e-4, "element": 2.5e-3},
            {"length": 0.0148, "radius": 4.445e-4, "EI": [5.2e-4, 2.733333333333333e-4], "element": 1.25e-3},
            {"length": 0.0152, "radius": 4.445e-4, "EI": [2.733333333333333e-4, 2e-5], "curvature": 82.6446281, "element": 1.25e-3}],
            "drive": {"insertion": [[0, 0], [7.5, 0.150], [9.5, 0.150], [11.52, 0.1904]]}, "contact_spacing": )" +
                std::to_string(spacing),
            0.02, R"({"step": 0.02, "end": 11.52})");
    };
    const RunSummary coarse = run(6e-4), fine = run(1.5e-4);
    INFO(fine.message);
    CHECK(fine.status == "done");
    CHECK(fine.snaps.size() > 0);
    CHECK(std::abs(fine.energy.error()) < 2e-3 * fine.energy.work_absolute);
    // The same wire: what it lost does not depend on where contact is searched for.
    CHECK(fine.energy.elastic == doctest::Approx(coarse.energy.elastic).epsilon(0.05));
}
