#pragma once

#include "mesh/generate/plane.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/tests/keep.hpp"

#include <doctest/doctest.h>
#include <memory>
#include <string>

// Runs of small scenes of solids, rigid bodies and planes, for tests.

namespace amontons {

inline constexpr double kGravity = 9.81; // [m/s^2]

inline constexpr const char* kFloor =
    R"("floor": {"kind": "obstacle", "surface": {"generate": "plane"}})";
inline constexpr const char* kRubber =
    R"({"law": "neo_hooke", "youngs_modulus": 1e6, "poisson_ratio": 0.45})";

struct Result {
    RunSummary summary;
    std::vector<StepRecord> records;
    std::unique_ptr<Simulation> simulation;

    double value(const std::string& name, std::size_t step) const
    {
        return amontons::value(records[step], name);
    }
    double value(const std::string& name) const { return value(name, records.size() - 1); }
    Vec3 vector(const std::string& name, std::size_t step) const
    {
        return {value(name + "_x", step), value(name + "_y", step), value(name + "_z", step)};
    }
    Vec3 vector(const std::string& name) const { return vector(name, records.size() - 1); }
};

/// @param rest  members of the scene beside "schema"
/// @param stop  asked for before the first state
/// @param from  a saved state that the run goes on from
inline Result run(const std::string& rest, const std::vector<std::string>& overrides = {},
                  bool stop = false, const std::vector<std::byte>& from = {})
{
    const Scene scene = parse_scene("{\"schema\": 1, " + rest + "}", "test.json", overrides);
    std::vector<Obstacle> obstacles;
    for (const ObstacleInput& o : scene.obstacles) // planes are enough here
        obstacles.push_back({o.name, make_plane({o.surface.centre, o.surface.axis, 1})});
    Result r;
    r.simulation = make_simulation(scene, std::move(obstacles));
    if (!from.empty()) r.simulation->restore(from);
    Keep keep;
    const std::atomic<bool> stopped{stop};
    r.summary = r.simulation->run(keep, stopped);
    r.records = std::move(keep.records);
    return r;
}

} // namespace amontons
