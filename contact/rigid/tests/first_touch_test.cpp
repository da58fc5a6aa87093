#include "contact/rigid/first_touch.hpp"

#include "contact/rigid/broad_phase.hpp"
#include "contact/rigid/detect.hpp"
#include "contact/rigid/tests/shapes_for_tests.hpp"

#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

Pose at_place(const Vec3& x)
{
    return {x, Eigen::Quaterniond::Identity()};
}

} // namespace

TEST_CASE("balls touch when the distance of their centres is the sum of radii")
{
    std::mt19937 rng{1};
    int hits = 0;
    for (int i = 0; i < 600; ++i) {
        const Vec3 a0 = random_vector(rng, 1), a1 = random_vector(rng, 1);
        const Vec3 b0 = random_vector(rng, 1), b1 = random_vector(rng, 1);
        const Vec3 x = a0 - b0, v = (a1 - a0) - (b1 - b0);
        const double r = 0.7;
        if (x.norm() <= r * (1 + 1e-5)) continue;
        // |x + t v| = r
        const double p = x.dot(v) / v.squaredNorm(),
                     q = (x.squaredNorm() - r * r) / v.squaredNorm();
        const double root = p * p - q;
        const double t = first_touch(Ball{0.3}, at_place(a0), at_place(a1), Ball{0.4}, at_place(b0),
                                     at_place(b1));
        const double expected = root >= 0 && p < 0 ? -p - std::sqrt(root) : 1;
        CHECK(t <= std::min(1.0, expected) + 1e-12);
        if (root < 1e-6 && expected < 1) continue; // grazes
        CHECK(t == doctest::Approx(std::min(1.0, expected)).epsilon(1e-4));
        hits += expected < 1 ? 1 : 0;
    }
    CHECK(hits > 50);
}

TEST_CASE("a bullet does not pass a thin wall however long the step")
{
    const Box wall{{0.0005, 1, 1}};
    const TriangleShape triangles = triangle_box({0.0005, 1, 1}, 3);
    for (const double length : {1e-2, 1.0, 1e3, 1e6})
        for (const RigidShape& target : {RigidShape{wall}, RigidShape{triangles}}) {
            const double start = -0.2 * length - 0.0105;
            const double t = first_touch(Ball{0.01}, at_place({start, 0.3, 0.2}),
                                         at_place({start + length, 0.3, 0.2}), target, {}, {});
            CHECK(start + t * length == doctest::Approx(-0.0105).epsilon(1e-4));
            CHECK(start + t * length <= -0.0105);
            // Past the wall's edge.
            CHECK(first_touch(Ball{0.01}, at_place({start, 1.02, 0.2}),
                              at_place({start + length, 1.02, 0.2}), target, {}, {}) == 1);
        }
    // Against a plane, and the plane against the ball.
    const double t =
        first_touch(Ball{0.01}, at_place({0, 0, 1}), at_place({0, 0, -1e4}), Plane{}, {}, {});
    CHECK(t == doctest::Approx(0.99 / 10001).epsilon(1e-4));
    CHECK(first_touch(Plane{}, {}, at_place({0, 0, 2}), Ball{0.25}, at_place({0, 0, 1}),
                      at_place({0, 0, 1})) == doctest::Approx(0.375).epsilon(1e-5));
}

TEST_CASE("a turning rod touches when its end comes round")
{
    // Length 2 about its middle, a small ball at radius 1 and angle 60 degrees; and a plane below
    // at half a length: the end's height -sin(angle).
    const Box rod{{1, 0.01, 0.01}};
    const Pose from = at_place({0, 0, 0}), to{Vec3::Zero(), turn_about(-Vec3::UnitY(), 1.5)};
    const double angle = std::numbers::pi / 3;
    const Vec3 ball = 0.9 * Vec3{std::cos(angle), 0, std::sin(angle)};
    const double t = first_touch(rod, from, to, Ball{0.02}, at_place(ball), at_place(ball));
    // Distance of the ball's centre from the rod's side: 0.9 sin(60 - phi) = 0.03.
    CHECK(t == doctest::Approx((angle - std::asin(0.03 / 0.9)) / 1.5).epsilon(1e-5));
    // On the way back it starts from below.
    const double back = first_touch(rod, from, {Vec3::Zero(), turn_about(Vec3::UnitY(), 1.5)},
                                    Ball{0.02}, at_place(ball), at_place(ball));
    CHECK(back == 1);
    const double on_plane =
        first_touch(rod, from, to, Plane{}, at_place({0, 0, -0.5}), at_place({0, 0, -0.5}));
    // -sin(phi) - 0.01 cos(phi) = -0.5
    const double phi = std::asin(0.5 / std::hypot(1, 0.01)) - std::atan(0.01);
    CHECK(on_plane == doctest::Approx(phi / 1.5).epsilon(1e-5));
}

TEST_CASE("at the first touch bodies of all shapes are apart by little and before it never nearer")
{
    std::mt19937 rng{2};
    const RigidShape shapes[] = {Box{{0.5, 0.7, 0.3}}, Ball{0.3}, Cylinder{0.4, 0.6}, triangle_l(),
                                 triangle_prism(0.5, 0.4, 7)};
    const auto gap = [](const RigidShape& a, const Pose& pa, const RigidShape& b, const Pose& pb) {
        std::vector<RigidContact> c;
        detect(a, pa, b, pb, 0.05, c);
        double least = 0.05;
        for (const RigidContact& one : c)
            least = std::min(least, one.gap);
        return least;
    };
    int hits = 0;
    for (const RigidShape& a : shapes)
        for (const RigidShape& b : shapes)
            for (int i = 0; i < 12; ++i) {
                Pose a0 = random_pose(rng), a1 = random_pose(rng);
                const Pose b0 = random_pose(rng), b1 = random_pose(rng);
                a0.place.x() -= 4;
                a1.place.x() += 1;
                const double t = first_touch(a, a0, a1, b, b0, b1);
                const double end = gap(a, pose_between(a0, a1, t), b, pose_between(b0, b1, t));
                CAPTURE(a.index());
                CAPTURE(b.index());
                if (t == 0) continue; // they overlap from the start
                if (t < 1) {
                    ++hits;
                    CHECK(end > 0);
                    CHECK(end < 1.1e-6 * std::min(bounding_radius(a), bounding_radius(b)));
                }
                for (int k = 0; k < 20; ++k) {
                    const double s = t * k / 20;
                    CHECK(gap(a, pose_between(a0, a1, s), b, pose_between(b0, b1, s)) > 0);
                }
                CHECK(first_touch(b, b0, b1, a, a0, a1) == doctest::Approx(t).epsilon(1e-5));
            }
    CHECK(hits > 50);
}

TEST_CASE("bodies that touch at the start touch at once")
{
    CHECK(first_touch(Box{Vec3::Ones()}, at_place({0, 0, 1}), at_place({0, 0, 5}), Plane{}, {},
                      {}) == 0);
    CHECK(first_touch(Box{Vec3::Ones()}, at_place({0, 0, 2}), at_place({1, 0, 2}),
                      Box{Vec3::Ones()}, {}, {}) == 0);
}
