#include "contact/rigid/detect.hpp"

#include "contact/rigid/spread.hpp"
#include "contact/rigid/tests/shapes_for_tests.hpp"
#include "mesh/wall.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

std::vector<RigidContact> contacts_with_wall(const RigidShape& a, const Pose& pose,
                                             const Wall& wall, double reach)
{
    std::vector<RigidContact> out;
    WallHint hint;
    detect_wall(
        a, pose, [&](const Vec3& x) { return wall.sample(x, hint); }, reach, out);
    for (const RigidContact& c : out) {
        CHECK(std::abs(c.normal.norm() - 1) < 1e-12);
        CHECK((c.point_a - c.point_b - c.gap * c.normal).norm() < 1e-12);
        CHECK(std::abs(wall.distance(c.point_b, hint)) < 1e-12);
        CHECK(c.gap <= reach);
    }
    return out;
}

double least_wall_gap(const std::vector<RigidContact>& all)
{
    double least = 1e300;
    for (const RigidContact& c : all)
        least = std::min(least, c.gap);
    return least;
}

} // namespace

TEST_CASE("against a plane wall a body has the contacts it has with a Plane")
{
    std::mt19937 rng{1};
    for (const RigidShape& shape : {RigidShape{Box{{0.5, 0.7, 0.3}}}, RigidShape{Ball{0.4}},
                                    RigidShape{triangle_l()}, RigidShape{Cylinder{0.4, 0.6}}}) {
        std::size_t compared = 0;
        for (int i = 0; i < 50; ++i) {
            const Pose plane = random_pose(rng), pose = random_pose(rng);
            const auto a = contacts_with_wall(
                shape, pose, make_plane_wall(plane.place, plane.turn * Vec3::UnitZ()), 1);
            std::vector<RigidContact> b;
            detect(shape, pose, Plane{}, plane, 1, b);
            REQUIRE(a.size() == b.size());
            for (std::size_t k = 0; k < a.size(); ++k) {
                CHECK(a[k].id == b[k].id);
                CHECK((a[k].point_a - b[k].point_a).norm() < 1e-12);
                CHECK(std::abs(a[k].gap - b[k].gap) < 1e-12);
            }
            compared += a.size();
        }
        CHECK(compared > 20);
    }
}

TEST_CASE("a ball obstacle touches faces and edges of a box exactly where they bulge into it")
{
    std::mt19937 rng{2};
    const Vec3 half{0.5, 0.7, 0.3};
    int compared = 0;
    for (int i = 0; i < 300; ++i) {
        const Pose pose = random_pose(rng);
        const double radius = 0.25;
        std::vector<RigidContact> exact;
        detect(Box{half}, pose, Ball{radius}, {}, 0.3, exact);
        if (exact.empty() || exact[0].gap < -0.2) continue; // its centre inside the box
        ++compared;
        for (const RigidShape& shape : {RigidShape{Box{half}}, RigidShape{triangle_box(half)}}) {
            const auto c =
                contacts_with_wall(shape, pose, make_ball_wall(Vec3::Zero(), radius, false), 0.3);
            REQUIRE_FALSE(c.empty());
            CHECK(least_wall_gap(c) == doctest::Approx(exact[0].gap).epsilon(1e-10));
        }
    }
    CHECK(compared > 20);
}

TEST_CASE("a cylinder touches round walls at its rims and its side and its ends")
{
    std::mt19937 rng{3};
    const Cylinder cylinder{0.4, 0.6};
    int side = 0;
    for (int i = 0; i < 300; ++i) {
        const Pose pose = random_pose(rng);
        std::vector<RigidContact> exact;
        detect(cylinder, pose, Ball{0.25}, {}, 0.3, exact);
        if (exact.empty() || exact[0].gap < -0.2) continue;
        const auto c =
            contacts_with_wall(cylinder, pose, make_ball_wall(Vec3::Zero(), 0.25, false), 0.3);
        REQUIRE_FALSE(c.empty());
        CHECK(least_wall_gap(c) == doctest::Approx(exact[0].gap).epsilon(1e-9));
        side += std::any_of(c.begin(), c.end(), [](const RigidContact& one) {
            return std::abs(one.point_a.norm() - one.point_b.norm() - one.gap) < 1e-12;
        });
    }
    CHECK(side > 20);
    // In a tube it lies on a line; its rims touch.
    const Wall tube = make_cylinder_wall(Vec3::Zero(), Vec3::UnitZ(), 1, true);
    const auto c =
        contacts_with_wall(cylinder, {Vec3{0.55, 0, 0}, Eigen::Quaterniond::Identity()}, tube, 0.1);
    CHECK(c.size() == 2);
    for (const RigidContact& one : c) {
        CHECK(one.gap == doctest::Approx(0.05));
        CHECK((one.normal + Vec3::UnitX()).norm() < 1e-12);
    }
}

TEST_CASE("a ball in a tube: its gap is what the tube leaves")
{
    const Wall tube = make_cylinder_wall(Vec3::Zero(), Vec3::UnitZ(), 1, true);
    const auto c =
        contacts_with_wall(Ball{0.3}, {Vec3{0.3, 0.4, 7}, Eigen::Quaterniond::Identity()}, tube, 1);
    REQUIRE(c.size() == 1);
    CHECK(c[0].gap == doctest::Approx(0.2));
    CHECK((c[0].point_a - Vec3{0.48, 0.64, 7}).norm() < 1e-12);
}

TEST_CASE("spread: equal cells of a disc have its moments and its torque of spin")
{
    for (const int least : {1, 64, 65, 1000}) {
        const Cylinder disc{0.1, 0.01, least};
        double n = 0, torque = 0;
        Vec3 sum = Vec3::Zero();
        spread_over(disc, 0, [&](const Vec3& x, std::size_t) {
            ++n;
            sum += x;
            torque += x.head<2>().norm();
        });
        CHECK(n >= least);
        CHECK(sum.head<2>().norm() < 1e-12);
        CHECK(torque / n == doctest::Approx(2. / 3 * 0.1).epsilon(1e-12)); // T / (mu N), pure spin
    }
    // A disc that slides and spins at eps = v / (R omega) = 0.6530018: F/(mu N) = 0.616033,
    // T/(mu N R) = 0.471694 (Farkas, Bartels, Unger & Wolf 2003).
    for (const int least : {64, 256}) {
        double n = 0;
        Vec3 force = Vec3::Zero();
        double torque = 0;
        spread_over(Cylinder{1, 1, least}, 0, [&](const Vec3& x, std::size_t) {
            const Vec3 v{0.6530018 - x[1], x[0], 0};
            force += v.normalized();
            torque += x.cross(v.normalized())[2];
            ++n;
        });
        CHECK(force[0] / n == doctest::Approx(0.616033).epsilon(0.01));
        CHECK(torque / n == doctest::Approx(0.471694).epsilon(0.01));
    }
    // A box: n >= spread cells, mean 0, second moment of the area within the cell's size.
    double n = 0, moment = 0;
    spread_over(Box{{1, 2, 3}, 600}, 5, [&](const Vec3& x, std::size_t) {
        CHECK(x[2] == 3);
        ++n;
        moment += x[1] * x[1];
    });
    CHECK(n >= 600);
    CHECK(n < 660);
    CHECK(moment / n == doctest::Approx(4. / 3).epsilon(0.01));
}

TEST_CASE("spread: a body flat on a plane rests on its area and a tilted one on its rim")
{
    std::vector<RigidContact> c;
    const Pose flat{Vec3{0, 0, 0.01}, Eigen::Quaterniond::Identity()};
    detect(Cylinder{0.1, 0.01, 64}, flat, Plane{}, {}, 1e-3, c);
    CHECK(c.size() == 64);
    c.clear();
    detect(Cylinder{0.1, 0.01, 64}, {Vec3{0, 0, 0.01}, turn_about(Vec3::UnitX(), 0.01)}, Plane{},
           {}, 1e-3, c);
    CHECK(c.size() < 10);
    c.clear();
    detect(Box{{0.1, 0.1, 0.01}, 100}, flat, Plane{}, {}, 1e-3, c);
    CHECK(c.size() == 100);
    for (const RigidContact& one : c)
        CHECK(std::abs(one.gap) < 1e-15);
}
