#include "contact/rigid/overlap.hpp"
#include "contact/rigid/shape_distance.hpp"
#include "contact/rigid/shape_surface.hpp"
#include "contact/rigid/tests/contacts_for_tests.hpp"

#include <numbers>

// Ellipsoids, capsules and wedges: against closed forms, and against the other shapes that they
// contain as special cases.

using namespace amontons;

namespace {

double enclosed_volume(const SurfaceMesh& mesh)
{
    double volume = 0;
    for (const auto& [a, b, c] : mesh.triangles)
        volume += mesh.points[std::size_t(a)].dot(
                      mesh.points[std::size_t(b)].cross(mesh.points[std::size_t(c)])) /
                  6;
    return volume;
}

} // namespace

TEST_CASE("mass and inertia of an ellipsoid and a capsule are the closed forms")
{
    const MassProperties e = mass_properties(Ellipsoid{{1, 2, 3}}, 5);
    CHECK(e.mass == doctest::Approx(40 * std::numbers::pi));
    CHECK(e.inertia(0, 0) == doctest::Approx(e.mass / 5 * (4 + 9)));
    CHECK(e.inertia(1, 1) == doctest::Approx(e.mass / 5 * (1 + 9)));
    // A capsule by integrating its discs along the axis.
    const double r = 0.7, h = 1.2, density = 3;
    double mass = 0, along = 0, across = 0;
    const int n = 400000;
    const double dz = 2 * (h + r) / n;
    for (int i = 0; i < n; ++i) {
        const double z = -(h + r) + (i + 0.5) * dz, beyond = std::max(0.0, std::abs(z) - h);
        const double square = r * r - beyond * beyond;
        const double dm = density * std::numbers::pi * square * dz;
        mass += dm;
        along += dm * square / 2;
        across += dm * (square / 4 + z * z);
    }
    const MassProperties c = mass_properties(Capsule{r, h}, density);
    CHECK(c.mass == doctest::Approx(mass).epsilon(1e-9));
    CHECK(c.inertia(2, 2) == doctest::Approx(along).epsilon(1e-9));
    CHECK(c.inertia(0, 0) == doctest::Approx(across).epsilon(1e-9));
}

TEST_CASE("a wedge has the mass and centre and faces of its prism whichever way its corners run")
{
    // A right triangle of legs 3 and 2, and an L, both 4 long.
    const TriangleShape w = make_wedge({{0, 0}, {3, 0}, {0, 2}}, 4);
    const TriangleShape back = make_wedge({{0, 2}, {3, 0}, {0, 0}}, 4);
    for (const TriangleShape* s : {&w, &back}) {
        const MassProperties m = mass_properties(*s, 2);
        CHECK(m.mass == doctest::Approx(24));
        CHECK((m.centre - Vec3{1, 2. / 3, 0}).norm() < 1e-14);
        // Second moments of a triangle about its centroid: b^2/18, h^2/18 of its area.
        CHECK(m.inertia(0, 0) == doctest::Approx(24 * (4. / 18 + 16. / 12)));
        CHECK(m.inertia(1, 1) == doctest::Approx(24 * (9. / 18 + 16. / 12)));
        CHECK(m.inertia(0, 1) == doctest::Approx(24 * 6. / 36));
        CHECK(s->polyhedron.normals.size() == 5);
        CHECK(s->polyhedron.convex);
    }
    const TriangleShape l = make_wedge({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}, 1);
    CHECK(mass_properties(l, 1).mass == doctest::Approx(3));
    CHECK(l.polyhedron.normals.size() == 8);
    CHECK_FALSE(l.polyhedron.convex);
    CHECK_THROWS(make_wedge({{0, 0}, {1, 0}}, 1));
    CHECK_THROWS(make_wedge({{0, 0}, {1, 0}, {2, 0}}, 1));
    CHECK_THROWS(make_wedge({{0, 0}, {1, 1}, {1, 0}, {0, 1}}, 1)); // a bow tie
    CHECK_THROWS(make_wedge({{0, 0}, {1, 0}, {1, 0}, {0, 1}}, 1));
}

TEST_CASE("from the nearest place on an ellipsoid the point lies along the normal")
{
    std::mt19937 rng{31};
    std::uniform_real_distribution<double> logarithm(-2, 0);
    for (int i = 0; i < 20000; ++i) {
        const auto radius = [&] { return std::pow(10, logarithm(rng)); };
        Ellipsoid e{{radius(), radius(), radius()}};
        if (i % 7 == 0) e.radii[1] = e.radii[0];
        Vec3 x = random_vector(rng, i % 2 == 0 ? 0.05 : 1);
        if (i % 5 == 0) x[i % 3] = 0;
        std::int32_t near = -1;
        const WallSample s = shape_distance(e, x, near);
        const Vec3 foot = x - s.distance * s.normal;
        const double level = foot.cwiseQuotient(e.radii).norm();
        CHECK(level == doctest::Approx(1).epsilon(1e-9));
        const Vec3 normal = foot.cwiseQuotient(e.radii.cwiseAbs2()).normalized();
        CHECK((normal - s.normal).norm() < 1e-7);
        CHECK((s.distance < 0) == (x.cwiseQuotient(e.radii).norm() < 1));
        // No sampled place is nearer.
        for (int k = 0; k < 4; ++k) {
            const Vec3 other = e.radii.cwiseProduct(random_vector(rng).normalized());
            CHECK((other - x).norm() > std::abs(s.distance) * (1 - 1e-9));
        }
    }
    // Its derivatives are those of the distance.
    const Ellipsoid e{{1, 0.5, 0.25}};
    for (int i = 0; i < 200; ++i) {
        const Vec3 x = e.radii.cwiseProduct(random_vector(rng).normalized()) * 1.3;
        std::int32_t near = -1;
        const WallSample s = shape_distance(e, x, near);
        Mat3 difference;
        const double h = 1e-5;
        for (int k = 0; k < 3; ++k)
            difference.col(k) = (shape_distance(e, x + h * Vec3::Unit(k), near).normal -
                                 shape_distance(e, x - h * Vec3::Unit(k), near).normal) /
                                (2 * h);
        CHECK((difference - s.hessian).norm() < 1e-6 * (1 + s.hessian.norm()));
    }
}

TEST_CASE("an ellipsoid of equal half axes is a ball against every shape")
{
    std::mt19937 rng{32};
    int seen = 0;
    for (const RigidShape& b : all_shapes())
        for (int i = 0; i < 400; ++i) {
            const Pose pa = random_pose(rng, 0.7), pb = random_pose(rng, 0.7);
            const Contacts ball = contacts(Ball{0.45}, pa, b, pb, 0.3);
            const Contacts round = contacts(Ellipsoid{Vec3::Constant(0.45)}, pa, b, pb, 0.3);
            CAPTURE(b.index());
            if (convex(b)) {
                // Deep inside the way out may be another as good.
                if (least_gap(ball) < -0.2) continue;
                REQUIRE(round.size() == ball.size());
                if (ball.empty()) continue;
                ++seen;
                CHECK(round[0].gap == doctest::Approx(ball[0].gap).epsilon(1e-9));
                CHECK((round[0].normal - ball[0].normal).norm() < 1e-7);
                CHECK((round[0].point_a - ball[0].point_a).norm() < 1e-7);
            } else if (least_gap(ball) > 0) {
                CHECK(least_gap(round) == doctest::Approx(least_gap(ball)).epsilon(1e-9));
            }
        }
    CHECK(seen > 300);
}

TEST_CASE("an ellipsoid's and a capsule's nearest contact is the distance and its direction is the "
          "one that keeps the bodies farthest apart" *
          doctest::test_suite("slow"))
{
    // Against the nearest of many places of one surface from the other body, whose distance is
    // exact.
    std::mt19937 rng{33};
    const auto shapes = all_shapes();
    int seen = 0;
    for (const RigidShape& a :
         {RigidShape(Ellipsoid{{0.6, 0.2, 0.4}}), RigidShape(Capsule{0.2, 0.5})})
        for (const RigidShape& b : shapes) {
            if (std::holds_alternative<Plane>(b)) continue;
            for (int i = 0; i < 60; ++i) {
                const Pose pa = random_pose(rng, 0.8), pb = random_pose(rng, 0.8);
                const Contacts c = contacts(a, pa, b, pb, 1);
                // Places of a: of its core, from which all of it is as far.
                double sampled = 1e300;
                std::int32_t near = -1;
                const auto search = [&](const Vec3& own, double radius) {
                    const Vec3 x = pb.turn.conjugate() * (pa.place + pa.turn * own - pb.place);
                    sampled = std::min(sampled, shape_distance(b, x, near).distance - radius);
                };
                if (const auto* capsule = std::get_if<Capsule>(&a))
                    for (int k = 0; k <= 2000; ++k)
                        search(Vec3{0, 0, capsule->half_length * (k / 1000.0 - 1)},
                               capsule->radius);
                else
                    for (int k = 0; k < 20000; ++k) { // a spiral
                        const double z = 1 - (2 * k + 1) / 20000.0, angle = 2.399963229728653 * k;
                        const double r = std::sqrt(1 - z * z);
                        search(std::get<Ellipsoid>(a).radii.cwiseProduct(
                                   Vec3{r * std::cos(angle), r * std::sin(angle), z}),
                               0);
                    }
                CAPTURE(a.index());
                CAPTURE(b.index());
                CAPTURE(i);
                if (sampled > 0.95) continue;
                REQUIRE(!c.empty());
                if (sampled < 0.01) {
                    CHECK(least_gap(c) < 0.02);
                    continue;
                }
                ++seen;
                CHECK(least_gap(c) <= sampled + 1e-12);
                CHECK(least_gap(c) > sampled - 2e-3);
            }
        }
    CHECK(seen > 400);
}

TEST_CASE("an ellipsoid on a plane touches it below its centre by the support function")
{
    std::mt19937 rng{34};
    const Ellipsoid e{{3, 2, 1}};
    for (int i = 0; i < 100; ++i) {
        const Pose pose{{0.2, -0.1, 3}, random_turn(rng)};
        const Contacts c = contacts(e, pose, Plane{}, {}, 5);
        REQUIRE(c.size() == 1);
        const Vec3 down = pose.turn.conjugate() * Vec3::UnitZ();
        CHECK(c[0].gap == doctest::Approx(3 - e.radii.cwiseProduct(down).norm()).epsilon(1e-13));
        CHECK(c[0].normal == Vec3::UnitZ());
    }
}

TEST_CASE(
    "a capsule that lies touches with both ends, standing with one, on a plane and a box alike")
{
    const Capsule capsule{0.5, 2};
    const Pose lying{{0, 0, 0.5}, turn_about(Vec3::UnitY(), std::numbers::pi / 2)};
    for (const RigidShape& ground : {RigidShape(Plane{}), RigidShape(Box{{5, 5, 0.5}}),
                                     RigidShape(triangle_box({5, 5, 0.5}, 3))}) {
        const double top = std::holds_alternative<Plane>(ground) ? 0 : 0.5;
        const Pose below{{0, 0, -top}, Eigen::Quaterniond::Identity()};
        const Contacts c = contacts(capsule, lying, ground, below, 0.1);
        REQUIRE(c.size() == 2);
        for (const double x : {-2.0, 2.0})
            CHECK(has(c, {x, 0, 0}, Vec3::UnitZ()));
        const Contacts vertical =
            contacts(capsule, {{0, 0, 2.5}, Eigen::Quaterniond::Identity()}, ground, below, 0.1);
        REQUIRE(vertical.size() == 1);
        CHECK(vertical[0].gap == doctest::Approx(0));
    }
    // Over a box that is shorter: where it crosses the outline of its top.
    const Contacts bridge = contacts(capsule, lying, Box{{1, 1, 0.5}},
                                     {{0, 0, -0.5}, Eigen::Quaterniond::Identity()}, 0.1);
    REQUIRE(bridge.size() == 2);
    for (const double x : {-1.0, 1.0})
        CHECK(has(bridge, {x, 0, 0}, Vec3::UnitZ()));
    // Side by side: the ends of the overlap; crossed: one place.
    const Contacts beside = contacts(capsule, lying, capsule, {{1, 0, 1.6}, lying.turn}, 0.2);
    REQUIRE(beside.size() == 2);
    for (const RigidContact& one : beside)
        CHECK(one.gap == doctest::Approx(0.1));
    const Contacts crossed =
        contacts(capsule, lying, capsule,
                 {{0, 0, 1.6}, turn_about(Vec3::UnitX(), std::numbers::pi / 2)}, 0.2);
    REQUIRE(crossed.size() == 1);
    CHECK(has(crossed, {0, 0, 1}, -Vec3::UnitZ()));
}

TEST_CASE("round shapes against walls have the contacts that they have with the body of that wall")
{
    std::mt19937 rng{35};
    const Ball ball{1.5};
    const SampleWall wall = [&](const Vec3& x) {
        std::int32_t near = -1;
        return shape_distance(ball, x, near);
    };
    for (const RigidShape& a :
         {RigidShape(Ellipsoid{{0.6, 0.3, 0.4}}), RigidShape(Capsule{0.2, 0.5})})
        for (int i = 0; i < 300; ++i) {
            const Pose pose{(1.5 + 0.3) * random_vector(rng).normalized(), random_turn(rng)};
            Contacts on_wall;
            detect_wall(a, pose, wall, 0.5, on_wall);
            const Contacts on_ball = contacts(a, pose, ball, {}, 0.5);
            REQUIRE(!on_ball.empty());
            CAPTURE(a.index());
            CHECK(least_gap(on_wall) == doctest::Approx(least_gap(on_ball)).epsilon(1e-9));
            // How deep it is, by a search that uses no contacts.
            const ShapeOverlap deep = deepest_in(a, pose, nullptr, wall, {});
            CHECK(deep.depth == doctest::Approx(std::max(0.0, -least_gap(on_ball))).epsilon(1e-7));
        }
    // Across a round tube of radius R: the least curved places of both sides touch at once.
    const double R = 0.61;
    const SampleWall tube = [&](const Vec3& x) {
        WallSample s;
        const Vec3 out{x[0], x[1], 0};
        const double r = std::max(out.norm(), 1e-12);
        s.distance = R - r;
        s.normal = -out / r;
        s.hessian = -(Mat3(Vec3(1, 1, 0).asDiagonal()) - out * out.transpose() / (r * r)) / r;
        return s;
    };
    Contacts across;
    detect_wall(Ellipsoid{{0.6, 0.3, 0.4}}, {}, tube, 0.05, across);
    REQUIRE(across.size() == 2);
    for (const double side : {-1.0, 1.0})
        CHECK(has(across, {side * 0.6, 0, 0}, {-side, 0, 0}, 1e-9));
}

TEST_CASE("triangulated ellipsoids and capsules are closed and a little smaller than the shape")
{
    for (const RigidShape& shape :
         {RigidShape(Ellipsoid{{3, 2, 1}}), RigidShape(Capsule{0.5, 2})}) {
        const SurfaceMesh mesh = surface_of(shape);
        const double volume = mass_properties(shape, 1).mass;
        CHECK(enclosed_volume(mesh) < volume);
        CHECK(enclosed_volume(mesh) > 0.96 * volume);
        CHECK_NOTHROW(make_triangle_shape(mesh));
    }
}
