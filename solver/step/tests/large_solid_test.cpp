#include "mesh/tests/test_program.hpp"
#include "solver/module.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <fmt/format.h>

// Large solids are solved by iterations and without W. The factor's way is independent of all that:
// on small solids both must give the same forces.

using namespace amontons;

namespace {

std::string block(double friction, const std::string& more, const std::string& time)
{
    return fmt::format(R"("bodies": {{
        "plate": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
        "block": {{"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
            "mesh": {{"generate": "box", "size": [0.1, 0.1, 0.08], "cells": [5, 4, 4],
                      "element": "T4", "centre": [0, 0, 0.04]}}{}}}}},
        "contact": [{{"between": ["block", "plate"], "friction": {}}}],
        "time": {}, "accuracy": {{"contact": 1e-9}})",
                       more, friction, time);
}

const char* const kShear = R"(, "hold": [{"set": "z_max", "x": [[1, 0], [2, 2e-4]], "y": [[0, 0]],
                                          "z": [[0, 0], [1, -1e-3]]}])";

/// Both ways, and that every force of every contact is the same to `share` of the largest.
void compare(const std::string& scene, double share)
{
    const Result direct = run(scene, {"solver.linear=direct"}),
                 other = run(scene, {"solver.linear=iterative"});
    REQUIRE(direct.summary.status == "done");
    REQUIRE_MESSAGE(other.summary.status == "done", other.summary.message);
    REQUIRE(direct.records.size() == other.records.size());
    for (std::size_t k = 0; k < direct.records.size(); ++k) {
        const std::vector<ContactRecord>&a = direct.records[k].contacts,
              &b = other.records[k].contacts;
        double most = 0;
        for (const ContactRecord& c : a)
            most = std::max(most, c.force.norm());
        REQUIRE(a.size() == b.size());
        for (std::size_t i = 0; i < a.size(); ++i)
            CHECK((a[i].force - b[i].force).norm() <= share * most);
        CHECK(other.records[k].certificate.certified);
    }
    CHECK(direct.summary.contacts_max >= 12);
}

bool no_module_petsc()
{
    if (!find_module("petsc").empty()) return false;
    skip_test("the module petsc is not built (petsc-dev)");
    return true;
}

} // namespace

TEST_CASE("a large solid pressed and sheared has the forces that its factor gives" *
          doctest::test_suite("slow"))
{
    if (no_module_petsc()) return;
    const std::string time = R"({"step": 1, "end": 2})";
    SUBCASE("friction that sticks and slips")
    {
        compare(block(0.3, kShear, time), 1e-6);
    }
    SUBCASE("all slips")
    {
        compare(block(0.05, kShear, time), 1e-6);
    }
    SUBCASE("without friction")
    {
        compare(block(0, kShear, time), 1e-6);
    }
    SUBCASE("small sliding")
    {
        std::string scene = block(0.3, kShear, time);
        scene.replace(scene.find("\"friction\""), 0, "\"sliding\": \"small\", ");
        compare(scene, 1e-6);
    }
}

TEST_CASE("holds of a large solid take the friction on nodes that they hold along it" *
          doctest::test_suite("slow"))
{
    if (no_module_petsc()) return;
    const char* const hold = R"(, "hold": [{"set": "z_max", "y": 0, "z": [[0, 0], [1, -1e-3]]},
                                           {"set": "x_min", "x": [[0, 0], [1, 0], [2, 2e-3]]}])";
    const Result r = run(block(0.3, hold, R"({"step": 1, "end": 2})"), {"solver.linear=iterative"});
    REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
    const Vec3 floor = r.vector("plate_on_block_force");
    CHECK(std::abs(floor.x()) > 10);
    CHECK((floor + r.vector("block_z_max_force") + r.vector("block_x_min_force")).norm() <
          1e-6 * floor.norm());
}

TEST_CASE("a large solid that falls and slides moves as by its factor" *
          doctest::test_suite("slow"))
{
    if (no_module_petsc()) return;
    for (const double friction : {0.0, 0.2, 1.0}) {
        CAPTURE(friction);
        const std::string scene =
            block(friction, R"(, "start": {"place": [0, 0, 1e-4], "velocity": [0.3, 0, 0]})",
                  R"({"kind": "dynamic", "step": 1e-3, "end": 0.02})") +
            R"(, "gravity": [0, 0, -9.81])";
        compare(scene, 1e-5);
    }
}

TEST_CASE("small solids take their factor and the plan names the other ways")
{
    const Result r = run(block(0.3, kShear, R"({"step": 1, "end": 1})"));
    const LinearPlan plan = r.simulation->linear_plan();
    CHECK(plan.taken == "direct");
    REQUIRE(plan.path("iterative"));
    REQUIRE(plan.path("distributed"));
    CHECK_FALSE(plan.path("distributed")->possible);
    CHECK(plan.available > 1e8);
}

TEST_CASE("a solid that contacts alone hold keeps its factor")
{
    const std::string scene = block(0.3, "", R"({"step": 1, "end": 1})");
    CHECK_THROWS_AS(run(scene, {"solver.linear=iterative"}), InputError);
}
