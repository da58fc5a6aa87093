#include "solver/step/tests/body_runs.hpp"

using namespace amontons;

namespace {

/// A block that is held, pressed and touches the floor by its sets.
std::string block_with(const std::string& sets, const std::string& hold, const std::string& load,
                       const std::string& contact)
{
    return std::string("\"bodies\": {") + kFloor + R"(, "block": {"kind": "solid",
      "youngs_modulus": 1e5, "poisson_ratio": 0.3,
      "mesh": {"generate": "box", "size": [0.2, 0.1, 0.1], "centre": [0, 0, 0.05], "cells": [4, 2, 2]},
      "start": {"place": [0.3, 0, 0]}, )" +
           sets + R"("hold": [{"set": ")" + hold + R"("}], "loads": [{"set": ")" + load +
           R"(", "pressure": 500}]}}, "contact": [{"between": ["block", "floor"], "friction": 0.3,
      "surfaces": [")" +
           contact + R"(", ""]}], "time": {"step": 1, "end": 1})";
}

std::string set_refusal(const std::string& sets)
{
    try {
        run(block_with("\"sets\": {" + sets + "}, ", "x_min", "z_max", "z_min"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("sets by place hold and load and touch as those that the generator names, to the bit")
{
    const Result named = run(block_with("", "x_min", "z_max", "z_min"));
    const Result placed = run(block_with(
        R"("sets": {"root": {"box": {"from": [-0.1, -1, -1], "to": [-0.1, 1, 1]}},
                    "top": {"plane": {"at": [0, 0, 0.1], "normal": [0, 0, -1]}},
                    "sole": {"faces_like": {"at": [0.01, 0.01, 0], "angle": 30}}}, )",
        "root", "top", "sole"));
    REQUIRE(named.records.size() == placed.records.size());
    REQUIRE(named.value("floor_on_block_force_z") > 1);
    for (const Quantity& q : named.records.back().quantities) {
        std::string name = q.name;
        if (const std::size_t at = name.find("x_min"); at != std::string::npos)
            name.replace(at, 5, "root");
        CAPTURE(name);
        CHECK(placed.value(name) == q.value);
    }
}

TEST_CASE("a set that is empty or beside the body is refused with the nearest place of the body")
{
    using std::string;
    const auto has = [](const string& text, const char* part) {
        CAPTURE(text);
        CHECK(text.find(part) != string::npos);
    };
    const string empty = set_refusal(R"("a": {"box": {"from": [1, 0, 0], "to": [2, 1, 1]}})");
    has(empty, "test.json: /bodies/block/sets/a: found an empty set");
    has(empty, "the mesh reaches from (-0.1, -0.05, 0) to (0.1, 0.05, 0.1) [m]");
    has(set_refusal(R"("a": {"ball": {"centre": [0, 0, 0.05], "radius": 0.01}})"),
        "no face of the outside with all its nodes, allowed: a place that holds whole faces, or "
        "\"of\": \"nodes\"");
    has(set_refusal(R"("a": {"faces_like": {"at": [0, 0, 0.5]}})"),
        "(0, 0, 0.5), 0.4 m from the outside, allowed: a place on it; the nearest is (0, 0, 0.1)");
    has(set_refusal(R"("a": {"faces": [0, 100000]})"),
        "sets/a/faces: found face 100000, allowed: 0 to");
    has(set_refusal(R"("a": {"nodes": [0]})"),
        "sets/a/nodes: found node 0, allowed: a node of the mesh");
    has(set_refusal(R"("x_max": {"faces": [0]})"), "\"x_max\", a set of the mesh itself");
    CHECK(set_refusal(
              R"("a": {"nodes": [1]}, "b": {"box": {"from": [-1, -1, -1], "to": [1, 1, 1]}})") ==
          "");
}

TEST_CASE("nodes of a set are those that the file numbers and a set of nodes inside is held")
{
    const Result r = run(block_with(
        R"("sets": {"half": {"box": {"from": [-0.1, -1, -1], "to": [0.001, 1, 1]}, "of": "nodes"}}, )",
        "half", "z_max", "z_min"));
    CHECK(r.summary.status == "done");
    for (const BodyPlan& b : r.simulation->plan())
        for (const SetSize& s : b.sets) {
            if (s.name == "x_min") CHECK(s.area == doctest::Approx(0.01).epsilon(1e-12));
            // T10: 5 of 9 planes of nodes, 5 x 5 nodes each
            if (s.name == "half") CHECK(s.nodes == 5 * 25);
        }
}
