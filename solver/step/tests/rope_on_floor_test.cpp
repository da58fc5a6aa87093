// A rope that hangs slack comes down on a floor: it bends within less than an element.

#include "solver/step/tests/body_runs.hpp"

#include <fmt/format.h>
#include <numbers>

using namespace amontons;

TEST_CASE("a slack rope lies on a floor between its nodes as well, and its supports carry the rest")
{
    const double L = 3.132, r = L / 1000, density = 1977, g = 9.81;
    for (const double EI : {1.842e-5, 4.6e-5}) {
        CAPTURE(EI);
        const Result rope = run(fmt::format(
            R"("bodies": {{"rope": {{"kind": "rod", "segments": [{{"length": {}, "radius": {},
               "EI": {}, "EA": 274.6, "density": {}, "element": {}}}],
               "shape": {{"start": [-1.566, 0, 0], "normal": [0, 0, 1]}}, "plane": [0, 1, 0],
               "hold": [{{"set": "start", "turns": "free"}},
                 {{"set": "end", "turns": "free", "x": [[0, 0], [1, -0.313]], "y": 0, "z": 0}}]}},
               "floor": {{"kind": "obstacle", "surface": {{"generate": "plane",
                 "centre": [0, 0, -0.3132], "axis": [0, 0, 1]}}}}}},
               "contact": [{{"between": ["rope", "floor"], "friction": 0.3}}],
               "time": {{"step": 0.25, "end": 1}}, "gravity": [0, 0, {}])",
            L, r, EI, density, L / 43, -g));
        REQUIRE_MESSAGE(rope.summary.message == "", rope.summary.message);
        const double weight = std::numbers::pi * r * r * L * density * g;
        CHECK(rope.summary.worst_overlap.depth < 0.1 * r);
        CHECK(rope.value("floor_on_rope_force_z") > 0.1 * weight);
        CHECK(rope.value("floor_on_rope_force_z") + rope.value("rope_start_force_z") +
                  rope.value("rope_end_force_z") ==
              doctest::Approx(weight).epsilon(1e-6));
    }
}
