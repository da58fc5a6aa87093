#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

// Instruments in one another, in motion.

using namespace amontons;

namespace {

constexpr double kInner = 4e-4, kOuter = 8e-4; // radii [m]

std::string beam(const char* name, double radius, double bore, double EI, double density,
                 const std::string& fed, double length = 0.12)
{
    return fmt::format(R"("{}": {{"kind": "beam", "segments": [{{"length": {}, "radius": {},
        "inner_radius": {}, "EI": {}, "EA": 1e3, "density": {}, "element": 4e-3}}],
        "introducer": {{"direction": [1, 0, 0]}}, "drive": {{"insertion": {}}}}})",
                       name, length, radius, bore, EI, density, fed);
}

std::string in_motion(const std::string& bodies, const std::string& pairs, double step, double end)
{
    return fmt::format(R"("gravity": [0, 0, -9.81], "bodies": {{{}}}, "contact": [{}],
        "time": {{"kind": "dynamic", "step": {}, "end": {}}}, "accuracy": {{"contact": 1e-11}})",
                       bodies, pairs, step, end);
}

} // namespace

TEST_CASE("a wire that fills the bore of a catheter falls with it as one of both stiffnesses and "
          "masses")
{
    const double EI[2] = {1e-4, 2e-4}, density[2] = {8000, 1500};
    const double mass = density[0] * std::numbers::pi * kInner * kInner +
                        density[1] * std::numbers::pi * (kOuter * kOuter - kInner * kInner);
    const char* const out = "[[0, 0.06], [1, 0.06]]";
    const Result both = done(
        in_motion(beam("wire", kInner, 0, EI[0], density[0], out, 0.1) + "," +
                      beam("catheter", kOuter, kInner, EI[1], density[1], out, 0.1),
                  R"({"between": ["catheter", "wire"], "friction": 0})", 5e-4, 0.04));
    const Result one = done(in_motion(beam("wire", kOuter, 0, EI[0] + EI[1],
                                           mass / (std::numbers::pi * kOuter * kOuter), out, 0.1),
                                      "", 5e-4, 0.04));
    REQUIRE(both.records.size() == one.records.size());
    CHECK(one.value("tip_z") < -1e-3);
    for (std::size_t i = 10; i < one.records.size(); i += 10) {
        CAPTURE(i);
        const double z = one.value("tip_z", i);
        CHECK(both.value("wire_tip_z", i) == doctest::Approx(z).epsilon(2e-3));
        CHECK(both.value("catheter_tip_z", i) == doctest::Approx(z).epsilon(2e-3));
    }
    CHECK(both.summary.energy.kinetic ==
          doctest::Approx(one.summary.energy.kinetic).epsilon(1e-2));
    CHECK(std::abs(both.summary.energy.error()) < 1e-2 * both.summary.energy.work_absolute);
}

TEST_CASE("a wire with clearance in a catheter, both fed, falls and strikes: energy closes" *
          doctest::test_suite("slow"))
{
    for (const double friction : {0.0, 0.2}) {
        CAPTURE(friction);
        double error[2] = {};
        for (int k = 0; k < 2; ++k) {
            const Result r = done(in_motion(
                beam("wire", 3e-4, 0, 1e-4, 8000, "[[0, 0.03], [0.2, 0.08]]") + "," +
                    beam("catheter", kOuter, 5e-4, 2e-4, 1500, "[[0, 0.03], [0.2, 0.05]]"),
                fmt::format(R"({{"between": ["catheter", "wire"], "friction": {}}})", friction),
                k ? 5e-4 : 1e-3, 0.2));
            CHECK(r.summary.uncertified_steps == 0);
            error[k] = std::abs(r.summary.energy.error()) / r.summary.energy.work_absolute;
            CHECK(r.summary.energy.kinetic > 0);
            CHECK(r.summary.energy.released > -1e-3 * r.summary.energy.work_absolute);
        }
        CAPTURE(error[0]);
        CHECK(error[1] < 0.02);
    }
}
