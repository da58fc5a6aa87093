#include "contact/rigid/broad_phase.hpp"

#include "contact/rigid/tests/shapes_for_tests.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

std::vector<BoxPair> all_with_all(const std::vector<AxisBox>& boxes)
{
    std::vector<BoxPair> pairs;
    for (std::size_t i = 0; i < boxes.size(); ++i)
        for (std::size_t j = i + 1; j < boxes.size(); ++j)
            if ((boxes[i].low.array() <= boxes[j].high.array()).all() &&
                (boxes[j].low.array() <= boxes[i].high.array()).all())
                pairs.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)});
    return pairs;
}

} // namespace

TEST_CASE("sort and sweep finds the pairs that all with all finds in order")
{
    std::mt19937 rng{1};
    std::vector<BoxPair> pairs;
    for (const std::size_t n : {0u, 1u, 2u, 50u, 400u}) {
        for (const double spread : {0.0, 1.0, 10.0}) {
            std::vector<AxisBox> boxes;
            for (std::size_t i = 0; i < n; ++i) {
                const Vec3 c = 1e3 * Vec3::Ones() + random_vector(rng, spread),
                           h = random_vector(rng).cwiseAbs();
                boxes.push_back({c - h, c + h});
            }
            if (n > 2) { // ground and walls
                boxes[1] = axis_box(Plane{}, {});
                boxes[2] = axis_box(Plane{}, random_pose(rng));
            }
            overlapping_pairs(boxes, pairs);
            CHECK(pairs == all_with_all(boxes));
            if (n > 2) CHECK(pairs.size() + 1 >= n); // a wall along no axis touches all
        }
    }
    // Boxes that only touch count.
    const std::vector<AxisBox> stack{{Vec3::Zero(), Vec3::Ones()}, {Vec3{0, 0, 1}, Vec3{1, 1, 2}}};
    overlapping_pairs(stack, pairs);
    CHECK(pairs.size() == 1);
}

TEST_CASE("the swept box holds the body all along its motion")
{
    std::mt19937 rng{2};
    const RigidShape shapes[] = {Box{{0.5, 0.7, 0.3}}, Ball{0.6}, Cylinder{0.4, 0.6}, triangle_l()};
    for (const RigidShape& shape : shapes)
        for (int i = 0; i < 100; ++i) {
            const Pose from = random_pose(rng), to = random_pose(rng);
            const AxisBox all = swept_box(shape, from, to, 0);
            for (int k = 0; k <= 20; ++k) {
                const AxisBox now = axis_box(shape, pose_between(from, to, k / 20.0));
                CHECK((now.low - all.low).minCoeff() >= -1e-12);
                CHECK((all.high - now.high).minCoeff() >= -1e-12);
            }
        }
    const Pose up{Vec3{0, 0, 1}, Eigen::Quaterniond::Identity()};
    CHECK(swept_box(Plane{}, {}, up, 0.5).high[2] == 1.5);
    const Pose turned{Vec3::Zero(), turn_about(Vec3::UnitX(), 0.1)};
    CHECK(std::isinf(swept_box(Plane{}, {}, turned, 0).high[2]));
}
