#include "solver/scene/instruments.hpp"

#include "solver/scene/tests/issues_of.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

std::string scene_with(const std::string& wire)
{
    return R"({"schema": 1, "bodies": {"wire": {"kind": "beam", )" + wire +
           R"(, "drive": {"insertion": [[0, 0], [1, 0.01]]}}}, "time": {"step": 0.02, "end": 1}})";
}

std::string issues_with(const std::string& wire)
{
    return issues_of(scene_with(wire));
}

BeamInput beam(const std::string& wire)
{
    return parse_scene(scene_with(wire), "s.json").beams.at(0);
}

} // namespace

TEST_CASE("every instrument of the library is a beam that a scene can use")
{
    for (const Instrument& i : instruments()) {
        CAPTURE(i.name);
        CHECK_FALSE(i.source.empty());
        const BeamInput b = beam("\"instrument\": \"" + i.name + "\"");
        double length = 0, turned = 0, bends = 0;
        for (const BeamSegment& s : b.segments) {
            length += s.length;
            turned += s.length * s.curvature;
            CHECK(s.radius == i.diameter / 2);
            CHECK(s.inner_radius == i.bore / 2);
            CHECK(s.element <= s.length);
        }
        for (const TipPiece& p : i.tip)
            bends += p.length * p.curvature;
        CHECK(length == doctest::Approx(i.length).epsilon(1e-12));
        CHECK(turned == doctest::Approx(bends).epsilon(1e-12));
        CHECK(b.segments.front().EI[0] == i.EI);
        CHECK(b.segments.back().EI[1] == doctest::Approx(i.EI_tip).epsilon(1e-12));
        // EI and EA of one material: their ratio is that of a ring's second moment and area.
        CHECK(b.segments.front().EA[0] * (i.diameter * i.diameter + i.bore * i.bore) ==
              doctest::Approx(16 * i.EI).epsilon(1e-12));
        // The next segment begins as stiff as this one ends.
        for (std::size_t k = 0; k + 1 < b.segments.size(); ++k)
            CHECK(b.segments[k].EI[1] == doctest::Approx(b.segments[k + 1].EI[0]).epsilon(1e-12));
    }
    // Bending stiffness of the wires as the paper's moduli give it (0.889 mm)
    CHECK(beam(R"("instrument": "guidewire-stiff")").segments[0].EI[0] ==
          doctest::Approx(5.2e-4).epsilon(5e-3));
    CHECK(beam(R"("instrument": "guidewire-lunderquist")").segments[0].EI[0] ==
          doctest::Approx(4.86e-3).epsilon(5e-3));
}

TEST_CASE("what the scene specifies of an instrument overrides the library")
{
    const char* wire = R"("instrument": "guidewire-stiff", "length": 0.9, "element": 5e-3,
                          "tip": {"shape": "angled", "radius": 4e-3, "angle": 0.5})";
    const BeamInput b = beam(wire);
    REQUIRE(b.segments.size() == 4); // shaft, taper, bend, straight end
    CHECK(b.segments[0].length == doctest::Approx(0.87));
    CHECK(b.segments[0].element == 5e-3);
    CHECK(b.segments[2].length == doctest::Approx(2e-3));
    CHECK(b.segments[2].curvature == doctest::Approx(250));
    CHECK(b.segments[3].length == doctest::Approx(5e-3));
    CHECK(b.segments[3].curvature == 0);
    const BeamInput tail = beam(R"("instrument": "catheter-5f", "tip": {"shape": "pigtail"})");
    CHECK(tail.segments.back().length * tail.segments.back().curvature ==
          doctest::Approx(1.75 * std::numbers::pi));
    CHECK(beam(R"("instrument": "guidewire-stiff", "tip": {"shape": "straight"})")
              .segments.back()
              .curvature == 0);
    // The resolved scene has the segments, and reads to the same again.
    const Scene s = parse_scene(scene_with(wire), "s.json");
    const std::string text = resolved_scene(s);
    CHECK(resolved_scene(parse_scene(text, "s.json")) == text);
}

TEST_CASE("instruments that cannot be")
{
    CHECK(has(issues_with(R"("instrument": "guidewire-stif")"), "\"guidewire-stiff\")"));
    CHECK(has(issues_with(R"("plane": [0, 1, 0])"), "/bodies/wire/segments: found nothing"));
    CHECK(has(issues_with(R"("instrument": "catheter-5f", "segments": [{"length": 0.3,
                        "radius": 4e-4, "EI": 5e-4, "element": 5e-3}])"),
              "either \"instrument\" or \"segments\""));
    CHECK(has(issues_with(R"("instrument": "catheter-5f", "tip": {"shape": "J", "radius": 5e-4})"),
              "/bodies/wire/tip/radius: found 0.0005, allowed: > 0.000835 [m]"));
    CHECK(has(issues_with(R"("instrument": "catheter-5f", "tip": {"radius": 5e-3})"),
              "/bodies/wire/tip: found no \"shape\""));
    CHECK(has(issues_with(R"("instrument": "catheter-simmons", "tip": {"length": 5e-3})"),
              "/bodies/wire/tip: found no \"shape\""));
    CHECK(has(issues_with(R"("instrument": "guidewire-stiff",
                           "tip": {"shape": "straight", "radius": 5e-3})"),
              "/bodies/wire/tip: found a radius"));
    CHECK(has(issues_with(R"("instrument": "guidewire-stiff", "length": 0.02)"),
              "/bodies/wire/length: found 0.02, allowed: > 0.03 [m]"));
    CHECK(
        has(issues_with(R"("instrument": "guidewire-stiff", "length": -1)"), "/length: found -1"));
    const char* segment = R"("segments": [{"length": 0.3, "radius": 4e-4, "EI": 5e-4,
                              "element": 5e-3, )";
    CHECK(has(issues_with(segment + std::string("\"inner_radius\": 4e-4}]")),
              "/segments/0/inner_radius: found 0.0004, allowed: < 0.0004 [m], the radius"));
    CHECK(has(issues_with(segment + std::string("\"curvature\": -2500}]")),
              "tighter than the wire's own radius"));
    CHECK(has(issues_with(segment + std::string("\"EA\": 100}], \"length\": 0.3")),
              "only an \"instrument\" has it"));
    CHECK(has(issues_with(R"("segments": [{"length": 0, "radius": 4e-4, "EI": 5e-4,
                           "element": 5e-3}])"),
              "/segments/0/length: found 0"));
}
