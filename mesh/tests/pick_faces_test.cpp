#include "mesh/pick_faces.hpp"

#include "mesh/generate/solid_box.hpp"
#include "mesh/generate/solid_round.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

std::vector<FaceRef> named(const VolumeMesh& mesh, const char* name)
{
    const FaceSet* set = find_set(mesh.face_sets, name);
    REQUIRE(set != nullptr);
    REQUIRE(!set->members.empty());
    std::vector<FaceRef> faces = set->members;
    std::ranges::sort(faces);
    return faces;
}

} // namespace

TEST_CASE("sides of a block that planes and flat boxes and seeds pick are those of its generator, "
          "with its units and place")
{
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10, ElementKind::H8})
        for (const double unit : {1.0, 1e-5})
            for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(-40, 3, 7)}) {
                CAPTURE(unit);
                CAPTURE(shift.transpose());
                SolidBoxOptions o;
                o.lowest = unit * (Vec3(0, 0, 0) + shift);
                o.highest = unit * (Vec3(3, 2, 1) + shift);
                o.cells = {4, 3, 2};
                o.grading = {2, 1, 1};
                o.kind = kind;
                const VolumeMesh mesh = make_solid_box(o);
                const ExternalSurface outside = extract_surface(mesh);
                const double slack = place_tolerance(mesh);
                const char* const names[] = {"x_min", "x_max", "y_min", "y_max", "z_min", "z_max"};
                for (int side = 0; side < 6; ++side) {
                    CAPTURE(names[side]);
                    const int axis = side / 2;
                    Vec3 from = o.lowest, to = o.highest;
                    (side % 2 ? from : to)[axis] = (side % 2 ? to : from)[axis];
                    const std::vector<FaceRef> own = named(mesh, names[side]);
                    CHECK(faces_in(outside, mesh, inside_box(to, from, slack)) == own);
                    CHECK(faces_in(outside, mesh, near_plane(from, 3 * Vec3::Unit(axis), slack)) ==
                          own);
                    const AlikeFaces alike =
                        faces_alike(outside, mesh, 0.5 * (from + to), 30 * kDegree);
                    CHECK(alike.faces == own);
                    CHECK(alike.away <= slack);
                    std::vector<std::int32_t> nodes =
                        nodes_of(mesh, *find_set(mesh.face_sets, names[side]));
                    CHECK(nodes_in(mesh, inside_box(from, to, slack)) == nodes);
                }
                CHECK(faces_in(outside, mesh, inside_box(o.lowest, o.highest, slack)) ==
                      outside.faces);
                CHECK(nodes_in(mesh, inside_box(o.lowest, o.highest, slack)).size() ==
                      mesh.nodes.size());
                // All around, where the angle allows a right one.
                CHECK(faces_alike(outside, mesh, o.lowest, 91 * kDegree).faces == outside.faces);
            }
}

TEST_CASE("a face belongs to a region with all its nodes or not at all")
{
    SolidBoxOptions o;
    o.highest = {4, 1, 1};
    o.cells = {4, 1, 1};
    const VolumeMesh mesh = make_solid_box(o);
    const ExternalSurface outside = extract_surface(mesh);
    CHECK(faces_in(outside, mesh, inside_box({-1, -1, 0.9}, {1.9, 2, 2}, 0)).size() == 1);
    CHECK(faces_in(outside, mesh, inside_box({-1, -1, 0.9}, {2.1, 2, 2}, 0)).size() == 2);
    CHECK(faces_in(outside, mesh, inside_box({0.1, 0, 0}, {0.9, 1, 1}, 0)).empty());
}

TEST_CASE(
    "a seed on the mantle or the end of a cylinder or on a ball takes what its generator names")
{
    for (const ElementKind kind : {ElementKind::T10, ElementKind::H8}) {
        SolidCylinderOptions o;
        o.axis = {1, 2, 2};
        o.radius = 0.5;
        o.length = 3;
        o.cells = 8;
        o.kind = kind;
        const VolumeMesh mesh = make_solid_cylinder(o);
        const ExternalSurface outside = extract_surface(mesh);
        const Vec3 n = o.axis.normalized();
        CHECK(faces_alike(outside, mesh, 3 * n, 40 * kDegree).faces == named(mesh, "end"));
        CHECK(faces_alike(outside, mesh, 1.5 * n + 0.5 * n.unitOrthogonal(), 40 * kDegree).faces ==
              named(mesh, "outer"));
        const VolumeMesh ball = make_solid_ball({Vec3(1, 0, 0), 0.2, 6, kind});
        const ExternalSurface skin = extract_surface(ball);
        CHECK(faces_in(skin, ball, inside_ball({1, 0, 0}, 0.2, place_tolerance(ball))) ==
              named(ball, "outer"));
        const AlikeFaces far = faces_alike(skin, ball, {1, 0, 0.5}, 60 * kDegree);
        CHECK(far.away == doctest::Approx(0.3).epsilon(0.02));
        CHECK(far.seed.z() == doctest::Approx(0.2).epsilon(0.02));
        CHECK(far.faces == named(ball, "outer"));
    }
}
