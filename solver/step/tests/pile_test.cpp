// Piles of bricks in bond: contact problems that are solved by what their bodies are.

#include "mesh/generate/plane.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>

using namespace amontons;

namespace {

constexpr double kSize = 0.1, kGap = 0.002, kStep = 1e-3;

/// @param soft  every so many bricks one is elastic; 0: none
std::string pile(int side, int layers, int soft, int steps)
{
    std::string bodies = kFloor;
    int brick = 0;
    for (int layer = 0; layer < layers; ++layer)
        for (int i = 0; i < side - layer % 2; ++i)
            for (int j = 0; j < side - layer % 2; ++j) {
                const double shift = 0.5 * (layer % 2);
                const std::string kind =
                    soft > 0 && ++brick % soft == 0
                        ? R"("kind": "solid", "youngs_modulus": 1e7, "poisson_ratio": 0.3,
                             "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1],
                                      "cells": [2, 2, 2], "element": "H8"})"
                        : R"("kind": "rigid", "shape": {"generate": "box",
                             "size": [0.1, 0.1, 0.1]})";
                bodies += fmt::format(
                    R"(, "b{}_{}_{}": {{{}, "density": 1000,
                       "start": {{"place": [{:.17g}, {:.17g}, {:.17g}]}}}})",
                    layer, i, j, kind, (i + shift) * (kSize + kGap), (j + shift) * (kSize + kGap),
                    (layer + 0.5) * kSize);
            }
    return fmt::format(R"("bodies": {{{}}},
        "contact": [{{"between": ["*", "*"], "friction": 0.4}}], "gravity": [0, 0, {}],
        "time": {{"kind": "dynamic", "step": {}, "end": {}}},
        "accuracy": {{"contact": 1e-6}})",
                       bodies, -kGravity, kStep, steps * kStep);
}

} // namespace

TEST_CASE("a pile of 800 contacts gives the floor its weight less what its momentum takes")
{
    constexpr int kSide = 5, kLayers = 4;
    const Result r = run(pile(kSide, kLayers, 0, 2));
    REQUIRE(r.summary.message == "");
    double floor = 0, momentum = 0;
    int bricks = 0;
    for (const ContactRecord& c : r.records.back().contacts)
        if (c.body_b == 0) floor += c.force.z();
    const double mass = 1000 * std::pow(kSize, 3);
    for (int layer = 0; layer < kLayers; ++layer)
        for (int i = 0; i < kSide - layer % 2; ++i)
            for (int j = 0; j < kSide - layer % 2; ++j, ++bricks) {
                const std::string name = fmt::format("b{}_{}_{}_velocity_z", layer, i, j);
                momentum += mass * (r.value(name, 2) - r.value(name, 1));
            }
    const double weight = bricks * mass * kGravity;
    CHECK(floor - weight == doctest::Approx(momentum / kStep).epsilon(1e-6 * weight));
    CHECK(floor > 0.5 * weight);
}

TEST_CASE("a pile with elastic bricks among rigid ones is solved at rest where its bricks are")
{
    // The motions of the bodies themselves enter the certificate: a refusal if W is not
    // theirs.
    const Result r = run(pile(5, 4, 4, 3));
    REQUIRE(r.summary.message == "");
    CHECK(r.summary.energy.friction >= 0);
    for (const char* name : {"b0_2_2", "b1_1_1", "b2_2_2"})
        CHECK(std::abs(r.value(fmt::format("{}_velocity_z", name))) < 3 * kStep * kGravity);
}

TEST_CASE("a large pile has the same bits for any number of threads" * doctest::test_suite("slow"))
{
    const std::string text = "{\"schema\": 1, " + pile(10, 5, 40, 1) + "}";
    const Scene scene = parse_scene(text, "pile.json", {});
    std::vector<Vec3> one;
    for (const int threads : {1, 3}) {
        std::vector<Obstacle> obstacles;
        for (const ObstacleInput& o : scene.obstacles)
            obstacles.push_back({o.name, make_plane({o.surface.centre, o.surface.axis, 1})});
        const auto simulation = make_simulation(scene, std::move(obstacles), {"", threads});
        Keep keep;
        const std::atomic<bool> stop{false};
        REQUIRE(simulation->run(keep, stop).message == "");
        std::vector<Vec3> numbers;
        for (const ContactRecord& c : keep.records.back().contacts)
            numbers.insert(numbers.end(), {c.point, c.force, c.slip});
        REQUIRE(numbers.size() > 3 * 3000);
        if (threads == 1)
            one = numbers;
        else
            CHECK(numbers == one);
    }
}
