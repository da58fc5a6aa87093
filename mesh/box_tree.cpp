#include "mesh/box_tree.hpp"

#include <algorithm>
#include <numeric>

namespace amontons {

namespace {

constexpr std::int32_t kBoxLeaf = 4;

} // namespace

BoxTree::BoxTree(std::span<const BoundingBox> boxes) : order_(boxes.size())
{
    if (boxes.empty()) return;
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.reserve(boxes.size());
    nodes_.emplace_back();
    split_(0, 0, static_cast<std::int32_t>(boxes.size()), boxes);
    boxes_.reserve(boxes.size());
    for (const std::int32_t i : order_)
        boxes_.push_back(boxes[static_cast<std::size_t>(i)]);
    all_ = nodes_[0].box;
}

void BoxTree::split_(std::size_t node, std::int32_t first, std::int32_t count,
                     std::span<const BoundingBox> boxes)
{
    const auto twice_centre = [&](std::int32_t i) -> Eigen::Array3d {
        const BoundingBox& b = boxes[static_cast<std::size_t>(i)];
        return b.low + b.high;
    };
    BoundingBox box, centres;
    for (std::int32_t i = first; i < first + count; ++i) {
        const std::int32_t k = order_[static_cast<std::size_t>(i)];
        box.add(boxes[static_cast<std::size_t>(k)]);
        centres.add(twice_centre(k).matrix());
    }
    nodes_[node].box = box;
    if (count <= kBoxLeaf) {
        nodes_[node].first = first;
        nodes_[node].count = count;
        return;
    }
    Eigen::Index axis = 0;
    (centres.high - centres.low).maxCoeff(&axis);
    const std::int32_t half = count / 2;
    const auto along = [&](std::int32_t i) {
        const BoundingBox& b = boxes[static_cast<std::size_t>(i)];
        return b.low[axis] + b.high[axis];
    };
    // Ties by number: the order does not depend on the library.
    std::nth_element(order_.begin() + first, order_.begin() + first + half,
                     order_.begin() + first + count, [&](std::int32_t a, std::int32_t b) {
                         const double x = along(a), y = along(b);
                         return x < y || (x == y && a < b);
                     });
    const std::size_t child = nodes_.size();
    nodes_[node].first = static_cast<std::int32_t>(child);
    nodes_.resize(child + 2);
    split_(child, first, half, boxes);
    split_(child + 1, first + half, count - half, boxes);
}

} // namespace amontons
