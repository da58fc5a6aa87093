#include "contact/rigid/detect.hpp"

#include "contact/rigid/tests/contacts_for_tests.hpp"

#include <numbers>

using namespace amontons;

TEST_CASE("balls: the gap is the distance of centres less the radii")
{
    std::mt19937 rng{1};
    for (int i = 0; i < 100; ++i) {
        const Pose a = random_pose(rng), b = random_pose(rng);
        const Contacts c = contacts(Ball{0.5}, a, Ball{0.7}, b, 10);
        REQUIRE(c.size() == 1);
        CHECK(c[0].gap == doctest::Approx((a.place - b.place).norm() - 1.2).epsilon(1e-13));
        CHECK((c[0].normal - (a.place - b.place).normalized()).norm() < 1e-14);
        check_sane(c, 1, 10);
    }
    CHECK(contacts(Ball{0.5}, Vec3{2, 0, 0}, Ball{0.5}, 0.9).empty());
    const Contacts same = contacts(Ball{1}, Vec3::Zero(), Ball{1}, 0);
    REQUIRE(same.size() == 1);
    CHECK(same[0].gap == -2);
    check_sane(same, 1, 0);
}

TEST_CASE("ball and box: exact beside faces and edges and corners and from inside")
{
    const Box box{{1, 2, 3}};
    struct Case {
        Vec3 centre, normal;
        double distance;
    };
    for (const Case& k :
         {Case{{1.5, 0.3, -2}, {1, 0, 0}, 0.5}, Case{{1.3, -2.4, 1}, {3, -4, 0}, 0.5},
          Case{{-1 - 2. / 9, 2 + 1. / 9, 3 + 2. / 9}, {-2, 1, 2}, 1. / 3},
          Case{{0.8, 0, 0}, {1, 0, 0}, -0.2}, Case{{0.1, 0.2, -2.9}, {0, 0, -1}, -0.1}}) {
        for (const RigidShape& shape : {RigidShape{box}, RigidShape{triangle_box({1, 2, 3}, 3)}}) {
            const Contacts c = contacts(Ball{0.25}, k.centre, shape, 1);
            REQUIRE(c.size() == 1);
            CHECK(c[0].gap == doctest::Approx(k.distance - 0.25).epsilon(1e-12));
            CHECK((c[0].normal - k.normal.normalized()).norm() < 1e-12);
            check_sane(c, 1, 1);
        }
    }
}

TEST_CASE("ball and cylinder: exact beside the side and the ends and the rims and from inside")
{
    const Cylinder cylinder{1, 2};
    struct Case {
        Vec3 centre, normal;
        double distance;
    };
    for (const Case& k : {Case{{0, 1.5, 1}, {0, 1, 0}, 0.5}, Case{{0.5, 0, -2.5}, {0, 0, -1}, 0.5},
                          Case{{1.3, 0, 2.4}, {3, 0, 4}, 0.5}, Case{{0.9, 0, 0}, {1, 0, 0}, -0.1},
                          Case{{0, 0, 1.5}, {0, 0, 1}, -0.5}}) {
        const Contacts c = contacts(Ball{0.25}, k.centre, cylinder, 1);
        REQUIRE(c.size() == 1);
        CHECK(c[0].gap == doctest::Approx(k.distance - 0.25).epsilon(1e-12));
        CHECK((c[0].normal - k.normal.normalized()).norm() < 1e-12);
    }
}

TEST_CASE("a ball in the corner of an L touches both walls")
{
    const Contacts c = contacts(Ball{0.25}, Vec3{1.25, 0.5, 1.25}, triangle_l(), 0.1);
    REQUIRE(c.size() == 2);
    CHECK(has(c, {1, 0.5, 1.25}, Vec3::UnitX()));
    CHECK(has(c, {1.25, 0.5, 1}, Vec3::UnitZ()));
}

TEST_CASE("a body on a plane rests on its corners at their exact heights")
{
    std::mt19937 rng{3};
    for (int i = 0; i < 50; ++i) {
        const Pose plane = random_pose(rng), pose = random_pose(rng);
        const Vec3 n = plane.turn * Vec3::UnitZ();
        for (const RigidShape& shape :
             {RigidShape{Box{{1, 2, 3}}}, RigidShape{triangle_box({1, 2, 3}, 2)}}) {
            const Contacts c = contacts(shape, pose, Plane{}, plane, 100);
            REQUIRE(c.size() == 8);
            std::array<double, 8> expected, found;
            const auto corners = box_corners({1, 2, 3});
            for (std::size_t v = 0; v < 8; ++v) {
                expected[v] = n.dot(pose.place + pose.turn * corners[v] - plane.place);
                found[v] = c[v].gap;
                CHECK((c[v].normal - n).norm() < 1e-14);
            }
            std::sort(expected.begin(), expected.end());
            std::sort(found.begin(), found.end());
            for (std::size_t v = 0; v < 8; ++v)
                CHECK(found[v] == doctest::Approx(expected[v]).epsilon(1e-12));
            check_sane(c, 1, 100);
        }
    }
    CHECK(contacts(Box{{1, 2, 3}}, Vec3{0, 0, 3}, Plane{}, 0.1).size() == 4);
}

TEST_CASE("a cylinder on a plane: standing or lying or tilted with the exact lowest point")
{
    const double r = 0.4, h = 0.6;
    const Cylinder cylinder{r, h};
    // Standing: points of the rim all around.
    const Contacts standing = contacts(cylinder, Vec3{0, 0, h}, Plane{}, 0.01);
    CHECK(standing.size() == 8);
    CHECK(hull_area(standing) == doctest::Approx(2 * std::sqrt(2.) * r * r));
    // Lying: two ends.
    const Pose lying{{0, 0, r}, turn_about(Vec3::UnitX(), std::numbers::pi / 2)};
    const Contacts two = contacts(cylinder, lying, Plane{}, {}, 0.01);
    REQUIRE(two.size() == 2);
    CHECK(has(two, {0, h, 0}, Vec3::UnitZ()));
    CHECK(has(two, {0, -h, 0}, Vec3::UnitZ()));
    // Tilted: height of the centre less h cos + r sin.
    for (double tilt = 0.01; tilt < 3.1; tilt += 0.1) {
        CAPTURE(tilt);
        const Pose pose{{0.3, 0.2, 1}, turn_about({1, 2, 0}, tilt)};
        const Contacts c = contacts(cylinder, pose, Plane{}, {}, 1);
        REQUIRE_FALSE(c.empty());
        CHECK(
            least_gap(c) ==
            doctest::Approx(1 - h * std::abs(std::cos(tilt)) - r * std::sin(tilt)).epsilon(1e-13));
        check_sane(c, 1, 1);
    }
}

TEST_CASE("box and box: exact distance face to face and edge to edge and corner to corner and "
          "corner to edge")
{
    // b is the cube of half 1; a is placed so that the features named are the nearest.
    const double root2 = std::sqrt(2.), root3 = std::sqrt(3.);
    const Box cube{Vec3::Ones()};
    // Face above face, shifted: the overlap's corners.
    Contacts c = contacts(cube, Vec3{0.5, 0.25, 2.1}, cube, 0.2);
    CHECK(c.size() == 4);
    for (const RigidContact& one : c) {
        CHECK(one.gap == doctest::Approx(0.1).epsilon(1e-13));
        CHECK((one.normal - Vec3::UnitZ()).norm() < 1e-14);
    }
    // Parallel edges, diagonal.
    c = contacts(cube, Vec3{2.1, 0.5, 2.1}, cube, 0.2);
    REQUIRE(c.size() == 2);
    for (const RigidContact& one : c) {
        CHECK(one.gap == doctest::Approx(0.1 * root2).epsilon(1e-13));
        CHECK((one.normal - Vec3{1, 0, 1} / root2).norm() < 1e-12);
    }
    CHECK(has(c, {1.1, -0.5, 1.1}, {1, 0, 1}));
    CHECK(has(c, {1.1, 1, 1.1}, {1, 0, 1}));
    // Corner to corner.
    c = contacts(cube, Vec3{2.1, 2.1, 2.1}, cube, 0.2);
    REQUIRE(c.size() == 1);
    CHECK(c[0].gap == doctest::Approx(0.1 * root3).epsilon(1e-13));
    CHECK((c[0].normal - Vec3::Ones() / root3).norm() < 1e-12);
    // Crossed edges: a stands on an edge turned by 90 degrees about z against b's.
    const Eigen::Quaterniond on_edge = turn_about(Vec3::UnitX(), std::numbers::pi / 4);
    const Pose below{Vec3::Zero(), on_edge};
    const Pose above{{0.1, 0.2, 2 * root2 + 0.05},
                     turn_about(Vec3::UnitZ(), std::numbers::pi / 2) * on_edge};
    c = contacts(cube, above, cube, below, 0.1);
    REQUIRE(c.size() == 1);
    CHECK(c[0].gap == doctest::Approx(0.05).epsilon(1e-12));
    CHECK((c[0].point_a - Vec3{0.1, 0, root2 + 0.05}).norm() < 1e-12);
    CHECK((c[0].normal - Vec3::UnitZ()).norm() < 1e-12);
    // Corner above face: a stands on its corner.
    const Eigen::Quaterniond on_corner =
        Eigen::Quaterniond::FromTwoVectors(Vec3{-1, -1, -1}, -Vec3::UnitZ());
    c = contacts(cube, {{0.1, -0.2, 1 + root3 + 0.03}, on_corner}, cube, {}, 0.1);
    REQUIRE(c.size() == 1);
    CHECK(c[0].gap == doctest::Approx(0.03).epsilon(1e-12));
    CHECK((c[0].point_b - Vec3{0.1, -0.2, 1}).norm() < 1e-12);
    // Corner beside an edge: 3-4-5.
    const Vec3 aside{0.6, 0, 0.8};
    c = contacts(cube,
                 {Vec3{1.3, 0.2, 1.4} + root3 * aside,
                  Eigen::Quaterniond::FromTwoVectors(Vec3{-1, -1, -1}, -aside)},
                 cube, {}, 0.6);
    CHECK(least_gap(c) == doctest::Approx(0.5).epsilon(1e-12));
}

TEST_CASE("the nearest contact of boxes is their distance and deep inside the shortest "
          "displacement that separates them")
{
    // The distance by brute force: dense samples of one surface against the other, closed form.
    std::mt19937 rng{5};
    const Vec3 half{0.5, 0.7, 0.3};
    int apart = 0;
    for (int i = 0; i < 300; ++i) {
        const Pose a = random_pose(rng, 0.7), b = random_pose(rng, 0.7);
        const Contacts c = contacts(Box{half}, a, Box{half}, b, 3);
        const Contacts t = contacts(triangle_box(half, 1), a, triangle_box(half, 1), b, 3);
        REQUIRE_FALSE(c.empty());
        CHECK(least_gap(t) == doctest::Approx(least_gap(c)).epsilon(1e-10));
        // Separating axes: an independent, plainer sum over all 15.
        double best = -1e300;
        const Mat3 ra = a.turn.toRotationMatrix(), rb = b.turn.toRotationMatrix();
        const Vec3 d = a.place - b.place;
        const auto axis = [&](Vec3 n) {
            if (n.norm() < 1e-9) return;
            n.normalize();
            best = std::max(best, std::abs(n.dot(d)) - (ra.transpose() * n).cwiseAbs().dot(half) -
                                      (rb.transpose() * n).cwiseAbs().dot(half));
        };
        for (int j = 0; j < 3; ++j) {
            axis(ra.col(j));
            axis(rb.col(j));
            for (int k = 0; k < 3; ++k)
                axis(ra.col(j).cross(rb.col(k)));
        }
        if (best > 0) {
            ++apart;
            // Alternating projections between two convex bodies end at their distance.
            Vec3 x = a.place;
            for (int k = 0; k < 20000; ++k) {
                const Vec3 yb = rb.transpose() * (x - b.place);
                const Vec3 y = b.place + rb * yb.cwiseMax(-half).cwiseMin(half);
                const Vec3 xa = ra.transpose() * (y - a.place);
                x = a.place + ra * xa.cwiseMax(-half).cwiseMin(half);
            }
            const Vec3 yb = rb.transpose() * (x - b.place);
            const double distance = (yb - yb.cwiseMax(-half).cwiseMin(half)).norm();
            CHECK(least_gap(c) == doctest::Approx(distance).epsilon(1e-5));
        } else {
            // The feature of least penetration is among the contacts.
            double nearest = 1e300;
            for (const RigidContact& one : c)
                nearest = std::min(nearest, std::abs(one.gap - best));
            CHECK(nearest < 1e-9);
        }
    }
    CHECK(apart > 100);
    CHECK(apart < 290);
}

TEST_CASE("a cylinder on a large box has the contacts that it has with a plane")
{
    std::mt19937 rng{21};
    const Cylinder cylinder{0.4, 0.6};
    for (int i = 0; i < 200; ++i) {
        Pose pose = random_pose(rng, 0.3);
        const Contacts on_plane = contacts(cylinder, pose, Plane{}, {}, 10);
        pose.place[2] += 0.01 - least_gap(on_plane);
        const Contacts expected = contacts(cylinder, pose, Plane{}, {}, 0.1);
        for (const RigidShape& box :
             {RigidShape{Box{{9, 9, 9}}}, RigidShape{triangle_box({9, 9, 9}, 2)}}) {
            const Contacts c = contacts(cylinder, pose, box,
                                        {Vec3{0, 0, -9}, Eigen::Quaterniond::Identity()}, 0.1);
            REQUIRE(!expected.empty());
            REQUIRE(c.size() == expected.size());
            for (const RigidContact& one : expected)
                CHECK(has(c, one.point_a, one.normal));
        }
    }
}

TEST_CASE("a cylinder's nearest contact with boxes and cylinders is their distance" *
          doctest::test_suite("slow"))
{
    std::mt19937 rng{22};
    const Vec3 half{0.5, 0.7, 0.3};
    const double r = 0.4, h = 0.6;
    const auto in_box = [&](const Pose& p, const Vec3& x) -> Vec3 {
        const Vec3 y = p.turn.conjugate() * (x - p.place);
        return p.place + p.turn * y.cwiseMax(-half).cwiseMin(half);
    };
    const auto in_cylinder = [&](const Pose& p, const Vec3& x) -> Vec3 {
        Vec3 y = p.turn.conjugate() * (x - p.place);
        const double out = y.head<2>().norm();
        if (out > r) y.head<2>() *= r / out;
        y[2] = std::clamp(y[2], -h, h);
        return p.place + p.turn * y;
    };
    int compared = 0;
    for (const bool box : {true, false})
        for (int i = 0; i < 400; ++i) {
            const Pose a = random_pose(rng, 0.8), b = random_pose(rng, 0.8);
            // Alternating projections between two convex bodies end at their distance.
            Vec3 x = a.place, y = b.place;
            for (int k = 0; k < 20000; ++k) {
                y = box ? in_box(b, x) : in_cylinder(b, x);
                x = in_cylinder(a, y);
            }
            const double distance = (x - y).norm();
            if (distance < 0.05 || distance > 2.9) continue;
            const RigidShape other = box ? RigidShape{Box{half}} : RigidShape{Cylinder{r, h}};
            const Contacts c = contacts(Cylinder{r, h}, a, other, b, 3);
            CAPTURE(box);
            CAPTURE(distance);
            ++compared;
            CHECK_FALSE(c.empty());
            if (!c.empty()) CHECK(least_gap(c) == doctest::Approx(distance).epsilon(1e-5));
        }
    CHECK(compared > 300);
}

TEST_CASE("cylinders: standing on each other or lying side by side or crossed")
{
    const double r = 0.4, h = 0.6;
    const Cylinder c{r, h};
    const Eigen::Quaterniond flat = turn_about(Vec3::UnitY(), std::numbers::pi / 2); // axis x
    for (const double gap : {0.0, 1e-9, -1e-9, 1e-3, -1e-3}) {
        CAPTURE(gap);
        // A stack, shifted: points of both rims and the two crossings.
        Contacts all = contacts(c, Vec3{r, 0, 2 * h + gap}, c, 0.01);
        CHECK(all.size() >= 4);
        for (const RigidContact& one : all) {
            CHECK((one.normal - Vec3::UnitZ()).norm() < 1e-12);
            CHECK(one.gap == doctest::Approx(gap).epsilon(1e-9));
        }
        CHECK(has(all, {r / 2, r * std::sqrt(0.75), h + gap}, Vec3::UnitZ(), 1e-9));
        CHECK(has(all, {r / 2, -r * std::sqrt(0.75), h + gap}, Vec3::UnitZ(), 1e-9));
        // Side by side: the ends of the overlap.
        all = contacts(c, Vec3{0, 2 * r + gap, 0.5}, c, 0.01);
        CHECK(all.size() == 2);
        for (const RigidContact& one : all) {
            CHECK((one.normal - Vec3::UnitY()).norm() < 1e-9);
            CHECK(std::abs(one.gap - gap) < 1e-12);
            CHECK(std::min(std::abs(one.point_a[2] - h), std::abs(one.point_a[2] - 0.5 + h)) <
                  1e-9);
        }
        // Crossed at right angles.
        all = contacts(c, {{0.1, 2 * r + gap, 0.2}, flat}, c, {}, 0.01);
        REQUIRE(all.size() == 1);
        CHECK((all[0].normal - Vec3::UnitY()).norm() < 1e-12);
        CHECK((all[0].point_b - Vec3{0, r, 0.2}).norm() < 1e-12);
        CHECK(std::abs(all[0].gap - gap) < 1e-12);
        // Lying on a box of half its length: where the box's edges cross the lowest line.
        const Box box{{h / 2, 1, 1}};
        all = contacts(c, {{0, 0, 1 + r + gap}, flat}, box, {}, 0.01);
        CHECK(all.size() == 2);
        CHECK(has(all, {h / 2, 0, 1 + gap}, Vec3::UnitZ(), 1e-12));
        CHECK(has(all, {-h / 2, 0, 1 + gap}, Vec3::UnitZ(), 1e-12));
        // Standing over the box's edge: the rim crosses it at y = +-r, and points of the rim.
        all = contacts(c, Vec3{h / 2, 0, 1 + h + gap}, box, 0.01);
        CHECK(has(all, {h / 2, r, 1 + gap}, Vec3::UnitZ(), 1e-9));
        CHECK(has(all, {h / 2, -r, 1 + gap}, Vec3::UnitZ(), 1e-9));
        for (const RigidContact& one : all) {
            CHECK((one.normal - Vec3::UnitZ()).norm() < 1e-9);
            CHECK(one.point_a[0] < h / 2 + 1e-9);
        }
    }
}

TEST_CASE("stacked blocks touch in the corners of their overlap whose area is exact")
{
    for (const RigidShape& top :
         {RigidShape{Box{{1, 1, 0.5}}}, RigidShape{triangle_box({1, 1, 0.5}, 3)}})
        for (const RigidShape& base :
             {RigidShape{Box{{2, 1, 0.5}}}, RigidShape{triangle_box({2, 1, 0.5}, 2)}})
            for (const double height : {1.0, 1 - 1e-9, 1 + 1e-4, 0.99}) {
                CAPTURE(height);
                Contacts c = contacts(top, Vec3{1.5, 0.25, height}, base, 1e-3);
                CHECK(c.size() == 4);
                CHECK(hull_area(c) == doctest::Approx(1.5 * 1.75).epsilon(1e-12));
                for (const RigidContact& one : c) {
                    CHECK((one.normal - Vec3::UnitZ()).norm() < 1e-12);
                    CHECK(one.gap == doctest::Approx(height - 1).epsilon(1e-12));
                }
                // Turned by 45 degrees about z: an octagon. Side 2: area 8 (sqrt(2) - 1).
                const RigidShape square = Box{{1, 1, 0.5}};
                c = contacts(top, {{0, 0, height}, turn_about(Vec3::UnitZ(), std::numbers::pi / 4)},
                             square, {}, 1e-3);
                CHECK(c.size() == 8);
                CHECK(hull_area(c) == doctest::Approx(8 * (std::sqrt(2.) - 1)).epsilon(1e-12));
                // Aligned: exactly the four corners, whatever coincides.
                c = contacts(top, Vec3{0, 0, height}, square, 1e-3);
                CHECK(c.size() == 4);
                CHECK(hull_area(c) == doctest::Approx(4).epsilon(1e-12));
            }
}

TEST_CASE("a small turn or tilt does not change where blocks rest")
{
    // Under each small motion the corners of the overlap stay, and the gaps are those of the
    // exact places: no contact appears or disappears at once.
    std::mt19937 rng{7};
    const Box block{{1, 1, 0.5}};
    for (const double small : {1e-12, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2}) {
        CAPTURE(small);
        for (int i = 0; i < 20; ++i) {
            const Pose pose{Vec3{0.5, 0.25, 1} + random_vector(rng, small),
                            turn_about(random_vector(rng), small)};
            const Contacts c = contacts(block, pose, block, {}, 0.05);
            REQUIRE(c.size() >= 4);
            CHECK(std::abs(hull_area(c) - 1.5 * 1.75) < 20 * small);
            for (const RigidContact& one : c) {
                CHECK((one.normal - Vec3::UnitZ()).norm() < 2 * small + 1e-12);
                CHECK(std::abs(one.gap) < 8 * small);
            }
        }
        for (int i = 0; i < 20; ++i) { // aligned blocks, where corners and edges coincide
            const Pose pose{Vec3{0, 0, 1} + random_vector(rng, small),
                            turn_about(random_vector(rng), small)};
            const Contacts c = contacts(block, pose, block, {}, 0.05);
            REQUIRE(c.size() >= 4);
            CHECK(std::abs(hull_area(c) - 4) < 20 * small);
            for (const RigidContact& one : c)
                CHECK((one.normal - Vec3::UnitZ()).norm() < 2 * small + 1e-12);
        }
    }
}

TEST_CASE("a block in equilibrium on another has its centre of pressure among the contacts")
{
    // The weight's line passes through the overlap exactly if the shift is below the half width.
    const Box block{{1, 1, 0.5}};
    for (double shift = 0.05; shift < 2; shift += 0.1) {
        const Contacts c = contacts(block, Vec3{shift, 0, 1}, block, 1e-3);
        double low = 1e300, high = -1e300;
        for (const RigidContact& one : c) {
            low = std::min(low, one.point_a[0]);
            high = std::max(high, one.point_a[0]);
        }
        CHECK((low <= shift && shift <= high) == (shift <= 1));
    }
}

TEST_CASE("an arch's voussoirs touch in the four corners of each joint")
{
    // Wedges of a semicircle, two triangles a face.
    const int count = 24;
    const double inner = 0.94625, outer = 1.05375, depth = 0.5;
    std::vector<TriangleShape> blocks;
    const auto corner = [&](int joint, bool out, double y) {
        const double angle = std::numbers::pi * joint / count;
        const double r = out ? outer : inner;
        return Vec3{r * std::cos(angle), y, r * std::sin(angle)};
    };
    for (int i = 0; i < count; ++i) {
        std::array<Vec3, 8> c; // x along the radius, y along the arch, z along the depth
        for (int v = 0; v < 8; ++v)
            c[static_cast<std::size_t>(v)] =
                corner((v & 2) != 0 ? i + 1 : i, (v & 1) != 0, (v & 4) != 0 ? 0 : depth);
        blocks.push_back(make_triangle_shape(hexahedron(c)));
    }
    REQUIRE(blocks.size() == count);
    for (int i = 0; i + 1 < count; ++i) {
        const Contacts c = contacts(blocks[static_cast<std::size_t>(i)], {},
                                    blocks[static_cast<std::size_t>(i + 1)], {}, 1e-3);
        REQUIRE(c.size() == 4);
        const double angle = std::numbers::pi * (i + 1) / count;
        const Vec3 normal{std::sin(angle), 0, -std::cos(angle)}; // towards the block before
        for (const bool out : {false, true})
            for (const double y : {0.0, depth})
                CHECK(has(c, corner(i + 1, out, y), normal, 1e-12));
        check_sane(c, 1, 1e-3);
    }
    CHECK(contacts(blocks[0], {}, blocks[2], {}, 1e-3).empty());
}

TEST_CASE("card house: planks that rest on each other push apart horizontally at the apex")
{
    const double length = 1, thin = 0.01, slope = std::numbers::pi / 12;
    const Box plank{{thin / 2, 0.3, length / 2}};
    // The inner upper edge of each plank lies on the plane x = 0.
    const auto tilted = [&](double side) {
        const Eigen::Quaterniond turn = turn_about(Vec3::UnitY(), side * slope);
        const Vec3 edge = turn * Vec3{side * thin / 2, 0, length / 2};
        return Pose{Vec3{-edge[0], 0, 1 - edge[2]}, turn};
    };
    for (const double gap : {0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-10, -1e-10, 1e-3}) {
        CAPTURE(gap);
        Pose left = tilted(1), right = tilted(-1);
        left.place[0] -= gap / 2;
        right.place[0] += gap / 2;
        const Contacts c = contacts(plank, left, plank, right, 1e-2);
        REQUIRE(c.size() == 2);
        for (const RigidContact& one : c) {
            CHECK(std::abs(one.gap - gap) < 1e-15);
            CHECK((one.normal + Vec3::UnitX()).norm() < 1e-9);
            CHECK(std::abs(std::abs(one.point_a[1]) - 0.3) < 1e-12);
            CHECK(std::abs(one.point_a[2] - 1) < 1e-12);
        }
    }
    // A plank's edge on the face of another: the ends of the edge, the face's normal.
    const Pose vertical{{thin / 2, 0, 1}, Eigen::Quaterniond::Identity()};
    const Contacts c = contacts(plank, tilted(1), plank, vertical, 1e-3);
    CHECK(c.size() == 2);
    for (const RigidContact& one : c)
        CHECK((one.normal + Vec3::UnitX()).norm() < 1e-12);
    // The edge of a plank on the rim of a face: the face decides.
    const Pose rim{{thin / 2, 0, 0.5}, Eigen::Quaterniond::Identity()};
    const Contacts r = contacts(plank, tilted(1), plank, rim, 1e-3);
    CHECK(r.size() >= 2);
    check_sane(r, 1, 1e-3);
}

TEST_CASE(
    "two bodies in one place and one around the other have a displacement that separates them")
{
    for (const RigidShape& a : all_shapes())
        for (const RigidShape& b : all_shapes()) {
            if (a.index() == 3 && b.index() == 3) continue;
            const Contacts c = contacts(a, {}, b, {}, 0.01);
            CAPTURE(a.index());
            CAPTURE(b.index());
            REQUIRE_FALSE(c.empty());
            check_sane(c, 1, 0.01);
            if (convex(a) && convex(b)) CHECK(least_gap(c) < -0.1);
        }
    // A cube in one ten times as large, near a wall of it: pushed out through that wall.
    const Contacts c = contacts(Box{Vec3::Ones()}, Vec3{8, 0, 0}, Box{Vec3::Constant(10)}, 0);
    REQUIRE_FALSE(c.empty());
    for (const RigidContact& one : c)
        CHECK((one.normal - Vec3::UnitX()).norm() < 1e-12);
    CHECK(least_gap(c) == doctest::Approx(-3));
}

TEST_CASE("a corner that projects beyond a rim does not block the motion back")
{
    // A block overhangs a table by 1e-4 at the table's height: nothing pushes sideways.
    const Box block{{1, 1, 0.5}};
    for (const double over : {1e-4, 1e-6, 1e-8, 0.0, -1e-8}) {
        CAPTURE(over);
        for (const double height : {0.0, 1e-7, -1e-7}) {
            const Contacts c = contacts(block, Vec3{over, over, 1 + height}, block, 1e-3);
            REQUIRE(c.size() >= 4);
            for (const RigidContact& one : c)
                CHECK((one.normal - Vec3::UnitZ()).norm() < 1e-9);
        }
    }
}

TEST_CASE("the L's corner holds a block from two sides")
{
    const TriangleShape l = triangle_l();
    for (const RigidShape& block :
         {RigidShape{Box{{0.3, 0.3, 0.3}}}, RigidShape{triangle_box({0.3, 0.3, 0.3})}})
        for (const double gap : {1e-6, 0.0, -1e-5}) {
            const Contacts c = contacts(block, Vec3{1.3 + gap, 0.5, 1.3 + gap}, l, 1e-3);
            CAPTURE(gap);
            int from_wall = 0, from_floor = 0;
            for (const RigidContact& one : c) {
                from_wall += (one.normal - Vec3::UnitX()).norm() < 1e-12 ? 1 : 0;
                from_floor += (one.normal - Vec3::UnitZ()).norm() < 1e-12 ? 1 : 0;
                CHECK(std::abs(one.gap - gap) < 1e-12);
            }
            CHECK(from_wall + from_floor == static_cast<int>(c.size()));
            CHECK(from_wall == 4);
            CHECK(from_floor == 4);
        }
}
