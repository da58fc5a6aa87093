#include "solver/scene/read.hpp"
#include "solver/scene/tests/issues_of.hpp"

#include <doctest/doctest.h>
#include <string>

using namespace amontons;

namespace {

const char* const kExample = R"({
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

/// The issues of the example with one piece of text replaced; "" if it is a scene.
std::string bad(const std::string& old, const std::string& now)
{
    return issues_of(replaced(kExample, old, now));
}

} // namespace

TEST_CASE("rods read as they are written, and resolved as the same again")
{
    const Scene s = parse_scene(kExample, "s.json", {});
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

TEST_CASE("a rod is not laid in a bend tighter than itself")
{
    const std::string points =
        "\"points\": [{\"at\": [0, 0, 0]}, {\"at\": [0, 1.2, 0]}, {\"at\": [1.2, 1.2, 0]}]";
    const auto bent = [&](double radius) {
        return bad(points, "\"curve\": {\"pieces\": [{\"length\": 2}, {\"radius\": " +
                               std::to_string(radius) +
                               ", \"angle\": " + std::to_string(0.4 / radius) + "}]}");
    };
    CHECK(bent(0.02) == "");
    CHECK(has(bent(0.01), "/shape/curve/pieces/1/radius: found 0.01, allowed: > 0.01 [m]"));
}

TEST_CASE("bad rods are said with their places")
{
    CHECK(has(bad("\"element\": 0.12", "\"element\": 3"), "/segments/0/element"));
    CHECK(has(bad("\"length\": 2.4", "\"length\": -2.4"), "/segments/0/length"));
    CHECK(has(bad("\"length\": 2.4", "\"length\": 2.6"), "the length of the polyline"));
    CHECK(has(bad("\"EI\": 1440", "\"EI\": 0"), "/segments/0/EI"));
    CHECK(has(bad("{\"at\": [0, 1.2, 0]}", "{\"at\": [0, 0, 0]}"), "/shape/points/1"));
    CHECK(has(bad("\"points\": [", "\"closed\": true, \"points\": ["), "the rod is closed"));
    CHECK(has(bad("\"at\": 2.4, \"turns\"", "\"turns\""), "either \"set\" or \"at\""));
    CHECK(has(bad("{\"at\": 2.4, \"turns\": \"free\"}", "{\"at\": 2.5, \"turns\": \"free\"}"),
              "/hold/1/at"));
    CHECK(has(bad("\"at\": 2.4, \"turns\": \"free\"",
                  "\"at\": 2.4, \"places\": \"free\", \"turns\": \"free\""),
              "a hold of nothing"));
    CHECK(has(bad("\"force\": [0, -1, 0], ", ""), "a load of nothing"));
    CHECK(has(bad("\"force\": [0, -1, 0]", "\"line\": [0, -1, 0]"), "\"set\": \"all\""));
    CHECK(has(bad("[[-1, -1], [1, 1]]", "[[1, -1], [1, 1]]"), "/loads/0/over"));
    CHECK(has(bad("\"path\": 0.01", "\"path\": 0.01, \"kind\": \"dynamic\""), "/time/path"));
    CHECK(has(bad("\"elements\": \"corotational\"", "\"elements\": \"cubic\""), "/elements"));
    CHECK(has(bad("\"time\":", "\"contact\": [{\"between\": [\"frame\", \"frame\"]}], \"time\":"),
              "not one rod alone, without contact"));
}

TEST_CASE("a rod in a sheath is straight and long enough, and neither it nor a medium is dynamic")
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
    CHECK(has(dynamic, "a sheath in a dynamic scene"));
    CHECK(has(dynamic, "/drag"));
}
