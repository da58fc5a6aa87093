#include "solver/rod10/rod10_contact.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// @param frame  columns: the box's axes in space
SurfaceMesh box(const Vec3& low, const Vec3& high, const Mat3& frame = Mat3::Identity())
{
    SurfaceMesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.points.push_back(frame * Vec3(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(),
                                           k & 4 ? high.z() : low.z()));
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

/// A post below the rod's place `at`, its top `depth` above the rod's lower side.
SurfaceMesh post(double at, double depth, const Mat3& frame = Mat3::Identity())
{
    const double top = -Rod10{}.diameter / 2 + depth;
    return box({at - 0.004, -0.02, top - 0.02}, {at + 0.004, 0.02, top}, frame);
}

double compliance(const Rod10& rod)
{
    return std::pow(rod.length, 3) / (3 * rod.bending());
}

} // namespace

TEST_CASE("a tip on a post settles where spring and rod balance and not where the post ends")
{
    const Rod10 rod;
    const double C = compliance(rod), K = 0.8 / C, depth = 1e-4;
    Rod10Contact contact(rod, {Rod10Object(post(rod.length, depth))}, {.stiffness = K});
    Rod10Contact::Frame f;
    for (int i = 0; i < 200; ++i)
        f = contact.frame(Vec3::Zero(), Mat3::Identity());
    CHECK(f.touching == 1);
    const double F = K * depth / (1 + K * C); // rigid contact: depth / C
    CHECK(std::abs(f.force.z() / F - 1) < 1e-9);
    CHECK(std::abs(f.depth / (F / K) - 1) < 1e-9);
    CHECK(std::abs(contact.deflections().back().along.z() / (C * F) - 1) < 1e-9);
}

TEST_CASE("frames never settle where a spring is stiffer than the rod")
{
    const Rod10 rod;
    const double C = compliance(rod), depth = 1e-4;
    for (const double stiffness : {0.95, 1.05}) {
        CAPTURE(stiffness);
        Rod10Contact contact(rod, {Rod10Object(post(rod.length, depth))},
                             {.stiffness = stiffness / C});
        Vec3 last = Vec3::Zero(), change = Vec3::Zero();
        for (int i = 0; i < 1000; ++i) {
            const Vec3 force = contact.frame(Vec3::Zero(), Mat3::Identity()).force;
            change = force - last;
            last = force;
        }
        CHECK((change.norm() < 1e-12 * depth / C) == (stiffness < 1));
    }
}

TEST_CASE("a force between nodes bends the rod as a force there does wherever the rod points")
{
    const Rod10 rod;
    const double at = 5.5 * rod.element(), depth = 1e-4; // the middle of the sixth element
    const Mat3 turns[] = {Mat3::Identity(),
                          Eigen::Quaterniond(0.3, -0.5, 0.7, 0.1).normalized().toRotationMatrix()};
    double first = 0;
    for (const Mat3& turn : turns) {
        Rod10Contact contact(rod, {Rod10Object(post(at, depth, turn))}, {.stiffness = 1e-3});
        Rod10Contact::Frame f;
        for (int i = 0; i < 100; ++i)
            f = contact.frame(Vec3::Zero(), turn.transpose());
        CHECK(f.touching == 1);
        const double F = f.force.dot(turn.col(2));
        CHECK((f.force - F * turn.col(2)).norm() < 1e-12 * F);
        const double tip = F * at * at * (3 * rod.length - at) / (6 * rod.bending());
        CHECK(std::abs(turn.col(2).dot(contact.deflections().back().along) / tip - 1) < 1e-9);
        if (first > 0) CHECK(std::abs(F / first - 1) < 1e-9);
        first = F;
    }
}

TEST_CASE("the damper acts on the speed into the face")
{
    const Rod10 rod;
    const double B = 1e-4, depth = 1e-4, step = 1e-6, frame = 1e-3;
    Rod10Contact contact(rod, {Rod10Object(post(rod.length, depth))},
                         {.stiffness = 1e-9, .attenuation = B, .frame = frame});
    contact.frame(Vec3::Zero(), Mat3::Identity());
    const auto f = contact.frame(Vec3(0, 0, -step), Mat3::Identity());
    CHECK(std::abs(f.force.z() / (B * step / frame) - 1) < 1e-4);
}

TEST_CASE("the hand's force changes by the limit at most in a frame and arrives")
{
    const Rod10 rod;
    const double K = 0.1 / compliance(rod), depth = 1e-4, limit = K * depth / 10;
    Rod10Contact contact(rod, {Rod10Object(post(rod.length, depth))},
                         {.stiffness = K, .largest_change = limit});
    Vec3 last = Vec3::Zero();
    Rod10Contact::Frame f;
    for (int i = 0; i < 40; ++i) {
        f = contact.frame(Vec3::Zero(), Mat3::Identity());
        CHECK((f.sent - last).norm() <= limit * (1 + 1e-12));
        last = f.sent;
    }
    CHECK((f.sent - f.force).norm() < 1e-12 * f.force.norm());
}

TEST_CASE("a point is pushed out of the nearest face and not of the one that it came through")
{
    const Rod10Object object(box({0, 0, 0}, {1, 2, 3}));
    CHECK(object.contains({0.5, 1, 2.9})->normal.isApprox(Vec3::UnitZ()));
    CHECK(std::abs(object.contains({0.5, 1, 2.9})->depth - 0.1) < 1e-15);
    CHECK(object.contains({0.99, 1, 2.9})->normal.isApprox(Vec3::UnitX()));
    CHECK_FALSE(object.contains({1.001, 1, 2.9}));
    CHECK(object.near({1.1, 1, 2.9}));
    CHECK_FALSE(object.near({4, 1, 2.9}));
}

TEST_CASE("what is open or turned inside out or not convex is refused")
{
    SurfaceMesh open = box({0, 0, 0}, {1, 1, 1});
    open.triangles.pop_back();
    CHECK_THROWS_AS(Rod10Object{open}, InputError);
    SurfaceMesh inside_out = box({0, 0, 0}, {1, 1, 1});
    for (auto& t : inside_out.triangles)
        std::swap(t[0], t[1]);
    CHECK_THROWS_AS(Rod10Object{inside_out}, InputError);
    SurfaceMesh dented = box({0, 0, 0}, {1, 1, 1});
    dented.points[7] = Vec3(0.4, 0.4, 0.4);
    CHECK_THROWS_AS(Rod10Object{dented}, InputError);
    CHECK_THROWS_AS(Rod10Object{SurfaceMesh{}}, InputError);
    CHECK_THROWS_AS(Rod10Contact(Rod10{}, {}, {.stiffness = -1}), InputError);
}
