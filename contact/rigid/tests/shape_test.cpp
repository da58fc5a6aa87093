#include "contact/rigid/shape.hpp"

#include "contact/rigid/tests/shapes_for_tests.hpp"
#include "mesh/generate/ball.hpp"

#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

void check_close(const MassProperties& a, const MassProperties& b, double tolerance)
{
    CHECK(a.mass == doctest::Approx(b.mass).epsilon(tolerance));
    CHECK((a.centre - b.centre).norm() <= tolerance);
    CHECK((a.inertia - b.inertia).norm() <= tolerance * b.inertia.norm());
}

} // namespace

TEST_CASE("mass and centre and inertia of primitives are the closed forms")
{
    const MassProperties box = mass_properties(Box{{0.5, 1, 1.5}}, 10);
    CHECK(box.mass == doctest::Approx(60));
    CHECK(box.inertia(0, 0) == doctest::Approx(60. / 12 * (4 + 9)));
    CHECK(box.inertia(2, 2) == doctest::Approx(60. / 12 * (1 + 4)));
    const MassProperties ball = mass_properties(Ball{2}, 3);
    CHECK(ball.mass == doctest::Approx(32 * std::numbers::pi));
    CHECK(ball.inertia(1, 1) == doctest::Approx(0.4 * ball.mass * 4));
    const MassProperties cylinder = mass_properties(Cylinder{2, 1.5}, 3);
    CHECK(cylinder.mass == doctest::Approx(36 * std::numbers::pi));
    CHECK(cylinder.inertia(2, 2) == doctest::Approx(2 * cylinder.mass));
    CHECK(cylinder.inertia(0, 0) == doctest::Approx(cylinder.mass / 12 * (3 * 4 + 9)));
    CHECK(mass_properties(Plane{}, 3).mass == 0);
}

TEST_CASE("mass properties of triangles are exact wherever the body is")
{
    const Vec3 half{0.5, 1, 1.5};
    check_close(mass_properties(triangle_box(half, 3), 10), mass_properties(Box{half}, 10), 1e-13);

    // Turned and moved: R I R^T about the moved centre.
    std::mt19937 rng{1};
    const Pose pose = random_pose(rng, 3);
    SurfaceMesh mesh = hexahedron(box_corners(half));
    for (Vec3& p : mesh.points)
        p = pose.place + pose.turn * p;
    const Mat3 turn = pose.turn.toRotationMatrix();
    MassProperties expected = mass_properties(Box{half}, 10);
    expected.centre = pose.place;
    expected.inertia = turn * expected.inertia * turn.transpose();
    check_close(mass_properties(make_triangle_shape(mesh), 10), expected, 1e-13);

    // The L is two boxes: 2 x 1 x 1 and 1 x 1 x 1.
    const MassProperties l = mass_properties(triangle_l(), 1);
    CHECK(l.mass == doctest::Approx(3));
    CHECK((l.centre - Vec3{5. / 6, 0.5, 5. / 6}).norm() < 1e-14);
    const Vec3 lower = Vec3{1, 0.5, 0.5} - l.centre, upper = Vec3{0.5, 0.5, 1.5} - l.centre;
    const double about_y = 2 * (5. / 12 + lower.squaredNorm()) + (2. / 12 + upper.squaredNorm());
    CHECK(l.inertia(1, 1) == doctest::Approx(about_y));

    // A prism of n sides tends to the cylinder as n^-2.
    const double exact = mass_properties(Cylinder{1, 2}, 1).mass;
    const double e24 = exact - mass_properties(triangle_prism(1, 2, 24), 1).mass;
    const double e48 = exact - mass_properties(triangle_prism(1, 2, 48), 1).mass;
    CHECK(e24 / e48 == doctest::Approx(4).epsilon(0.01));
}

TEST_CASE("coplanar triangles are one face and straight chains of edges one edge")
{
    for (const int n : {1, 2, 5}) {
        CAPTURE(n);
        const Polyhedron p = triangle_box({1, 2, 3}, n).polyhedron;
        CHECK(p.normals.size() == 6);
        CHECK(p.edges.size() == 12);
        CHECK(p.vertices.size() == 8);
        CHECK(p.convex);
        for (const PolyhedronEdge& e : p.edges)
            CHECK(std::min({std::abs(e.length - 2), std::abs(e.length - 4),
                            std::abs(e.length - 6)}) < 1e-12);
    }
    const Polyhedron l = triangle_l().polyhedron;
    CHECK(l.normals.size() == 8);
    CHECK(l.edges.size() == 18);
    CHECK(l.vertices.size() == 12);
    CHECK_FALSE(l.convex);
    int concave = 0;
    for (const auto& e : l.edge_ends)
        concave += e.convex ? 0 : 1;
    CHECK(concave == 1);
    int not_convex = 0;
    for (const char c : l.face_convex)
        not_convex += c != 0 ? 0 : 1;
    CHECK(not_convex == 2); // the two Ls

    // A ball of triangles keeps every one of them.
    const SurfaceMesh ball = *make_ball({.radius = 1}).surface;
    const Polyhedron b = make_polyhedron(ball);
    CHECK(b.normals.size() == ball.triangles.size());
    CHECK(b.convex);
}

TEST_CASE("a box as a polyhedron is that of its triangles")
{
    const Vec3 half{1, 2, 3};
    const BoxPolyhedron box(half);
    const PolyhedronView v = box.view();
    for (std::size_t e = 0; e < 12; ++e) {
        const auto& ends = v.topology->edges[e];
        const Vec3 along = v.vertices[static_cast<std::size_t>(ends.vertex[1])] -
                           v.vertices[static_cast<std::size_t>(ends.vertex[0])];
        CHECK((along - v.edges[e].length * v.edges[e].along).norm() == 0);
        const Vec3 &n0 = v.normals[static_cast<std::size_t>(ends.face[0])],
                   &n1 = v.normals[static_cast<std::size_t>(ends.face[1])];
        CHECK((v.edges[e].into[0] - n0.cross(v.edges[e].along)).norm() == 0);
        CHECK((v.edges[e].into[1] - v.edges[e].along.cross(n1)).norm() == 0);
        CHECK(v.edges[e].into[0].dot(n1) == -1);
        for (const int k : {0, 1})
            for (const auto i : ends.vertex)
                CHECK(
                    v.normals[static_cast<std::size_t>(ends.face[static_cast<std::size_t>(k)])].dot(
                        v.vertices[static_cast<std::size_t>(i)]) ==
                    v.offsets[static_cast<std::size_t>(ends.face[static_cast<std::size_t>(k)])]);
    }
}

TEST_CASE("the axis-aligned box holds the body and touches it on every side")
{
    std::mt19937 rng{2};
    const TriangleShape prism = triangle_prism(1, 2, 720);
    for (int i = 0; i < 20; ++i) {
        const Pose pose = random_pose(rng, 5);
        const AxisBox of_cylinder = axis_box(Cylinder{1, 2}, pose),
                      of_prism = axis_box(prism, pose);
        CHECK((of_cylinder.low - of_prism.low).norm() < 1e-4);
        CHECK((of_cylinder.high - of_prism.high).norm() < 1e-4);
        const AxisBox box = axis_box(Box{{1, 2, 3}}, pose);
        const AxisBox same = axis_box(triangle_box({1, 2, 3}), pose);
        CHECK((box.low - same.low).norm() < 1e-13);
        CHECK((box.high - same.high).norm() < 1e-13);
        CHECK(bounding_radius(triangle_box({1, 2, 3})) == doctest::Approx(std::sqrt(14)));
    }
    const AxisBox plane = axis_box(Plane{}, {Vec3{1, 2, 3}, Eigen::Quaterniond::Identity()});
    CHECK(plane.high[2] == 3);
    CHECK(std::isinf(plane.low[2]));
}

TEST_CASE("a surface that encloses nothing is refused with all faults")
{
    SurfaceMesh open = hexahedron(box_corners(Vec3::Ones()));
    open.triangles.pop_back();
    CHECK_THROWS_AS(make_triangle_shape(open), InputError);
    SurfaceMesh inward = hexahedron(box_corners(Vec3::Ones()));
    for (auto& t : inward.triangles)
        std::swap(t[0], t[1]);
    CHECK_THROWS_AS(make_triangle_shape(inward), InputError);
    SurfaceMesh nan = hexahedron(box_corners(Vec3::Ones()));
    nan.points[3][1] = std::nan("");
    CHECK_THROWS_AS(make_triangle_shape(nan), InputError);
    CHECK_THROWS_AS(make_triangle_shape({}), InputError);
    CHECK(issues(RigidShape{Box{{1, -1, std::nan("")}}}).size() == 2);
    CHECK(issues(RigidShape{Cylinder{0, 1, -1}}).size() == 2);
    CHECK(issues(RigidShape{Ball{1}}).empty());
}
