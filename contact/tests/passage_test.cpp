#include "contact/surface/passage.hpp"

#include "contact/tests/contact_surfaces.hpp"

#include <doctest/doctest.h>
#include <string>

using namespace amontons;
using namespace amontons::test;

namespace {

bool passes(const TouchingBody& a, const Eigen::Isometry3d& motion_a, const TouchingBody& b,
            const Eigen::Isometry3d& motion_b, double depth)
{
    TouchingBody later_a = a, later_b = b;
    later_a.move(motion_a);
    later_b.move(motion_b);
    const MovedSurface one{a.surface, a.mesh.nodes, later_a.mesh.nodes},
        other{b.surface, b.mesh.nodes, later_b.mesh.nodes};
    const bool found = passage(one, other, depth).has_value();
    CHECK(passage(other, one, depth).has_value() == found);
    return found;
}

Eigen::Isometry3d shift(const Vec3& d)
{
    return Eigen::Isometry3d(Eigen::Translation3d(d));
}

} // namespace

TEST_CASE("a block that jumps through a plate is detected whichever of the two moves")
{
    const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        TouchingBody plate = box_body(kind, {-1, -1, -0.1}, {1, 1, 0}, {3, 3, 1});
        TouchingBody block = box_body(kind, {-0.1, -0.1, 0.1}, {0.1, 0.1, 0.3}, {1, 1, 1});
        plate.move(anywhere());
        block.move(anywhere());
        const auto along = [](const Vec3& d) { return shift(anywhere().linear() * d); };
        CHECK(passes(block, along({0.3, 0, -1}), plate, still, 0.02));
        CHECK(passes(block, still, plate, along({0, 0.1, 1}), 0.02));
        CHECK(passes(block, along({0, 0, -0.15}), plate, still, 0.02));  // stops within
        CHECK(!passes(block, along({0, 0, -0.1}), plate, still, 0.02));  // touches
        CHECK(!passes(block, along({0, 0, -0.11}), plate, still, 0.02)); // overlaps a little
        CHECK(!passes(block, along({0, 0, 1}), plate, still, 0.02));     // leaves
        CHECK(!passes(block, along({0, 0, -1}), plate, along({0, 0, -1}), 0.02)); // both
        CHECK(!passes(block, along({12, 0, -1}), plate, still, 0.02));            // past its border
    }
}

TEST_CASE("a node through a face of a larger block and a block around which a wide one turns")
{
    const TouchingBody anvil = box_body(ElementKind::T4, {-1, -1, -1}, {1, 1, 0}, {2, 2, 2});
    const TouchingBody pin =
        box_body(ElementKind::T10, {0.3, 0.2, 0.1}, {0.31, 0.21, 2}, {1, 1, 3});
    CHECK(passes(pin, shift({0, 0, -0.3}), anvil, Eigen::Isometry3d::Identity(), 0.05));
    // A long bar that swings by 60 degrees through a post.
    const TouchingBody bar =
        box_body(ElementKind::H8, {0.1, -0.01, -0.1}, {2, 0.01, 0.1}, {4, 1, 1});
    const TouchingBody post = box_body(ElementKind::H8, {0.8, 0.5, -1}, {0.9, 0.6, 1}, {1, 1, 40});
    CHECK(passes(bar, turn(1.0, Vec3::UnitZ()), post, Eigen::Isometry3d::Identity(), 0.01));
    CHECK(!passes(bar, turn(-1.0, Vec3::UnitZ()), post, Eigen::Isometry3d::Identity(), 0.01));
}

TEST_CASE("a plate is as thin as it is through however many elements and slivers make nothing thin")
{
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        for (const int through : {1, 2, 3}) {
            TouchingBody plate = box_body(kind, {-1, -1, -0.1}, {1, 1, 0}, {3, 3, through});
            plate.move(anywhere());
            CHECK(least_thickness(plate.surface, plate.mesh.nodes) ==
                  doctest::Approx(0.1).epsilon(1e-9));
        }
        TouchingBody cube = box_body(kind, {0, 0, 0}, {1, 1, 1}, {4, 4, 4});
        const double before = least_thickness(cube.surface, cube.mesh.nodes);
        CHECK(before >= 0.08);          // half an edge; of T10 that of a quarter of a face
        for (Vec3& x : cube.mesh.nodes) // all inside comes to lie close below the top
            if (x.minCoeff() > 0.1 && x.maxCoeff() < 0.9) x.z() = 1 - 1e-6;
        CHECK(least_thickness(cube.surface, cube.mesh.nodes) == before);
    }
}
