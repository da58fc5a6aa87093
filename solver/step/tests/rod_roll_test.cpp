#include "mesh/tests/relative.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

// Rods in motion on what they touch: the arms of their contacts are those of the start of a step.

using namespace amontons;
using test::relative;

namespace {

constexpr double kRodRadius = 1e-3, kLength = 0.1, kRodDensity = 8000;
constexpr const char* kRules[] = {R"("theta": 1)", R"("theta": 0.5)",
                                  R"("rule": "generalised_alpha", "spectral_radius": 0.5)"};

/// A rod along y on a plane.
/// @param v  its speed along x when the run begins [m/s]
std::string on_plane(const Vec3& gravity, double v, double friction, double step, double end,
                     const char* rule)
{
    return fmt::format(R"("gravity": [{}, 0, {}], "bodies": {{{},
        "rod": {{"kind": "rod", "segments": [{{"length": {}, "radius": {}, "EI": 1e-2,
            "element": 0.02, "density": {}}}], "shape": {{"start": [0, {}, {}],
            "direction": [0, 1, 0]}}, "velocity": [{}, 0, 0]}}}},
        "contact": [{{"between": ["rod", "floor"], "friction": {}}}],
        "time": {{"kind": "dynamic", "step": {}, "end": {}, {}}}, "accuracy": {{"contact": 1e-10}})",
                       gravity.x(), gravity.z(), kFloor, kLength, kRodRadius, kRodDensity,
                       -0.5 * kLength, kRodRadius, v, friction, step, end, rule);
}

const double kRodMass = kRodDensity * std::numbers::pi * kRodRadius * kRodRadius * kLength;

} // namespace

TEST_CASE("a rod thrown along a plane slides until it rolls, at two thirds of its speed")
{
    const double v = 0.1, friction = 0.3, end = 0.05; // it slides for v / (3 mu g) = 11 ms
    for (const char* rule : kRules)
        for (const double step : {1e-3, 2.5e-4}) {
            CAPTURE(rule);
            CAPTURE(step);
            const Result r = done(on_plane({0, 0, -kGravity}, v, friction, step, end, rule));
            CHECK(r.value("momentum_x") == relative(kRodMass * v * 2 / 3).epsilon(2e-3));
            CHECK(r.value("rod_end_z") == relative(kRodRadius).epsilon(1e-3));
            // What friction took: a third of the kinetic energy, to first order in the step.
            const double slides = v / (3 * friction * kGravity);
            CHECK(r.summary.energy.friction ==
                  relative(kRodMass * v * v / 6).epsilon(1.1 * step / slides));
            CHECK(std::abs(r.summary.energy.error()) < 0.02 * kRodMass * v * v);
        }
}

TEST_CASE("a rod rolls down a slope with two thirds of the weight along it")
{
    const double slope = 0.2, end = 0.1;
    const Vec3 gravity(kGravity * std::sin(slope), 0, -kGravity * std::cos(slope));
    for (const char* rule : kRules)
        for (const double step : {2e-3, 5e-4}) {
            CAPTURE(rule);
            CAPTURE(step);
            const Result r = done(on_plane(gravity, 0, 0.5, step, end, rule));
            CHECK(r.value("momentum_x") ==
                  relative(kRodMass * 2 / 3 * gravity.x() * end).epsilon(2e-3));
            CHECK(r.value("rod_end_z") == relative(kRodRadius).epsilon(1e-3));
        }
}
