#pragma once

#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/tests/keep.hpp"

#include <doctest/doctest.h>
#include <memory>
#include <string>

// Runs of small scenes, for tests.

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
/// @param stop  requested before the first state
/// @param from  a saved state that the run continues from
inline Result run(const std::string& rest, const std::vector<std::string>& overrides = {},
                  bool stop = false, const std::vector<std::byte>& from = {})
{
    const Scene scene = parse_scene("{\"schema\": 1, " + rest + "}", "test.json", overrides);
    Result r;
    r.simulation = make_simulation(scene, build_obstacles(scene));
    if (!from.empty()) r.simulation->restore(from);
    Keep keep;
    const std::atomic<bool> stopped{stop};
    r.summary = r.simulation->run(keep, stopped);
    r.records = std::move(keep.records);
    return r;
}

/// One that ends without a refusal.
inline Result done(const std::string& rest)
{
    Result r = run(rest);
    REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
    return r;
}

} // namespace amontons
