#include "solver/scene/read.hpp"

#include "mesh/base/error.hpp"
#include "solver/scene/fields.hpp"
#include "solver/scene/tests/issues_of.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <set>
#include <string>

using namespace amontons;

namespace {

const char* const kWireExample = R"({
  // The example of the interface page.
  "schema": 1,
  "title": "A wire in a bent tube",
  "bodies": {
    "tube": {"kind": "obstacle",
             "surface": {"generate": "tube", "centreline": {"file": "double_u.csv"}, "radius": 0.004}},
    "wire": {"kind": "beam",
             "segments": [{"length": 0.30, "radius": 4.445e-4, "EI": 5.2e-4, "GJ": 4.0e-4, "EA": 5000, "element": 2.5e-3},
                          {"length": 0.0148, "radius": 4.445e-4, "EI": [5.2e-4, 2.7e-4], "element": 1.25e-3},
                          {"length": 0.0152, "radius": 4.445e-4, "EI": [2.7e-4, 2e-5], "curvature": 82.6, "element": 1.25e-3}],
             "introducer": {"at": [0, 0, 0], "direction": [1, 0, 0]},
             "drive": {"insertion": [[0, 0], [15, 0.3]], "twist": [[15, 0], [17, 3.14159]]}}
  },
  "contact": [{"between": ["wire", "tube"], "friction": 0.1}],
  "time":    {"kind": "quasi_static", "step": 0.02, "end": 17},
  "accuracy": {"contact": 1e-8},
  "output":  {"every": 10}
})";

Scene read(const std::vector<std::string>& overrides = {})
{
    return parse_scene(kWireExample, "dir/scene.json", overrides);
}

/// The example with one piece of text replaced by another.
std::string with(const std::string& old, const std::string& now)
{
    return replaced(kWireExample, old, now);
}

} // namespace

TEST_CASE("a scene reads as it is written")
{
    const Scene s = read();
    CHECK(s.title == "A wire in a bent tube");
    CHECK(s.order == std::vector<std::string>{"tube", "wire"});
    REQUIRE(s.obstacles.size() == 1);
    CHECK(s.obstacles[0].surface.generate == "tube");
    CHECK(s.obstacles[0].surface.centreline.file == "double_u.csv");
    CHECK(s.obstacles[0].surface.radius == 0.004);
    REQUIRE(s.beams.size() == 1);
    const BeamInput& w = s.beams[0];
    REQUIRE(w.segments.size() == 3);
    CHECK(w.segments[0].EI == std::array{5.2e-4, 5.2e-4});
    CHECK(w.segments[0].GJ == std::array{4e-4, 4e-4});
    CHECK(w.segments[2].EI == std::array{2.7e-4, 2e-5});
    CHECK(w.segments[2].curvature == 82.6);
    CHECK(w.insertion == CurvePoints{{0, 0}, {15, 0.3}});
    CHECK(w.twist.size() == 2);
    CHECK(w.introducer.direction == Vec3{1, 0, 0});
    CHECK(s.contact.at(0).friction == 0.1);
    CHECK(s.time.end == 17);
    CHECK(s.output.every == 10);
    CHECK(beside(s, "double_u.csv") == "dir/double_u.csv");
    CHECK(beside(s, "/abs/a.csv") == "/abs/a.csv");
}

TEST_CASE(
    "a text in place of a centreline is its file, and what is no object is refused with its fields")
{
    const std::string line = "{\"file\": \"double_u.csv\"}";
    const Scene s = parse_scene(with(line, "\"double_u.csv\""), "scene.json", {});
    CHECK(s.obstacles[0].surface.centreline.file == "double_u.csv");
    CHECK(has(issues_of(with(line, "[1, 2]")),
              "/bodies/tube/surface/centreline: found [1,2], allowed: an object {\"file\": ..., "
              "\"scale\": ..., \"pieces\": ..., "));
}

TEST_CASE("stiffnesses that are not given follow from EI and the radius")
{
    const BeamSegment tip = read().beams[0].segments[2];
    for (std::size_t end : {0u, 1u}) {
        CHECK(tip.GJ[end] == doctest::Approx(0.77 * tip.EI[end]).epsilon(1e-15));
        CHECK(tip.EA[end] ==
              doctest::Approx(4 * tip.EI[end] / (4.445e-4 * 4.445e-4)).epsilon(1e-14));
    }
    CHECK(tip.GA == std::array{0.0, 0.0});
}

TEST_CASE("the resolved scene reads to the same scene")
{
    const Scene s = read();
    const std::string resolved = resolved_scene(s);
    CHECK(resolved_scene(parse_scene(resolved, "again.json")) == resolved);
    CHECK(has(resolved, "\"smallest_step\"") == false);
    CHECK(resolved_scene(read({"contact.0.friction=0.2"})) != resolved);
}

TEST_CASE("an override replaces one value with dots or with slashes")
{
    CHECK(read({"contact/0/friction=0.2"}).contact[0].friction == 0.2);
    CHECK(read({"contact.0.friction=0.2"}).contact[0].friction == 0.2);
    CHECK(read({"/time/end=1"}).time.end == 1);
    CHECK(read({"bodies.wire.segments.0.EI=[1e-3,2e-3]"}).beams[0].segments[0].EI ==
          std::array{1e-3, 2e-3});
    CHECK(read({"title=a plain text"}).title == "a plain text");
    CHECK(read({"output.picture=false"}).output.picture == false); // not in the file
    CHECK(read({"bodies.wire.introducer.fade=0.005"}).beams[0].introducer.fade == 0.005);
}

TEST_CASE("an override of an unknown path names the nearest")
{
    CHECK(has(issues_of(kWireExample, {"contact.0.frction=0.2"}), "\"friction\""));
    CHECK(has(issues_of(kWireExample, {"bodies.wier.segments.0.EI=1"}), "\"wire\""));
    CHECK(has(issues_of(kWireExample, {"bodies.wire.segments.7.EI=1"}), "0 to 2"));
    CHECK(has(issues_of(kWireExample, {"tiem.end=1"}), "\"time\""));
    CHECK(has(issues_of(kWireExample, {"time.end.x=1"}), "/time/end"));
    CHECK(has(issues_of(kWireExample, {"nonsense"}), "PATH=VALUE"));
    CHECK(has(issues_of(kWireExample, {"time.end=NaN"}), "(--set): found \"NaN\""));
}

TEST_CASE("broken JSON is reported with its line and column")
{
    CHECK(has(issues_of("{\n  \"schema\": 1,\n  \"bodies\" {}\n}"), "s.json: line 3, column 12"));
    CHECK(has(issues_of("{\"schema\": NaN}"), "line 1, column 12"));
    CHECK(has(issues_of("{\n\"schema\": 1e999}"), "line 2, column 11: found number 1e999"));
    CHECK(has(issues_of("{\"schema\": 1"), "line 1"));
    CHECK(has(issues_of(""), "an empty file"));
    CHECK(has(issues_of(" \n"), "an empty file"));
    CHECK(has(issues_of("[1]"), "a scene"));
    CHECK(has(issues_of(with("\"title\"", "\"schema\"")), "twice"));
    CHECK(has(issues_of("{\"a\": \"\xff\"}"), "line 1"));
}

TEST_CASE("each wrong value is reported with its place and what is allowed")
{
    const auto bad = [](const std::string& old, const std::string& now) {
        return issues_of(with(old, now));
    };
    CHECK(issues_of(kWireExample).empty());
    CHECK(bad("\"friction\"", "\"frction\"") ==
          "s.json: /contact/0: found field \"frction\", allowed: \"friction\" (nearest name)");
    CHECK(bad("\"radius\": 0.004", "\"radius\": -0.004") ==
          "s.json: /bodies/tube/surface/radius: found -0.004, allowed: a number >= 1e-09 and <= "
          "1e+09 [m]");
    CHECK(has(bad("\"friction\": 0.1", "\"friction\": -0.1"),
              "/contact/0/friction: found -0.1, allowed: a number 0, or >= 1e-12 and <= 1e+12"));
    CHECK(
        has(bad("\"friction\": 0.1", "\"friction\": \"0.1\""), "found \"0.1\", allowed: a number"));
    CHECK(has(bad("\"EI\": 5.2e-4", "\"EI\": [1, 2, 3]"),
              "/bodies/wire/segments/0/EI: found [1,2,3]"));
    CHECK(has(bad("\"EI\": 5.2e-4", "\"EI\": -1"), "/bodies/wire/segments/0/EI: found -1"));
    CHECK(has(bad("\"kind\": \"beam\"", "\"kind\": \"baem\""), "nearest: \"beam\""));
    CHECK(has(bad("\"generate\": \"tube\"", "\"generate\": \"tubes\""), "nearest: \"tube\""));
    CHECK(has(bad("\"quasi_static\"", "\"quasistatic\""), "nearest: \"quasi_static\""));
    CHECK(has(bad("[1, 0, 0]", "[0, 0, 0]"), "not all 0"));
    CHECK(has(bad("[1, 0, 0]", "[1, 0]"), "three numbers"));
    CHECK(
        has(bad("[[0, 0], [15, 0.3]]", "[[0, 0], [0, 0.3]]"), "/drive/insertion/1: found time 0"));
    CHECK(has(bad("[[0, 0], [15, 0.3]]", "[]"), "found []"));
    CHECK(has(bad("\"every\": 10", "\"every\": 0"), "a whole number >= 1"));
    CHECK(has(bad("\"every\": 10", "\"every\": 1.5"), "a whole number"));
    CHECK(has(bad("\"step\": 0.02, ", ""), "/time/step: found nothing"));
    CHECK(has(bad("\"schema\": 1", "\"schema\": 2"), "/schema: found 2"));
}

TEST_CASE("fields that contradict each other are reported")
{
    const auto bad = [](const std::string& old, const std::string& now) {
        return issues_of(with(old, now));
    };
    CHECK(has(bad("[15, 0.3]", "[15, 0.4]"),
              "/bodies/wire/drive/insertion: found 0.4, allowed: < 0.33 [m]"));
    CHECK(has(bad("\"element\": 2.5e-3", "\"element\": 0.4"), "/bodies/wire/segments/0/element"));
    CHECK(has(bad("[\"wire\", \"tube\"]", "[\"wire\", \"tubr\"]"), "\"tube\" (nearest name)"));
    CHECK(has(bad("[\"wire\", \"tube\"]", "[\"tube\", \"tube\"]"), "at least one body that moves"));
    CHECK(has(bad("\"friction\": 0.1}", "\"friction\": 0.1}, {\"between\": [\"tube\", \"wire\"]}"),
              "each pair once"));
    const std::string springs = "\"friction\": 0.1, \"foundation\": 2000}";
    CHECK(bad("\"friction\": 0.1}", springs).empty());
    CHECK(has(bad("\"friction\": 0.1}", "\"foundation\": -1}"), "/contact/0/foundation"));
    CHECK(has(bad("\"friction\": 0.1}", "\"foundation\": 0}"), "/contact/0/foundation"));
    CHECK(has(
        issues_of(replaced(with("\"friction\": 0.1}", springs), "\"quasi_static\"", "\"dynamic\"")),
        "springs have no inertia"));
    CHECK(has(issues_of(replaced(with("\"friction\": 0.1}", springs), "[\"wire\", \"tube\"]",
                                 "[\"wire\", \"*\"]")),
              "springs lie below obstacles that beams touch"));
    const std::string on_springs = with("\"friction\": 0.1}", springs);
    CHECK(has(issues_of(replaced(on_springs, "\"time\": ",
                                 "\"haptic\": {\"handle\": \"wire\", \"device\": \"touch\"}, "
                                 "\"time\": ")),
              "found 2000 N/m^2, in the hand"));
    const std::string inner = replaced(
        on_springs, "\"wire\": {",
        R"("inner": {"kind": "beam", "segments": [{"length": 0.3, "radius": 1e-4, "EI": 1e-4,
            "element": 2.5e-3}], "drive": {"insertion": [[0, 0], [1, 0.1]]}}, "wire": {)");
    CHECK(has(issues_of(replaced(inner, "2000}", "2000}, {\"between\": [\"inner\", \"wire\"]}")),
              "instruments in one another need rigid obstacles"));
    CHECK(has(bad("\"quasi_static\"", "\"dynamic\""),
              "/bodies/wire/segments/0/density: found nothing"));
    CHECK(has(bad("\"centreline\": {\"file\": \"double_u.csv\"}", "\"centreline\": {}"), "either"));
    CHECK(has(bad("\"EI\": 5.2e-4, \"GJ\": 4.0e-4, \"EA\": 5000", "\"EI\": 0"), "where EI is 0"));
    // A cable bends and twists freely, but all of it.
    CHECK(has(bad("\"EI\": 5.2e-4, \"GJ\": 4.0e-4", "\"EI\": 0, \"GJ\": 0"), "0 everywhere"));
    CHECK(has(bad("\"GJ\": 4.0e-4", "\"GJ\": 0"), "segments/0/GJ: found 0"));
    CHECK(has(bad("[2.7e-4, 2e-5]", "[2.7e-4, 0]"), "segments/2/EI: found 0"));
    CHECK(issues_of(kWireExample, {"bodies.wire.segments=[{\"length\":0.33,\"radius\":4.445e-4,"
                                   "\"EI\":0,\"EA\":5000,\"element\":2.5e-3}]"})
              .empty());
    // What would be ignored is refused: beams have factors only.
    for (const char* linear : {"iterative", "distributed"})
        CHECK(has(issues_of(kWireExample, {std::string("solver.linear=") + linear}),
                  "/solver/linear (--set): found \"" + std::string(linear) +
                      "\", allowed: \"auto\""));
    for (const char* linear : {"auto", "direct"})
        CHECK(issues_of(kWireExample, {std::string("solver.linear=") + linear}).empty());
    CHECK(has(bad("\"radius\": 4.445e-4", "\"radius\": 0.0041"), "the radius of \"tube\""));
    CHECK(has(bad("\"file\": \"double_u.csv\"", "\"pieces\": [{\"radius\": 0.003, \"angle\": 1}]"),
              "the radius of the bend"));
}

TEST_CASE("all that is wrong is reported together and nothing twice")
{
    std::string text = with("\"friction\": 0.1", "\"friction\": -0.1");
    text.replace(text.find("0.004"), 5, "\"x\"  ");
    text.replace(text.find("\"every\""), 7, "\"evry\" ");
    try {
        parse_scene(text, "s.json", {"time.end=-1"});
        FAIL("read without complaint");
    } catch (const InputError& error) {
        CHECK(error.issues().size() == 4);
    }
    // A wrong kind makes the body unknown, but its pair is no second mistake.
    CHECK_FALSE(has(issues_of(with("\"kind\": \"obstacle\"", "\"kind\": 3")), "/contact"));
    // A wrong length is not reported again as a wire too short.
    CHECK_FALSE(has(issues_of(with("\"length\": 0.30", "\"length\": \"a\"")), "insertion"));
}

TEST_CASE("a sheath fades within its length which is the wire's own in any unit of length")
{
    const std::string fade = "bodies.wire.introducer.fade=",
                      length = "bodies.wire.introducer.length=";
    CHECK(read({fade + "0.02"}).beams[0].introducer.fade == 0.02);
    CHECK(has(issues_of(kWireExample, {fade + "0.04"}),
              "/drive/insertion: found 0.3, allowed: < 0.29"));
    CHECK(has(issues_of(kWireExample, {fade + "0.4"}),
              "/fade (--set): found 0.4, allowed: < 0.33 [m]"));
    CHECK(has(issues_of(kWireExample, {fade + "0.02", length + "0.01"}),
              "found 0.02, allowed: <= 0.01 [m], the length of the introducer"));
    const std::string millimetres =
        R"([{"length": 330, "radius": 0.4445, "EI": 520, "EA": 5000, "element": 2.5}])";
    CHECK(
        read({"bodies.wire.segments=" + millimetres, "bodies.wire.drive.insertion=[[0,0],[15,300]]",
              "bodies.tube.surface.radius=4", fade + "20"})
            .beams[0]
            .introducer.fade == 20);
}

TEST_CASE("every kind of surface and an introducer on a centreline read back the same")
{
    for (const char* surface :
         {R"({"file": "a.stl", "scale": 0.001})", R"({"generate": "ball", "radius": 1})",
          R"({"generate": "cylinder", "radius": 1, "axis": [0, 1, 1]})",
          R"({"generate": "plane", "axis": [0, 1, 0]})",
          R"({"generate": "vessel", "descending_length": 0.1, "descending_diameter": 0.02,
              "arch_radius": 0.04, "arch_diameter": [0.02, 0.03], "ascending_length": 0.1,
              "ascending_diameter": 0.03, "branches": [
              {"name": "a", "at": 0.01, "diameter": 0.01, "length": 0.1}]})"}) {
        CAPTURE(surface);
        const Scene s = read(
            {std::string("bodies.tube.surface=") + surface,
             R"(bodies.wire.introducer={"centreline": {"file": "c.mrk.json", "along": 0.1}})"});
        CHECK(s.beams[0].introducer.centreline.along == 0.1);
        const std::string resolved = resolved_scene(s);
        CHECK(resolved_scene(parse_scene(resolved, "again.json")) == resolved);
    }
    CHECK_FALSE(has(resolved_scene(read()), "along"));
    // Fields of another generator are unknown here.
    CHECK(has(issues_of(kWireExample,
                        {R"(bodies.tube.surface={"generate": "ball", "radius": 1, "blend": 1})"}),
              "field \"blend\""));
}

TEST_CASE("every number of a scene has bounds, those of its unit or its own")
{
    std::set<const ObjectDeclaration*> done;
    int numbers = 0;
    const std::function<void(const ObjectDeclaration&)> visit = [&](const ObjectDeclaration& o) {
        if (!done.insert(&o).second) return;
        const auto all = [&](const std::vector<FieldDeclaration>& fields) {
            for (const FieldDeclaration& f : fields) {
                CAPTURE(f.name);
                if (f.object) visit(*f.object);
                if (f.type != FieldType::integer && f.type != FieldType::number &&
                    f.type != FieldType::pair && f.type != FieldType::vector &&
                    f.type != FieldType::curve)
                    continue;
                if (f.allowed.lower == f.allowed.upper) continue; // of the scene's format
                ++numbers;
                CHECK(std::isfinite(f.allowed.lower));
                CHECK(std::isfinite(f.allowed.upper));
                CHECK((f.allowed.lower != 0 || f.allowed.least > 0 || f.allowed.above));
                CHECK(allowed_in_words(f).find("<= ") != std::string::npos);
            }
        };
        all(o.fields);
        for (const VariantDeclaration& v : o.variants)
            all(v.fields);
    };
    visit(scene_declaration());
    CHECK(numbers > 150);
}

TEST_CASE("values nested too deeply, fields without a name and texts that no file may contain are "
          "refused")
{
    const auto refusal = [](const std::string& text, const std::vector<std::string>& set = {}) {
        try {
            parse_scene(text, "s.json", set);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const std::string deep = std::string(100000, '[') + std::string(100000, ']');
    CHECK(has(refusal(deep), "more than 64 deep"));
    CHECK(has(refusal("{\"title\": " + deep + "}"), "more than 64 deep"));
    CHECK(has(refusal(kWireExample, {"title=" + deep}), "more than 64 deep"));
    CHECK(has(refusal(kWireExample, {"..time.step=1"}), "field \"\""));
    CHECK(has(refusal(with("\"every\": 10", "\"\": 1")), "/output: found field \"\""));
    CHECK(has(refusal(kWireExample, {"title=a\tb"}), "at most 4000 printable bytes"));
    CHECK(has(
        refusal(kWireExample, {"bodies.tube.surface.centreline.file=" + std::string(5000, 'x')}),
        "at most 4000 printable bytes"));
    CHECK(has(refusal(with("[[15, 0], [17", "[[15, 0], [15.0000000000001, 1], [17")),
              ">= 1e-12 [s] after"));
}
