// Solids that buckle and snap, at rest.

#include "mesh/base/file.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_build.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>

using namespace amontons;

TEST_CASE("first loads whose balance is not found at once are taken up in parts" *
          doctest::test_suite("slow"))
{
    // A column of 50 times its width that has to run from upright to hanging upside down: 15 times
    // Euler's load. All at once its elements are crushed.
    const auto column = [](const char* over, double step) {
        return run(fmt::format(
            R"("bodies": {{"a": {{"kind": "solid", "material": {{"law": "neo_hooke",
               "youngs_modulus": 1e5, "poisson_ratio": 0.4}},
               "mesh": {{"generate": "box", "size": [0.02, 0.02, 1], "cells": [1, 1, 20],
                         "element": "H8"}},
               "hold": [{{"set": "z_min"}}],
               "loads": [{{"set": "z_max", "traction": [0, 1, -125]{}}}]}}}},
               "time": {{"step": {}, "end": 1}})",
            over, step));
    };
    const Result once = column("", 1), ramped = column(R"(, "over": [[0, 0], [1, 1]])", 0.1);
    REQUIRE_MESSAGE(once.summary.message == "", once.summary.message);
    REQUIRE_MESSAGE(ramped.summary.message == "", ramped.summary.message);
    CHECK(once.records.front().energy.work == 0);
    for (const char* axis : {"_y", "_z"}) {
        const std::string force = std::string("a_z_min_force") + axis;
        CHECK(once.value(force, 0) == doctest::Approx(ramped.value(force)).epsilon(1e-7));
    }
    CHECK(once.value("a_max_displacement", 0) > 0.5);
    CHECK(once.value("a_max_displacement", 0) ==
          doctest::Approx(ramped.value("a_max_displacement")).epsilon(1e-6));
}

TEST_CASE("a share of the loads is what smaller loads are for each kind of body")
{
    const auto body = [](int kind, double by) {
        const std::string beam = fmt::format(
            R"("mesh": {{"generate": "box", "size": [0.4, 0.1, 0.1], "cells": [4, 1, 1],
               "element": "H8"}}, "hold": [{{"set": "x_min"}}], "loads": [{{"set": "x_max",
               "traction": [0, 0, {}]}}, {{"set": "z_max", "pressure": {}}},
               {{"set": "y_max", "force": [0, {}, 0]}}])",
            -100 * by, 200 * by, by);
        const std::string elastic = R"("youngs_modulus": 1e6, "poisson_ratio": 0.3, )";
        if (kind == 0) return R"("kind": "solid", )" + elastic + beam;
        if (kind == 1) return R"("kind": "solid", "motion": "corotational", )" + elastic + beam;
        if (kind == 2)
            return R"("kind": "solid", "material": )" + std::string(kRubber) + ", " + beam;
        return fmt::format(
            R"("kind": "rod", "segments": [{{"length": 1, "radius": 0.01, "EI": 1, "element": 0.2}}],
               "hold": [{{"set": "start"}}], "loads": [{{"set": "end", "force": [0, 0, {}],
               "moment": [{}, 0, 0]}}, {{"set": "all", "line": [0, {}, 0]}}])",
            -by, by, by);
    };
    const auto state = [&](int kind, double loads, double share) {
        const Scene scene = parse_scene(R"({"schema": 1, "bodies": {"a": {)" + body(kind, loads) +
                                            R"(}}, "time": {"step": 1, "end": 1}})",
                                        "test.json", {});
        const std::vector<Obstacle> obstacles;
        std::vector<Issue> warnings;
        const auto system = build_bodies(scene, obstacles, warnings);
        StepInput step;
        step.load = share;
        std::vector<std::string> messages;
        if (SolidBody* solid = system->refs.front().solid) solid->make_ready(step, "", messages);
        REQUIRE(try_body_step(*system, step, {}).accepted);
        const std::vector<double> x = system->bodies.front()->state();
        return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(x.data(), Eigen::Index(x.size())));
    };
    for (int kind = 0; kind < 4; ++kind) {
        CAPTURE(kind);
        const Eigen::VectorXd of_share = state(kind, 0.4, 0.5), of_loads = state(kind, 0.2, 1);
        CHECK((of_share - of_loads).norm() <= 1e-9 * of_loads.norm());
        CHECK((of_share - state(kind, 0.4, 1)).norm() > 1e-4 * of_loads.norm());
    }
}

TEST_CASE("a slender bar that is pressed buckles and the run reports it" *
          doctest::test_suite("slow"))
{
    // Straight on, until round-off has grown to a bend: some of these were given up on the way.
    struct Case {
        double side;
        const char* cells;
        double step;
    };
    for (const auto& [side, cells, step] : {Case{0.2, "10, 2, 2", 0.1},
                                            {0.25, "10, 2, 2", 0.1},
                                            {0.2, "10, 3, 3", 0.1},
                                            {0.2, "10, 2, 2", 0.05}}) {
        CAPTURE(side);
        CAPTURE(std::string(cells));
        const Result r = run(fmt::format(
            R"("bodies": {{"bar": {{"kind": "solid", "material": {0},
               "mesh": {{"generate": "box", "size": [1, {1}, {1}], "cells": [{2}], "element": "H8"}},
               "hold": [{{"set": "x_min"}}, {{"set": "x_max", "x": [[0, 0], [1, -0.6]], "y": 0, "z": 0}}]}}}},
               "time": {{"step": {3}, "end": 1}})",
            kRubber, side, cells, step));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        bool note = false;
        for (const StepRecord& s : r.records)
            note |= s.remark.find("not stable") != std::string::npos ||
                    s.remark.find("snapped") != std::string::npos;
        CHECK(note);
        // Euler's load of a bar that is clamped at both ends is 4 pi^2 EI / L^2, and shortened by
        // 0.6 L the elastica bears (2 K / pi)^2 of it, 2 (1 - E / K) = 0.6: 1.456. Straight it
        // would be 1e6 side^2 and more, three times that.
        const double buckled = -r.vector("bar_x_max_force")[0],
                     euler = 4 * M_PI * M_PI * 1e6 * std::pow(side, 4) / 12;
        CHECK(buckled > 0.2 * euler);
        CHECK(buckled < 1.456 * euler);
    }
}

TEST_CASE(
    "a shallow arch that snaps: load and displacement and damped motion find the same balances" *
    doctest::test_suite("slow"))
{
    const TemporaryFolder folder;
    const std::string path = folder / "arch";
    const int along = 24, layers = 2;
    const double span = 0.2, rise = 0.01, thick = 0.004, width = 0.02;
    const auto number = [](int i, int j, int k) { return (i * 2 + j) * (layers + 1) + k; };
    std::string nodes, elements;
    for (int i = 0; i <= along; ++i)
        for (int j = 0; j < 2; ++j)
            for (int k = 0; k <= layers; ++k) {
                const double s = 2.0 * i / along - 1, slope = -4 * rise * s / span;
                const double out = thick * (double(k) / layers - 0.5) / std::hypot(1, slope);
                nodes += fmt::format("{:.17g} {:.17g} {:.17g}\n", 0.5 * span * s - out * slope,
                                     width * (j - 0.5), rise * (1 - s * s) + out);
            }
    for (int i = 0; i < along; ++i)
        for (int k = 0; k < layers; ++k) {
            for (const int up : {0, 1})
                for (const auto& [a, b] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
                    elements += fmt::format("{} ", number(i + a, b, k + up));
            elements.back() = '\n';
        }
    elements += "node_set ends\n";
    for (const int i : {0, along})
        for (int n = 0; n < 2 * (layers + 1); ++n)
            elements += fmt::format("{}\n", number(i, 0, 0) + n);
    const int crown = number(along / 2, 0, layers);
    elements += fmt::format("node_set crown\n{}\n{}\n", crown, number(along / 2, 1, layers));
    write_file(path + ".nodes", nodes);
    write_file(path + ".elements", elements);
    const auto arch = [&](const std::string& hold, const std::string& more,
                          const std::string& time) {
        Result r = run(fmt::format(
            R"("bodies": {{"arch": {{"kind": "solid", "density": 1000, "mesh": {{"file": "{}.nodes"}},
               "material": {{"law": "neo_hooke", "youngs_modulus": 1e6, "poisson_ratio": 0.3}},
               "hold": [{{"set": "ends"}}, {{"set": "all", "y": 0}}{}]{}}}}}, "time": {{{}}})",
            path, hold, more, time));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        return r;
    };
    const double top = rise + 0.5 * thick;
    const auto down = [&](const Result& r) { // of the crown
        return top - r.simulation->body_records()[0].points[std::size_t(crown)].z();
    };
    const auto loaded = [&](double force, const std::string& more, const std::string& time) {
        return arch("",
                    fmt::format(R"(, "loads": [{{"set": "crown", "force": [0, 0, {}],
                                   "over": [[0, 0], [0.5, 1]]}}]{})",
                                -force, more),
                    time);
    };
    // What holds the crown where the load alone has led it to is that load.
    for (const double force : {0.02, 0.03}) {
        CAPTURE(force);
        const bool snaps = force > 0.025;
        const Result by_load = loaded(force, "", R"("step": 0.1, "end": 0.5)");
        const double way = down(by_load);
        CHECK((way > rise) == snaps);
        std::size_t note = 0;
        for (const StepRecord& s : by_load.records)
            note += s.remark.find("snapped") != std::string::npos;
        CHECK(note == (snaps ? 1 : 0));
        CHECK((by_load.summary.energy.released > 1e-6) == snaps);
        const Result held =
            arch(fmt::format(R"(, {{"set": "crown", "z": [[0, 0], [1, {:.17g}]]}})", -way), "",
                 R"("step": 0.02, "end": 1)");
        CHECK(held.value("arch_crown_force_z") == doctest::Approx(-force).epsilon(1e-5));
        // On the way there it passes a largest force, smaller than the load, or none.
        std::size_t peak = 1;
        while (peak < held.records.size() &&
               held.value("arch_crown_force_z", peak) < held.value("arch_crown_force_z", peak - 1))
            ++peak;
        CHECK((peak < held.records.size()) == snaps);
        if (snaps) CHECK(-held.value("arch_crown_force_z", peak - 1) < 0.95 * force);
        const Result moving = loaded(force, R"(, "mass_damping": 20)",
                                     R"("kind": "dynamic", "step": 0.01, "end": 2)");
        CHECK(down(moving) == doctest::Approx(way).epsilon(1e-5));
    }
}

TEST_CASE("a bar that a box presses until it is not stable: what was set free closes the energy" *
          doctest::test_suite("slow"))
{
    const Result r =
        run(R"("bodies": {"bar": {"kind": "solid", "material": )" + std::string(kRubber) +
            R"(, "mesh": {"generate": "box", "size": [1, 0.2, 0.2], "centre": [0.5, 0, 0],
             "cells": [10, 2, 2], "element": "H8"}, "hold": [{"set": "x_min"}]},
            "box": {"kind": "rigid", "shape": {"generate": "box", "size": [0.2, 0.6, 0.6]},
             "start": {"place": [1.1, 0, 0]}, "drive": {"x": [[0, 0], [1, -0.3]]}}},
            "contact": [{"between": ["bar", "box"], "friction": 1}],
            "time": {"step": 0.1, "end": 0.6})");
    REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
    bool note = false;
    for (const StepRecord& s : r.records)
        note |= s.remark.find("not stable") != std::string::npos;
    CHECK(note);
    const EnergyRecord& e = r.records.back().energy;
    CHECK(e.work > 100);
    CHECK(std::abs(e.error()) < 0.01 * e.work);
}

namespace {

/// A straight rod of length 1 m and EI 1 N m^2 between holds, along x, shortened by `shortened`.
std::string straight_rod(const std::string& ends, double shortened, const std::string& more)
{
    return fmt::format(
        R"("rod": {{"kind": "rod", {}"segments": [{{"length": 1, "radius": 0.001, "EI": 1, "EA": 1e7,
           "element": 0.02}}], "hold": [{{"set": "start", "x": [[0, 0], [1, {}]], "y": 0, "z": 0,
           "turns": "{}"}}, {{"set": "end", "turns": "{}"}}]}})",
        more, shortened, ends, ends);
}

constexpr double kEuler = 9.8696044011; // pi^2 EI / l^2 [N]

std::string in_steps(int count)
{
    return fmt::format(R"("time": {{"step": {}, "end": 1}})", 1.0 / count);
}

} // namespace

TEST_CASE("a straight column leaves the balance that does not stand")
{
    // Nothing disturbs it. Euler 1744: P = pi^2 EI / l^2 of hinged ends, 4 times that of clamped
    // ones; beyond, the elastica bears P (1 + d / (2 l)) where its ends have come nearer by d.
    struct Case {
        const char* ends;
        double load;
    };
    for (const Case& c : {Case{"free", kEuler}, Case{"held", 4 * kEuler}})
        for (const char* plane : {"", R"("plane": [0, 0, 1], )"})
            for (const int steps : {1, 4}) {
                if (c.load == kEuler && !*plane) continue; // nothing would keep it from turning
                CAPTURE(c.ends);
                CAPTURE(plane);
                CAPTURE(steps);
                const double shortened = 1e-3;
                const Result r = run("\"bodies\": {" + straight_rod(c.ends, shortened, plane) +
                                     "}, " + in_steps(steps));
                REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
                CHECK(r.value("rod_start_force_x") == doctest::Approx(c.load).epsilon(2e-3));
                CHECK(r.value("rod_negative") == 0);
                CHECK(r.summary.warnings.empty());
                CHECK(std::abs(r.summary.energy.error()) <
                      0.01 * (r.summary.energy.work + r.summary.energy.released));
            }
}

TEST_CASE("a straight rod between two plates rests on them where its load passes Euler's")
{
    const auto plate = [](const char* name, double y) {
        return fmt::format(R"("{}": {{"kind": "rigid", "shape": {{"generate": "box",
            "size": [1.2, 0.1, 0.1]}}, "drive": {{"x": 0}}, "start": {{"place": [0.5, {}, 0]}}}})",
                           name, y);
    };
    for (const double play : {1e-3, 1e-4}) {
        CAPTURE(play);
        // The shape that a play allows takes up far less than is prescribed: the rest is 25 times
        // Euler.
        const Result r = run(
            "\"bodies\": {" + plate("top", 0.051 + play) + ", " + plate("bottom", -0.051 - play) +
            ", " + straight_rod("held", 1e-4, R"("plane": [0, 0, 1], )") +
            R"(}, "contact": [{"between": ["rod", "top"]}, {"between": ["rod", "bottom"]}], )" +
            in_steps(1));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        CHECK(r.value("rod_negative") == 0);
        CHECK(r.value("top_on_rod_normal_force") + r.value("bottom_on_rod_normal_force") > 0);
        CHECK(r.value("rod_start_force_x") < 999);
        CHECK(r.value("rod_start_force_x") > kEuler);
    }
}

TEST_CASE("a corotational column that stays straight beyond Euler's load is reported")
{
    // 3 times Euler's load of clamped ends, 3.3 N, with nothing that disturbs it.
    const auto column = [](double shortened) {
        return run(fmt::format(R"("bodies": {{"a": {{"kind": "solid", "motion": "corotational",
            "youngs_modulus": 1e6, "poisson_ratio": 0.3, "mesh": {{"generate": "box",
            "size": [0.02, 0.02, 0.4], "cells": [2, 2, 30], "element": "H8"}},
            "hold": [{{"set": "z_min"}}, {{"set": "z_max", "x": 0, "y": 0,
            "z": [[0, 0], [1, -{}]]}}]}}}}, {})",
                               shortened, in_steps(1)));
    };
    const Result light = column(1e-3), heavy = column(1e-2);
    REQUIRE(light.summary.status == "done");
    CHECK(light.summary.warnings.empty());
    REQUIRE(heavy.summary.status == "done");
    REQUIRE(!heavy.summary.warnings.empty());
    CHECK(heavy.summary.warnings.front().find("unstable balance") != std::string::npos);
}
