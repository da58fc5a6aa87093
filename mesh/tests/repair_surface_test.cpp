#include "mesh/repair_surface.hpp"

#include "mesh/orient_surface.hpp"
#include "mesh/surface_check.hpp"
#include "mesh/tests/sample_surfaces.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// No fault of any kind is left, and the unit cube is what is enclosed.
void check_whole_cube(const SurfaceMesh& mesh)
{
    SurfaceRequirements all;
    all.closed = true;
    const SurfaceReport report = check_surface(mesh);
    CHECK(issues(report, mesh, all, "cube").empty());
    CHECK(report.unreferenced.empty());
    CHECK(report.coincident.empty());
    CHECK(report.enclosed_volume == doctest::Approx(1));
}

} // namespace

TEST_CASE("repair leaves a good surface as it is and reports nothing")
{
    SurfaceMesh cube = unit_cube();
    const auto before = cube.triangles;
    CHECK(sentences(repair_surface(cube)).empty());
    CHECK(cube.triangles == before);
}

TEST_CASE("vertices nearer than rounding become one and unused ones are removed")
{
    SurfaceMesh cube = unit_cube();
    cube.points.push_back(cube.points[6] + Vec3(1e-10, 0, 0)); // used by one triangle
    cube.triangles[3][1] = 8;
    cube.points.emplace_back(5, 5, 5); // of no triangle
    const SurfaceRepair done = repair_surface(cube);
    CHECK(done.merged == 1);
    CHECK(done.unused == 1);
    CHECK(sentences(done).size() == 2);
    check_whole_cube(cube);
}

TEST_CASE("collapsed and repeated triangles are removed")
{
    SurfaceMesh cube = unit_cube();
    cube.triangles.push_back({0, 0, 1});
    cube.triangles.push_back(cube.triangles[4]);
    const SurfaceRepair done = repair_surface(cube);
    CHECK(done.collapsed == 1);
    CHECK(done.repeated == 1);
    check_whole_cube(cube);
}

TEST_CASE("a triangle without area is taken into its neighbour which is divided")
{
    SurfaceMesh cube = unit_cube(); // the edge 0-1 of triangles {0,1,2} and {1,0,4}
    cube.points.emplace_back(0, 0.3, 0);
    cube.triangles[0] = {0, 8, 2};
    cube.triangles.push_back({8, 1, 2});
    cube.triangles.push_back({0, 1, 8}); // flat: fills the slit to {1,0,4}
    const SurfaceRepair done = repair_surface(cube);
    CHECK(done.flat == 1);
    CHECK(cube.triangles.size() == 14);
    check_whole_cube(cube);
}

TEST_CASE("turned triangles are turned back and a surface inside out is turned outwards")
{
    SurfaceMesh cube = unit_cube();
    std::swap(cube.triangles[2][0], cube.triangles[2][1]);
    CHECK(repair_surface(cube).turned == 1);
    check_whole_cube(cube);
    turn_around(cube);
    SurfaceRepair done = repair_surface(cube);
    CHECK(done.turned_around);
    CHECK(done.turned == 0);
    check_whole_cube(cube);
    turn_around(cube);
    std::swap(cube.triangles[2][0], cube.triangles[2][1]);
    done = repair_surface(cube);
    CHECK(done.turned == 11); // all but the one that faced outwards
    check_whole_cube(cube);
}

TEST_CASE("each part faces outwards but inwards where it is a cavity of another")
{
    const auto inner = moved(unit_cube(), 0.96, {0.02, 0.02, 0.02});
    const auto innermost = moved(unit_cube(), 0.5, {0.25, 0.25, 0.25});
    const auto beside = moved(unit_cube(), 0.5, {2, 0, 0});
    SurfaceMesh all = together(together(together(unit_cube(), inner), innermost), beside);
    SurfaceRepair done = repair_surface(all);
    CHECK(done.turned_parts == 1); // the inner one
    CHECK(done.turned == 0);
    CHECK_FALSE(done.turned_around);
    CHECK(sentences(done).size() == 1);
    const double volume = 1 - 0.96 * 0.96 * 0.96 + 0.125 + 0.125;
    CHECK(enclosed_volume(all) == doctest::Approx(volume));
    CHECK(sentences(repair_surface(all)).empty());
    // Any part, and one triangle of another, drawn from the other side: the same comes out.
    for (std::size_t part = 0; part < 4; ++part) {
        SurfaceMesh wrong = all;
        for (std::size_t t = 12 * part; t < 12 * (part + 1); ++t)
            std::swap(wrong.triangles[t][1], wrong.triangles[t][2]);
        const std::size_t other = 12 * ((part + 1) % 4) + 5;
        std::swap(wrong.triangles[other][1], wrong.triangles[other][2]);
        done = repair_surface(wrong);
        CHECK(done.turned_parts == 1);
        CHECK(done.turned == 1);
        CHECK(wrong.triangles == all.triangles);
    }
    // A part beside another, inside out: all of the volume may hide that it is one.
    SurfaceMesh two = together(unit_cube(), beside);
    for (std::size_t t = 12; t < 24; ++t)
        std::swap(two.triangles[t][1], two.triangles[t][2]);
    CHECK(repair_surface(two).turned_parts == 1);
    CHECK(enclosed_volume(two) == doctest::Approx(1.125));
}

TEST_CASE("two triangles back to back that enclose nothing are both removed")
{
    // Beside the body, on an edge of it, and two of them that make a square.
    for (const std::vector<std::array<std::int32_t, 3>>& sheet :
         {std::vector<std::array<std::int32_t, 3>>{{8, 9, 10}},
          {{0, 1, 8}},
          {{0, 8, 9}, {0, 9, 10}}}) {
        SurfaceMesh cube = unit_cube();
        cube.points.insert(cube.points.end(), {{-1, 0, 0}, {-1, -1, 0}, {0, -1, 0}});
        for (const auto& [a, b, c] : sheet) {
            cube.triangles.push_back({a, b, c});
            cube.triangles.push_back({b, a, c});
        }
        const SurfaceRepair done = repair_surface(cube);
        CHECK(done.repeated == static_cast<std::int64_t>(2 * sheet.size()));
        CHECK(cube.triangles.size() == 12);
        check_whole_cube(cube);
    }
    // One that closes the body stays, whichever way its copy runs.
    SurfaceMesh cube = unit_cube();
    const auto [a, b, c] = cube.triangles[7];
    cube.triangles.push_back({b, a, c});
    CHECK(repair_surface(cube).repeated == 1);
    check_whole_cube(cube);
}

TEST_CASE("holes stay open unless they are to be closed")
{
    SurfaceMesh tube = open_tube(24, 5, 3);
    repair_surface(tube);
    CHECK(check_surface(tube).boundaries.size() == 2);
    const double area = 12 * std::sin(2 * 3.14159265358979323846 / 24);
    CHECK(close_holes(tube) == 2);
    CHECK(sentences(repair_surface(tube)).empty());
    const SurfaceReport report = check_surface(tube);
    CHECK(report.closed());
    CHECK(report.enclosed_volume == doctest::Approx(3 * area));
}

TEST_CASE("a triangle without area at a border passes and the border runs through its vertex")
{
    SurfaceMesh tube = open_tube(12, 3, 2);
    const std::size_t before = tube.triangles.size();
    const Vec3 a = tube.points[0], b = tube.points[1];
    tube.points.push_back(0.5 * (a + b));
    const auto middle = static_cast<std::int32_t>(tube.points.size()) - 1;
    // As a decimated border has it: divided at the middle of an edge, with a flat triangle outside.
    std::array<std::int32_t, 3> flat{};
    for (std::size_t t = 0; t < before; ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t from = tube.triangles[t][k], to = tube.triangles[t][(k + 1) % 3];
            if (from + to != 1 || from * to != 0) continue;
            const std::int32_t third = tube.triangles[t][(k + 2) % 3];
            tube.triangles.push_back({middle, to, third});
            tube.triangles[t] = {from, middle, third};
            flat = {from, to, middle};
        }
    tube.triangles.push_back(flat);
    REQUIRE(tube.triangles.size() == before + 2);
    REQUIRE(check_surface(tube).degenerate.size() == 1);
    const SurfaceRepair done = repair_surface(tube);
    CHECK(done.flat == 1);
    CHECK(tube.triangles.size() == before + 1);
    const SurfaceReport report = check_surface(tube);
    CHECK(report.degenerate.empty());
    CHECK(report.inconsistent.empty());
    REQUIRE(report.boundaries.size() == 2);
    CHECK(report.boundaries[0].vertices.size() + report.boundaries[1].vertices.size() == 25);
}

TEST_CASE("small holes are closed and openings stay")
{
    SurfaceMesh tube = open_tube(24, 8, 4);
    tube.triangles.erase(tube.triangles.begin() + 100);
    REQUIRE(check_surface(tube).boundaries.size() == 3);
    const auto small = [](const BoundaryLoop& hole) { return is_small_hole(hole, 0.1); };
    CHECK(close_holes(tube, small) == 1);
    const SurfaceReport report = check_surface(tube);
    REQUIRE(report.boundaries.size() == 2);
    CHECK(report.boundaries[0].vertices.size() == 24);
    CHECK(report.inconsistent.empty());
    CHECK(report.degenerate.empty());
}
