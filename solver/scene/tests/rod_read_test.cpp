#include "solver/scene/read.hpp"
#include "solver/scene/tests/issues_of.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <string>

using namespace amontons;

namespace {

const char* const kFrameExample = R"({
  "schema": 1,
  "bodies": {
    "frame": {"kind": "rod", "elements": "corotational", "plane": [0, 0, 1],
      "segments": [{"length": 2.4, "radius": 0.01, "EI": 1440, "EA": 4.32e7, "element": 0.12}],
      "shape": {"points": [{"at": [0, 0, 0]}, {"at": [0, 1.2, 0]}, {"at": [1.2, 1.2, 0]}]},
      "hold": [{"set": "start", "turns": "free"}, {"at": 2.4, "turns": "free"}],
      "loads": [{"at": 1.44, "force": [0, -1, 0], "over": [[-1, -1], [1, 1]]}]}
  },
  "time": {"step": 0.1, "end": 1, "path": 0.01}
})";

/// The same of a frame that is bent into its shape: it may have a curvature of its own.
std::string bad_bent_frame(const std::string& old, const std::string& now)
{
    return issues_of(replaced(
        replaced(kFrameExample, "\"shape\": {", "\"shape\": {\"stress_free\": false, "), old, now));
}

/// The issues of the example with one piece of text replaced; "" if it is a scene.
std::string bad_frame(const std::string& old, const std::string& now)
{
    return issues_of(replaced(kFrameExample, old, now));
}

} // namespace

TEST_CASE("rods read as they are written and resolved as the same again")
{
    const Scene s = parse_scene(kFrameExample, "s.json", {});
    REQUIRE(s.rods.size() == 1);
    const RodInput& rod = s.rods[0];
    CHECK(rod.elements == "corotational");
    CHECK(rod.shape.points.size() == 3);
    CHECK(!rod.shape.has_curve());
    CHECK(rod.hold.at(1).at == 2.4);
    CHECK(*rod.loads.at(0).force == Vec3(0, -1, 0));
    CHECK(s.time.path == 0.01);
    const std::string resolved = resolved_scene(s);
    CHECK(resolved_scene(parse_scene(resolved, "again.json", {})) == resolved);
}

TEST_CASE("a closed rod is the same with its first point again at the end and without")
{
    const auto loop = [](const std::string& end) {
        std::string text =
            replaced(kFrameExample, "\"points\": [", "\"closed\": true, \"points\": [");
        text = replaced(text, "{\"at\": [1.2, 1.2, 0]}]", "{\"at\": [1.2, 1.2, 0]}" + end + "]");
        text = replaced(text, "\"length\": 2.4", "\"length\": 4.0970562748");
        return resolved_scene(parse_scene(text, "s.json", {}));
    };
    CHECK(loop("") == loop(", {\"at\": [0, 0, 0]}"));
}

TEST_CASE("a flattened rod bends by two stiffnesses")
{
    const auto with = [&](const std::string& more) {
        return replaced(kFrameExample, "\"EI\": 1440", "\"EI\": 1440" + more);
    };
    const Scene s = parse_scene(with(", \"EI_across\": [480, 240]"), "s.json", {});
    const BeamSegment& flat = s.rods[0].segments[0];
    CHECK(flat.EI_across == std::array<double, 2>{480, 240});
    CHECK(flat.GJ[0] == doctest::Approx(1.54 / (1 / 1440. + 1 / 480.)).epsilon(1e-14));
    CHECK(resolved_scene(parse_scene(resolved_scene(s), "again.json", {})) == resolved_scene(s));
    CHECK(has(issues_of(with(", \"EI_across\": 9, \"bending\": [[0, 0], [1, 1440]]")),
              "/segments/0/EI_across: found 9, allowed: nothing beside bending"));
    CHECK(has(issues_of(with(", \"EI_across\": 0")), "/segments/0/EI_across: found 0"));
}

TEST_CASE("tables of a rod's section: what they are not and the stiffness that follows")
{
    const std::string EI = "\"EI\": 1440", corotational = "\"elements\": \"corotational\", ";
    const auto with = [&](const std::string& table) {
        return issues_of(replaced(replaced(kFrameExample, corotational, ""), EI, table));
    };
    const Scene s = parse_scene(replaced(replaced(kFrameExample, corotational, ""), EI,
                                         "\"bending\": [[0, 0], [2, 3000], [5, 4000]]"),
                                "s.json", {});
    CHECK(s.rods[0].segments[0].EI == std::array<double, 2>{1500, 1500});
    CHECK(s.rods[0].segments[0].GJ[0] == 0.77 * 1500);
    CHECK(resolved_scene(parse_scene(resolved_scene(s), "again.json", {})) == resolved_scene(s));
    CHECK(has(bad_frame(EI, "\"bending\": [[0, 0], [2, 3000]]"), "\"exact\" elements"));
    CHECK(
        has(with("\"bending\": 3"), "/segments/0/bending: found 3, allowed: [[curvature, value]"));
    CHECK(has(with("\"bending\": [[0, 0]]"), "a point beyond [0, 0]"));
    CHECK(has(with("\"bending\": [[0.1, 0], [1, 3]]"), "a table from [0, 0] on"));
    CHECK(has(with("\"bending\": [[-1, -3], [0, 0], [1, 3]]"), "a table from [0, 0] on"));
    CHECK(has(with("\"bending\": [[0, 0], [1, 3], [1, 4]]"),
              "/bending/2: found curvature 1, allowed: > 1 [1/m]"));
    CHECK(has(with("\"bending\": [[0, 0], [1, 3], [2, 3]]"),
              "/bending/2: found 3, allowed: > 3, the value before it"));
    CHECK(has(with("\"EI\": 4, \"bending\": [[0, 0], [1, 3]]"), "/segments/0/EI: found 4"));
    const std::string EA = "\"EA\": 4.32e7";
    const auto stretching = [&](const std::string& table) {
        return issues_of(replaced(replaced(kFrameExample, corotational, ""), EA, table));
    };
    CHECK(stretching("\"stretching\": [[-0.01, -1e3], [0, 0], [0.01, 4e3]]") == "");
    CHECK(
        has(stretching("\"stretching\": [[-0.01, -1e3], [0, 1], [0.01, 4e3]]"), "through [0, 0]"));
    CHECK(has(stretching("\"stretching\": [[-0.01, -1e3], [0, 0]]"), "a point beyond [0, 0]"));
}

TEST_CASE("cones: pieces between their ends and what they cannot be")
{
    const std::string
        given = "\"radius\": 0.01, \"EI\": 1440, \"EA\": 4.32e7",
        cone = "\"radius\": 0.01, \"end_radius\": 0.005, \"EI\": [1440, 90], \"EA\": [4e7, 1e7]";
    const Scene s = parse_scene(replaced(kFrameExample, given, cone), "s.json", {});
    const std::vector<BeamSegment>& piece = s.rods[0].segments;
    REQUIRE(piece.size() == 20);
    for (std::size_t i = 0; i < piece.size(); ++i) {
        const double from = 0.01 - 0.005 * double(i) / 20, to = 0.01 - 0.005 * double(i + 1) / 20;
        CHECK(piece[i].length == doctest::Approx(0.12).epsilon(1e-14));
        CHECK(piece[i].radius == doctest::Approx(0.5 * (from + to)).epsilon(1e-14));
        // A solid bar's: E pi r^4 / 4 and E pi r^2.
        CHECK(piece[i].EI[0] == doctest::Approx(1440 * std::pow(from / 0.01, 4)).epsilon(1e-12));
        CHECK(piece[i].EI[1] == doctest::Approx(1440 * std::pow(to / 0.01, 4)).epsilon(1e-12));
        CHECK(piece[i].GJ[1] == doctest::Approx(0.77 * piece[i].EI[1]).epsilon(1e-12));
        CHECK(piece[i].EA[1] == doctest::Approx(4e7 * std::pow(to / 0.01, 2)).epsilon(1e-12));
        if (i > 0) CHECK(piece[i].EI[0] == piece[i - 1].EI[1]);
    }
    CHECK(resolved_scene(parse_scene(resolved_scene(s), "again.json", {})) == resolved_scene(s));
    // One number of a stiffness is that of the whole cone; EA is that of each end.
    const Scene same = parse_scene(
        replaced(kFrameExample, given, "\"radius\": 0.01, \"end_radius\": 0.005, \"EI\": 1"),
        "s.json", {});
    CHECK(same.rods[0].segments[7].EI == std::array<double, 2>{1, 1});
    CHECK(same.rods[0].segments.back().EA[1] == doctest::Approx(4 / 2.5e-5));

    CHECK(has(bad_frame(given, given + ", \"end_radius\": 0.3"),
              "/segments/0/end_radius: found 0.3, allowed: 0 to 0.25 [m]"));
    CHECK(has(bad_frame(given, given + ", \"end_radius\": 0.004, \"inner_radius\": 0.005"),
              "/end_radius: found 0.004, allowed: > 0.005 [m]"));
    CHECK(bad_bent_frame(given, cone + ", \"twist\": 1") == "");
    CHECK(has(bad_frame(given, "\"radius\": 0.01, \"end_radius\": 0.004, \"EA\": 4e7, "
                               "\"bending\": [[0, 0], [1, 1440]]"),
              "found a cone"));
    CHECK(has(bad_frame(given, given + ", \"end_radius\": 0"), "/end_radius: found 0"));
}

TEST_CASE("layers of a section: what they add up to and what they cannot be")
{
    const std::string given = "\"EI\": 1440, \"EA\": 4.32e7";
    const auto with = [&](const std::string& layers) {
        return replaced(kFrameExample, given, "\"layers\": [" + layers + "]");
    };
    // Two tubes of one material are one full bar.
    const std::string inner = R"({"outer_radius": 0.004, "youngs_modulus": 2e11})",
                      outer = R"({"inner_radius": 0.004, "outer_radius": 0.01,
                                  "youngs_modulus": 2e11})";
    const Scene s = parse_scene(with(inner + ", " + outer), "s.json", {});
    const BeamSegment& bar = s.rods[0].segments[0];
    const double pi = 3.14159265358979323846, r = 0.01, E = 2e11;
    CHECK(bar.EI[0] == doctest::Approx(E * pi * r * r * r * r / 4).epsilon(1e-14));
    CHECK(bar.GJ[1] == doctest::Approx(E / 2.6 * pi * r * r * r * r / 2).epsilon(1e-14));
    CHECK(bar.EA[0] == doctest::Approx(E * pi * r * r).epsilon(1e-14));
    CHECK(resolved_scene(parse_scene(resolved_scene(s), "again.json", {})) == resolved_scene(s));
    // A steel coil of 1 mm wire, 10 mm across, turns 2 mm apart: per turn F R^2 2 pi R / GJ long
    // and M 2 pi R / EI round, by Castigliano's theorem.
    const Scene coiled = parse_scene(with(R"({"inner_radius": 0.0045, "outer_radius": 0.0055,
                                         "youngs_modulus": 2e11, "pitch": 0.002})"),
                                     "s.json", {});
    const BeamSegment& coil = coiled.rods[0].segments[0];
    const double I = pi / 4 * std::pow(0.5e-3, 4), GJ = E / 2.6 * 2 * I, R = 5e-3;
    CHECK(coil.EA[0] == doctest::Approx(0.002 * GJ / (2 * pi * R * R * R)).epsilon(1e-12));
    CHECK(coil.GJ[0] == doctest::Approx(0.002 * E * I / (2 * pi * R)).epsilon(1e-12));
    CHECK(coil.EI[0] == doctest::Approx(0.002 / (pi * R * (1 / (E * I) + 1 / GJ))).epsilon(1e-12));
    const auto bad_layers = [&](const std::string& layers) { return issues_of(with(layers)); };
    CHECK(has(bad_layers(outer + ", " + outer), "/layers/1: found 0.004 to 0.01"));
    CHECK(has(bad_layers(R"({"outer_radius": 0.02, "youngs_modulus": 1})"),
              "/layers/0/outer_radius: found 0.02, allowed: <= 0.01 [m]"));
    CHECK(has(bad_layers(R"({"inner_radius": 0.01, "outer_radius": 0.01, "youngs_modulus": 1})"),
              "/layers/0/inner_radius: found 0.01, allowed: < 0.01 [m]"));
    CHECK(has(bad_layers(R"({"inner_radius": 0.004, "outer_radius": 0.006, "youngs_modulus": 1,
                             "pitch": 0.001})"),
              "/layers/0/pitch: found 0.001"));
    CHECK(has(bad_layers(R"({"outer_radius": 0.006, "youngs_modulus": 1, "pitch": 0.1})"),
              "> 0 of a coil"));
    CHECK(has(bad_layers(R"({"outer_radius": 0.006})"), "/layers/0/youngs_modulus: found nothing"));
    CHECK(has(issues_of(replaced(kFrameExample, "\"EI\": 1440",
                                 "\"EI\": 1440, \"layers\": [" + inner + "]")),
              "/segments/0/EI: found 1440, allowed: nothing beside layers"));
}

TEST_CASE("layers that taper: a core ground down within a coil")
{
    const std::string given = "\"radius\": 0.01, \"EI\": 1440, \"EA\": 4.32e7";
    const auto with = [&](const std::string& section, const std::string& core) {
        return replaced(kFrameExample, given, section + ", \"layers\": [" + core + R"(,
                        {"inner_radius": 0.009, "outer_radius": 0.01, "youngs_modulus": 2e11,
                         "pitch": 0.002}])");
    };
    const std::string plain = "\"radius\": 0.01",
                      core = R"({"outer_radius": 0.008, "end_outer_radius": 0.002,
                                 "youngs_modulus": 7e10})";
    const Scene s = parse_scene(with(plain, core), "s.json", {});
    const std::vector<BeamSegment>& piece = s.rods[0].segments;
    REQUIRE(piece.size() == 20);
    const double pi = 3.14159265358979323846, R = 9.5e-3, wire = pi / 4 * std::pow(0.5e-3, 4),
                 GJ = 2e11 / 2.6 * 2 * wire, coil = 0.002 / (pi * R * (1 / (2e11 * wire) + 1 / GJ));
    for (std::size_t i = 0; i < piece.size(); ++i) {
        CHECK(piece[i].radius == 0.01);
        for (std::size_t end = 0; end < 2; ++end) {
            const double r = 0.008 - 0.006 * double(i + end) / 20;
            CHECK(piece[i].EI[end] ==
                  doctest::Approx(coil + 7e10 * pi / 4 * std::pow(r, 4)).epsilon(1e-12));
            CHECK(piece[i].EA[end] ==
                  doctest::Approx(0.002 * GJ / (2 * pi * R * R * R) + 7e10 * pi * r * r)
                      .epsilon(1e-12));
        }
        if (i > 0) CHECK(piece[i].GJ[0] == piece[i - 1].GJ[1]);
    }
    CHECK(resolved_scene(parse_scene(resolved_scene(s), "again.json", {})) == resolved_scene(s));
    // What is given beside layers varies linearly; a cone of one layer is one of a bar.
    const Scene given_GJ = parse_scene(with(plain + ", \"GJ\": [4, 2]", core), "s.json", {});
    CHECK(given_GJ.rods[0].segments[4].GJ[1] == doctest::Approx(3.5));
    const Scene bar = parse_scene(
        replaced(kFrameExample, given, R"("radius": 0.01, "end_radius": 0.005, "layers": [
            {"outer_radius": 0.01, "end_outer_radius": 0.005, "youngs_modulus": 1e10}])"),
        "s.json", {});
    CHECK(bar.rods[0].segments[9].EI[1] ==
          doctest::Approx(1e10 * pi / 4 * std::pow(0.0075, 4)).epsilon(1e-12));

    CHECK(has(issues_of(with(plain + ", \"end_radius\": 0.008", core)),
              "/layers/1/outer_radius: found 0.01, allowed: <= 0.008 [m]"));
    CHECK(has(issues_of(with(plain, R"({"outer_radius": 0.008, "end_outer_radius": 0.0095,
                                        "youngs_modulus": 7e10})")),
              "/layers/1: found 0.009 to 0.01, allowed: a place beside layer 0, 0 to 0.0095"));
    CHECK(has(issues_of(with(plain, R"({"outer_radius": 0.008, "end_inner_radius": 0.008,
                                        "youngs_modulus": 7e10})")),
              "/layers/0/end_inner_radius: found 0.008, allowed: < 0.008 [m]"));
}

TEST_CASE("a rod is not laid in a bend tighter than itself")
{
    const std::string points =
        "\"points\": [{\"at\": [0, 0, 0]}, {\"at\": [0, 1.2, 0]}, {\"at\": [1.2, 1.2, 0]}]";
    const auto bent = [&](double radius) {
        return bad_frame(points, "\"curve\": {\"pieces\": [{\"length\": 2}, {\"radius\": " +
                                     std::to_string(radius) +
                                     ", \"angle\": " + std::to_string(0.4 / radius) + "}]}");
    };
    CHECK(bent(0.02) == "");
    CHECK(has(bent(0.01), "/shape/curve/pieces/1/radius: found 0.01, allowed: > 0.01 [m]"));
}

TEST_CASE("bad rods are reported with their places")
{
    CHECK(has(bad_frame("\"element\": 0.12", "\"element\": 3"), "/segments/0/element"));
    CHECK(has(bad_frame("\"length\": 2.4", "\"length\": -2.4"), "/segments/0/length"));
    CHECK(has(bad_frame("\"length\": 2.4", "\"length\": 2.6"), "the length of the polyline"));
    CHECK(has(bad_frame("\"EI\": 1440", "\"EI\": 0"), "/segments/0/EI"));
    CHECK(has(bad_frame("{\"at\": [0, 1.2, 0]}", "{\"at\": [0, 0, 0]}"), "/shape/points/1"));
    // A closed rod comes back to its first point, which need not be given again.
    CHECK(has(bad_frame("\"points\": [", "\"closed\": true, \"points\": ["),
              "4.09705627 [m], the length of the polyline"));
    CHECK(has(bad_frame("\"points\": [{\"at\": [0, 0, 0]}, ", "\"closed\": true, \"points\": ["),
              "at least three"));
    CHECK(has(bad_frame("\"at\": 2.4, \"turns\"", "\"turns\""), "either \"set\" or \"at\""));
    CHECK(has(bad_frame("{\"at\": 2.4, \"turns\": \"free\"}", "{\"at\": 2.5, \"turns\": \"free\"}"),
              "/hold/1/at"));
    CHECK(has(bad_frame("\"at\": 2.4, \"turns\": \"free\"",
                        "\"at\": 2.4, \"places\": \"free\", \"turns\": \"free\""),
              "a hold of nothing"));
    CHECK(has(bad_frame("\"force\": [0, -1, 0], ", ""), "a load of nothing"));
    CHECK(has(bad_frame("\"force\": [0, -1, 0]", "\"line\": [0, -1, 0]"), "\"set\": \"all\""));
    CHECK(has(bad_frame("[[-1, -1], [1, 1]]", "[[1, -1], [1, 1]]"), "/loads/0/over"));
    CHECK(has(bad_frame("\"path\": 0.01", "\"path\": 0.01, \"kind\": \"dynamic\""), "/time/path"));
    CHECK(has(bad_frame("\"elements\": \"corotational\"", "\"elements\": \"cubic\""), "/elements"));
    CHECK(has(
        bad_frame("\"time\":", "\"contact\": [{\"between\": [\"frame\", \"frame\"]}], \"time\":"),
        "not one rod alone, without contact"));
}

TEST_CASE("a rod in a sheath is straight and long enough and a medium is not dynamic")
{
    const std::string fed = R"({
      "schema": 1,
      "bodies": {
        "wire": {"kind": "rod", "fed": [[0, 0.1], [1, 0.2]], "drag": 3, "shape": {"start": [0, 0, 0]},
          "segments": [{"length": 0.3, "radius": 0.001, "EI": 1e-4, "element": 0.01}]}
      },
      "time": {"step": 0.1, "end": 1}
    })";
    const Scene s = parse_scene(fed, "s.json", {});
    CHECK(s.rods.at(0).fed.at(1)[1] == 0.2);
    CHECK(s.rods.at(0).drag == 3);
    const auto bad_feed = [&](const std::string& old, const std::string& now) {
        return issues_of(replaced(fed, old, now));
    };
    CHECK(has(bad_feed("[1, 0.2]", "[1, 0.4]"), "/fed/1/1"));
    CHECK(has(bad_feed("[1, 0.2]", "[0, 0.2]"), "/fed"));
    CHECK(has(bad_feed("\"drag\": 3", "\"drag\": -3"), "/drag"));
    CHECK(has(bad_feed("\"EI\": 1e-4", "\"EI\": 1e-4, \"curvature\": 2"), "not straight"));
    CHECK(has(
        bad_feed(
            "{\"start\": [0, 0, 0]}",
            "{\"points\": [{\"at\": [0, 0, 0]}, {\"at\": [0.1, 0, 0]}, {\"at\": [0.1, 0.2, 0]}]}"),
        "not straight"));
    const std::string dynamic = bad_feed("\"step\": 0.1", "\"kind\": \"dynamic\", \"step\": 0.1");
    CHECK(has(dynamic, "/drag"));
}

TEST_CASE("points of a polyline that differ by round-off only are coincident")
{
    const auto with = [](const std::string& point) {
        return bad_frame(R"({"at": [0, 1.2, 0]}, )", R"({"at": [0, 1.2, 0]}, )" + point);
    };
    for (const char* same : {R"({"at": [0, 1.2, 1e-18]}, )", R"({"at": [1e-13, 1.2, 0]}, )"})
        CHECK(with(same).find("/shape/points/2: found the point before it again") !=
              std::string::npos);
    CHECK(with(R"({"at": [1e-3, 1.2, 0]}, )") == "");
}

TEST_CASE("lists that are given are not empty")
{
    const std::string points =
        R"("points": [{"at": [0, 0, 0]}, {"at": [0, 1.2, 0]}, {"at": [1.2, 1.2, 0]}])";
    CHECK(has(bad_frame(points, "\"points\": []"),
              "s.json: /bodies/frame/shape/points: found an empty list, allowed: at least 2"));
    CHECK(has(bad_frame(points, R"("curve": {"pieces": []})"),
              "/shape/curve/pieces: found an empty list, allowed: at least one"));
    CHECK(has(bad_frame("\"EI\": 1440", "\"EI\": 1440, \"layers\": []"),
              "/segments/0/layers: found an empty list, allowed: at least one"));
    CHECK(
        bad_frame("\"hold\": [{\"set\": \"start\", \"turns\": \"free\"}, {\"at\": 2.4, \"turns\": "
                  "\"free\"}]",
                  "\"hold\": []") == ""); // as none
}

TEST_CASE("sizes that no beam has are refused with what is allowed")
{
    const std::string radius = "\"radius\": 0.01", EI = "\"EI\": 1440, \"EA\": 4.32e7";
    for (const char* r : {"1e-30", "1e-10", "1e30"})
        CHECK(has(bad_frame(radius, std::string("\"radius\": ") + r),
                  "/segments/0/radius: found " +
                      std::string(r == std::string("1e30") ? "1e+30" : r) +
                      ", allowed: a number >= 1e-09 and <= 1000000 [m]"));
    CHECK(has(bad_frame(radius, "\"radius\": 2.5"),
              "/segments/0/radius: found 2.5, allowed: <= 2.4 [m], the length of the beam"));
    CHECK(has(bad_frame(EI, "\"EI\": 1e-30, \"EA\": 1"),
              "/EI: found 1e-30, allowed: a number or [start, end], each 0, or >= 1e-24"));
    CHECK(has(bad_frame(EI, "\"EI\": 1e30"), "/EI: found 1e+30"));
    CHECK(has(bad_frame(EI, "\"EI\": 1, \"GJ\": 1e-30"), "/GJ: found 1e-30"));
    CHECK(has(bad_frame(EI, "\"EI\": 1, \"EA\": 1e-30"), "/EA: found 1e-30"));
    // A round wire is stretched beyond round-off from 1.6e6 radii on.
    const auto thin = [&](const char* r) {
        return issues_of(replaced(replaced(kFrameExample, EI, "\"EI\": 1440"), radius, r));
    };
    CHECK(has(thin("\"radius\": 1e-6"), "round-off of stretching hides bending"));
    CHECK(thin("\"radius\": 2e-6") == "");
}

TEST_CASE("an element that is far shorter than the beam is refused")
{
    const std::string first = R"("element": 0.12}])";
    const auto with = [&](const char* h) {
        const std::string piece = std::string(R"("element": 0.12}, {"length": )") + h +
                                  R"(, "radius": 0.01, "EI": 1440, "element": )" + h + "}]";
        return bad_frame(first, piece);
    };
    CHECK(has(with("1e-8"), "/segments/1/element: found 1e-08 m an element, allowed: >= 2.4e-05"));
    CHECK(with("3e-5") == "");
}

TEST_CASE("a wall of a bore is thicker than round-off")
{
    const std::string EI = "\"EI\": 1440";
    for (const char* bore : {"0.01", "0.00999999999999999", "0.02"})
        CHECK(has(bad_frame(EI, EI + ", \"inner_radius\": " + bore),
                  "allowed: < 0.01 [m], the radius, by more than 1e-09 of it"));
    CHECK(bad_frame(EI, EI + ", \"inner_radius\": 0.0099999") == "");
    CHECK(has(bad_frame(EI + ", \"EA\": 4.32e7",
                        R"("layers": [{"inner_radius": 0.00999999999999999, "outer_radius": 0.01,
                                 "youngs_modulus": 1e9}])"),
              "/layers/0/inner_radius"));
}

TEST_CASE("an element turns by at most 120 degrees when free of loads")
{
    // Elements of 0.12 m: 17.45 rad/m is 120 degrees.
    const std::string EI = "\"EI\": 1440";
    CHECK(bad_bent_frame(EI, EI + ", \"curvature\": 17.4") == "");
    CHECK(has(bad_frame(EI, EI + ", \"curvature\": -17.6"),
              "/element: found 0.12: an element turns by"));
    CHECK(has(bad_frame(EI, EI + ", \"curvature\": 99.9"), "allowed: <= 0.0209649 [m]"));
    CHECK(has(bad_frame(EI, EI + ", \"twist\": 20, \"curvature\": 1"), "/segments/0/element"));
}

TEST_CASE("a natural curvature beside a shape that is free of stress is refused")
{
    const auto with = [](const std::string& segment, const std::string& shape) {
        return issues_of(replaced(replaced(kFrameExample, "\"EI\": 1440", "\"EI\": 1440" + segment),
                                  "\"shape\": {", "\"shape\": {" + shape));
    };
    CHECK(has(
        with(", \"curvature\": 0.2", ""),
        "/bodies/frame/segments/0/curvature: found 0.2 beside a shape by \"points\", allowed: 0: "
        "the rod is free of stress in that shape; or \"stress_free\": false"));
    CHECK(has(with(", \"twist\": 0.1", ""), "/segments/0/twist"));
    CHECK(with(", \"curvature\": 0.2", "\"stress_free\": false, ") == "");
    CHECK(with("", "") == "");
}
