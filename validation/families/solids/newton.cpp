// Newton's method is as quick as its tangent is right.

#include "solver/scene/read.hpp"
#include "validation/families/solids/solids.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tuple>

namespace amontons::validation {

std::vector<Measured> newton_steps()
{
    // Bodies without contact that bend by a third of their length and more in twenty steps.
    const char* const rod =
        R"("kind": "rod", "segments": [{{"length": 1, "radius": 1e-3, "EI": 1, "GJ": 0.77, "EA": 1e6,
        "element": 0.05}}], "hold": [{{"set": "start"}}],
        "loads": [{{"set": "end", "force": [0, 0.5, -2], "over": [[0, 0], [1, 1]]}}], "elements": "{}")";
    const char* const solid =
        R"("kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "mesh": {{"generate": "box",
        "size": [1, 0.1, 0.1], "centre": [0.5, 0, 0], "cells": [10, 1, 1], "element": "H8"}},
        "hold": [{{"set": "x_min"}}], "loads": [{{"set": "x_max", "traction": [0, 200, -1000],
        "over": [[0, 0], [1, 1]]}}], "motion": "{}")";
    std::vector<Measured> rows;
    for (const auto& [what, body, kind] : {std::tuple{"rod", rod, "exact"},
                                           {"rod", rod, "corotational"},
                                           {"solid", solid, "corotational"},
                                           {"solid", solid, "hyperelastic"}}) {
        const Scene scene = parse_scene(
            fmt::format(R"({{"schema": 1, "title": "bent far", "bodies": {{"body": {{{}}}}},
                "time": {{"step": 0.05, "end": 1}}}})",
                        fmt::format(fmt::runtime(body), kind)),
            "bent far");
        const SolidRun run = try_run(scene);
        int most = 0, all = 0, retries = 0;
        for (const StepRecord& step : run.steps) {
            most = std::max(most, step.factorisations);
            all += step.factorisations;
            retries += step.retries;
        }
        // A step is a few per cent of the motion; digits double in each iteration: five reach
        // 1e-10. With a tangent that is 5 % off they grow by 1.3 an iteration. Two or fewer would
        // be a body that does not bend.
        rows.push_back(at_most(
            fmt::format("iterations of Newton's method in any of twenty steps, {}, {}", what, kind),
            run.summary.status == "done" && all > 2 * 20 ? most : std::nan(""), 6));
        rows.back().note = run.summary.message;
        rows.push_back(at_most(fmt::format("steps made shorter, {}, {}", what, kind), retries, 0));
    }
    return rows;
}

} // namespace amontons::validation
