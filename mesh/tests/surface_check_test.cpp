#include "mesh/surface_check.hpp"

#include "mesh/format/read.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/test_program.hpp"
#include "mesh/weld.hpp"

#include <algorithm>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

std::string faults(const SurfaceMesh& mesh, const SurfaceRequirements& required)
{
    return InputError(issues(check_surface(mesh), mesh, required, "f")).what();
}

constexpr SurfaceRequirements kClosed = {true, true, true, true, true};

/// A strip of n quadrilaterals, closed to a ring after half a turn.
SurfaceMesh moebius_strip(int n)
{
    SurfaceMesh strip;
    for (int i = 0; i < n; ++i) {
        const double angle = 2 * 3.14159265358979323846 * i / n;
        const Vec3 out(std::cos(angle), std::sin(angle), 0);
        const Vec3 across = std::cos(angle / 2) * out + std::sin(angle / 2) * Vec3::UnitZ();
        strip.points.emplace_back(3 * out - across);
        strip.points.emplace_back(3 * out + across);
    }
    for (int i = 0; i < n; ++i) {
        const int a = 2 * i, b = a + 1;
        const int c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
        strip.triangles.push_back({a, b, d});
        strip.triangles.push_back({a, d, c});
    }
    return strip;
}

} // namespace

TEST_CASE("a cube has no defects")
{
    const SurfaceReport r = check_surface(unit_cube());
    CHECK(r.closed());
    CHECK(r.components == 1);
    CHECK(r.enclosed_volume == doctest::Approx(1));
    CHECK(r.diagonal == doctest::Approx(std::sqrt(3)));
    CHECK(r.non_manifold.empty());
    CHECK(r.inconsistent.empty());
    CHECK(r.degenerate.empty());
    CHECK(r.coincident.empty());
    CHECK(r.unreferenced.empty());
    CHECK(r.intersection_count == 0);
    CHECK(faults(unit_cube(), kClosed) == "");
}

TEST_CASE("the enclosed volume has the sign of the normals wherever the surface is")
{
    const SurfaceMesh far = moved(unit_cube(), 2e-3, Vec3(1e3, -2e3, 5e2));
    CHECK(enclosed_volume(far) == doctest::Approx(8e-9).epsilon(1e-6));
    SurfaceMesh inward = far;
    turn_around(inward);
    CHECK(enclosed_volume(inward) == doctest::Approx(-8e-9).epsilon(1e-6));
    CHECK(enclosed_volume({}) == 0);
}

TEST_CASE("an open tube has two holes each with its place and length")
{
    const SurfaceMesh tube = open_tube(64, 10, 5);
    const SurfaceReport r = check_surface(tube);
    CHECK(!r.closed());
    REQUIRE(r.boundaries.size() == 2);
    for (const BoundaryLoop& loop : r.boundaries) {
        CHECK(loop.vertices.size() == 64);
        CHECK(loop.length == doctest::Approx(128 * std::sin(3.14159265358979323846 / 64)));
        const double z = loop.centre[2];
        CHECK((std::abs(z) < 1e-12 || std::abs(z - 5) < 1e-12));
        CHECK(loop.centre.head<2>().norm() < 1e-12);
        for (std::size_t i = 0; i < 64; ++i) { // neighbours in the list are neighbours in space
            const auto x = [&](std::size_t k) {
                return tube.points[static_cast<std::size_t>(loop.vertices[k % 64])];
            };
            CHECK((x(i + 1) - x(i)).norm() < 0.11);
        }
    }
    const std::string text = faults(tube, kClosed);
    CHECK(text.find("f: hole around (") == 0);
    CHECK(text.find("found 64 open edges, length 6.28") != std::string::npos);
    CHECK(text.find("allowed: a closed surface") != std::string::npos);
    CHECK(faults(tube, {}) == "");
}

TEST_CASE("two holes that touch at a vertex are two loops")
{
    // A 2 x 2 checkerboard of squares in a frame would do; here two triangles tip to tip.
    SurfaceMesh bow;
    bow.points = {{0, 0, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}};
    bow.triangles = {{0, 1, 2}, {0, 3, 4}};
    const SurfaceReport r = check_surface(bow);
    CHECK(r.components == 2); // a vertex alone connects nothing
    std::size_t edges = 0;
    for (const BoundaryLoop& loop : r.boundaries)
        edges += loop.vertices.size();
    CHECK(edges == 6);
    CHECK(r.intersection_count == 0);
}

TEST_CASE("an edge with three triangles is named with its ends")
{
    SurfaceMesh mesh = unit_cube();
    mesh.points.emplace_back(-1, 2, 0.5);
    mesh.triangles.push_back({0, 1, 8}); // a fin on the edge 0-1
    const SurfaceReport r = check_surface(mesh);
    REQUIRE(r.non_manifold.size() == 1);
    CHECK(r.non_manifold[0].triangles == std::vector<std::int32_t>{0, 10, 12});
    CHECK(!r.closed());
    CHECK(faults(mesh, {}) == "f: edge 0-1: found 3 triangles (0, 10, 12) from (0, 0, 0) to "
                              "(0, 1, 0), allowed: one or two triangles on an edge");
}

TEST_CASE("a turned triangle is found and turned back")
{
    SurfaceMesh mesh = unit_cube();
    std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
    const SurfaceReport r = check_surface(mesh);
    CHECK(r.inconsistent.size() == 3);
    for (const EdgeFault& e : r.inconsistent)
        CHECK(std::count(e.triangles.begin(), e.triangles.end(), 3) == 1);
    CHECK(faults(mesh, {}).find("neighbours that face the same side") != std::string::npos);
    CHECK(faults(mesh, {.oriented = false}) == "");

    const Orienting done = orient_consistently(mesh);
    CHECK(done.turned == 1);
    CHECK(done.orientable);
    CHECK(check_surface(mesh).inconsistent.empty());
    CHECK(enclosed_volume(mesh) == doctest::Approx(1));
}

TEST_CASE("each component is oriented on its own by its majority")
{
    SurfaceMesh inward = moved(unit_cube(), 1, Vec3(5, 0, 0));
    turn_around(inward);
    SurfaceMesh mesh = together(unit_cube(), inward);
    for (const std::size_t t : {0, 1, 2, 13, 14})
        std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    CHECK(orient_consistently(mesh).turned == 5);
    const SurfaceReport r = check_surface(mesh);
    CHECK(r.components == 2);
    CHECK(r.inconsistent.empty());
    CHECK(r.enclosed_volume == doctest::Approx(0)); // 1 - 1
    CHECK(orient_consistently(mesh).turned == 0);
}

TEST_CASE("a Moebius strip has one side and one edge")
{
    SurfaceMesh strip = moebius_strip(20);
    CHECK(!orient_consistently(strip).orientable);
    const SurfaceReport r = check_surface(strip);
    CHECK(r.boundaries.size() == 1);
    CHECK(r.boundaries[0].vertices.size() == 40);
    CHECK(!r.inconsistent.empty());
    CHECK(r.intersection_count == 0);
}

TEST_CASE("triangles without area are found at any size and place")
{
    for (const double size : {1e-6, 1.0, 1e6})
        for (const Vec3& by : {Vec3(0, 0, 0), Vec3(1, 1, 1)}) {
            SurfaceMesh mesh = unit_cube();
            mesh.points.emplace_back(0.5, 0.5, 0);        // on the diagonal 0-2
            mesh.points.emplace_back(0.5, 0.5 + 1e-5, 0); // a sliver, but a triangle
            mesh.triangles.push_back({0, 2, 8});
            mesh.triangles.push_back({0, 2, 9});
            mesh.triangles.push_back({1, 1, 3});
            mesh = moved(mesh, size, size * by);
            CHECK(check_surface(mesh).degenerate == std::vector<std::int32_t>{12, 14});
        }
    SurfaceMesh mesh = unit_cube();
    mesh.triangles.push_back({1, 1, 3});
    CHECK(faults(mesh, {}) == "f: triangle 12: found no area between (0, 1, 0) (0, 1, 0) "
                              "(1, 0, 0), allowed: triangles with an area");
    CHECK(check_surface(mesh).closed()); // a collapsed triangle separates no neighbours
}

TEST_CASE("vertices at the same place or nearly and vertices of no triangle are found")
{
    for (const double size : {1e-6, 1.0, 1e6}) {
        SurfaceMesh mesh = unit_cube();
        mesh.points.push_back(mesh.points[6]);                            // 8: exact
        mesh.points.push_back(mesh.points[3] + Vec3(1e-9, -1e-9, 1e-10)); // 9: within 1.7e-9
        mesh.points.push_back(mesh.points[3] + Vec3(1e-8, 0, 0));         // 10: not
        mesh = moved(mesh, size, Vec3(-size, 0, 3 * size));
        const SurfaceReport r = check_surface(mesh);
        CHECK(r.coincident == std::vector<std::array<std::int32_t, 2>>{{6, 8}, {3, 9}});
        CHECK(r.unreferenced == std::vector<std::int32_t>{8, 9, 10});
    }
}

TEST_CASE("near vertices are found on whatever side of a cube's wall they are")
{
    SurfaceMesh mesh = unit_cube();
    for (int i = 1; i <= 500; ++i) {
        const Vec3 x(std::sin(i * 1.1), std::sin(i * 1.7), std::sin(i * 2.3));
        mesh.points.push_back(x);
        mesh.points.push_back(x + 1.5e-9 * Vec3(std::cos(i), std::sin(i) * std::cos(i), 0.1));
    }
    CHECK(check_surface(mesh).coincident.size() == 500);
}

TEST_CASE("welding closes a soup of triangles whatever the sign of zero")
{
    SurfaceMesh soup;
    const SurfaceMesh cube = unit_cube();
    for (const auto& triangle : cube.triangles) {
        const auto n = static_cast<std::int32_t>(soup.points.size());
        for (const std::int32_t corner : triangle)
            soup.points.push_back(-1.0 * (-1.0 * cube.points[static_cast<std::size_t>(corner)]));
        soup.triangles.push_back({n, n + 1, n + 2});
    }
    soup.points[0] = -soup.points[0]; // (-0, -0, -0)
    CHECK(check_surface(soup).boundaries.size() == 12);
    weld(soup);
    CHECK(soup.points == cube.points);
    CHECK(soup.triangles == cube.triangles);
}

TEST_CASE("of many faults the first are listed and the rest counted")
{
    SurfaceMesh mesh = unit_cube();
    for (int i = 0; i < 10; ++i)
        mesh.triangles.push_back({1, 1, 3});
    const std::vector<Issue> all = issues(check_surface(mesh), mesh, {}, "f");
    REQUIRE(all.size() == 4);
    CHECK(all[3].found == "7 more of this");
}

TEST_CASE("an index of no vertex is a broken invariant")
{
    SurfaceMesh mesh = unit_cube();
    mesh.triangles.push_back({0, 1, 8});
    CHECK_THROWS_AS(check_surface(mesh), std::logic_error);
    CHECK(check_surface({}).closed() == false);
}

TEST_CASE("a patient's vessels: closed and with the free side inside")
{
    const auto file = vessel_data() / "aorta_supra_aortic.obj";
    if (!std::filesystem::exists(file)) {
        skip_test("no file ../shared/data/vessels/aorta_supra_aortic.obj");
        return;
    }
    const SurfaceReport r = check_surface(read_surface(file.string(), 1e-3));
    CHECK(r.vertices == 1786);
    CHECK(r.triangles == 3584);
    CHECK(r.closed()); // its ends have lids
    CHECK(r.components == 1);
    CHECK(r.inconsistent.empty());
    CHECK(r.intersection_count == 0);
    CHECK(r.enclosed_volume < -1e-4); // a third of a litre, normals into the blood
    CHECK(r.enclosed_volume > -1e-3);
}
