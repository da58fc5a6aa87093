// A simulation that is stepped by its caller: cut where the caller requests it, and again after a
// failure.

#include "mesh/base/curve.hpp"
#include "mesh/base/error.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/tests/keep.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <random>
#include <sstream>

namespace amontons {
namespace {

using Outcome = StepResult::Outcome;

const std::atomic<bool> kNoStop{false};

std::unique_ptr<Simulation> make(const std::string& rest)
{
    Scene scene = parse_scene("{\"schema\": 1, " + rest + "}", "test.json", {});
    place_introducers(scene);
    return make_simulation(scene, build_obstacles(scene));
}

/// A wire pushed 80 mm into a bent tube.
std::string wire(double friction, const char* time)
{
    return fmt::format(R"("bodies": {{
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.004,
            "centreline": {{"pieces": [{{"length": 0.02}}, {{"radius": 0.03, "angle": 1.57}},
                                       {{"length": 0.06}}]}}}}}},
        "wire": {{"kind": "beam", "drive": {{"insertion": [[0, 0], [8, 0.08]]}},
            "segments": [{{"length": 0.15, "radius": 4.445e-4, "EI": 5.2e-4, "density": 7900,
                           "element": 2.5e-3}}]}}}},
        "contact": [{{"between": ["wire", "tube"], "friction": {}}}], {})",
                       friction, time);
}

/// A rigid block that is drawn over a plane, with a solid one on it.
std::string bodies(const char* time)
{
    return fmt::format(R"("bodies": {{
        "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
        "block": {{"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3, "density": 1000,
            "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [0, 0, 0.05],
                      "cells": [2, 2, 2], "element": "H8"}},
            "hold": [{{"set": "z_max", "x": [[0, 0], [1, 0.01]], "y": 0,
                       "z": [[0, 0], [0.35, -0.001], [1, -0.003]]}}]}}}},
        "contact": [{{"between": ["block", "floor"], "friction": 0.3}}], {})",
                       time);
}

/// The same step, clocks apart.
void check_same(const StepRecord& a, const StepRecord& b)
{
    CHECK(a.step == b.step);
    CHECK(a.time == b.time);
    CHECK(a.step_length == b.step_length);
    CHECK(a.iterations == b.iterations);
    REQUIRE(a.quantities.size() == b.quantities.size());
    for (std::size_t q = 0; q < a.quantities.size(); ++q)
        CHECK(std::memcmp(&a.quantities[q].value, &b.quantities[q].value, sizeof(double)) == 0);
    REQUIRE(a.contacts.size() == b.contacts.size());
    for (std::size_t c = 0; c < a.contacts.size(); ++c)
        CHECK(a.contacts[c].force == b.contacts[c].force);
}

std::vector<StepRecord> run_of(Simulation& simulation)
{
    Keep keep;
    const RunSummary sum = simulation.run(keep, kNoStop);
    REQUIRE_MESSAGE(sum.status == "done", sum.message);
    return std::move(keep.records);
}

} // namespace

TEST_CASE("a caller whose cuts fall on the steps of a run gets that run bit by bit" *
          doctest::test_suite("slow"))
{
    std::string scene;
    SUBCASE("wire")
    {
        scene = wire(0.1, R"("time": {"step": 0.1, "end": 8})");
    }
    SUBCASE("wire in motion")
    {
        scene = wire(0.1, R"("time": {"kind": "dynamic", "step": 0.1, "end": 2})");
    }
    SUBCASE("bodies")
    {
        scene = bodies(R"("time": {"step": 0.1, "end": 1})");
    }
    SUBCASE("bodies in motion")
    {
        scene = bodies(R"("time": {"kind": "dynamic", "step": 0.01, "end": 0.3})");
    }
    const std::vector<StepRecord> whole = run_of(*make(scene));
    REQUIRE(whole.size() > 8);
    std::mt19937 random(3);
    for (int repeat = 0; repeat < 4; ++repeat) {
        const auto simulation = make(scene);
        std::size_t next = 0, target = 0;
        while (next < whole.size()) {
            target = std::min(target + 1 + random() % 5, whole.size() - 1);
            // Times that agree to some last digits are one time.
            const double latest = whole[target].time * (1 + (repeat % 2) * 1e-14);
            while (true) {
                const StepResult r = simulation->step(kNoStop, latest);
                if (r.outcome == Outcome::done) break;
                REQUIRE_MESSAGE(r.outcome == Outcome::accepted, r.message);
                check_same(r.record, whole[next]);
                ++next;
            }
            CHECK(next == target + 1);
        }
        CHECK(simulation->step(kNoStop).outcome == Outcome::done);
    }
}

TEST_CASE("a caller's cuts are found exactly, and what comes after them is as long as before" *
          doctest::test_suite("slow"))
{
    std::string scene;
    double end = 0, longest = 0;
    SUBCASE("wire")
    {
        end = 8, longest = 0.1;
        scene = wire(0.1, R"("time": {"step": 0.1, "end": 8})");
    }
    SUBCASE("bodies")
    {
        end = 1, longest = 0.1;
        scene = bodies(R"("time": {"step": 0.1, "end": 1})");
    }
    const auto simulation = make(scene);
    REQUIRE(simulation->step(kNoStop).outcome == Outcome::accepted);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> share(0, 0.08);
    double latest = 0;
    int cuts = 0;
    while (latest < end) {
        latest = std::min(end, latest + share(random) * end);
        StepRecord last;
        while (true) {
            const StepResult r = simulation->step(kNoStop, latest);
            if (r.outcome == Outcome::done) break;
            REQUIRE_MESSAGE(r.outcome == Outcome::accepted, r.message);
            CHECK(r.record.certificate.certified);
            CHECK(r.record.time <= latest * (1 + 1e-12));
            CHECK(r.record.step_length <= longest * (1 + 1e-5));
            last = r.record;
        }
        CHECK(last.time == doctest::Approx(latest).epsilon(1e-12));
        if (latest == end) break;
        CHECK(last.time == latest);
        ++cuts;
        CHECK(simulation->step(kNoStop, latest).outcome == Outcome::done);
    }
    CHECK(cuts > 10);
}

namespace {

std::string with_curve(std::string scene, const std::string& curve)
{
    return scene.replace(scene.find("CURVE"), 5, curve);
}

/// The points that a scene's text has, such as [[0, 1], [2, 3]].
CurvePoints points_of(const std::string& text)
{
    CurvePoints all;
    std::istringstream in(text.substr(text.find("[[") + 1));
    for (char c = 0; in >> c && c == '[';) {
        double t = 0, value = 0;
        in >> t >> c >> value >> c >> c;
        all.push_back({t, value});
    }
    return all;
}

std::size_t number_of(const Simulation& simulation, const std::string& input)
{
    const auto& all = simulation.inputs();
    const auto at = std::ranges::find(all, input, &InputInfo::name);
    REQUIRE_MESSAGE(at != all.end(), input);
    return std::size_t(at - all.begin());
}

double value_of(const StepRecord& r, const std::string& name)
{
    const auto at = std::ranges::find(r.quantities, name, &Quantity::name);
    REQUIRE_MESSAGE(at != r.quantities.end(), name);
    return at->value;
}

const char* const kBlock = R"("bodies": {"block": {"kind": "solid", "density": 1000, MATERIAL,
    "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "cells": [2, 2, 2], "element": "H8"},
    "hold": [{"set": "z_min", "x": 0, "y": 0, "z": 0}], "loads": [LOAD],
    "probes": {"top": {"set": "z_max"}}}}, "time": TIME)";

std::string loaded_block(const char* material, const char* load, const char* time)
{
    std::string text = kBlock;
    for (const auto& [word, by] : {std::pair{"MATERIAL", material}, {"LOAD", load}, {"TIME", time}})
        text.replace(text.find(word), std::strlen(word), by);
    return text;
}

} // namespace

TEST_CASE("drives and loads that a caller leads along curves move bodies as the curves do" *
          doctest::test_suite("slow"))
{
    const char *
        linear = R"("youngs_modulus": 1e5, "poisson_ratio": 0.3)",
       *rubber = R"("material": {"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.4})",
       *still = R"({"step": 0.1, "end": 1})",
       *motion = R"({"kind": "dynamic", "step": 0.01, "end": 0.3})";
    const char *rise = "[[0, 0.5], [0.2, 1], [1, -0.3]]", *first = "[[0, 0.5]]";
    std::string scene, input, curve = rise, start = first, output = "block_top_displacement_z";
    SUBCASE("the factor on a traction")
    {
        scene = loaded_block(
            linear, R"({"set": "z_max", "traction": [0, 0, -3000], "over": CURVE})", still);
        input = "block.loads.0.over";
    }
    SUBCASE("the factor on a traction, in motion")
    {
        scene = loaded_block(
            linear, R"({"set": "z_max", "traction": [0, 0, -3000], "over": CURVE})", motion);
        input = "block.loads.0.over";
    }
    SUBCASE("the factor on a force that the scene does not turn down: 1")
    {
        scene = loaded_block(rubber, R"({"set": "z_max", "force": [0, 5, -30] CURVE})", still);
        input = "block.loads.0.over";
        curve = R"(, "over": [[0, 1], [1, 0.2]])", start = "";
    }
    SUBCASE("a pressure on a linear solid")
    {
        scene = loaded_block(linear, R"({"set": "z_max", "pressure": CURVE})", still);
        input = "block.loads.0.pressure";
        curve = "[[0, 100], [0.3, 4000], [1, 1000]]", start = "[[0, 100]]";
    }
    SUBCASE("a pressure on rubber, in motion")
    {
        scene = loaded_block(rubber, R"({"set": "z_max", "pressure": CURVE})", motion);
        input = "block.loads.0.pressure";
        curve = "[[0, 0], [0.1, 4000], [1, 1000]]", start = "[[0, 0]]";
    }
    SUBCASE("a force on a rigid body")
    {
        scene =
            R"("bodies": {"ball": {"kind": "rigid", "mass": 2, "force": [0, 0, 3], "over": CURVE,
            "shape": {"generate": "ball", "radius": 0.1}}}, "time": )" +
            std::string(motion);
        input = "ball.over", output = "ball_z";
    }
    SUBCASE("a solid's drive")
    {
        scene =
            R"("bodies": {"block": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
            "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "cells": [2, 2, 2], "element": "H8"},
            "drive": {"z": CURVE}, "hold": [{"set": "z_min", "x": 0, "y": 0, "z": 0}],
            "probes": {"top": {"set": "z_max"}}}}, "time": )" +
            std::string(still);
        input = "block.z", curve = "[[0, 0], [0.3, 0.01], [1, -0.02]]", start = "[[0, 0]]";
    }
    SUBCASE("a rod's load")
    {
        scene = R"("bodies": {"rod": {"kind": "rod", "shape": {"direction": [1, 0, 0]},
            "segments": [{"length": 1, "radius": 0.01, "EI": 10, "element": 0.1}],
            "hold": [{"set": "start"}], "loads": [{"set": "end", "force": [0, 0, -8], "over": CURVE}]}},
            "time": )" +
                std::string(still);
        input = "rod.loads.0.over", output = "rod_end_z";
    }
    SUBCASE("a rod fed out of its sheath")
    {
        scene = R"("bodies": {"ball": {"kind": "obstacle", "side": "inside",
                "surface": {"generate": "ball", "radius": 0.015}},
            "wire": {"kind": "rod", "segments": [{"length": 0.06, "radius": 8e-4, "EI": 1e-4, "EA": 400,
                     "element": 1e-3}],
                "shape": {"points": [{"at": [-0.066, 0.005, 0]}, {"at": [-0.006, 0.005, 0]}]},
                "fed": CURVE, "drag": 5}},
            "contact": [{"between": ["wire", "ball"], "friction": 0.2}],
            "time": {"step": 0.02, "end": 0.6, "smallest_step": 1e-5})";
        input = "wire.fed", output = "wire_end_x";
        curve = "[[0, 0.004], [0.4, 0.03], [0.6, 0.02]]", start = "[[0, 0.004]]";
    }
    const std::vector<StepRecord> whole = run_of(*make(with_curve(scene, curve)));
    REQUIRE(whole.size() > 8);
    const auto led = make(with_curve(scene, start));
    const std::size_t number = number_of(*led, input);
    const CurvePoints points = points_of(curve);
    CHECK(led->input(number) == curve_value(points, 0));
    std::vector<std::byte> state;
    double least = INFINITY, largest = -INFINITY;
    std::vector<StepRecord> same;
    for (const StepRecord& r : whole) {
        if (r.step > 0) led->set_input(number, curve_value(points, r.time));
        if (r.step == 5) state = led->save();
        StepResult last = led->step(kNoStop, r.time);
        REQUIRE_MESSAGE(last.outcome == Outcome::accepted, last.message);
        same.push_back(std::move(last.record));
        REQUIRE(same.back().time == doctest::Approx(r.time));
        for (const Quantity& q : r.quantities) {
            const double scale = q.name.find("error") == std::string::npos ? 1 : INFINITY;
            CAPTURE(q.name);
            CHECK(std::abs(value_of(same.back(), q.name) - q.value) <=
                  1e-9 * scale * std::max(1.0, std::abs(q.value)));
        }
        const double now = value_of(r, output);
        least = std::min(least, now);
        largest = std::max(largest, now);
    }
    CHECK(largest - least > 1e-4); // the curve matters
    // What waits for its step is in the state.
    const auto again = make(with_curve(scene, start));
    again->restore(state);
    CHECK(again->input(number) == curve_value(points, whole[5].time));
    check_same(again->step(kNoStop, whole[5].time).record, same[5]);
}

TEST_CASE("inputs have bounds, and a path of balances has no inputs")
{
    const auto rod = make(R"("bodies": {"wire": {"kind": "rod", "segments": [{"length": 0.06,
        "radius": 8e-4, "EI": 1e-4, "element": 1e-3}],
        "shape": {"points": [{"at": [-0.066, 0, 0]}, {"at": [-0.006, 0, 0]}]},
        "hold": [{"at": 0.05, "y": [[0, 0], [1, 1e-3]]}], "fed": [[0, 0.02], [1, 0.03]]}},
        "time": {"step": 0.02, "end": 1})");
    const std::size_t fed = number_of(*rod, "wire.fed");
    CHECK(rod->inputs()[fed].lower == doctest::Approx(0.01)); // what is held must stay out
    CHECK(rod->inputs()[fed].upper == doctest::Approx(0.06));
    CHECK_THROWS_AS(rod->set_input(fed, 0.009), InputError);
    CHECK_THROWS_AS(rod->set_input(fed, 0.061), InputError);
    CHECK_THROWS_AS(rod->set_input(fed, NAN), InputError);
    CHECK_THROWS_AS(rod->set_input(rod->inputs().size(), 0), InputError);
    CHECK(rod->input(fed) == 0.02);

    const auto path = make(R"("bodies": {"rod": {"kind": "rod", "shape": {"direction": [1, 0, 0]},
        "segments": [{"length": 1, "radius": 0.01, "EI": 10, "element": 0.1}],
        "hold": [{"set": "start"}],
        "loads": [{"set": "end", "force": [0, 0, -8], "over": [[0, 0], [1, 1]]}]}},
        "time": {"step": 0.1, "end": 1, "path": 0.1})");
    CHECK(path->inputs().empty());
}

TEST_CASE("a step that fails leaves the state of the last one and can be repeated" *
          doctest::test_suite("slow"))
{
    std::string scene, other;
    SUBCASE("a wire that jams")
    {
        scene = wire(3, R"("time": {"step": 0.1, "end": 8, "smallest_step": 0.05})");
        other = wire(0.1, R"("time": {"step": 0.1, "end": 8, "smallest_step": 0.05})");
    }
    SUBCASE("a block that is pressed flat")
    {
        const auto block = [](const char* law, const char* z) {
            return fmt::format(R"("bodies": {{
                "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
                "block": {{"kind": "solid", {},
                    "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [0, 0, 0.05],
                              "cells": [2, 2, 2], "element": "H8"}},
                    "hold": [{{"set": "z_max", "x": 0, "y": 0, "z": {}}}]}}}},
                "contact": [{{"between": ["block", "floor"], "friction": 0.3}}],
                "time": {{"step": 0.05, "end": 1, "smallest_step": 0.01}})",
                               law, z);
        };
        const char* law = R"("material": {"law": "neo_hooke", "youngs_modulus": 1e5,
                                          "poisson_ratio": 0.45})";
        scene = block(law, "[[0, 0], [1, -0.12]]");
        other = block(law, "[[0, 0], [1, -0.05]]");
    }
    const auto simulation = make(scene);
    std::vector<std::byte> good;
    StepResult r;
    while (true) {
        good = simulation->save();
        r = simulation->step(kNoStop);
        if (r.outcome != Outcome::accepted) break;
    }
    REQUIRE(r.outcome == Outcome::failed);
    CHECK(r.message.find("step ") == 0);
    const StepResult again = simulation->step(kNoStop);
    CHECK(again.outcome == Outcome::failed);
    CHECK(again.message == r.message);
    // What continues from there in a scene that can is what continues from before the failure.
    const auto before = make(other), after = make(other);
    before->restore(good);
    after->restore(simulation->save());
    int steps = 0;
    while (true) {
        const StepResult a = before->step(kNoStop), b = after->step(kNoStop);
        REQUIRE(a.outcome == b.outcome);
        CHECK(a.message == b.message);
        if (a.outcome != Outcome::accepted) break;
        check_same(a.record, b.record);
        ++steps;
    }
    CHECK(steps > 0);
}

} // namespace amontons
