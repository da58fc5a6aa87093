#include "mesh/base/file.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/tests/issues_of.hpp"
#include "solver/step/branch_log.hpp"
#include "solver/step/simulation.hpp"
#include "solver/step/tests/keep.hpp"
#include "solver/step/wire_simulation.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

using namespace amontons;

namespace {

/// A wire in a straight tube of 100 mm, a part of which has a name.
std::string in_tube(const std::string& branches, const std::string& introducer,
                    const std::string& insertion = "[[0, 0.002], [1, 0.06]]")
{
    return fmt::format(R"({{"schema": 1, "bodies": {{
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.004,
          "centreline": {{"pieces": [{{"length": 0.1}}]}}, "branches": [{}]}}}},
        "wire": {{"kind": "beam", "segments": [{{"length": 0.15, "radius": 4e-4, "EI": 5e-4,
          "element": 5e-3}}], "introducer": {{{}}}, "drive": {{"insertion": {}}}}}}},
        "contact": [{{"between": ["wire", "tube"]}}], "time": {{"step": 0.1, "end": 1}}}})",
                       branches, introducer, insertion);
}

RunSummary run_in_tube(const std::string& text)
{
    Scene scene = parse_scene(text, "s.json", {});
    place_introducers(scene);
    WireSimulation simulation(scene, build_obstacles(scene));
    Keep keep;
    std::atomic<bool> never{false};
    return simulation.run(keep, never);
}

std::string branch_of(const std::string& branches, const std::string& insertion)
{
    const RunSummary sum = run_in_tube(in_tube(branches, "", insertion));
    REQUIRE(sum.message == "");
    REQUIRE(sum.texts.size() == 1);
    CHECK(sum.texts[0].name == "branch");
    return sum.texts[0].value;
}

std::string tube_refusal(const std::string& text)
{
    try {
        run_in_tube(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("a wire is in the named part of a vessel that its tip was in when it was deepest")
{
    const std::string in = "[[0, 0.002], [1, 0.06]]", back = "[[0, 0.002], [0.5, 0.06], [1, 0.02]]";
    const std::string far =
                          R"({"name": "far", "box": {"from": [0.05, -1, -1], "to": [0.2, 1, 1]}})",
                      near =
                          R"({"name": "near", "box": {"from": [0, -1, -1], "to": [0.05, 1, 1]}})";
    CHECK(branch_of(far + ", " + near, in) == "far");
    CHECK(branch_of(far + ", " + near, back) == "far");
    CHECK(branch_of(near, "[[0, 0.002], [1, 0.04]]") == "near");
    CHECK(branch_of(far, "[[0, 0.002], [1, 0.04]]") == "");
    // Through a ball at the mouth of a branch, and on.
    CHECK(branch_of(R"({"name": "mouth", "ball": {"centre": [0.03, 0, 0], "radius": 0.01}})", in) ==
          "mouth");
    CHECK(branch_of(R"({"name": "line", "centreline": {"start": [0.05, 0, 0],
                       "pieces": [{"length": 0.05}]}})",
                    in) == "line");
}

TEST_CASE("a wire that comes back out of a ball and takes another way is not in its branch")
{
    BranchLog log;
    std::vector<Obstacle> obstacles;
    {
        Scene scene = parse_scene(
            in_tube(R"({"name": "mouth", "ball": {"centre": [0.03, 0, 0], "radius": 0.01}})", ""),
            "s.json", {});
        obstacles = build_obstacles(scene);
    }
    const int walls[] = {0};
    const auto move_tip = [&](double x, double y, double depth, bool most) {
        log.note(obstacles, walls, {x, y, 0}, depth, most);
    };
    move_tip(0.01, 0, 0.01, true);
    CHECK(log.name(obstacles) == "");
    move_tip(0.025, 0, 0.025, true);
    CHECK(log.name(obstacles) == "mouth");
    move_tip(0.06, 0, 0.06, true);
    CHECK(log.name(obstacles) == "mouth");
    move_tip(0.01, 0, 0.01, false);
    CHECK(log.name(obstacles) == "mouth"); // where it was when it was deepest
    move_tip(0.01, 0.1, 0.08, true);
    CHECK(log.name(obstacles) == "");
}

TEST_CASE("an introducer sits at the end of a named branch and examines it")
{
    const std::string branch =
        R"({"name": "femoral", "centreline": {"pieces": [{"length": 0.04}, {"length": 0.06}]}})";
    const auto placed = [&](const std::string& introducer) {
        Scene scene = parse_scene(in_tube(branch, introducer), "s.json", {});
        place_introducers(scene);
        return scene.beams[0].introducer;
    };
    const IntroducerInput end = placed(R"("branch": "femoral")"),
                          start = placed(R"("branch": "femoral", "end": "start")");
    CHECK((end.at - Vec3(0.1, 0, 0)).norm() < 1e-12);
    CHECK((end.direction + Vec3::UnitX()).norm() < 1e-9);
    CHECK(start.at.norm() < 1e-12);
    CHECK((start.direction - Vec3::UnitX()).norm() < 1e-9);
    Scene scene = parse_scene(in_tube(branch, R"("branch": "femoral")"), "s.json", {});
    place_introducers(scene);
    const std::string resolved = resolved_scene(scene); // as the manifest has it: runs again
    CHECK(resolved_scene(parse_scene(resolved, "again.json", {})) == resolved);
    CHECK(tube_refusal(in_tube(branch, R"("branch": "femoral")")) == "");

    CHECK(has(tube_refusal(in_tube(branch, R"("branch": "femorl")")), "one of \"femoral\""));
    CHECK(has(tube_refusal(in_tube(branch, R"("branch": "femoral", "at": [0, 0, 0])")),
              "/introducer/at: found a place beside \"branch\", which gives it"));
    CHECK(has(tube_refusal(in_tube(branch, R"("end": "end")")), "nothing without"));
    CHECK(has(tube_refusal(in_tube(R"({"name": "b", "ball": {"centre": [0, 0, 0], "radius": 1}})",
                                   R"("branch": "b")")),
              "a branch with a \"centreline\""));
    CHECK(has(tube_refusal(in_tube(R"({"name": "b"})", "")), "branches/0: found no place"));
}

TEST_CASE("the normal of an introducer is compared with the direction of its centreline")
{
    const TemporaryFolder folder;
    std::string line;
    for (int i = 0; i <= 20; ++i)
        line += fmt::format("0,0,{}\n", 0.01 * i);
    write_file(folder / "line.csv", line);
    const auto with = [&](const std::string& more) {
        return R"({"schema": 1, "bodies": {"wire": {"kind": "beam", "segments": [{"length": 0.15,
            "radius": 4e-4, "EI": 5e-4, "element": 5e-3}], "introducer": {"centreline": ")" +
               (folder / "line.csv") + R"(", )" + more + R"(}, "drive": {"insertion": 0.01}}},
            "time": {"step": 0.1, "end": 0.1}})";
    };
    CHECK(tube_refusal(with(R"("normal": [1, 0, 0])")) == "");
    CHECK(has(tube_refusal(with(R"("normal": [0, 0, 2])")),
              "/bodies/wire/introducer/normal: found parallel to the direction (0, 0, 1) that the "
              "centreline gives"));
    Scene scene = parse_scene(with(R"("end": "end")"), "s.json", {});
    place_introducers(scene);
    CHECK((scene.beams[0].introducer.at - Vec3(0, 0, 0.2)).norm() < 1e-9);
    CHECK((scene.beams[0].introducer.direction + Vec3::UnitZ()).norm() < 1e-9);
}

TEST_CASE("a wire in a wall whose free space is outside is offered the other side")
{
    const TemporaryFolder folder;
    // The unit cube, normals outwards; its last triangle has no area, as marching cubes make them.
    const std::string obj =
        "v 0 0 0\nv 0 1 0\nv 1 1 0\nv 1 0 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "v 0 0 0\nf 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\nf 1 4 6\nf 1 6 5\n"
        "f 4 3 7\nf 4 7 6\nf 3 2 8\nf 3 8 7\nf 2 1 5\nf 2 5 8\nf 1 9 2\n";
    write_file(folder / "cube.obj", obj);
    const auto scene = [&](const std::string& side) {
        return R"({"schema": 1, "bodies": {"room": {"kind": "obstacle", )" + side +
               R"("surface": {"file": ")" + (folder / "cube.obj") + R"("}},
            "wire": {"kind": "beam", "segments": [{"length": 0.5, "radius": 4e-3, "EI": 5e-1,
              "element": 2e-2}], "introducer": {"at": [0.3, 0.5, 0.5]}, "drive": {"insertion": 0.05}}},
            "contact": [{"between": ["wire", "room"]}], "time": {"step": 0.1, "end": 0.1}})";
    };
    CHECK(has(tube_refusal(scene("")),
              "; the orientation of the surface of room puts the free space outside: \"side\": "
              "\"inside\" of it is the other way"));
    CHECK(tube_refusal(scene(R"("side": "inside", )")) == "");
    std::vector<Issue> warnings;
    const Scene parsed = parse_scene(scene(R"("side": "inside", )"), "s.json", {});
    const std::vector<Obstacle> obstacles = build_obstacles(parsed, &warnings);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].found == "1 triangles without area, which were left out");
    const SurfaceFacts facts = surface_facts(parsed.obstacles[0], obstacles[0]);
    CHECK(facts.side == "inside");
    CHECK(facts.holes == 0);
    REQUIRE(facts.volume);
    CHECK(*facts.volume == doctest::Approx(1).epsilon(0.5)); // inside a lumen edges are rounded
}

TEST_CASE("a generated vessel is not triangulated to report where its free space is")
{
    const Scene scene = parse_scene(
        R"({"schema": 1, "bodies": {"aorta": {"kind": "obstacle", "surface": {"generate": "vessel",
            "descending_length": 0.12, "descending_diameter": 0.024, "arch_radius": 0.038,
            "arch_diameter": 0.026, "ascending_length": 0.06, "ascending_diameter": 0.028,
            "branches": [{"name": "carotid", "at": 0.052, "diameter": 0.008, "length": 0.1}]}},
            "wire": {"kind": "beam", "segments": [{"length": 0.15, "radius": 4e-4, "EI": 5e-4,
              "element": 5e-3}], "introducer": {"at": [0, 0, 0]}, "drive": {"insertion": 0.01}}},
            "contact": [{"between": ["wire", "aorta"]}], "time": {"step": 0.1, "end": 0.1}})",
        "s.json", {});
    std::vector<Obstacle> obstacles = build_obstacles(scene);
    obstacles[0].model.surface =
        Late<SurfaceMesh>{[]() -> SurfaceMesh { throw std::logic_error("triangles were made"); }};
    const SurfaceFacts facts = surface_facts(scene.obstacles[0], obstacles[0]);
    CHECK(facts.side == "inside");
    CHECK(facts.holes == 2); // the inlet and the branch
    CHECK(facts.triangles > 1000);
    CHECK(!facts.volume);
}

TEST_CASE(
    "a rod whose tip begins outside its vessel is reported, and drag is offered for a free one")
{
    const auto refusal = [](const std::string& fed, double y, bool touches = true) {
        const Scene scene = parse_scene(
            fmt::format(R"({{"schema": 1, "bodies": {{"tube": {{"kind": "obstacle", "surface": {{
                "generate": "tube", "radius": 0.004, "centreline": {{"pieces": [{{"length": 0.1}}]}}}}}},
                "rod": {{"kind": "rod", {}"shape": {{"start": [-0.1, {}, 0]}}, "segments": [{{
                "length": 0.1, "radius": 4e-4, "EI": 5e-4, "element": 5e-3}}]}}}},
                "contact": [{}], "time": {{"step": 0.1, "end": 0.1}}}})",
                        fed, y, touches ? R"({"between": ["rod", "tube"]})" : ""),
            "s.json", {});
        try {
            make_simulation(scene, build_obstacles(scene));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const std::string fed = R"("fed": [[0, 0], [1, 0.05]], )";
    CHECK(refusal(fed, 0) == "");
    CHECK(has(refusal(fed, 0.02),
              "/bodies/rod/shape: found its tip at (0, 0.02, 0), 0.016 m outside of "
              "the free space of tube"));
    CHECK(refusal("", 0) == ""); // its contacts may hold it
    CHECK(has(refusal("", 0, false), "or \"drag\", a medium that resists every motion"));
}
