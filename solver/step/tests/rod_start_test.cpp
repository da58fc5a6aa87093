#include "mesh/base/error.hpp"
#include "mesh/tests/relative.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

// Rods that begin in each other or in other bodies, and are separated.

using namespace amontons;
using test::relative;

namespace {

constexpr double kBarRadius = 0.005, kBarLength = 1, kEI = 2;

/// A rod of 1 m along x or y at a height.
std::string bar(const char* name, bool along_x, double height, const char* more)
{
    return fmt::format(
        R"("{}": {{"kind": "rod", "segments": [{{"length": {}, "radius": {}, "EI": {},
        "EA": 1e3, "element": 0.05, "density": 1000}}], "shape": {{"start": [{}, {}, {}], "direction": [{}, {}, 0]}}{}}})",
        name, kBarLength, kBarRadius, kEI, along_x ? -0.5 : 0.0, along_x ? 0.0 : -0.5, height,
        along_x ? 1 : 0, along_x ? 0 : 1, more);
}

constexpr const char* kClamped = R"(, "hold": [{"set": "start"}, {"set": "end"}])";

std::string crossed(double depth, const char* more, const char* law, const char* time)
{
    return R"("bodies": {)" + bar("low", true, 0, more) + ", " +
           bar("high", false, 2 * kBarRadius - depth, more) +
           R"(}, "contact": [{"between": ["low", "high"], "friction": 0.3)" + law + "}], " + time;
}

constexpr const char* kResolve = R"(, "start_overlap": "resolve")";
constexpr const char* kAtRest = R"("time": {"step": 1, "end": 1})";
constexpr const char* kInMotion = R"("time": {"kind": "dynamic", "step": 1e-3, "end": 0.01})";

} // namespace

TEST_CASE("clamped rods that begin in each other are separated by 192 EI / L^3 of half the depth")
{
    for (const double depth : {1e-4, 0.8 * kBarRadius}) {
        CAPTURE(depth);
        const Result r = done(crossed(depth, kClamped, kResolve, kAtRest));
        const double stiffness = 192 * kEI / std::pow(kBarLength, 3);
        const Vec3 force = r.vector("high_on_low_force");
        CHECK(force.z() == relative(-stiffness * depth / 2).epsilon(0.005));
        CHECK(r.summary.worst_penetration < 1e-9);
    }
}

TEST_CASE("a rod that begins in a floor or in a rigid body is separated from it")
{
    const double depth = 0.5 * kBarRadius;
    for (const char* other :
         {R"("other": {"kind": "obstacle", "surface": {"generate": "ball", "radius": 0.1,
              "centre": [0, 0, -0.1]}})",
          R"("other": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.1},
              "start": {"place": [0, 0, -0.1]}, "drive": {"z": 0}})"}) {
        const Result r =
            done(std::string(R"("bodies": {)") + other + ", " +
                 bar("rod", true, kBarRadius - depth, kClamped) +
                 R"(}, "contact": [{"between": ["rod", "other"], "start_overlap": "resolve"}], )" +
                 kAtRest);
        CHECK(r.vector("other_on_rod_force").z() ==
              relative(192 * kEI / std::pow(kBarLength, 3) * depth).epsilon(0.005));
    }
}

TEST_CASE("free rods in motion that begin in each other are separated at rest")
{
    const double depth = 0.5 * kBarRadius;
    const Result r = done(crossed(depth, "", kResolve, kInMotion));
    // Alike, so each moves by half the depth; nothing is left of the motion.
    CHECK(r.summary.worst_penetration < 1e-6 * kBarRadius);
    CHECK(r.summary.energy.kinetic < 1e-12);
    const double mass = 1000 * std::numbers::pi * kBarRadius * kBarRadius * kBarLength;
    CHECK(r.vector("momentum").norm() < 1e-9 * mass * kBarLength);
}

TEST_CASE("what is no start that can be separated is refused with its place")
{
    const auto wrong = [](const std::string& rest) {
        try {
            run(rest);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const std::string deep = crossed(1.2 * kBarRadius, kClamped, kResolve, kAtRest);
    CHECK(wrong(deep).find("low and high overlap by") != std::string::npos);
    const std::string fit = crossed(1e-3, kClamped, R"(, "start_overlap": "close")", kAtRest);
    CHECK(wrong(fit).find("low and high overlap by") != std::string::npos);
    CHECK(wrong(fit).find("\"resolve\"") != std::string::npos);
    CHECK(wrong(fit).find("\"close\" takes") == std::string::npos);
}
