#include "contact/rigid/broad_phase.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace amontons {

Pose pose_between(const Pose& from, const Pose& to, double t)
{
    return {from.place + t * (to.place - from.place), from.turn.slerp(t, to.turn)};
}

AxisBox swept_box(const RigidShape& shape, const Pose& from, const Pose& to, double margin)
{
    const AxisBox one = axis_box(shape, from), two = axis_box(shape, to);
    const double angle = from.turn.angularDistance(to.turn);
    if (std::holds_alternative<Plane>(shape)) {
        if (angle > 0) { // a half-space that turns passes everywhere
            constexpr double infinity = std::numeric_limits<double>::infinity();
            return {Vec3::Constant(-infinity), Vec3::Constant(infinity)};
        }
        return {one.low.cwiseMin(two.low).array() - margin,
                one.high.cwiseMax(two.high).array() + margin};
    }
    // A point at distance R leaves the straight line between its ends by R angle^2 / 8 at most.
    const double room = margin + bounding_radius(shape) * angle * angle / 8;
    return {one.low.cwiseMin(two.low).array() - room, one.high.cwiseMax(two.high).array() + room};
}

void overlapping_pairs(std::span<const AxisBox> boxes, std::vector<BoxPair>& pairs)
{
    pairs.clear();
    // The axis with the largest variance of centres.
    Eigen::Array3d sum = Eigen::Array3d::Zero(), squares = sum, first = sum;
    double count = 0;
    for (const AxisBox& box : boxes) {
        const Eigen::Array3d centre = (box.low + box.high).array() / 2;
        if (!centre.allFinite()) continue;
        if (count == 0) first = centre; // against cancellation far from the origin
        sum += centre - first;
        squares += (centre - first).square();
        ++count;
    }
    Eigen::Index axis = 0;
    if (count > 0) (squares - sum.square() / count).maxCoeff(&axis);

    std::vector<std::int32_t> order(boxes.size());
    std::iota(order.begin(), order.end(), 0);
    const auto box = [&](std::int32_t i) -> const AxisBox& {
        return boxes[static_cast<std::size_t>(i)];
    };
    std::sort(order.begin(), order.end(), [&](std::int32_t i, std::int32_t j) {
        const double x = box(i).low[axis], y = box(j).low[axis];
        return x != y ? x < y : i < j;
    });
    for (std::size_t i = 0; i < order.size(); ++i) {
        const AxisBox& one = box(order[i]);
        for (std::size_t j = i + 1; j < order.size(); ++j) {
            const AxisBox& two = box(order[j]);
            if (two.low[axis] > one.high[axis]) break;
            if ((two.low.array() <= one.high.array()).all() &&
                (one.low.array() <= two.high.array()).all())
                pairs.push_back({std::min(order[i], order[j]), std::max(order[i], order[j])});
        }
    }
    std::sort(pairs.begin(), pairs.end());
}

} // namespace amontons
