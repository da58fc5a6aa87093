// A step that is refused gives the reason.

#include "solver/body/solid_body.hpp"
#include "solver/scene/tests/issues_of.hpp"
#include "solver/step/body_build.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <algorithm>
#include <fmt/format.h>

using namespace amontons;

namespace {

/// A sheet between two blocks of 100 kPa, pressed by 20 mm within a step.
std::string pressed_sheet(double thick, double E, double friction)
{
    const auto solid = [](const std::string& name, double modulus, const std::string& mesh,
                          const std::string& hold) {
        return fmt::format(
            R"("{}": {{"kind": "solid", "mesh": {{"generate": "box", "element": "H8", {}}},
            "material": {{"law": "neo_hooke", "youngs_modulus": {}, "poisson_ratio": 0.45}},
            "hold": [{{{}}}]}})",
            name, mesh, modulus, hold);
    };
    return fmt::format(
        R"("bodies": {{{}, {}, {}}},
           "contact": [{{"between": ["lower", "sheet"], "friction": {}}},
                       {{"between": ["sheet", "upper"], "friction": {}}}],
           "time": {{"step": 1, "end": 1, "smallest_step": 0.5}})",
        solid("lower", 1e5, R"("size": [1, 1, 0.4], "centre": [0, 0, -0.2], "cells": [2, 2, 1])",
              R"("set": "z_min")"),
        solid("sheet", E,
              fmt::format(R"("size": [1.3, 1.3, {}], "centre": [0, 0, {}], "cells": [4, 4, 1])",
                          thick, thick / 2),
              R"("set": "x_min")"),
        solid("upper", 1e5,
              fmt::format(R"("size": [1, 1, 0.4], "centre": [0.03, 0.02, {}], "cells": [3, 3, 1])",
                          thick + 0.2),
              R"("set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.02]])"),
        friction, friction);
}

/// The whole step, refused.
BodyStepReport refused(const std::string& text, const BodyStepOptions& options)
{
    const Scene scene = parse_scene("{\"schema\": 1, " + text + "}", "test.json", {});
    const std::vector<Obstacle> obstacles;
    std::vector<Issue> warnings;
    const std::unique_ptr<BodySystem> system = build_bodies(scene, obstacles, warnings);
    std::vector<std::string> messages;
    StepInput step;
    step.h = 1;
    for (const BodyRef& b : system->refs)
        b.solid->make_ready(step, "", messages);
    BodyStepReport r = try_body_step(*system, step, options);
    CHECK(!r.accepted);
    return r;
}

std::string refusal(const std::string& text, int iterations)
{
    BodyStepOptions options;
    options.most_iterations = iterations;
    return refused(text, options).refusal;
}

} // namespace

TEST_CASE("a step without a balance states which body lacks it and where")
{
    const std::string why = refusal(pressed_sheet(0.2, 1e5, 0), 1);
    CAPTURE(why);
    CHECK(has(why, "no balance"));
    CHECK(has(why, " is out of balance, most at ("));
    CHECK(!has(why, "times as long"));
}

TEST_CASE("a step without a balance names what a mesh of slivers makes of it")
{
    const std::string why = refusal(pressed_sheet(0.0025, 1e5, 0), 1);
    CAPTURE(why);
    CHECK(has(why, "sheet: its elements have edges up to 130 times as long")); // 1.3/4 over 0.0025
    CHECK(!has(why, "upper: its elements"));
}

TEST_CASE("a contact problem that rounding leaves unsolved reports it")
{
    const Result r = run(pressed_sheet(0.002, 100, 0));
    CAPTURE(r.summary.message);
    CHECK(r.summary.status == "failed");
    CHECK(has(r.summary.message, "contact problem"));
    CHECK(has(r.summary.message, "times as stiff as others"));
    CHECK(has(r.summary.message, "s were tried"));
}

TEST_CASE("a step whose error rises by more than is allowed ends there")
{
    // A soft sheet that buckles: errors fall and rise until patience ends.
    BodyStepOptions options;
    const BodyStepReport patient = refused(pressed_sheet(0.05, 1e4, 0), options);
    double least = std::numeric_limits<double>::infinity(), rise = 0;
    for (const double error : patient.errors) {
        rise = std::max(rise, error / least);
        least = std::min(least, error);
    }
    CHECK(rise > 2);
    for (const double most : {0.0, 2.0}) { // 0: not even the first one is allowed
        options.most_rise = most;
        const BodyStepReport hasty = refused(pressed_sheet(0.05, 1e4, 0), options);
        REQUIRE(hasty.errors.size() < patient.errors.size());
        if (most == 0) CHECK(hasty.errors.size() == 1);
        for (std::size_t i = 0; i < hasty.errors.size(); ++i)
            CHECK(hasty.errors[i] == patient.errors[i]);
    }
}

TEST_CASE(
    "a block without friction that its soft bed pushes aside reports it and what would hold it")
{
    // Beside the middle of the bed, whose surface the load tilts.
    const auto pressed = [](const std::string& law) {
        return run(fmt::format(
            R"("bodies": {{"bed": {{"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                   "hold": [{{"set": "z_min"}}], "mesh": {{"generate": "box", "size": [0.16, 0.16, 0.05],
                   "cells": [4, 4, 2], "element": "H8"}}}},
               "top": {{"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                   "loads": [{{"set": "z_max", "traction": [0, 0, -1000]}}],
                   "start": {{"place": [0.013, 0.0065, 0.05]}}, "mesh": {{"generate": "box",
                   "size": [0.1, 0.1, 0.05], "cells": [3, 3, 2], "element": "H8"}}}}}},
               "contact": [{{"between": ["top", "bed"]{}}}], "time": {{"step": 1, "end": 1}})",
            law));
    };
    const Result r = pressed("");
    CAPTURE(r.summary.message);
    CHECK(r.summary.status == "failed");
    CHECK(has(r.summary.message, "nothing holds its shift"));
    CHECK(has(r.summary.message, "have no friction"));
    CHECK(pressed(R"(, "friction": 0.01)").summary.message == "");
    CHECK(pressed(R"(, "sliding": "small")").summary.message == "");
}
