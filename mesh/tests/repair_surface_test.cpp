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

TEST_CASE("repair leaves a good surface as it is, and says nothing")
{
    SurfaceMesh cube = unit_cube();
    const auto before = cube.triangles;
    CHECK(sentences(repair_surface(cube)).empty());
    CHECK(cube.triangles == before);
}

TEST_CASE("vertices nearer than rounding become one, and unused ones go")
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

TEST_CASE("collapsed and repeated triangles go")
{
    SurfaceMesh cube = unit_cube();
    cube.triangles.push_back({0, 0, 1});
    cube.triangles.push_back(cube.triangles[4]);
    const SurfaceRepair done = repair_surface(cube);
    CHECK(done.collapsed == 1);
    CHECK(done.repeated == 1);
    check_whole_cube(cube);
}

TEST_CASE("a triangle without area is taken into its neighbour, which is divided")
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

TEST_CASE("turned triangles are turned back, and a surface inside out is turned outwards")
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
