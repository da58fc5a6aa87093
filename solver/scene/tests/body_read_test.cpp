#include "solver/scene/read.hpp"
#include "solver/scene/tests/issues_of.hpp"

#include <doctest/doctest.h>
#include <string>

using namespace amontons;

namespace {

const char* const kBodiesExample = R"({
  "schema": 1,
  "bodies": {
    "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
    "block": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3, "density": 1000,
              "mesh": {"generate": "box", "size": [0.1, 0.2, 0.3], "cells": [1, 2, 3], "grading": [1, 1, 2]},
              "hold": [{"set": "z_min"}], "loads": [{"set": "z_max", "pressure": 5}]},
    "stone": {"kind": "rigid", "shape": {"generate": "box", "size": [0.1, 0.1, 0.2]}, "mass": 2,
              "inertia": [0.1, 0.2, 0.3], "drive": {"x": [[0, 0], [1, 0.1]], "axis": [0, 1, 0]}}
  },
  "contact": [{"between": ["block", "floor"], "friction": 0.3}],
  "couplings": [{"kind": "spring", "between": ["stone", "world"], "to": [0, 0, 1], "stiffness": 10}],
  "time": {"kind": "dynamic", "step": 0.1, "end": 1}
})";

/// The issues of the example with one piece of text replaced; "" if it is a scene.
std::string bad_bodies(const std::string& old, const std::string& now)
{
    return issues_of(replaced(kBodiesExample, old, now));
}

} // namespace

TEST_CASE("solids and rigid bodies read as they are written and resolved as the same again")
{
    const Scene s = parse_scene(kBodiesExample, "s.json", {});
    REQUIRE(s.solids.size() == 1);
    CHECK(s.solids[0].mesh.size == Vec3(0.1, 0.2, 0.3));
    CHECK(s.solids[0].mesh.cells == Vec3(1, 2, 3));
    CHECK(s.solids[0].hold.at(0).set == "z_min");
    CHECK(s.solids[0].loads.at(0).pressure == CurvePoints{{0, 5}});
    REQUIRE(s.rigids.size() == 1);
    CHECK(*s.rigids[0].inertia == Vec3(0.1, 0.2, 0.3));
    CHECK(s.rigids[0].drive.given);
    CHECK(s.couplings.at(0).kind == "spring");
    const std::string resolved = resolved_scene(s);
    CHECK(resolved_scene(parse_scene(resolved, "again.json", {})) == resolved);
}

TEST_CASE("holds that turn or have a gradient, and patches of joints, read as they are written")
{
    const std::string solid = R"({"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
        "mesh": {"generate": "box", "size": [1, 1, 1]}, "hold": [{"set": "z_min", "angle":
        [[0, 0], [1, 2]], "axis": [1, 0, 0], "about": [0, 0, 3]}, {"set": "z_max", "gradient":
        [[1, 2, 3], [4, 5, 6], [7, 8, 9]], "over": [[0, 0], [1, 0.1]]}]})";
    const Scene s = parse_scene(R"({"schema": 1, "bodies": {"a": )" + solid + R"(, "b": )" + solid +
                                    R"(}, "couplings": [{"kind": "weld", "between": ["a", "b"],
        "set": "x_max", "to_set": "x_min"}, {"kind": "ball", "between": ["a", "b"], "radius": 0.2}],
        "time": {"step": 1, "end": 1}})",
                                "test.json", {});
    const HoldInput &turned = s.solids.at(0).hold.at(0), &sheared = s.solids.at(0).hold.at(1);
    CHECK(turned.affine());
    CHECK(turned.angle.size() == 2);
    REQUIRE(sheared.gradient);
    CHECK((*sheared.gradient)(1, 2) == 6);
    CHECK(s.couplings.at(0).to_set == "x_min");
    CHECK(s.couplings.at(1).radius == 0.2);
    const std::string resolved = resolved_scene(s);
    CHECK(resolved_scene(parse_scene(resolved, "again.json", {})) == resolved);
}

TEST_CASE("every one of three numbers is held to its range")
{
    for (const char* size : {"[0.1, 0.2, 0]", "[0, 0.2, 0.3]", "[0.1, -0.2, 0.3]", "[0.1, 0.2]"}) {
        CAPTURE(size);
        std::string shown = size;
        std::erase(shown, ' ');
        CHECK(bad_bodies("[0.1, 0.2, 0.3]", size) ==
              "s.json: /bodies/block/mesh/size: found " + shown +
                  ", allowed: three numbers, each >= 1e-09 and <= 1e+09 [m]");
    }
    CHECK(has(bad_bodies("[1, 2, 3]", "[1, 0, 3]"),
              "/bodies/block/mesh/cells: found [1,0,3], allowed: three numbers, each >= 1"));
    CHECK(has(bad_bodies("[1, 2, 3]", "[1, 1.5, 3]"), "/bodies/block/mesh/cells: found 1.5"));
    CHECK(has(bad_bodies("[1, 1, 2]", "[1, 1, 0]"), "/bodies/block/mesh/grading"));
    CHECK(has(bad_bodies("[0.1, 0.1, 0.2]", "[0.1, 0.1, 0]"), "/bodies/stone/shape/size"));
    CHECK(has(bad_bodies("\"inertia\": [0.1, 0.2, 0.3]", "\"inertia\": [0.1, 0, 0.3]"),
              "/bodies/stone/inertia"));
    CHECK(has(bad_bodies("[0, 1, 0]", "[0, 0, 0]"), "allowed: three numbers, not all 0"));
}

TEST_CASE("an inertia that no body has is refused and a flat body's is the limit")
{
    CHECK(bad_bodies("\"inertia\": [0.1, 0.2, 0.3]", "\"inertia\": [0.1, 0.2, 0.31]") ==
          "s.json: /bodies/stone/inertia: found [0.1, 0.2, 0.31], allowed: none above the sum of "
          "the other two: no body has such an inertia");
    CHECK(bad_bodies("\"inertia\": [0.1, 0.2, 0.3]", "\"inertia\": [0.3, 0.1, 0.2]").empty());
}

TEST_CASE("materials and sets and loads and masses and joints that cannot be are refused with "
          "their place")
{
    CHECK(has(bad_bodies("\"poisson_ratio\": 0.3", "\"poisson_ratio\": 0.5"),
              "/bodies/block/poisson_ratio: found 0.5"));
    CHECK(has(bad_bodies("\"poisson_ratio\": 0.3", "\"poisson_ratio\": -1"),
              "/bodies/block/poisson_ratio"));
    CHECK(has(bad_bodies("\"youngs_modulus\": 1e5", "\"youngs_modulus\": 0"),
              "/bodies/block/youngs_modulus"));
    CHECK(has(bad_bodies(", \"density\": 1000", ""), "/bodies/block/density"));
    CHECK(has(bad_bodies("\"set\": \"z_min\"", "\"set\": \"\""),
              "/bodies/block/hold/0/set: found \"\", allowed: a text that is not empty"));
    CHECK(has(bad_bodies(", \"pressure\": 5", ""), "/bodies/block/loads/0"));
    CHECK(has(bad_bodies("\"mass\": 2", "\"mass\": 2, \"density\": 1"),
              "either \"mass\" or \"density\""));
    CHECK(has(bad_bodies("\"mass\": 2", "\"mass\": 0"), "/bodies/stone/mass"));
    CHECK(has(bad_bodies("\"stone\", \"world\"", "\"stome\", \"world\""),
              "\"stone\" (nearest name)"));
    CHECK(has(bad_bodies(", \"stiffness\": 10", ""), "/couplings/0/stiffness"));
    const std::string damped =
        replaced(kBodiesExample, "\"stiffness\": 10", "\"stiffness\": 10, \"damping\": 1");
    CHECK(issues_of(damped).empty());
    CHECK(has(issues_of(replaced(damped, "\"dynamic\"", "\"quasi_static\"")),
              "at rest nothing is damped"));
    CHECK(has(bad_bodies("\"spring\"", "\"turn_spring\""),
              "the axis of a coupling of kind \"hinge\" between the same two bodies"));
    CHECK(has(bad_bodies("\"spring\"", "\"distance\", \"length\": 2"), "/couplings/0/length"));
    CHECK(has(bad_bodies("\"kind\": \"spring\"", "\"kind\": \"hinge\", \"damping\": 1"),
              "0, of a hinge: springs have it"));
    CHECK(has(bad_bodies("\"friction\": 0.3", "\"restitution\": 1.1"), "/contact/0/restitution"));
    CHECK(has(bad_bodies("\"kind\": \"dynamic\"", "\"kind\": \"quasi_static\", \"theta\": 0.4"),
              "/time/theta"));
}

TEST_CASE("sets by place read as they are written and state what cannot be")
{
    const auto with = [](const std::string& sets) {
        return replaced(kBodiesExample, "\"hold\": [{", "\"sets\": " + sets + ", \"hold\": [{");
    };
    const Scene s = parse_scene(with(R"({"a": {"box": {"from": [0, 0, 0], "to": [1, 1, 0]}},
                 "b": {"ball": {"centre": [0, 0, 1], "radius": 0.5}, "of": "nodes"},
                 "c": {"plane": {"at": [0, 0, 1], "normal": [0, 0, 2]}, "within": 1e-3},
                 "d": {"faces_like": {"at": [1, 0, 0]}}, "e": {"faces": [0, 4]},
                 "f": {"nodes": [7]}})"),
                                "s.json", {});
    const std::vector<SetInput>& sets = s.solids.at(0).sets;
    REQUIRE(sets.size() == 6);
    CHECK(sets[0].box.to == Vec3(1, 1, 0));
    CHECK(sets[1].of == "nodes");
    CHECK(sets[2].within == 1e-3);
    CHECK(sets[3].faces_like.angle == 30);
    CHECK(sets[4].faces == std::vector<int>{0, 4});
    CHECK(sets[5].nodes == std::vector<int>{7});
    const std::string resolved = resolved_scene(s);
    CHECK(resolved_scene(parse_scene(resolved, "again.json", {})) == resolved);

    const auto bad = [&](const std::string& sets) { return issues_of(with(sets)); };
    CHECK(has(bad("{}"), "/bodies/block/sets: found {}"));
    CHECK(has(bad(R"({"a b": {"faces": [1]}})"), "a name of letters, digits, _ and -"));
    CHECK(has(bad(R"({"a": {}})"), "/bodies/block/sets/a: found no place, allowed: one of"));
    CHECK(has(bad(R"({"a": {"faces": [1], "nodes": [2]}})"), "sets/a: found 2 places"));
    CHECK(has(bad(R"({"a": {"faces": [1.5]}})"), "sets/a/faces: found [1.5], allowed: a list"));
    CHECK(has(bad(R"({"a": {"faces": [-1]}})"), "sets/a/faces: found [-1]"));
    CHECK(has(bad(R"({"a": {"faces": [1], "within": 1}})"), "nothing without a \"plane\""));
    CHECK(has(bad(R"({"a": {"faces": [1], "of": "nodes"}})"), "sets/a/of: found \"nodes\""));
    CHECK(has(bad(R"({"all": {"faces": [1]}})"), "another name"));
    // Radians, where degrees are requested, are no angle that is taken for another.
    CHECK(has(bad(R"({"a": {"faces_like": {"at": [0, 0, 0], "angle": 0.52}}})"),
              "/angle: found 0.52, allowed: a number >= 5 and <= 180 [degree]"));
}
