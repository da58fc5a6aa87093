#include "mesh/tests/relative.hpp"
#include "solver/scene/tests/issues_of.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

// Instruments in one another beside other bodies: rods fed from one sheath, one in the other's
// bore.

using namespace amontons;
using test::relative;

namespace {

constexpr double kBeamElement = 2.5e-3; // length [m]

/// @param density  [kg/m^3]; 0: none
std::string nested_beam(const char* name, double radius, double bore, double EI, double density,
                        const std::string& fed, double z = 0)
{
    const std::string mass = density > 0 ? fmt::format(R"("density": {}, )", density) : "";
    return fmt::format(R"("{}": {{"kind": "beam", "segments": [{{"length": 0.14, "radius": {},
        "inner_radius": {}, "EI": {}, "EA": 1e3, {}"element": {}}}],
        "introducer": {{"at": [0, 0, {}], "direction": [1, 0, 0]}}, "drive": {{"insertion": {}}}}})",
                       name, radius, bore, EI, mass, kBeamElement, z, fed);
}

/// A catheter and a wire in a bend of 40 mm, the wire ahead or behind, the catheter over it.
/// @param beside  another body of the scene: then they are rods
std::string in_bend(const std::string& beside, double friction)
{
    return fmt::format(
        R"("bodies": {{{0}"tube": {{"kind": "obstacle", "surface": {{"generate": "tube",
        "radius": 0.003, "centreline": {{"normal": [0, 1, 0], "pieces": [{{"length": 0.02}},
        {{"radius": 0.04, "angle": 2}}]}}}}}}, {1}, {2}}},
        "contact": [{{"between": ["wire", "tube"], "friction": {3}}},
                    {{"between": ["catheter", "tube"], "friction": {3}}},
                    {{"between": ["catheter", "wire"], "friction": {3}}}],
        "time": {{"step": 0.02, "end": 3.5}})",
        beside,
        nested_beam("wire", 4e-4, 0, 2e-4, 0, "[[0, 0.005], [1, 0.06], [3, 0.06], [4, 0.03]]"),
        nested_beam("catheter", 9e-4, 6e-4, 1e-4, 0, "[[1, 0.005], [2, 0.05], [3, 0.075]]"),
        friction);
}

/// A driven ball that is far away.
constexpr const char* kFarBall = R"("far": {"kind": "rigid", "drive": {"z": 0},
    "shape": {"generate": "ball", "radius": 0.001}, "start": {"place": [0, -1, 0]}}, )";

constexpr double kBoxMass = 2e-4, kBoxFriction = 0.3, kBoxSide = 0.004;

/// A catheter with a wire in it before a free box on a floor.
std::string before_box(double catheter, double wire, double in_bore, bool moving, double step)
{
    const double density = moving ? 1000 : 0;
    return fmt::format(
        R"("gravity": [0, 0, -9.81], "bodies": {{
        "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
        "box": {{"kind": "rigid", "shape": {{"generate": "box", "size": [{0}, {0}, {0}]}}, "mass": {1},
                 "start": {{"place": [0.034, 0, {2}]}}}},
        {3}, {4}}},
        "contact": [{{"between": ["box", "floor"], "friction": {5}}},
                    {{"between": ["catheter", "box"]}}, {{"between": ["wire", "box"]}},
                    {{"between": ["catheter", "wire"], "friction": {6}}}],
        "time": {{"kind": "{7}", "step": {8}, "end": 1}})",
        kBoxSide, kBoxMass, kBoxSide / 2,
        nested_beam("wire", 4e-4, 0, 2e-3, density, fmt::format("[[0, 0.01], [1, {}]]", wire),
                    kBoxSide / 2),
        nested_beam("catheter", 9e-4, 6e-4, 1e-3, density,
                    fmt::format("[[0, 0.012], [1, {}]]", catheter), kBoxSide / 2),
        kBoxFriction, in_bore, moving ? "dynamic" : "quasi_static", step);
}

/// Whether all contacts with the tube are where an instrument has its own: at nodes and half-way
/// between two. Rods touch what is sharper than they are anywhere between these, too.
bool touches_where_instruments_do(const StepRecord& r)
{
    constexpr double kPlace = 1.5e-6; // [m]: a contact of 0.1 N on a bend of 37 mm pushes by 4e-6 N
    return std::ranges::all_of(r.contacts, [&](const ContactRecord& c) {
        return c.body_b != 0 || std::ranges::any_of(r.beams, [&](const BeamRecord& b) {
                   return std::ranges::any_of(b.points, [&](const Vec3& x) {
                       const double way = Vec3(c.point - x).cross(c.normal).norm();
                       return std::min(way, std::abs(way - kBeamElement / 2)) < kPlace;
                   });
               });
    });
}

/// Records of the two runs that are at one time, as are those before them.
std::vector<std::array<std::size_t, 2>> same_steps(const Result& one, const Result& two)
{
    const auto apart = [&](std::size_t k, std::size_t l) {
        return std::abs(one.records[k].time - two.records[l].time) > 1e-9;
    };
    std::vector<std::array<std::size_t, 2>> same;
    for (std::size_t k = 1, l = 1; k < one.records.size(); ++k) {
        while (l < two.records.size() && two.records[l].time < one.records[k].time - 1e-9)
            ++l;
        if (l == two.records.size()) break;
        // Where one of the two cuts its steps otherwise, friction differs.
        if (!apart(k, l) && !apart(k - 1, l - 1)) same.push_back({k, l});
    }
    return same;
}

} // namespace

TEST_CASE("a wire and its catheter in a bend need the same pushes as rods and as instruments")
{
    for (const double friction : {0.0, 0.1}) {
        CAPTURE(friction);
        const Result alone = done(in_bend("", friction)), rods = done(in_bend(kFarBall, friction));
        CHECK(rods.summary.uncertified_steps == 0);
        CHECK(rods.summary.worst_penetration < 1e-8);
        double largest[2] = {}, off[2] = {};
        const char* const push[2] = {"wire_push_force", "catheter_push_force"};
        int compared = 0;
        for (const auto& [k, l] : same_steps(alone, rods)) {
            if (!touches_where_instruments_do(rods.records[l])) continue; // the next test
            ++compared;
            for (int w = 0; w < 2; ++w) {
                const double expected = alone.value(push[w], k);
                largest[w] = std::max(largest[w], std::abs(expected));
                off[w] = std::max(off[w], std::abs(expected - rods.value(push[w], l)));
            }
        }
        CHECK(compared >= 100);
        for (int w = 0; w < 2; ++w) {
            CAPTURE(push[w]);
            CHECK(largest[w] > 0.01);
            CHECK(off[w] < 1e-4 * largest[w]);
        }
    }
}

// An instrument touches at its nodes and half-way between them: on the inner side of a bend, which
// is sharper than the wire, it stands in the wall beside them, and a contact on a slope pushes it
// along. The latter error is in proportion to the distance of these places.
TEST_CASE("instruments that are rods touch the inner side of a bend where shorter elements do")
{
    const std::vector<std::string> until = {"time.step=0.025", "time.end=0.95"};
    std::vector<std::string> shorter = until;
    for (const char* name : {"wire", "catheter"})
        shorter.push_back(fmt::format("bodies.{}.segments.0.element={}", name, kBeamElement / 8));
    const Result alone = run(in_bend("", 0), until), rods = run(in_bend(kFarBall, 0), until),
                 fine = run(in_bend("", 0), shorter);
    for (const Result* r : {&alone, &rods, &fine})
        REQUIRE(r->summary.message == "");
    const auto farthest = [&](const Result& instrument) {
        double most = 0;
        int between = 0;
        for (std::size_t l = 0; l < rods.records.size(); ++l) {
            if (touches_where_instruments_do(rods.records[l])) continue;
            // Without friction the steps before do not matter.
            const auto same = std::ranges::find_if(instrument.records, [&](const StepRecord& r) {
                return std::abs(r.time - rods.records[l].time) < 1e-9;
            });
            if (same == instrument.records.end()) continue;
            ++between;
            const auto k = std::size_t(same - instrument.records.begin());
            most = std::max(most, std::abs(instrument.value("wire_push_force", k) -
                                           rods.value("wire_push_force", l)));
        }
        CHECK(between >= 4);
        return most;
    };
    CHECK(farthest(fine) < farthest(alone) / 8);
    const auto in_wall = [](const Result& r) { return r.summary.worst_overlap.depth; };
    CHECK(in_wall(alone) > 1e-6);
    CHECK(in_wall(rods) < 1e-8);
}

TEST_CASE("a catheter with a wire in it pushes a free box with what its friction holds")
{
    const double slides = kBoxFriction * kBoxMass * kGravity;
    for (const double in_bore : {0.0, 0.2}) {
        CAPTURE(in_bore);
        // The catheter is ahead, then the wire.
        const Result c = done(before_box(0.06, 0.02, in_bore, false, 0.1));
        CHECK(c.value("catheter_push_force") + c.value("wire_push_force") ==
              relative(slides).epsilon(1e-4));
        if (in_bore == 0) CHECK(std::abs(c.value("wire_push_force")) < 1e-4 * slides);
        // A box ahead of a point that pushes it is unstable: in a step longer than itself it may
        // turn and come to lie beside the wire.
        const Result w = done(before_box(0.02, 0.06, in_bore, false, 0.05));
        CHECK(w.value("catheter_push_force") + w.value("wire_push_force") ==
              relative(slides).epsilon(1e-4));
        if (in_bore == 0) CHECK(std::abs(w.value("catheter_push_force")) < 1e-4 * slides);
        CHECK(w.value("box_x") == relative(0.06 + 4e-4 + kBoxSide / 2).epsilon(1e-5));
    }
}

TEST_CASE("a wire and its catheter hang out of a sheath as a beam of both stiffnesses and weights")
{
    constexpr double kClearance = 1e-5, kWireRadius = 4e-4, kCatheterRadius = 8e-4, kOut = 0.1;
    const double EI[2] = {1e-4, 2e-4}, density[2] = {8000, 1500};
    for (const char* kind : {"quasi_static", "dynamic"}) {
        CAPTURE(kind);
        const bool moving = std::string(kind) == "dynamic";
        const std::string text = fmt::format(
            R"("gravity": [0, 0, -9.81], "bodies": {{{}, {}}}, "contact": [{{"between": ["wire", "catheter"]}}],
            "time": {{"kind": "{}", "step": {}, "end": {}{}}})",
            nested_beam("wire", kWireRadius, 0, EI[0], density[0],
                        fmt::format("[[0, {0}], [1, {0}]]", kOut)),
            nested_beam("catheter", kCatheterRadius, kWireRadius + kClearance, EI[1], density[1],
                        fmt::format("[[0, {0}], [1, {0}]]", kOut)),
            kind, moving ? 0.05 : 1, moving ? 3 : 1, moving ? R"(, "damping": 20)" : "");
        const Result r = done(text);
        const double pi = std::numbers::pi,
                     weight = kGravity * (density[0] * pi * kWireRadius * kWireRadius +
                                          density[1] * pi *
                                              (kCatheterRadius * kCatheterRadius -
                                               std::pow(kWireRadius + kClearance, 2))),
                     sag = weight * std::pow(kOut, 4) / (8 * (EI[0] + EI[1]));
        for (const char* name : {"wire", "catheter"}) {
            CAPTURE(name);
            CHECK(-r.value(std::string(name) + "_tip_z") ==
                  doctest::Approx(sag).epsilon(1.5 * kClearance / sag));
        }
        // Alone the wire would hang farther than that by far.
        CHECK(r.vector("wire_on_catheter_force").norm() > 0);
    }
}

TEST_CASE("a wire in a catheter that is fed beside a box in motion keeps its energy balance")
{
    const Result r = done(before_box(0.05, 0.045, 0.1, true, 5e-3));
    CHECK(r.summary.uncertified_steps == 0);
    CHECK(std::abs(r.summary.energy.error()) < 0.02 * r.summary.energy.work_absolute);
    CHECK(r.value("catheter_push_force") + r.value("wire_push_force") ==
          relative(kBoxFriction * kBoxMass * kGravity).epsilon(0.02));
}

TEST_CASE("instruments in one another beside bodies that cannot be are refused with their place")
{
    const std::string good = in_bend(kFarBall, 0.1);
    const auto wrong = [&](const std::vector<std::string>& overrides) {
        return issues_of("{\"schema\": 1, " + good + "}", overrides);
    };
    CHECK(wrong({}) == "");
    // A catheter that the wire fills, or that it does not fit in.
    CHECK(has(wrong({"bodies.catheter.segments.0.inner_radius=4e-4"}), "clearance"));
    CHECK(has(wrong({"bodies.catheter.segments.0.inner_radius=3e-4"}), "/contact/2/between"));
    CHECK(has(wrong({"bodies.wire.plane=[0,1,0]"}), "/bodies/wire/plane"));
    CHECK(has(wrong({"bodies.wire.hold.x=[[0,0],[1,0]]"}), "/bodies/wire/hold"));
}
