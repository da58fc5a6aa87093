#include "haptics/pose.hpp"

#include <doctest/doctest.h>
#include <random>

using namespace amontons;

TEST_CASE("a displacement leads from one pose to the other whatever the sign of the quaternions")
{
    std::mt19937 rng{1};
    std::normal_distribution<double> normal;
    const auto vector = [&] { return Vec3{normal(rng), normal(rng), normal(rng)}; };
    for (int k = 0; k < 1000; ++k) {
        const HandPose a{vector(), turn(vector())};
        HandPose b{vector(), turn(vector())};
        if (k % 2) b.rotation.coeffs() *= -1;
        const Vec6 d = displacement(a, b);
        CHECK((a.position + d.head<3>() - b.position).norm() <= 1e-14);
        CHECK(d.tail<3>().norm() <= 3.1415926536);
        const Mat3 R = (turn(d.tail<3>()) * a.rotation).toRotationMatrix();
        CHECK((R - b.rotation.toRotationMatrix()).norm() <= 1e-13);
    }
    const Vec3 small{1e-160, -2e-170, 0}; // no division by a squared zero
    CHECK((turn_vector(turn(small)) - small).norm() <= 1e-15 * small.norm());
}

TEST_CASE("a pose with a number that is none is broken")
{
    CHECK_FALSE(is_broken(HandPose{}));
    HandPose p;
    p.position[1] = std::nan("");
    CHECK(is_broken(p));
    p = {};
    p.rotation.coeffs().setZero();
    CHECK(is_broken(p));
    Wrench w;
    CHECK_FALSE(is_broken(w));
    w.torque[2] = INFINITY;
    CHECK(is_broken(w));
}
